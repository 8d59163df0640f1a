//! A scene of two views for tests, with records of frames.

use std::sync::Arc;

use fmp::{Filter, Layout, Model, ModelSpec, N_CHANNELS, PartSpec, Placement, Pose};
use geometry::{Camera, Framing, Intrinsics, Lens, OutSize};
use messages::{
    FusedView, Joint3d, MAX_JOINTS, MAX_KEYPOINTS, MAX_VIEWS, Sightings, SkeletonMessage,
    Skeletons, Status,
};
use nalgebra::{Isometry3, Vector3};
use pipeline::Sighting;

use crate::{FrameRecord, Scene, View, ViewRecord};

/// Returns a scene with two views of 160x120 footage in frames of 80x60. The footage has 60 Hz, and every second frame is used.
pub(crate) fn scene() -> Scene {
    let model = Arc::new(model());
    let layout = Arc::new(Layout::new(&model, 80, 60).unwrap());
    let views = ["left", "right"].map(|name| {
        let camera = Camera {
            name: name.to_owned(),
            intrinsics: Intrinsics {
                fx: 150.0,
                fy: 150.0,
                cx: 79.5,
                cy: 59.5,
                size: [160, 120],
                lens: Lens::default(),
            },
            camera_from_world: Isometry3::translation(0.0, 0.0, 3.0),
        };
        let framing = Framing::new(&camera, [160, 120], None, OutSize::Exact([80, 60]), 0.0);
        View {
            name: name.to_owned(),
            framing: framing.unwrap(),
            layout: Arc::clone(&layout),
        }
    });
    Scene {
        model,
        views: views.into(),
        joints: &skeleton::PARSE14,
        extra_keypoints: Vec::new(),
        frame_rate_hz: Some(60.0),
        frame_step: 2,
        has_maps: false,
        least_heat: 0.0,
        follow: deployment::person::Follow::default(),
        up_in_world: Some(Vector3::z_axis()),
    }
}

fn model() -> Model {
    let part = PartSpec {
        name: "all".to_owned(),
        filter_of_type: vec![0],
        edge: None,
    };
    Model::new(ModelSpec {
        name: "one part".to_owned(),
        parts: vec![part],
        filters: vec![Filter {
            rows: 3,
            cols: 3,
            weights: vec![0.0; 9 * N_CHANNELS],
        }],
        root_bias: 0.0,
        interval: 5,
        cell_px: 4,
        threshold: 0.0,
        mirror: None,
    })
    .unwrap()
}

/// Returns a result with one person, with every joint at (1, 2, 3).
pub(crate) fn skeletons(frame: u64) -> Box<Skeletons> {
    let joint = Joint3d {
        in_world: [1.0, 2.0, 3.0],
        covariance: [1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-4],
        reprojection_px: 1.5,
        views_used: 0b11,
        status: Status::OK,
    };
    let fused = FusedView {
        energy: 1.0,
        n_pairs: 1,
        n_parts: 1,
        ..FusedView::default()
    };
    let person = SkeletonMessage {
        id: 1,
        status: Status::OK,
        n_joints: 14,
        n_keypoints: 0,
        n_views: 2,
        views_used: 0b11,
        n_pairs: 1,
        sides: messages::Sides::SURE,
        kept: messages::Kept::SOLVED,
        facing_margin: 1.0,
        sides_margin: 4.0,
        stature_m: 0.0,
        body_deviation: 0.0,
        joints: [joint; MAX_JOINTS],
        views: [fused; MAX_VIEWS],
        keypoints: [joint; MAX_KEYPOINTS],
    };
    let mut skeletons = Box::<Skeletons>::default();
    skeletons.stamp.frame = frame;
    skeletons.views_present = 0b11;
    (skeletons.n_people, skeletons.people[0]) = (1, person);
    skeletons
}

/// Returns a person whom a network has just seen clearly.
///
/// * `joints`: the joints of `skeleton::PARSE14`, in pixels of the frame.
pub(crate) fn sighting(joints: [[f32; 2]; 14]) -> Sighting {
    Sighting {
        joints: joints.map(Some),
        heats: [0.9; 14],
        score: 0.5,
        front: [0.0; 2],
        extras: Vec::new(),
        colour: None,
        age_s: 0.0,
    }
}

/// Returns a frame in which both views found a person.
pub(crate) fn record(frame: u64) -> FrameRecord {
    let pose = Pose {
        score: 0.5,
        level: 0,
        parts: vec![Placement {
            x: 4,
            y: 6,
            mixture: 0,
        }],
    };
    let message: Sightings = wire::candidates_to_message(&[pose], [80, 60]).unwrap();
    let view = ViewRecord {
        pose: Some(message),
        ..ViewRecord::default()
    };
    FrameRecord {
        skeletons: skeletons(frame),
        views: vec![view; 2],
        fused: Vec::new(),
    }
}
