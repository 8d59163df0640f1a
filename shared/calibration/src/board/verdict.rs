//! Reasons not to trust a calibration from a board.

use super::{CameraOutcome, Outcome, Sight, Task};

/// Limits below or above which a doubt is raised: number of boards, coverage of the picture, residuals, uncertainty of focal lengths.
const FEW_BOARDS: usize = 6;
const LITTLE_COVERED: f64 = 0.2;
const LARGE_PX: f64 = 3.0;
const FOCAL_SHARE: f64 = 0.01;
/// A changed focal length is evidence that cameras are out of step only if its uncertainty, as a fraction, is at most this.
const TOLD_SHARE: f64 = 0.1;
/// Two lenses are equal if they differ by less than this many standard deviations.
const SAME_SIGMAS: f64 = 3.0;
/// For cameras out of step: largest accepted uncertainty of a position, as a fraction of the distance from the first camera, and of a
/// rotation, in degrees.
const PLACE_SHARE: f64 = 0.02;
const TURN_DEGREES: f64 = 0.5;
const WRONG_SHARE: f64 = 0.15;
const AGREEING_SHARE: f64 = 0.6;
/// The limits of residuals are given for a picture whose longer side has this number of pixels. For other sizes, they change in proportion,
/// but never fall below half.
const USUAL_SIDE: f64 = 1280.0;

/// Reason not to trust a calibration.
#[derive(Debug, Clone, PartialEq)]
pub enum Doubt {
    /// The board was used in too few pictures.
    FewBoards {
        /// Index of the camera.
        camera: usize,
        /// Number of pictures.
        n: usize,
    },
    /// The board covered only a small part of the picture.
    LittleCovered {
        /// Index of the camera.
        camera: usize,
        /// Covered fraction of the picture, from 0 to 1.
        share: f64,
    },
    /// The residuals are large.
    LargeResiduals {
        /// Index of the camera.
        camera: usize,
        /// Root mean square of the residuals, in pixels.
        rms_px: f64,
        /// Limit for a picture of this size, in pixels.
        limit_px: f64,
    },
    /// The focal length is too uncertain.
    Focal {
        /// Index of the camera.
        camera: usize,
        /// Standard deviation of the focal length, as a fraction of the focal length.
        share: f64,
    },
    /// Pictures of one frame were not taken at the same time, and the pose of the camera is too uncertain.
    Place {
        /// Index of the camera.
        camera: usize,
        /// Standard deviation of the rotation, in degrees.
        degrees: f64,
        /// Standard deviation of the position, in metres.
        metres: f64,
    },
    /// Many corners do not fit.
    ManyWrong {
        /// Index of the camera.
        camera: usize,
        /// Fraction of corners that do not fit, from 0 to 1.
        share: f64,
    },
    /// Different frames give different relative poses of two cameras.
    Disagreement {
        /// Indices of the two cameras.
        cameras: [usize; 2],
        /// Number of frames that agree, and number of all frames.
        n: [usize; 2],
    },
}

impl Doubt {
    /// Returns the doubt as a sentence that suggests what to do.
    pub fn text(&self, names: &[String]) -> String {
        let name = |camera: &usize| names.get(*camera).map_or("?", String::as_str);
        match self {
            Self::FewBoards { camera, n } => format!(
                "{}: the board was used in only {n} pictures, but at least {FEW_BOARDS} are needed: show the board for longer, at other \
                 places and tilts",
                name(camera)
            ),
            Self::LittleCovered { camera, share } => format!(
                "{}: the board covered only {:.0} % of the picture, and the lens is unknown outside that area: move the board into the \
                 corners",
                name(camera),
                100.0 * share
            ),
            Self::LargeResiduals {
                camera,
                rms_px,
                limit_px,
            } => format!(
                "{}: the residuals are {rms_px:.2} px, but the limit is {limit_px:.2} px: is the board flat, is its description correct, \
                 and does the lens need another model (--lens)?",
                name(camera)
            ),
            Self::Focal { camera, share } => format!(
                "{}: its focal length is known to only {:.1} %: show the board tilted by 30 to 45 degrees, both nearer to the camera and \
                 further away",
                name(camera),
                100.0 * share
            ),
            Self::Place {
                camera,
                degrees,
                metres,
            } => format!(
                "{}: its pose is known to only {degrees:.1} degrees and {:.0} mm, because the pictures of a frame were not taken at the \
                 same time: hold the board still for a second at every place, or synchronise the cameras",
                name(camera),
                1000.0 * metres
            ),
            Self::ManyWrong { camera, share } => format!(
                "{}: {:.0} % of the corners do not fit and were left out: was the board moved too fast?",
                name(camera),
                100.0 * share
            ),
            Self::Disagreement { cameras: [a, b], n } => format!(
                "{} and {}: only {} of {} frames agree about their relative pose: are the videos synchronised, or did a camera move?",
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

/// Returns the relative standard deviation of a focal length; infinite if the pictures do not determine the focal length.
fn focal_share(camera: &CameraOutcome) -> f64 {
    let focal = camera.numbers.iter().find(|number| number.name == "focal length");
    focal.map_or(f64::INFINITY, |focal| focal.sd / focal.value)
}

/// Returns true if the focal length of a camera was given or is well determined.
fn is_lens_told(camera: &CameraOutcome) -> bool {
    camera.is_known || focal_share(camera) <= TOLD_SHARE
}

/// Returns true if adjusting all cameras together changed no lens that the camera's own pictures determine.
pub(super) fn are_lenses_the_same(joint: &Outcome, alone: &Outcome) -> bool {
    let is_same = |(joint, alone): (&CameraOutcome, &CameraOutcome)| {
        let [own, joint] = [alone, joint].map(|camera| camera.camera.intrinsics.fx);
        let limit = SAME_SIGMAS * focal_share(alone) * own;
        !is_lens_told(alone) || alone.is_known || (joint - own).abs() <= limit
    };
    joint.cameras.iter().zip(&alone.cameras).all(is_same)
}

/// Returns the largest standard deviations of a camera's rotation (degrees) and position (metres).
fn place_of(camera: &CameraOutcome) -> [f64; 2] {
    ["rotation", "place"].map(|name| {
        let own = camera.numbers.iter().filter(|number| number.name.starts_with(name));
        own.map(|number| number.sd).fold(0.0, f64::max)
    })
}

/// Adds doubts to an outcome.
pub(super) fn doubt(task: &Task, outcome: &mut Outcome) {
    let mut doubts = Vec::new();
    let centre = |camera_outcome: &CameraOutcome| camera_outcome.camera.centre_in_world();
    for (camera, it) in outcome.cameras.iter().enumerate() {
        let side = f64::from(task.sizes[camera][0].max(task.sizes[camera][1]));
        let limit_px = LARGE_PX * (side / USUAL_SIDE).max(0.5);
        // If cameras are out of step, the time differences enlarge the residuals of the common fit. The standard deviations already
        // include this effect.
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
