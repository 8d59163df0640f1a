//! Small synthetic scenes: a root with two arms that mirror each other, seen by cameras on a
//! circle.

use std::sync::Arc;

use fmp::{
    Edge, Filter, Layout, LevelLayout, Model, ModelSpec, N_CHANNELS, PartSpec, Placement, Pose,
    Responses, Solver, Spring, Springs,
};
use geometry::{Camera, Intrinsics, Lens, LensModel};
use multiview::{
    Compatibility, Epipolar, PairEstimate, PairInput, PairStart, Settings, TypeTables, ViewInput,
    ViewPlan, estimate_pair,
};
use nalgebra::{Isometry3, Point3, Vector3};

pub(crate) const N_PARTS: usize = 3;
pub(crate) const N_TYPES: usize = 2;
/// Mirror image of the parts: the left and the right arm are swapped.
pub(crate) const MIRROR: [usize; N_PARTS] = [0, 2, 1];

/// A deterministic generator of pseudorandom numbers.
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    /// Returns a number in 0..1.
    pub(crate) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub(crate) fn pick<T: Clone>(&mut self, from: &[T]) -> T {
        from[(self.unit() * from.len() as f64) as usize].clone()
    }
}

/// Returns a model with two equal sides.
pub(crate) fn model(noise: &mut Noise) -> Arc<Model> {
    let mut spring = || Spring {
        w: [
            noise.within(0.02, 0.3),
            noise.within(-0.1, 0.1),
            noise.within(0.02, 0.3),
            noise.within(-0.1, 0.1),
        ],
        anchor: [0, 1],
    };
    let springs = Springs::PerChildType(vec![spring(), spring()]);
    let bias: Vec<Vec<f64>> = (0..N_TYPES)
        .map(|_| (0..N_TYPES).map(|_| noise.within(-0.2, 0.2)).collect())
        .collect();
    let part = |part: usize| PartSpec {
        name: ["middle", "right", "left"][part].to_owned(),
        filter_of_type: (N_TYPES * part..N_TYPES * (part + 1)).collect(),
        edge: (part > 0).then(|| Edge {
            parent: 0,
            bias: bias.clone(),
            springs: springs.clone(),
        }),
    };
    let filter = Filter {
        rows: 1,
        cols: 1,
        weights: vec![0.0; N_CHANNELS],
    };
    let spec = ModelSpec {
        name: "planted".to_owned(),
        parts: (0..N_PARTS).map(part).collect(),
        filters: vec![filter; N_PARTS * N_TYPES],
        root_bias: noise.within(-1.0, 1.0),
        interval: 1,
        cell_px: 4,
        threshold: 0.0,
        mirror: Some(MIRROR.to_vec()),
    };
    Arc::new(Model::new(spec).unwrap())
}

/// Returns a pyramid with levels of `sizes` `[rows, cols]`; the first has cells of `cell_px`, and each next
/// level is twice as coarse.
pub(crate) fn layout(sizes: &[[usize; 2]], cell_px: f64) -> Layout {
    let [rows, cols] = sizes[0];
    let image_size = [cols, rows].map(|value| (value as f64 * cell_px) as usize);
    let mut offset = 0;
    let level = |(level, &[rows, cols]): (usize, &[usize; 2])| {
        let level_layout = LevelLayout {
            scale: cell_px * f64::from(1 << level),
            image_size,
            padded: [rows, cols],
            rows,
            cols,
            offset,
        };
        offset += rows * cols * N_PARTS * N_TYPES;
        level_layout
    };
    Layout {
        image_size,
        levels: sizes.iter().enumerate().map(level).collect(),
        pad: [0, 0],
        n_filters: N_PARTS * N_TYPES,
    }
}

/// Returns a camera 4 m from the origin, looking at it, for images of `[width, height]`.
pub(crate) fn camera(bearing: f64, height: f64, size: [usize; 2], lens: LensModel) -> Camera {
    let eye = Point3::new(4.0 * bearing.cos(), 4.0 * bearing.sin(), height);
    let upright = Isometry3::look_at_rh(&eye, &Point3::origin(), &Vector3::z());
    // `look_at_rh` has x right, y up, z backward; a rotation by 180 degrees about x gives OpenCV's axes.
    let opencv = Isometry3::rotation(Vector3::x() * std::f64::consts::PI);
    let [width, rows] = size.map(|size| size as f64);
    Camera {
        name: "planted".to_owned(),
        intrinsics: Intrinsics {
            fx: width,
            fy: 1.05 * width,
            cx: width / 2.0 - 0.3,
            cy: rows / 2.0 + 0.4,
            size: size.map(|size| size as u32),
            lens: Lens::new(lens),
        },
        camera_from_world: opencv * upright,
    }
}

/// Lenses with no distortion, a mild distortion, a fisheye, and a lens without a solution in the corners.
pub(crate) fn lenses() -> [LensModel; 4] {
    let radial = |k1: f64, k2: f64| LensModel::BrownConrady {
        k: [k1, k2, 0.0, 0.0, 0.0, 0.0],
        p: [0.001, -0.002],
    };
    let k = [0.05, -0.01, 0.0, 0.0];
    [
        LensModel::Pinhole,
        radial(-0.3, 0.1),
        LensModel::KannalaBrandt { k },
        radial(-1.0, 0.0),
    ]
}

/// One view of a scene.
pub(crate) struct View {
    pub(crate) plan: ViewPlan,
    pub(crate) values: Vec<f32>,
    pub(crate) levels: Vec<u16>,
    pub(crate) candidates: Vec<Pose>,
    pub(crate) sigma_px: Option<Vec<f32>>,
    pub(crate) tau_px: Option<Vec<f32>>,
}

impl View {
    pub(crate) fn evidence(&self) -> Responses<'_> {
        Responses::new(self.plan.layout(), &self.values, &self.levels)
    }

    pub(crate) fn input(&self) -> ViewInput<'_> {
        ViewInput {
            plan: &self.plan,
            candidates: &self.candidates,
            others: 0,
            sigma_px: self.sigma_px.as_deref(),
            tau_px: self.tau_px.as_deref(),
        }
    }

    /// Adds evidence for one of the view's candidates.
    pub(crate) fn add_evidence(&mut self, candidate: usize, score: f32) {
        let pose = &self.candidates[candidate];
        let layout = self.plan.layout();
        let cols = layout.levels[usize::from(pose.level)].cols;
        for (part, placement) in pose.parts.iter().enumerate() {
            let filter = part * N_TYPES + usize::from(placement.mixture);
            let map = layout.map_range(usize::from(pose.level), filter);
            self.values[map][usize::from(placement.y) * cols + usize::from(placement.x)] += score;
        }
    }

    /// Swaps the two sides of the model in the image.
    pub(crate) fn mirrored(&mut self) {
        let layout = self.plan.layout();
        for level in 0..layout.levels.len() {
            for mixture in 0..N_TYPES {
                let [right, left] =
                    [1, 2].map(|part| layout.map_range(level, part * N_TYPES + mixture));
                for (a, b) in right.zip(left) {
                    self.values.swap(a, b);
                }
            }
        }
        for pose in &mut self.candidates {
            *pose = mirrored(pose);
        }
        if let Some(sigma) = &mut self.sigma_px {
            sigma.swap(1, 2);
        }
    }
}

/// Returns the pose with the two sides of the model swapped.
pub(crate) fn mirrored(pose: &Pose) -> Pose {
    Pose {
        parts: MIRROR.map(|part| pose.parts[part]).to_vec(),
        ..pose.clone()
    }
}

/// Several views of one artificial instant.
pub(crate) struct Scene {
    pub(crate) solver: Solver,
    pub(crate) views: Vec<View>,
    pub(crate) tables: TypeTables,
}

impl Scene {
    /// Returns a scene of random evidence on levels of `sizes`.
    pub(crate) fn new(seed: u64, n_views: usize, sizes: &[[usize; 2]]) -> Self {
        let noise = &mut Noise(seed);
        let model = model(noise);
        let solver = Solver::new(Arc::clone(&model));
        let views = (0..n_views)
            .map(|view| {
                let layout = Arc::new(layout(sizes, 4.0));
                let bearing = 1.3 * view as f64 + noise.within(-0.4, 0.4);
                let height = noise.within(-1.0, 1.0);
                let lens = noise.pick(&lenses());
                let camera = camera(bearing, height, layout.image_size, lens);
                let values =
                    (0..layout.n_responses()).map(|_| noise.within(-1.0, 1.0) as f32).collect();
                let mut view = View {
                    levels: (0..layout.levels.len() as u16).collect(),
                    plan: ViewPlan::new(camera, Arc::clone(&model), layout),
                    values,
                    candidates: Vec::new(),
                    sigma_px: (noise.unit() < 0.7)
                        .then(|| (0..N_PARTS).map(|_| noise.within(0.0, 12.0) as f32).collect()),
                    tau_px: None,
                };
                view.candidates = (0..3).map(|_| pose(noise, &solver, &view)).collect();
                view.candidates.push(solver.best(&view.evidence(), None).unwrap());
                view.candidates.reverse();
                view
            })
            .collect();
        Self {
            solver,
            views,
            tables: tables(noise),
        }
    }

    /// Fuses two of the views from two of their candidates.
    pub(crate) fn fuse(
        &self,
        settings: &Settings,
        views: [usize; 2],
        start: PairStart,
    ) -> PairEstimate {
        let evidence = views.map(|view| self.views[view].evidence());
        self.fuse_evidence(settings, views, start, evidence.each_ref())
    }

    /// Like [`Self::fuse`], with the given evidence of these views.
    pub(crate) fn fuse_evidence(
        &self,
        settings: &Settings,
        views: [usize; 2],
        start: PairStart,
        evidence: [&Responses<'_>; 2],
    ) -> PairEstimate {
        let [first, second] = views.map(|view| &self.views[view]);
        let input = PairInput {
            views: [first.input(), second.input()],
            epipolar: Epipolar::new(&first.plan, &second.plan),
            tables: (views == [0, 1]).then_some(&self.tables),
        };
        estimate_pair(&self.solver, settings, &input, evidence, start)
    }
}

/// Settings in which parts can be off, the terms matter, and the iterations suffice.
pub(crate) fn settings(seed: u64) -> Settings {
    let noise = &mut Noise(seed ^ 0xABCD);
    Settings {
        alpha: noise.pick(&[0.01, 0.1, 0.5, 3.0]),
        beta: noise.pick(&[0.0, 0.5, 2.0]),
        max_distance_cells: noise.pick(&[1.0, 3.0, 8.0, f64::INFINITY]),
        max_iterations: 60,
        tau_px: noise.pick(&[Vec::new(), vec![8.0; N_PARTS]]),
        rescue_px: vec![2.0; N_PARTS],
        ..Settings::default()
    }
}

pub(crate) const FROM_BEST: PairStart = PairStart {
    candidates: [0, 0],
    exchanged: false,
};

/// Returns a random pose on a random level, with its score.
fn pose(noise: &mut Noise, solver: &Solver, view: &View) -> Pose {
    let level = noise.pick(&view.levels);
    let level_layout = &view.plan.layout().levels[usize::from(level)];
    let mut pose = Pose {
        score: 0.0,
        level,
        parts: (0..N_PARTS)
            .map(|_| Placement {
                x: (noise.unit() * level_layout.cols as f64) as u16,
                y: (noise.unit() * level_layout.rows as f64) as u16,
                mixture: (noise.unit() * N_TYPES as f64) as u8,
            })
            .collect(),
    };
    pose.score = solver.score(&view.evidence(), &pose, None);
    pose
}

/// Random type tables of the first two views.
fn tables(noise: &mut Noise) -> TypeTables {
    let mut table = || {
        let rows = (0..N_PARTS * N_TYPES).map(|row| {
            let p = noise.unit();
            format!("{},{p},{}\n", row / N_TYPES + 1, 1.0 - p)
        });
        Compatibility::parse(&rows.collect::<String>(), &[N_TYPES; N_PARTS]).unwrap()
    };
    let conditional = [table(), table()];
    let (joint, _) =
        Compatibility::joint_from_conditionals(&conditional[0], &conditional[1]).unwrap();
    let exchanged = Some(Arc::new(table()));
    TypeTables {
        conditional: conditional.map(Arc::new),
        joint: Arc::new(joint),
        exchanged,
    }
}
