//! A synthetic frame: 26 parts, random evidence, cameras on a circle.

use std::sync::Arc;

use fmp::{
    Edge, Filter, Layout, LevelLayout, Model, ModelSpec, N_CHANNELS, PartSpec, Responses, Solver,
    Spring, Springs,
};
use geometry::{Camera, Intrinsics, Lens, LensModel};
use multiview::ViewPlan;
use nalgebra::{Isometry3, Point3, Vector3};
use pipeline::ViewResult;
use skeleton::{MIRROR, N_PARTS, PARENT, PART_NAMES};

const N_TYPES: usize = 2;
const N_LEVELS: usize = 3;

/// The views of one frame, and their single-view results.
pub(crate) struct Scene {
    pub(crate) model: Arc<Model>,
    pub(crate) plans: Vec<Arc<ViewPlan>>,
    pub(crate) answers: Vec<Option<ViewResult>>,
    layout: Arc<Layout>,
    levels: Vec<u16>,
    values: Vec<Vec<f32>>,
}

impl Scene {
    /// * `rows`: number of cells of the finest level in each direction.
    pub(crate) fn new(rows: usize, n_views: usize) -> Self {
        let model = model();
        let layout = Arc::new(layout(rows));
        let levels: Vec<u16> = (0..N_LEVELS as u16).collect();
        let solver = Solver::new(Arc::clone(&model));
        let mut random = 1_u64;
        let mut unit = || {
            random = random.wrapping_mul(6364136223846793005).wrapping_add(1);
            (random >> 40) as f32 / (1_u64 << 24) as f32
        };
        let values: Vec<Vec<f32>> = (0..n_views)
            .map(|_| (0..layout.n_responses()).map(|_| unit()).collect())
            .collect();
        let answers = values.iter().map(|values| {
            let evidence = Responses::new(&layout, values, &levels);
            let (candidates, _) = solver.distinct_and_bounds(&evidence, 4, 1.0);
            Some(ViewResult {
                candidates,
                front: Vec::new(),
                sigma_px: Some(vec![5.0; N_PARTS]),
                tau_px: Some(vec![8.0; N_PARTS]),
                skew_s: 0.0,
            })
        });
        let answers = answers.collect();
        let plan = |view| {
            let camera = camera(view, layout.image_size);
            let (model, layout) = (Arc::clone(&model), Arc::clone(&layout));
            Arc::new(ViewPlan::new(camera, model, layout))
        };
        Self {
            plans: (0..n_views).map(plan).collect(),
            answers,
            levels,
            values,
            layout,
            model,
        }
    }

    pub(crate) fn evidence(&self) -> Vec<Responses<'_>> {
        let each = self.values.iter();
        each.map(|values| Responses::new(&self.layout, values, &self.levels)).collect()
    }
}

fn model() -> Arc<Model> {
    let spring = Spring {
        w: [0.05, 0.0, 0.05, 0.0],
        anchor: [0, 1],
    };
    let part = |part: usize| PartSpec {
        name: PART_NAMES[part].to_owned(),
        filter_of_type: (N_TYPES * part..N_TYPES * (part + 1)).collect(),
        edge: PARENT[part].map(|parent| Edge {
            parent,
            bias: vec![vec![0.0; N_TYPES]; N_TYPES],
            springs: Springs::PerChildType(vec![spring; N_TYPES]),
        }),
    };
    let filter = Filter {
        rows: 1,
        cols: 1,
        weights: vec![0.0; N_CHANNELS],
    };
    let spec = ModelSpec {
        name: "made up".to_owned(),
        parts: (0..N_PARTS).map(part).collect(),
        filters: vec![filter; N_PARTS * N_TYPES],
        root_bias: 0.0,
        interval: 1,
        cell_px: 4,
        threshold: 0.0,
        mirror: Some(MIRROR.to_vec()),
    };
    Arc::new(Model::new(spec).unwrap())
}

fn layout(rows: usize) -> Layout {
    let image_size = [4 * rows; 2];
    let mut offset = 0;
    let level = |level: usize| {
        let rows = rows >> level;
        let layout = LevelLayout {
            scale: 4.0 * f64::from(1 << level),
            image_size,
            padded: [rows; 2],
            rows,
            cols: rows,
            offset,
        };
        offset += rows * rows * N_PARTS * N_TYPES;
        layout
    };
    Layout {
        image_size,
        levels: (0..N_LEVELS).map(level).collect(),
        pad: [0, 0],
        n_filters: N_PARTS * N_TYPES,
    }
}

fn camera(view: usize, size: [usize; 2]) -> Camera {
    let bearing = 1.3 * view as f64;
    let eye = Point3::new(4.0 * bearing.cos(), 4.0 * bearing.sin(), 1.0);
    let upright = Isometry3::look_at_rh(&eye, &Point3::origin(), &Vector3::z());
    // `look_at_rh` has x right, y up, z backward: a rotation by 180 degrees about x gives OpenCV's axes.
    let opencv = Isometry3::rotation(Vector3::x() * std::f64::consts::PI);
    let [width, height] = size.map(|size| size as f64);
    Camera {
        name: format!("camera {view}"),
        intrinsics: Intrinsics {
            fx: width,
            fy: width,
            cx: width / 2.0,
            cy: height / 2.0,
            size: size.map(|size| size as u32),
            lens: Lens::new(LensModel::Pinhole),
        },
        camera_from_world: opencv * upright,
    }
}
