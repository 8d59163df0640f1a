//! Standard deviations of cameras whose pictures were not taken at the same time.

use super::{CameraOutcome, Known, Outcome};

/// By how much deviations of a lens that one camera tells are larger than of corners whose errors are independent: a board that moves is
/// blurred, and scanned row by row. Measured on Caliscope's session: four focal lengths were 1.3 to 2.1 deviations off before.
const ALIKE: f64 = 1.5;

/// By how much deviations are larger where the board never stood still: what its movement puts aside is not of the kind that residuals
/// tell. In a simulation of a board that is carried about, with cameras 0.7 and 0.8 frames apart, turns were 3.9 deviations off before.
const MOVING: f64 = 3.0;

/// The numbers of a lens that was held, with the deviations of its camera alone.
pub(super) fn held(alone: &CameraOutcome) -> impl Iterator<Item = Known> + '_ {
    alone.numbers.iter().map(|number| Known {
        sd: ALIKE * number.sd,
        ..number.clone()
    })
}

/// Widens the deviations of places and turns.
///
/// The adjustment takes corners as independent. Where a board moved between two pictures of a frame, all its corners are off together, so
/// that a sight tells no more than one corner would. A lens that is held is not certain either: what it is wrong by moves the camera
/// along its axis by the same share, and turns it.
///
/// * `alone`: every camera by itself.
/// * `is_held`: of every camera, whether its lens was held as it alone tells it.
/// * `are_still`: whether the board stood still in the frames that were used.
pub(super) fn widen(outcome: &mut Outcome, alone: &Outcome, is_held: &[bool], are_still: bool) {
    let moving = if are_still { 1.0 } else { MOVING };
    let boards = outcome.boards.clone();
    let lens = |nth: usize| -> [f64; 2] {
        let camera = &alone.cameras[nth];
        if !is_held[nth] || camera.is_known {
            return [0.0; 2];
        }
        let focal = camera.camera.intrinsics.fx;
        let sd = |name: &str| {
            let known = camera.numbers.iter().find(|it| it.name == name);
            known.map_or(0.0, |it| ALIKE * it.sd)
        };
        let aside = sd("principal point x").max(sd("principal point y"));
        [sd("focal length") / focal, (aside / focal).to_degrees()]
    };
    let first = (lens(0), distance(&outcome.cameras[0], &boards));
    for (nth, camera) in outcome.cameras.iter_mut().enumerate() {
        let n_sights = camera.n_boards[1].max(1);
        let corners = camera.residuals.len() as f64 / n_sights as f64;
        let (own, metres) = (lens(nth), distance(camera, &boards));
        let shift = (own[0] * metres).hypot(first.0[0] * first.1);
        let turn = own[1].hypot(first.0[1]);
        for number in &mut camera.numbers {
            number.sd *= moving * corners.max(1.0).sqrt();
            if number.name.starts_with("place") {
                number.sd = number.sd.hypot(shift);
            } else if number.name.starts_with("rotation") {
                number.sd = number.sd.hypot(turn);
            }
        }
    }
}

/// The mean distance of a camera from the boards, metres.
fn distance(camera: &CameraOutcome, boards: &[(usize, nalgebra::Isometry3<f64>)]) -> f64 {
    let centre = camera.camera.centre_in_world().coords;
    let each = boards
        .iter()
        .map(|it| (it.1.translation.vector - centre).norm());
    each.sum::<f64>() / boards.len().max(1) as f64
}
