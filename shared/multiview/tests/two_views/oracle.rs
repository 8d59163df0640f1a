//! The joint energy of the paper, written down from eq. 1, 3, 4 and 7 without the crate's terms.

use fmp::Pose;
use geometry::epipolar;
use multiview::Settings;
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

/// The last two sums of eq. 3.
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
        // The scene has tables of its first two views.
        if views == [0, 1] && !exchanged {
            let types = [0, 1].map(|side| usize::from(poses[side].parts[part].mixture));
            assert!(types.iter().all(|it| *it < N_TYPES));
            sum += settings.beta * scene.tables.joint.value(part, types[0], types[1]);
        }
    }
    sum
}

/// Eq. 6, one view's half of it.
fn is_usable(scene: &Scene, settings: &Settings, view: usize, part: usize) -> bool {
    match (&scene.views[view].sigma_px, settings.tau_px.get(part)) {
        (Some(sigma), Some(tau)) => sigma[part] <= *tau,
        _ => true,
    }
}

/// Eq. 4: squared distances to the lines of each other, in the cells of either view.
fn distance2(
    scene: &Scene,
    settings: &Settings,
    views: [usize; 2],
    poses: [&Pose; 2],
    parts: [usize; 2],
) -> f64 {
    let [a, b] = views.map(|it| scene.views[it].plan.camera());
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
