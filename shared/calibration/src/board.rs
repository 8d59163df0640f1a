//! Calibration of cameras from a board that is moved around: their intrinsics and their poses relative to each other.
//!
//! | step | where |
//! |---|---|
//! | choose frames that cover the pictures, distances and tilts | `choose` |
//! | find the intrinsics of each camera alone (Zhang, *A flexible new technique for camera calibration*, 2000) | `intrinsics`, `pose` |
//! | find the relative poses of cameras that saw the board together, then all poses along the strongest pairs | `graph` |
//! | run all steps, in this order | `rig` |
//! | adjust everything at once, without wrong corners | `adjust`, `problem`, `outcome` |
//! | weigh a moving board if the cameras are not synchronised | `certainty` |
//! | find the pose of a board that does not move | `still` |
//! | state the uncertainty of the result, and reasons not to trust it | `verdict` |

mod adjust;
mod certainty;
mod choose;
mod graph;
mod intrinsics;
mod outcome;
mod pose;
mod problem;
mod rig;
mod still;
mod verdict;

#[cfg(test)]
mod tests;

use geometry::bundle::Loss;
use geometry::{Camera, Intrinsics};
use nalgebra::{Isometry3, Point2, Vector2};

pub use pose::Sighted;
pub use rig::calibrate;
pub use still::standing_board;
pub use verdict::Doubt;

/// Minimum number of visible corners. A picture of the board with fewer is not used.
pub const LEAST_CORNERS: usize = 6;
/// Minimum number of pictures of the board from which intrinsics are found.
pub const LEAST_BOARDS: usize = 3;

/// A board in one picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Sight {
    /// Index of the camera.
    pub camera: usize,
    /// Index of the frame. Pictures of one frame were taken at the same time.
    pub frame: usize,
    /// Number of each corner and its position in the picture, in pixels.
    pub points: Vec<(usize, Point2<f64>)>,
    /// Position of each corner on the board, in metres.
    pub on_board: Vec<Point2<f64>>,
}

impl Sight {
    /// Creates a sight from numbered corners, without corners that the board does not have.
    pub fn new(
        camera: usize,
        frame: usize,
        corners: impl Iterator<Item = (usize, Point2<f64>)>,
        board: &[Point2<f64>],
    ) -> Self {
        let points: Vec<(usize, Point2<f64>)> =
            corners.filter(|corner| corner.0 < board.len()).collect();
        let on_board = points.iter().map(|point| board[point.0]).collect();
        Self {
            camera,
            frame,
            points,
            on_board,
        }
    }

    fn sighted(&self) -> Vec<Sighted> {
        let each = self.on_board.iter().zip(&self.points);
        each.map(|(on_board, (_, at))| (*on_board, *at)).collect()
    }

    /// Returns the same corners with different numbers.
    fn renumbered(&self, numbers: &[usize], board: &[Point2<f64>]) -> Self {
        let points = self.points.iter().map(|(id, at)| (numbers[*id], *at));
        Self::new(self.camera, self.frame, points, board)
    }
}

/// Lens parameters that are estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LensKind {
    /// Pinhole lens with the distortion coefficients k1, k2, k3, p1 and p2.
    #[default]
    Five,
    /// Pinhole lens with the distortion coefficients k1 to k6, p1 and p2.
    Eight,
    /// Fisheye lens with the distortion coefficients k1 to k4.
    Fisheye,
}

/// Loss functions for the residuals of corners, which are given in standard deviations.
struct CornerLoss;

impl CornerLoss {
    /// Loss while wrong corners may still be included.
    const ROBUST: Loss = Loss::Cauchy(2.0);
    /// Loss after wrong corners have been removed.
    const FINAL: Loss = Loss::Huber(4.0);
}

/// Input of a calibration.
#[derive(Debug, Clone)]
pub struct Task {
    /// Names of the cameras.
    pub names: Vec<String>,
    /// Width and height of each camera's pictures, in pixels.
    pub sizes: Vec<[u32; 2]>,
    /// Known intrinsics of each camera. Known intrinsics are not changed.
    pub known: Vec<Option<Intrinsics>>,
    /// Lens parameters to estimate for cameras without known intrinsics.
    pub lens: LensKind,
    /// Points of the board by number, in metres.
    pub board: Vec<Point2<f64>>,
    /// Rotations after which the board looks the same. Each one is given as a list of the numbers that the points have after the rotation.
    pub look_alikes: Vec<Vec<usize>>,
    /// All pictures in which the board was seen.
    pub sights: Vec<Sight>,
    /// True if the poses of the cameras are estimated in addition to their intrinsics.
    pub wants_rig: bool,
    /// Maximum number of frames to use.
    pub most_frames: usize,
}

/// A corner and its residual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Index of the frame.
    pub frame: usize,
    /// Number of the corner.
    pub id: usize,
    /// Position where the corner was seen, in pixels.
    pub at: Point2<f64>,
    /// Predicted position minus seen position, in pixels.
    pub off: Vector2<f64>,
    /// True if the corner was left out as wrong.
    pub is_wrong: bool,
}

/// An estimated quantity and its uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Known {
    /// Name of the quantity, such as `focal length`.
    pub name: String,
    /// Value of the quantity: pixels, metres in the world, degrees, or a coefficient.
    pub value: f64,
    /// Standard deviation of the value.
    pub sd: f64,
}

/// Calibration result for one camera.
#[derive(Debug, Clone)]
pub struct CameraOutcome {
    /// The calibrated camera. If no rig was requested, it has a world of its own.
    pub camera: Camera,
    /// True if the intrinsics were given.
    pub is_known: bool,
    /// Number of boards that were seen, and number of boards that were used.
    pub n_boards: [usize; 2],
    /// Residuals of all corners, including those that were left out.
    pub residuals: Vec<Residual>,
    /// Root mean square length of the residuals of the corners that were used, in pixels.
    pub rms_px: f64,
    /// Root mean square length of all residuals, including the corners that were left out, in pixels.
    pub rms_of_all_px: f64,
    /// Fraction of the picture that the corners cover.
    pub coverage: f64,
    /// Every free parameter, with its standard deviation.
    pub numbers: Vec<Known>,
}

impl CameraOutcome {
    /// Returns the fraction of corners that were left out.
    pub fn wrong_share(&self) -> f64 {
        let wrong = self.residuals.iter().filter(|residual| residual.is_wrong).count();
        wrong as f64 / self.residuals.len().max(1) as f64
    }
}

/// A pair of cameras that saw the board together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Together {
    /// Indices of the two cameras.
    pub cameras: [usize; 2],
    /// Number of frames in which both cameras saw the board.
    pub n: usize,
    /// Number of these frames that agree about the relative pose of the cameras.
    pub n_agree: usize,
}

/// Evidence that pictures of one frame were not taken at the same time: the residuals of a fit to all cameras together are larger than
/// those of separate fits to each camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutOfStep {
    /// Root mean square of the residuals if each camera is fitted alone, in pixels.
    pub alone_px: f64,
    /// Root mean square of the residuals if all cameras are fitted together, with free lens parameters, in pixels.
    pub together_px: f64,
    /// Largest change of a focal length between the two adjustments, as a fraction.
    pub bent: f64,
}

/// Result of a calibration.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Results for the cameras.
    pub cameras: Vec<CameraOutcome>,
    /// Pairs of cameras that saw the board together.
    pub pairs: Vec<Together>,
    /// Pose of the board in the world, by frame.
    pub boards: Vec<(usize, Isometry3<f64>)>,
    /// Standard deviation of a corner's position along each axis, in pixels.
    pub sigma_px: f64,
    /// Evidence that pictures of one frame were not taken at the same time, if there is any.
    pub out_of_step: Option<OutOfStep>,
    /// Reasons not to trust the calibration.
    pub doubts: Vec<Doubt>,
}

/// Reason why no calibration was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BoardError {
    /// A camera did not see the board often enough.
    #[error(
        "camera {camera:?} saw the board in {n} pictures, but at least {least} pictures with {corners} corners are needed",
        corners = LEAST_CORNERS
    )]
    TooFewBoards {
        /// Name of the camera.
        camera: String,
        /// Number of pictures with the board.
        n: usize,
        /// Number of pictures that are needed.
        least: usize,
    },
    /// No initial focal length was found for a camera.
    #[error(
        "camera {camera:?}: no focal length fits the board in its pictures: is the description of the board correct?"
    )]
    NoStart {
        /// Name of the camera.
        camera: String,
    },
    /// The cameras form several groups, and no camera saw the board at the same time as a camera of another group.
    #[error(
        "these groups of cameras never saw the board at the same time: {}; show the board to cameras of different groups at the same time",
        .groups.iter().map(|group| group.join(", ")).collect::<Vec<_>>().join(" | ")
    )]
    Apart {
        /// Names of the cameras in each group.
        groups: Vec<Vec<String>>,
    },
    /// The adjustment produced numbers that are not finite.
    #[error("the joint adjustment of all cameras gave numbers that are not finite")]
    NotFinite,
}
