//! Compares the solver with an exhaustive search, on trees small enough to try every pose.

use std::sync::Arc;

use fmp::{CandidateSettings, ExtraTerms, Model, Placement, Pose, Responses, Solver, Springs};
use proptest::prelude::*;

use crate::common::{Evidence, Noise, tree};
use crate::other_view::OtherView;

/// Returns all poses on a level.
fn all_poses(model: &Model, level: u16, [rows, cols]: [usize; 2]) -> Vec<Pose> {
    let mut all = vec![Vec::new()];
    for part in 0..model.n_parts() {
        let placements = (0..rows * cols * model.n_types(part)).map(|i| Placement {
            x: (i % cols) as u16,
            y: (i / cols % rows) as u16,
            mixture: (i / cols / rows) as u8,
        });
        let extend = |parts: &Vec<Placement>| {
            let parts = parts.clone();
            placements
                .clone()
                .map(move |placement| [parts.clone(), vec![placement]].concat())
        };
        all = all.iter().flat_map(extend).collect();
    }
    let pose = |parts| Pose {
        score: 0.0,
        level,
        parts,
    };
    all.into_iter().map(pose).collect()
}

/// Equation 1 in double precision, computed directly from the model.
fn energy(
    model: &Model,
    evidence: &Responses<'_>,
    pose: &Pose,
    extra: Option<&dyn ExtraTerms>,
) -> f64 {
    let level = usize::from(pose.level);
    let it = &evidence.layout().levels[level];
    let mut sum = model.spec().root_bias;
    for (part, at) in pose.parts.iter().enumerate() {
        let spec = &model.spec().parts[part];
        let mixture = usize::from(at.mixture);
        let cell = usize::from(at.y) * it.cols + usize::from(at.x);
        sum += f64::from(evidence.map(level, spec.filter_of_type[mixture])[cell]);
        if let Some(extra) = extra {
            let mut term = vec![0.0; it.rows * it.cols];
            extra.add_position(part, level, 0, &mut term);
            sum += f64::from(term[cell]) + f64::from(extra.of_type(part, mixture));
        }
        let Some(edge) = &spec.edge else { continue };
        let parent = pose.parts[edge.parent];
        let l = usize::from(parent.mixture);
        let spring = match &edge.springs {
            Springs::PerChildType(all) => Some(all[mixture]),
            Springs::PerTypePair(all) => all[l][mixture],
        };
        let Some(spring) = spring else {
            return f64::NEG_INFINITY;
        };
        let dx = f64::from(parent.x) + f64::from(spring.anchor[0]) - f64::from(at.x);
        let dy = f64::from(parent.y) + f64::from(spring.anchor[1]) - f64::from(at.y);
        let [xx, x, yy, y] = spring.w;
        sum += edge.bias[l][mixture] - (xx * dx * dx + x * dx + yy * dy * dy + y * dy);
    }
    sum
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn the_best_pose_has_the_highest_score_of_all_poses(seed in any::<u64>(), n_parts in 1..4_usize, fused: bool) {
        let mut noise = Noise(seed);
        let model = tree(&mut noise, n_parts);
        let sizes = [[2, 3], [3, 1]];
        let evidence = Evidence::new(&mut noise, &model, &sizes);
        let evidence = evidence.view();
        let other = OtherView(seed);
        let extra = fused.then_some(&other as &dyn ExtraTerms);
        let solver = Solver::new(Arc::clone(&model));
        let best = solver.best(&evidence, extra).unwrap();
        let mut highest = f32::NEG_INFINITY;
        for (level, size) in sizes.iter().enumerate() {
            for pose in all_poses(&model, level as u16, *size) {
                let score = solver.score(&evidence, &pose, extra);
                let exact = energy(&model, &evidence, &pose, extra);
                let equal = (f64::from(score) - exact).abs() < 1e-5;
                prop_assert!(equal || f64::from(score) == exact, "{} {}", score, exact);
                highest = highest.max(score);
            }
        }
        prop_assert_eq!(best.score, highest);
        prop_assert_eq!(solver.score(&evidence, &best, extra), best.score);
    }

    #[test]
    fn threads_and_instruction_sets_do_not_change_the_result(seed in any::<u64>()) {
        let mut noise = Noise(seed);
        let model = tree(&mut noise, 5);
        let evidence = Evidence::new(&mut noise, &model, &[[9, 20], [17, 7], [4, 35], [1, 1]]);
        let evidence = evidence.view();
        let settings = CandidateSettings { threshold: 1.0, overlap: 0.3, max: 10 };
        let answers = |solver: &Solver| (
            solver.best(&evidence, None),
            solver.best(&evidence, Some(&OtherView(seed))),
            solver.candidates(&evidence, &settings),
            solver.distinct(&evidence, 4, 0.5),
        );
        let want = answers(&Solver::new(Arc::clone(&model)));
        for isa in kernels::Isa::available() {
            let solver = Solver::on(isa, Arc::clone(&model));
            for threads in [1, 3] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                prop_assert_eq!(&pool.install(|| answers(&solver)), &want);
            }
        }
    }

    #[test]
    fn candidates_obey_their_settings(seed in any::<u64>(), overlap in 0.0..0.9_f64, max in 1..6_usize) {
        let mut noise = Noise(seed);
        let model = tree(&mut noise, 3);
        let evidence = Evidence::new(&mut noise, &model, &[[8, 9], [6, 5]]);
        let evidence = evidence.view();
        let solver = Solver::new(Arc::clone(&model));
        let best = solver.best(&evidence, None).unwrap();
        let threshold = best.score - 1.0;
        let settings = CandidateSettings { threshold, overlap, max };
        let found = solver.candidates(&evidence, &settings);
        prop_assert_eq!(&found[0], &best);
        prop_assert!(found.len() <= max);
        prop_assert!(found.iter().all(|pose| pose.score >= threshold));
        prop_assert!(found.is_sorted_by(|a, b| a.score >= b.score));
        for (at, picked) in found.iter().enumerate() {
            prop_assert_eq!(solver.score(&evidence, picked, None), picked.score);
            for later in &found[at + 1..] {
                for part in 0..model.n_parts() {
                    let [a, b] = [picked, later].map(|pose| pose.part_box(&model, evidence.layout(), part));
                    let side = |axis: usize| (a[axis + 2].min(b[axis + 2]) - a[axis].max(b[axis]) + 1.0).max(0.0);
                    let area = (a[2] - a[0] + 1.0) * (a[3] - a[1] + 1.0);
                    prop_assert!(side(0) * side(1) / area <= overlap);
                }
            }
        }
        let all = CandidateSettings { threshold, overlap: f64::INFINITY, max: usize::MAX };
        let roots = [0, 1].map(|level| solver.root_scores(&evidence, level, None)).concat();
        let above = roots.iter().filter(|&&it| it >= threshold).count();
        prop_assert_eq!(solver.candidates(&evidence, &all).len(), above);
    }

    #[test]
    fn distinct_poses_are_chosen_greedily_from_the_best(
        seed in any::<u64>(),
        separation in 0.0..3.0_f64,
    ) {
        let mut noise = Noise(seed);
        let model = tree(&mut noise, 3);
        let evidence = Evidence::new(&mut noise, &model, &[[12, 9], [6, 5]]);
        let evidence = evidence.view();
        let solver = Solver::new(Arc::clone(&model));
        let all = solver.distinct(&evidence, usize::MAX, 0.0);
        prop_assert_eq!(&all[0], &solver.best(&evidence, None).unwrap());
        prop_assert!(all.is_sorted_by(|a, b| a.score >= b.score));
        let far = |a: &Pose, b: &Pose| {
            let centres = [a, b].map(|pose| pose.centres(&model, evidence.layout()));
            let distance = centres[0].iter().zip(&centres[1]);
            let distance: f64 = distance.map(|(p, q)| (p[0] - q[0]).hypot(p[1] - q[1])).sum();
            let side = |pose: &Pose| evidence.layout().levels[usize::from(pose.level)].scale;
            distance / 3.0 >= separation * f64::midpoint(side(a), side(b))
        };
        let mut want: Vec<Pose> = Vec::new();
        for pose in all {
            prop_assert_eq!(solver.score(&evidence, &pose, None), pose.score);
            if want.len() < 4 && want.iter().all(|other| far(other, &pose)) {
                want.push(pose);
            }
        }
        prop_assert_eq!(solver.distinct(&evidence, 4, separation), want);
    }

    #[test]
    fn distinct_poses_are_the_local_maxima_of_the_root(seed in any::<u64>()) {
        let mut noise = Noise(seed);
        let model = tree(&mut noise, 2);
        let (rows, cols) = (7, 9);
        let evidence = Evidence::new(&mut noise, &model, &[[rows, cols]]);
        let evidence = evidence.view();
        let solver = Solver::new(model);
        let roots = solver.root_scores(&evidence, 0, None);
        let neighbours = |y: usize, x: usize| {
            let around = (0..rows * cols).map(|i| (i / cols, i % cols));
            around.filter(move |around| around.0.abs_diff(y) <= 1 && around.1.abs_diff(x) <= 1 && *around != (y, x))
        };
        let score = |(y, x): (usize, usize)| roots[y * cols + x];
        let mut found = solver.distinct(&evidence, usize::MAX, 0.0);
        found.sort_by_key(|pose| (pose.parts[0].y, pose.parts[0].x));
        let found = found.iter().map(|pose| (usize::from(pose.parts[0].y), usize::from(pose.parts[0].x)));
        let peaks = (0..rows * cols).map(|i| (i / cols, i % cols)).filter(|&at| {
            neighbours(at.0, at.1).all(|neighbour| score(neighbour) < score(at) || (score(neighbour) == score(at) && neighbour > at))
        });
        prop_assert_eq!(found.collect::<Vec<_>>(), peaks.collect::<Vec<_>>());
    }
}

#[test]
fn ties_go_to_the_lower_level_then_to_the_first_cell() {
    let mut noise = Noise(1);
    let model = tree(&mut noise, 1);
    let mut evidence = Evidence::new(&mut noise, &model, &[[3, 4], [2, 2]]);
    evidence.values.fill(0.5);
    let best = Solver::new(model).best(&evidence.view(), None).unwrap();
    assert_eq!((best.level, best.parts), (0, vec![Placement::default()]));
}

#[test]
fn only_available_and_requested_levels_are_searched() {
    let mut noise = Noise(2);
    let model = tree(&mut noise, 3);
    let evidence = Evidence::new(&mut noise, &model, &[[5, 5], [4, 4], [3, 3]]);
    let offered = [1, 2];
    let view = Responses::new(&evidence.layout, &evidence.values, &offered);
    let solver = Solver::new(model);
    assert_ne!(solver.best(&view, None).unwrap().level, 0);
    assert_eq!(solver.best_on(&view, &[0, 2], None).unwrap().level, 2);
    assert_eq!(solver.best_on(&view, &[0], None), None);
    assert!(solver.root_scores(&view, 0, None).is_empty());
}

#[test]
fn the_sweep_counter_counts_every_solved_level() {
    let mut noise = Noise(7);
    let model = tree(&mut noise, 3);
    let evidence = Evidence::new(&mut noise, &model, &[[8, 9], [6, 5]]);
    let evidence = evidence.view();
    let solver = Solver::new(model);
    let mut seen = vec![solver.n_sweeps()];
    solver.best(&evidence, None);
    seen.push(solver.n_sweeps());
    let bounds = solver.bounds(&evidence);
    seen.push(solver.n_sweeps());
    assert_eq!(seen, [0, 2, 4]);
    let evidence = evidence.with_bounds(&bounds);
    // Without a guess, at least one level has to be solved.
    solver.incremental(&evidence).best(&OtherView(7), None);
    assert!(solver.n_sweeps() > 4);
}
