//! Alternating solutions of two real views. Tests that bounds and threads do not change any result, and that bounds save work. Prints a
//! table of the milliseconds per iteration, the pyramid levels that remain after bounding, and the messages that are reused. The accuracy
//! tests use the same pairs and settings. Every pair is solved under both assumptions about left and right in the two views (the same, or
//! swapped), as in a pipeline that decides between them.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use ::footage::{Fill, Size, Warp};
use fmp::{Bounds, Extractor, Layout, Model, Pose, Responses, SolveStatistics, Solver};
use geometry::{Camera, Framing, OutSize, Rig};
use kernels::Rgb8View;
use multiview::{
    Epipolar, PairEstimate, PairInput, PairStart, Settings, TypeTables, ViewInput, ViewPlan,
    choose_start, estimate_pair,
};
use rayon::ThreadPool;

use crate::balancing::{clip, rig};
use crate::multi_view::{humaneva, tables, umpm};
use crate::shared_dir;

/// Number of runs, of which the fastest is used.
const RUNS: usize = 5;

/// One view at one time, with its single-view solution.
struct Shot {
    plan: ViewPlan,
    responses: Vec<f32>,
    levels: Vec<u16>,
    bounds: Option<Bounds>,
    candidates: Vec<Pose>,
}

impl Shot {
    fn new(extractor: &Extractor, solver: &Solver, camera: &Camera, rgb: &[u8]) -> Self {
        let model = solver.model();
        let [width, height] = camera.intrinsics.size.map(|size| size as usize);
        let layout = Arc::new(Layout::new(model, width, height).unwrap());
        let mut responses = vec![0.0; layout.n_responses()];
        let image = Rgb8View::new(width, height, rgb).unwrap();
        extractor.responses(image, &layout, &mut responses);
        let plan = ViewPlan::new(camera.clone(), Arc::clone(model), Arc::clone(&layout));
        let mut shot = Self {
            plan,
            responses,
            levels: (0..layout.levels.len() as u16).collect(),
            bounds: None,
            candidates: Vec::new(),
        };
        let (candidates, bounds) = solver.distinct_and_bounds(&shot.evidence(), 8, 1.0);
        (shot.candidates, shot.bounds) = (candidates, Some(bounds));
        shot
    }

    fn evidence(&self) -> Responses<'_> {
        let evidence = self.evidence_without_bounds();
        match &self.bounds {
            Some(bounds) => evidence.with_bounds(bounds),
            None => evidence,
        }
    }

    fn evidence_without_bounds(&self) -> Responses<'_> {
        Responses::new(self.plan.layout(), &self.responses, &self.levels)
    }

    fn answer(&self) -> ViewInput<'_> {
        ViewInput {
            plan: &self.plan,
            candidates: &self.candidates,
            others: 0,
            sigma_px: None,
            tau_px: None,
        }
    }
}

/// One pair of views, under one assumption about left and right.
struct Case<'a> {
    solver: &'a Solver,
    shots: [&'a Shot; 2],
    tables: Option<&'a TypeTables>,
    start: PairStart,
}

impl Case<'_> {
    fn solve(&self, max_iterations: usize) -> PairEstimate {
        self.solve_on(max_iterations, self.shots.map(Shot::evidence))
    }

    fn solve_on(&self, max_iterations: usize, evidence: [Responses<'_>; 2]) -> PairEstimate {
        let [first, second] = self.shots;
        let settings = Settings {
            max_iterations,
            ..Settings::default()
        };
        let input = PairInput {
            views: [first.answer(), second.answer()],
            epipolar: Epipolar::new(&first.plan, &second.plan),
            tables: self.tables,
        };
        let evidence = evidence.each_ref();
        estimate_pair(self.solver, &settings, &input, evidence, self.start)
    }

    /// Returns the shortest time of `n` iterations from the start, in milliseconds.
    fn fastest(&self, pool: &ThreadPool, n: usize) -> f64 {
        let run = |_| {
            let begin = Instant::now();
            pool.install(|| self.solve(n));
            begin.elapsed().as_secs_f64() * 1e3
        };
        (0..RUNS).map(run).fold(f64::INFINITY, f64::min)
    }

    /// Checks the solution, prints a row, and returns the number of iterations and their time in milliseconds on one and
    /// two threads.
    fn measure(&self, name: &str, pools: &[ThreadPool; 2]) -> [f64; 3] {
        let before = self.solver.statistics();
        let estimate = pools[0].install(|| self.solve(12));
        let effort = self.solver.statistics().since(&before);
        let on_two_threads = pools[1].install(|| self.solve(12));
        assert_eq!(estimate, on_two_threads, "{name}: one and two threads");
        let evidence = self.shots.map(Shot::evidence_without_bounds);
        let without_bounds = pools[1].install(|| self.solve_on(12, evidence));
        assert_eq!(estimate, without_bounds, "{name}: with and without bounds");
        assert!(
            effort.levels_solved < effort.levels_offered,
            "{name}: bounds rule out levels: {effort:?}"
        );
        let n = estimate.iterations.len();
        let [begin, first, all] =
            [0, 1, n].map(|n| pools.each_ref().map(|pool| self.fastest(pool, n)));
        let each = [0, 1].map(|i| (all[i] - begin[i]) / n as f64);
        let first = [0, 1].map(|i| first[i] - begin[i]);
        let exchanged = if self.start.exchanged {
            "exchanged"
        } else {
            "same"
        };
        let [one, two] = each;
        let [first, first_two] = first;
        println!(
            "| {name} | {exchanged} | {n} | {first:.2} / {first_two:.2} | {one:.2} / {two:.2} | {} |",
            describe(&effort)
        );
        [n as f64, n as f64 * one, n as f64 * two]
    }
}

fn describe(effort: &SolveStatistics) -> String {
    let n = effort.solutions as f64;
    let [solved, offered] =
        [effort.levels_solved, effort.levels_offered].map(|levels| levels as f64 / n);
    let percent = |a: u64, b: u64| 100.0 * a as f64 / b.max(1) as f64;
    let left = percent(effort.entries_solved, effort.entries_offered);
    let reused = 100.0 - percent(effort.entries_computed, effort.entries_solved);
    format!("{solved:.1} of {offered:.0} ({left:.0} %) | {reused:.0} %")
}

/// Checks and measures all pairs of the given shots. Both views start from a common solution.
fn measure(name: &str, solver: &Solver, shots: &[Shot], tables: Option<&TypeTables>) {
    let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
    let pools = [1, 2].map(pool);
    let answers: Vec<_> = shots.iter().map(Shot::answer).collect();
    let start = choose_start(&Settings::default(), &answers, &|_, _| tables);
    let [alone, alone_two] = pools.each_ref().map(|pool| {
        let run = |_| {
            let begin = Instant::now();
            pool.install(|| solver.best(&shots[0].evidence(), None));
            begin.elapsed().as_secs_f64() * 1e3
        };
        (0..RUNS).map(run).fold(f64::INFINITY, f64::min)
    });
    println!("| {name}: the first view alone | | | | {alone:.2} / {alone_two:.2} | | |");
    let before = solver.statistics();
    let mut sums = [0.0; 3];
    for [a, b] in pipeline::all_pairs(shots.len()) {
        for exchanged in [false, true] {
            let case = Case {
                solver,
                shots: [&shots[a], &shots[b]],
                tables,
                start: PairStart {
                    candidates: [a, b].map(|i| start.candidates[i]),
                    exchanged,
                },
            };
            let of_case = case.measure(&format!("{name} {a}-{b}"), &pools);
            sums = [0, 1, 2].map(|i| sums[i] + of_case[i]);
        }
    }
    let effort = solver.statistics().since(&before);
    assert!(
        effort.entries_computed < effort.entries_solved,
        "{name}: messages are reused: {effort:?}"
    );
    let [n, one, two] = sums;
    let (each, each_two) = (one / n, two / n);
    println!("| {name}: all | | {n} | | {each:.2} / {each_two:.2} | | {one:.0} / {two:.0} ms |");
}

/// Returns a picture and its camera at another size.
fn framed(camera: &Camera, source: [usize; 2], rgb: &[u8], size: [u32; 2]) -> (Camera, Vec<u8>) {
    let out = Size::new(size[0] as usize, size[1] as usize);
    let from = source.map(|source| source as u32);
    let framing = Framing::new(camera, from, None, OutSize::Exact(size), 0.0).unwrap();
    let source = Size::new(source[0], source[1]);
    let mut warp = Warp::new(source, out, &framing.source_from_output(), Fill::Black).unwrap();
    let mut image = vec![0; out.rgb_bytes()];
    warp.apply(rgb, &mut image);
    (framing.camera().clone(), image)
}

/// Measures two still pictures, at the size of the paper's pictures and at about 640 x 480.
fn stills(
    name: &str,
    model: &Path,
    images: [&Path; 2],
    cameras: &[Camera; 2],
    tables: &TypeTables,
) {
    let model = Arc::new(fmp::files::read(model).unwrap());
    let (extractor, solver) = (Extractor::new(Arc::clone(&model)), Solver::new(model));
    for size in [[227, 170], [640, 480]] {
        let shots: Vec<Shot> = images
            .iter()
            .zip(cameras)
            .map(|(path, camera)| {
                let picture = image::open(path).unwrap().into_rgb8();
                let source = [picture.width() as usize, picture.height() as usize];
                let (camera, rgb) = framed(camera, source, picture.as_raw(), size);
                Shot::new(&extractor, &solver, &camera, &rgb)
            })
            .collect();
        let name = format!("{name} {}x{}", size[0], size[1]);
        measure(&name, &solver, &shots, None);
        measure(&format!("{name} with types"), &solver, &shots, Some(tables));
    }
}

#[test]
#[ignore = "needs ../shared"]
fn bounds_and_threads_do_not_change_the_solutions_of_real_pairs() {
    let Some(shared) = shared_dir() else { return };
    println!(
        "| pair | facing | iterations | first, ms on 1 / 2 threads | mean, ms on 1 / 2 threads | levels solved (messages) | messages reused |"
    );
    println!("|---|---|---|---|---|---|---|");
    let folder = shared.join("data/humaneva");
    stills(
        "HumanEva",
        &shared.join("data/models/humaneva_fmp.txt"),
        [
            &folder.join("S1_Walking_1_C1_im0080.bmp"),
            &folder.join("S1_Walking_1_C2_im0080.bmp"),
        ],
        &["C1", "C2"].map(|name| humaneva(&shared, name, -1.0)),
        &tables(&shared, "he", ["C1", "C2"]),
    );
    let folder = shared.join("data/umpm");
    stills(
        "UMPM",
        &shared.join("data/models/umpm_fmp.txt"),
        [
            &folder.join("p1_triangle_1_l_im1920.png"),
            &folder.join("p1_triangle_1_r_im1920.png"),
        ],
        &["l", "r"].map(|name| umpm(&shared, name, 0.0)),
        &tables(&shared, "umpm", ["L", "R"]),
    );
    balancing(&shared, &rig());
}

fn balancing(shared: &Path, rig: &Rig) {
    let model = fmp::files::read(&shared.join("data/models/parse_fmp.mat")).unwrap();
    let model: Arc<Model> = Arc::new(model);
    let (extractor, solver) = (Extractor::new(Arc::clone(&model)), Solver::new(model));
    let clip = clip(&shared.join("data/pose2sim_balancing"), rig, true);
    for frame in [0, 20, 45] {
        let views = clip.cameras.iter().zip(&clip.frames);
        let shots: Vec<Shot> = views
            .map(|(camera, frames)| Shot::new(&extractor, &solver, camera, &frames[frame]))
            .collect();
        measure(&format!("balancing {frame}"), &solver, &shots, None);
    }
}
