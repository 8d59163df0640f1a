//! Independent computation of the energies: of the paper's energy from eq. 1, 3, 4 and 6, and of the program's energy from its description.

use fmp::Pose;
use geometry::epipolar;
use multiview::{Settings, heat_map};
use nalgebra::Point2;

use crate::planted::{MIRROR, N_TYPES, Scene};

/// Eq. 3 for two poses of two views.
pub(crate) fn energy(
    scene: &Scene,
    settings: &Settings,
    views: [usize; 2],
    poses: [&Pose; 2],
    exchanged: bool,
) -> f64 {
    let own = |side: usize| own(scene, views[side], poses[side]);
    own(0) + own(1) + between(scene, settings, views, poses, exchanged)
}

/// Eq. 1: the score of a pose in its own view.
pub(crate) fn own(scene: &Scene, view: usize, pose: &Pose) -> f64 {
    let evidence = scene.views[view].evidence();
    f64::from(scene.solver.score(&evidence, pose, None))
}

/// Returns the last two sums of eq. 3.
pub(crate) fn between(
    scene: &Scene,
    settings: &Settings,
    views: [usize; 2],
    poses: [&Pose; 2],
    exchanged: bool,
) -> f64 {
    let mut sum = 0.0;
    for (part, &mirror) in MIRROR.iter().enumerate() {
        let parts = [part, if exchanged { mirror } else { part }];
        if !(0..2).all(|side| is_usable(scene, settings, views[side], parts[side])) {
            continue;
        }
        sum -= settings.alpha * distance2(scene, settings, views, poses, parts);
        // The scene has tables for its first two views.
        if views == [0, 1] {
            let types = [0, 1].map(|side| usize::from(poses[side].parts[parts[side]].mixture));
            assert!(types.iter().all(|kind| *kind < N_TYPES));
            let other_side = scene.tables.exchanged.as_ref();
            let table = if exchanged {
                other_side.unwrap()
            } else {
                &scene.tables.joint
            };
            sum += settings.beta * table.value(part, types[0], types[1]);
        }
    }
    sum
}

/// Eq. 6 for one view.
fn is_usable(scene: &Scene, settings: &Settings, view: usize, part: usize) -> bool {
    match (&scene.views[view].sigma_px, settings.tau_px.get(part)) {
        (Some(sigma), Some(tau)) => sigma[part] <= *tau,
        _ => true,
    }
}

/// Eq. 4: the squared distance of each point from the other's line, in the cells of its own view.
fn distance2(
    scene: &Scene,
    settings: &Settings,
    views: [usize; 2],
    poses: [&Pose; 2],
    parts: [usize; 2],
) -> f64 {
    let [a, b] = views.map(|view| scene.views[view].plan.camera());
    let cap = settings.max_distance_cells.powi(2).min(1e6);
    let ideal = |side: usize| {
        let plan = &scene.views[views[side]].plan;
        let at = plan.centres(poses[side])[parts[side]];
        plan.camera().undistorted_px(&Point2::from(at))
    };
    let (Some(p), Some(q)) = (ideal(0), ideal(1)) else {
        return 2.0 * cap;
    };
    let px = epipolar::symmetric_distance(&epipolar::fundamental(a, b), &p, &q).unwrap();
    let of_side = |side: usize| {
        let plan = &scene.views[views[side]].plan;
        let cells = px[side] / plan.scale(usize::from(poses[side].level));
        (cells * cells).min(cap)
    };
    of_side(0) + of_side(1)
}

/// Returns the released program's score of `poses[target]`, with the other pose fixed.
pub(crate) fn released(
    scene: &Scene,
    settings: &Settings,
    target: usize,
    poses: &[Pose; 2],
    exchanged: bool,
) -> f64 {
    let support = 1 - target;
    let mut sum = own(scene, target, &poses[target]);
    for (part, &mirror) in MIRROR.iter().enumerate() {
        let other = if exchanged { mirror } else { part };
        let centre = scene.views[support].plan.centres(&poses[support])[other];
        // The program counts from 1.
        let pixel = centre.map(|centre| (centre + 1.0).round());
        let size = scene.views[support].plan.layout().image_size;
        let inside = |axis: usize| pixel[axis] > 0.0 && pixel[axis] < size[axis] as f64;
        if !inside(0) || !inside(1) || !is_supporting(scene, settings, support, [other, part]) {
            continue;
        }
        sum += settings.alpha * heat(scene, target, &poses[target], part, pixel);
        if !exchanged {
            let [support_type, own] =
                [support, target].map(|view| usize::from(poses[view].parts[part].mixture));
            sum += settings.beta * scene.tables.conditional[support].value(part, support_type, own);
        }
    }
    sum
}

/// Returns true if a part of the support is on: either it is good enough, or the part is bad in both views but clearly better in the
/// support.
///
/// * `parts`: indices of the part in the support and in the target.
fn is_supporting(scene: &Scene, settings: &Settings, support: usize, parts: [usize; 2]) -> bool {
    let views = [support, 1 - support];
    let [here, there] = [0, 1].map(|side| is_usable(scene, settings, views[side], parts[side]));
    let sigma = |side: usize| scene.views[views[side]].sigma_px.as_ref().unwrap()[parts[side]];
    here || (!there && sigma(0) < sigma(1) - settings.rescue_px[parts[0]])
}

/// Returns the heat, at `pixel` (counted from 1) in the target, of the epipolar line of a part of the support.
fn heat(scene: &Scene, target: usize, pose: &Pose, part: usize, pixel: [f64; 2]) -> f64 {
    let [here, there] = [target, 1 - target].map(|view| scene.views[view].plan.camera());
    let fundamental = epipolar::fundamental(there, here);
    let at = Point2::from(pixel.map(|pixel| pixel - 1.0));
    let line = epipolar::epipolar_line(&fundamental, &at).unwrap();
    let layout = scene.views[target].plan.layout();
    let [right, bottom] = layout.image_size.map(|image_size| image_size as f64 - 0.5);
    let mut ends = Vec::new();
    for x in [-0.5, right] {
        let y = -(line.x * x + line.z) / line.y;
        if (-0.5..=bottom).contains(&y) {
            ends.push([x + 1.0, y + 1.0]);
        }
    }
    for y in [-0.5, bottom] {
        let x = -(line.y * y + line.z) / line.x;
        if -0.5 < x && x < right {
            ends.push([x + 1.0, y + 1.0]);
        }
    }
    let [from, to] = ends[..] else { return 0.0 };
    let level = &layout.levels[usize::from(pose.level)];
    let map = heat_map([from, to], layout.image_size, level.rows, level.cols);
    let cell = usize::from(pose.parts[part].y) * level.cols + usize::from(pose.parts[part].x);
    f64::from(map[cell])
}
