//! Reasons not to trust a calibration from a board.

use super::{CameraOutcome, Outcome, Sight, Task};

/// Limits: fewer boards, less of the picture, larger residuals or less certain focal lengths are doubts.
const FEW_BOARDS: usize = 6;
const LITTLE_COVERED: f64 = 0.2;
const LARGE_PX: f64 = 3.0;
const FOCAL_SHARE: f64 = 0.01;
/// A lens shows whether cameras are out of step if its own camera determines it to this share.
const TOLD_SHARE: f64 = 0.1;
/// Lenses are the same within this many standard deviations.
const SAME_SIGMAS: f64 = 3.0;
/// Cameras out of step: least certainty of a place, as a share of the distance from the first camera, and of a turn,
/// degrees; anything less is a doubt.
const PLACE_SHARE: f64 = 0.02;
const TURN_DEGREES: f64 = 0.5;
const WRONG_SHARE: f64 = 0.15;
const AGREEING_SHARE: f64 = 0.6;
/// Residuals are judged in a picture of this longer side; larger ones are allowed as much more.
const USUAL_SIDE: f64 = 1280.0;

/// Why a calibration is not to be trusted.
#[derive(Debug, Clone, PartialEq)]
pub enum Doubt {
    /// Few pictures with the board.
    FewBoards {
        /// The camera.
        camera: usize,
        /// How many.
        n: usize,
    },
    /// The board was seen in a small part of the picture.
    LittleCovered {
        /// The camera.
        camera: usize,
        /// The share of the picture, from 0 to 1.
        share: f64,
    },
    /// Large residuals.
    LargeResiduals {
        /// The camera.
        camera: usize,
        /// Root mean square, pixels.
        rms_px: f64,
        /// The limit for its picture.
        limit_px: f64,
    },
    /// The focal length is not known well.
    Focal {
        /// The camera.
        camera: usize,
        /// Its standard deviation as a share of it.
        share: f64,
    },
    /// Pictures of one frame were not taken at the same time, and too little shows where the camera stands.
    Place {
        /// The camera.
        camera: usize,
        /// Standard deviation of its turn, degrees, and of its place, metres.
        degrees: f64,
        /// See there.
        metres: f64,
    },
    /// Many corners do not fit.
    ManyWrong {
        /// The camera.
        camera: usize,
        /// Their share, from 0 to 1.
        share: f64,
    },
    /// Frames of a pair that contradict one another.
    Disagreement {
        /// The cameras.
        cameras: [usize; 2],
        /// Frames that agree, and all.
        n: [usize; 2],
    },
}

impl Doubt {
    /// As a sentence that says what to do.
    pub fn text(&self, names: &[String]) -> String {
        let name = |camera: &usize| names.get(*camera).map_or("?", String::as_str);
        match self {
            Self::FewBoards { camera, n } => format!(
                "{}: the board was used in {n} pictures only, {FEW_BOARDS} are the least: show it longer, in other places and tilts",
                name(camera)
            ),
            Self::LittleCovered { camera, share } => format!(
                "{}: its board covered {:.0} % of the picture, the lens is not known beyond it: move the board into the corners",
                name(camera),
                100.0 * share
            ),
            Self::LargeResiduals {
                camera,
                rms_px,
                limit_px,
            } => format!(
                "{}: residuals of {rms_px:.2} px (limit {limit_px:.2}): is the board flat, its description right, the lens of another kind (--lens)?",
                name(camera)
            ),
            Self::Focal { camera, share } => format!(
                "{}: its focal length is known to {:.1} % only: show the board tilted by 30 to 45 degrees, nearer and further away",
                name(camera),
                100.0 * share
            ),
            Self::Place {
                camera,
                degrees,
                metres,
            } => format!(
                "{}: where it stands is known to {degrees:.1} degrees and {:.0} mm only, since pictures of one frame were not taken at the same \
                 time: hold the board still for a second at every place, or synchronise the cameras",
                name(camera),
                1000.0 * metres
            ),
            Self::ManyWrong { camera, share } => format!(
                "{}: {:.0} % of its corners do not fit and were left out: was the board moved too fast?",
                name(camera),
                100.0 * share
            ),
            Self::Disagreement { cameras: [a, b], n } => format!(
                "{} and {}: {} of {} frames agree about where they stand: are the videos synchronised, did a camera move?",
                name(a),
                name(b),
                n[0],
                n[1]
            ),
        }
    }
}

/// Returns true if the points of a sight span a plane.
pub(super) fn is_spread(sight: &Sight) -> bool {
    let n = sight.on_board.len() as f64;
    let sum = sight
        .on_board
        .iter()
        .map(|on_board| on_board.coords)
        .sum::<nalgebra::Vector2<f64>>();
    let middle = sum / n;
    let mut scatter = nalgebra::Matrix2::zeros();
    for point in &sight.on_board {
        let offset = point.coords - middle;
        scatter += offset * offset.transpose();
    }
    let eigenvalues = scatter.symmetric_eigenvalues();
    let finite = sight.points.iter().all(|point| point.1.coords.iter().all(|c| c.is_finite()));
    finite && eigenvalues.min() > 0.01 * eigenvalues.max()
}

/// Standard deviation of a focal length, share of it; infinite if it is not determined.
fn focal_share(camera: &CameraOutcome) -> f64 {
    let focal = camera.numbers.iter().find(|number| number.name == "focal length");
    focal.map_or(f64::INFINITY, |focal| focal.sd / focal.value)
}

/// Returns true if the focal length of a camera was given or is well determined.
fn is_lens_told(camera: &CameraOutcome) -> bool {
    camera.is_known || focal_share(camera) <= TOLD_SHARE
}

/// Returns true if a joint adjustment kept every lens as found from the camera's own pictures, where these determine it.
pub(super) fn are_lenses_the_same(joint: &Outcome, alone: &Outcome) -> bool {
    let is_same = |(joint, alone): (&CameraOutcome, &CameraOutcome)| {
        let [own, joint] = [alone, joint].map(|camera| camera.camera.intrinsics.fx);
        let limit = SAME_SIGMAS * focal_share(alone) * own;
        !is_lens_told(alone) || alone.is_known || (joint - own).abs() <= limit
    };
    joint.cameras.iter().zip(&alone.cameras).all(is_same)
}

/// How well a turn, degrees, and a place, metres, are known: the largest deviations.
fn place_of(camera: &CameraOutcome) -> [f64; 2] {
    ["rotation", "place"].map(|name| {
        let own = camera.numbers.iter().filter(|number| number.name.starts_with(name));
        own.map(|number| number.sd).fold(0.0, f64::max)
    })
}

/// Adds the doubts of an outcome to it.
pub(super) fn doubt(task: &Task, outcome: &mut Outcome) {
    let mut doubts = Vec::new();
    let centre = |camera_outcome: &CameraOutcome| camera_outcome.camera.centre_in_world();
    for (camera, it) in outcome.cameras.iter().enumerate() {
        let side = f64::from(task.sizes[camera][0].max(task.sizes[camera][1]));
        let limit_px = LARGE_PX * (side / USUAL_SIDE).max(0.5);
        // Out of step, residuals of all together tell of the times, and the deviations of what comes of it.
        let rms_px = outcome.out_of_step.map_or(it.rms_px, |out_of_step| out_of_step.alone_px);
        if outcome.out_of_step.is_some() {
            let [degrees, metres] = place_of(it);
            let apart = (centre(it) - centre(&outcome.cameras[0])).norm();
            if camera != 0 && (degrees > TURN_DEGREES || metres > PLACE_SHARE * apart) {
                doubts.push(Doubt::Place {
                    camera,
                    degrees,
                    metres,
                });
            }
        }
        if rms_px.is_nan() || rms_px > limit_px {
            doubts.push(Doubt::LargeResiduals {
                camera,
                rms_px,
                limit_px,
            });
        }
        let share = it.wrong_share();
        if share > WRONG_SHARE {
            doubts.push(Doubt::ManyWrong { camera, share });
        }
        if it.is_known {
            continue;
        }
        if it.n_boards[1] < FEW_BOARDS {
            let n = it.n_boards[1];
            doubts.push(Doubt::FewBoards { camera, n });
        }
        if it.coverage < LITTLE_COVERED {
            let share = it.coverage;
            doubts.push(Doubt::LittleCovered { camera, share });
        }
        let focal = it.numbers.iter().find(|number| number.name == "focal length");
        let share = focal.map_or(0.0, |focal| focal.sd / focal.value);
        if share.is_nan() || share > FOCAL_SHARE {
            doubts.push(Doubt::Focal { camera, share });
        }
    }
    for it in &outcome.pairs {
        if (it.n_agree as f64) < AGREEING_SHARE * it.n as f64 {
            let (cameras, n) = (it.cameras, [it.n_agree, it.n]);
            doubts.push(Doubt::Disagreement { cameras, n });
        }
    }
    outcome.doubts = doubts;
}
