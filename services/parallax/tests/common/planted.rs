//! A moving figure, cameras, and a model that finds the figure in milliseconds.

use std::sync::Arc;

use fmp::{Edge, Filter, Model, ModelSpec, N_CHANNELS, PartSpec, Spring, Springs};
use footage::{Canvas, Size};
use geometry::{Camera, Intrinsics, Lens, LensModel, Rig};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use skeleton::{MIRROR, N_PARTS, PARENT, PART_NAMES};

/// Width and height of every picture, in pixels.
pub(crate) const SIZE: [u32; 2] = [96, 128];
const CELL_PX: usize = 4;

/// Returns cameras named `a`, `b`, `c`, ... on an arc of 3 m around the origin, with z up.
pub(crate) fn rig(n_views: usize) -> Rig {
    let cameras = (0..n_views).map(|view| {
        let angle = 0.6 * view as f64 - 0.5;
        let eye = Point3::new(3.0 * angle.sin(), -3.0 * angle.cos(), 0.2);
        let looking = Isometry3::look_at_rh(&eye, &Point3::origin(), &Vector3::z());
        // Converts axes with y up and z backward to axes with y down and z forward.
        let turned = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), core::f64::consts::PI);
        Camera {
            name: name(view),
            intrinsics: Intrinsics {
                fx: 170.0,
                fy: 170.0,
                cx: 47.5,
                cy: 63.5,
                size: SIZE,
                lens: Lens::new(LensModel::Pinhole),
            },
            camera_from_world: Isometry3::from_parts(Translation3::identity(), turned) * looking,
        }
    });
    Rig::new(cameras.collect(), Some(Vector3::z_axis()), "planted").unwrap()
}

/// Returns the same cameras with lens distortion, each with another roll angle.
pub(crate) fn tilted_rig(n_views: usize) -> Rig {
    let tilted = rig(n_views).cameras().to_vec().into_iter().enumerate();
    let cameras = tilted.map(|(view, camera)| {
        let roll = 0.5 - 0.4 * view as f64;
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll);
        let lens = LensModel::BrownConrady {
            k: [-0.2, 0.05, 0.0, 0.0, 0.0, 0.0],
            p: [0.002, -0.001],
        };
        Camera {
            camera_from_world: turn * camera.camera_from_world,
            intrinsics: Intrinsics {
                fy: 168.0,
                lens: Lens::new(lens),
                ..camera.intrinsics
            },
            ..camera
        }
    });
    Rig::new(cameras.collect(), Some(Vector3::z_axis()), "planted").unwrap()
}

/// Returns the name of a view.
pub(crate) fn name(view: usize) -> String {
    char::from(b'a' + view as u8).to_string()
}

/// Returns the picture of a camera in a frame.
pub(crate) fn picture(camera: &Camera, frame: usize) -> Canvas {
    let [width, height] = SIZE.map(|size| size as usize);
    let mut canvas = Canvas::new(Size::new(width, height), [90, 96, 102]);
    let parts = figure(frame).map(|at| camera.project(&at).unwrap());
    for (part, at) in parts.iter().enumerate() {
        let colour = [
            40 * (part % 6) as u8,
            255 - 9 * part as u8,
            30 * (part % 7) as u8,
        ];
        if let Some(parent) = PARENT[part] {
            canvas.line(parts[parent].coords.into(), at.coords.into(), 3.0, colour);
        }
        canvas.disc(at.coords.into(), 2.5, colour);
    }
    canvas
}

/// Returns the parts of a figure that walks and turns, in metres.
fn figure(frame: usize) -> [Point3<f64>; N_PARTS] {
    let time = frame as f64;
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.3 * (0.2 * time).sin());
    let walk = Vector3::new(0.15 * (0.3 * time).sin(), 0.1 * (0.23 * time).cos(), 0.0);
    core::array::from_fn(|part| turn * standing(part) + walk)
}

/// Returns the 14 joints of the figure, in metres.
pub(crate) fn joints(frame: usize) -> Vec<[f64; 3]> {
    let parts = figure(frame).map(|point| point.coords.into());
    skeleton::PARSE14.from_parts(&parts)
}

/// Returns the position of a part of the standing figure. Parts deeper in the tree are lower, and parts are displaced to their side.
fn standing(part: usize) -> Point3<f64> {
    let depth = core::iter::successors(PARENT[part], |i| PARENT[*i]).count() as f64;
    let side = (MIRROR[part] as f64 - part as f64).signum();
    let side = if MIRROR[part] == part { 0.0 } else { side };
    let swing = 0.04 * ((part * 7) % 5) as f64;
    Point3::new(
        side * (0.12 + 0.02 * depth),
        swing - 0.08,
        0.55 - 0.11 * depth,
    )
}

/// Returns a model of 26 parts of two types, with four filters of 3x3 cells that respond to edges.
pub(crate) fn model() -> Arc<Model> {
    Arc::new(Model::new(spec()).unwrap())
}

fn spec() -> ModelSpec {
    let rig = rig(2);
    let camera = &rig.cameras()[1];
    let at = |part: usize| camera.project(&standing(part)).unwrap().coords;
    let part = |part: usize| PartSpec {
        name: PART_NAMES[part].to_owned(),
        filter_of_type: vec![part % 4, (part + 1) % 4],
        edge: PARENT[part].map(|parent| {
            let offset = (at(part) - at(parent)) / CELL_PX as f64;
            let anchor = [offset.x.round() as i32, offset.y.round() as i32];
            let spring = |seed: usize| Spring {
                w: [0.05 + 0.01 * seed as f64, 0.003 * part as f64, 0.06, -0.002],
                anchor: [anchor[0] + seed as i32, anchor[1]],
            };
            Edge {
                parent,
                bias: vec![vec![0.1, 0.02 * part as f64], vec![-0.05, 0.2]],
                springs: Springs::PerChildType(vec![spring(0), spring(1)]),
            }
        }),
    };
    ModelSpec {
        name: "planted".to_owned(),
        parts: (0..N_PARTS).map(part).collect(),
        filters: (0..4).map(filter).collect(),
        root_bias: -0.5,
        interval: 2,
        cell_px: CELL_PX,
        threshold: -1.0,
        mirror: Some(MIRROR.to_vec()),
    }
}

fn filter(seed: usize) -> Filter {
    let weight = |i: usize| match i % N_CHANNELS {
        31 => -1.0,
        _ => 0.1 + 0.1 * ((seed * 1000 + i) as f64).sin(),
    };
    Filter {
        rows: 3,
        cols: 3,
        weights: (0..9 * N_CHANNELS).map(weight).collect(),
    }
}
