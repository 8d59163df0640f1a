//! A tiny model, its layout, and poses on it.

use std::sync::Arc;

use fmp::{
    Edge, Filter, Layout, Model, ModelSpec, N_CHANNELS, PartSpec, Placement, Pose, Spring, Springs,
};
use geometry::{Camera, Intrinsics, Lens};
use messages::{MAX_PARTS, PoseMessage};
use multiview::ViewPlan;
use nalgebra::Isometry3;
use proptest::prelude::*;

/// Returns a model of three parts in a chain, with one, two and three types.
pub(crate) fn model() -> Model {
    let filter = Filter {
        rows: 3,
        cols: 3,
        weights: vec![0.0; 9 * N_CHANNELS],
    };
    let spring = Spring {
        w: [0.01, 0.0, 0.01, 0.0],
        anchor: [0, 1],
    };
    let part = |part: usize, first: usize| PartSpec {
        name: format!("part {part}"),
        filter_of_type: (first..=first + part).collect(),
        edge: (part > 0).then(|| Edge {
            parent: part - 1,
            bias: vec![vec![0.0; part + 1]; part],
            springs: Springs::PerChildType(vec![spring; part + 1]),
        }),
    };
    Model::new(ModelSpec {
        name: "chain".to_owned(),
        parts: vec![part(0, 0), part(1, 1), part(2, 3)],
        filters: vec![filter; 6],
        root_bias: 0.0,
        interval: 5,
        cell_px: 4,
        threshold: -1.0,
        mirror: None,
    })
    .unwrap()
}

/// Returns the layout for an image of 80x60 pixels.
pub(crate) fn layout() -> Layout {
    Layout::new(&model(), 80, 60).unwrap()
}

/// Poses within [`layout`].
pub(crate) fn any_pose() -> impl Strategy<Value = Pose> {
    let layout = layout();
    let levels = layout.levels.len();
    (0..levels, -10.0_f32..10.0).prop_flat_map(move |(level, score)| {
        let at = layout.levels[level];
        let part =
            move |part: u8| {
                (0..at.cols as u16, 0..at.rows as u16, 0..=part)
                    .prop_map(|(x, y, mixture)| Placement { x, y, mixture })
            };
        (part(0), part(1), part(2)).prop_map(move |(a, b, c)| Pose {
            score,
            level: level as u16,
            parts: vec![a, b, c],
        })
    })
}

/// Messages of arbitrary bytes, often almost valid.
pub(crate) fn pose_message() -> impl Strategy<Value = PoseMessage> {
    let number = || prop_oneof![30 => 0_u16..6, 1 => any::<u16>()];
    let cells = || prop::collection::vec(number(), MAX_PARTS);
    let types = prop::collection::vec(prop_oneof![30 => 0_u8..2, 1 => any::<u8>()], MAX_PARTS);
    let parts = prop_oneof![20 => Just(3_u16), 1 => any::<u16>()];
    let score = prop_oneof![9 => (-9.0_f32..9.0).prop_map(f32::to_bits), 1 => any::<u32>()];
    (score, number(), parts, cells(), cells(), types).prop_map(
        |(score, level, n_parts, x, y, mixture)| {
            let mut message = PoseMessage {
                score: f32::from_bits(score),
                level,
                n_parts,
                ..PoseMessage::default()
            };
            message.x.copy_from_slice(&x);
            message.y.copy_from_slice(&y);
            message.mixture.copy_from_slice(&mixture);
            message
        },
    )
}

/// Returns the plans of two views with the size of [`layout`].
pub(crate) fn plans() -> Vec<Arc<ViewPlan>> {
    plans_of(2)
}

/// Returns the plans of `n_views` views with the size of [`layout`], side by side.
pub(crate) fn plans_of(n_views: usize) -> Vec<Arc<ViewPlan>> {
    let camera = |x: f64| Camera {
        name: format!("at {x}"),
        intrinsics: Intrinsics {
            fx: 80.0,
            fy: 80.0,
            cx: 39.5,
            cy: 29.5,
            size: [80, 60],
            lens: Lens::default(),
        },
        camera_from_world: Isometry3::translation(x, 0.0, 3.0),
    };
    let model = Arc::new(model());
    let layout = Arc::new(layout());
    (0..n_views)
        .map(|view| {
            let camera = camera(view as f64);
            let plan = ViewPlan::new(camera, Arc::clone(&model), Arc::clone(&layout));
            Arc::new(plan)
        })
        .collect()
}
