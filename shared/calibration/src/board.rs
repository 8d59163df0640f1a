//! Cameras calibrated from a board that is moved around: intrinsics, and how they stand to one another.
//!
//! | step | where |
//! |---|---|
//! | frames that cover the pictures, distances and tilts | `choose` |
//! | the intrinsics of every camera separately (Zhang, *A flexible new technique for camera calibration*, 2000) | `intrinsics`, `pose` |
//! | how pairs stand that saw the board together, and all along the strongest pairs | `graph` |
//! | all of it, in this order | `rig` |
//! | everything adjusted at once, wrong corners left out | `adjust`, `problem`, `outcome` |
//! | how much a board that moves tells where cameras are out of step | `certainty` |
//! | a board that lies still before a rig | `still` |
//! | what is known how well, and what forbids to trust it | `verdict` |

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

/// The fewest corners of a board that count as a sight of it.
pub const LEAST_CORNERS: usize = 6;
/// The fewest sights of a board that intrinsics are found from.
pub const LEAST_BOARDS: usize = 3;

/// A board in one picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Sight {
    /// The camera, an index.
    pub camera: usize,
    /// The frame: pictures of one frame were taken at the same time.
    pub frame: usize,
    /// The number of each corner, and where it is in the picture, pixels.
    pub points: Vec<(usize, Point2<f64>)>,
    /// Where each corner is on the board, metres.
    pub on_board: Vec<Point2<f64>>,
}

impl Sight {
    /// Takes corners by their numbers and leaves out those that the board does not have.
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

    /// The same with other numbers.
    fn renumbered(&self, numbers: &[usize], board: &[Point2<f64>]) -> Self {
        let points = self.points.iter().map(|(id, at)| (numbers[*id], *at));
        Self::new(self.camera, self.frame, points, board)
    }
}

/// Parameters of a lens that are estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LensKind {
    /// Pinhole with k1, k2, k3, p1, p2.
    #[default]
    Five,
    /// Pinhole with k1 to k6, p1, p2.
    Eight,
    /// Fisheye with k1 to k4.
    Fisheye,
}

/// The loss of corners, in standard deviations.
struct CornerLoss;

impl CornerLoss {
    /// Where wrong corners may still be among them.
    const ROBUST: Loss = Loss::Cauchy(2.0);
    /// Where they are not.
    const FINAL: Loss = Loss::Huber(4.0);
}

/// Input of a calibration.
#[derive(Debug, Clone)]
pub struct Task {
    /// Names of the cameras.
    pub names: Vec<String>,
    /// Width and height of their pictures.
    pub sizes: Vec<[u32; 2]>,
    /// Intrinsics that are known, and kept.
    pub known: Vec<Option<Intrinsics>>,
    /// Lens parameters that are estimated for the other cameras.
    pub lens: LensKind,
    /// The points of the board by their numbers, metres.
    pub board: Vec<Point2<f64>>,
    /// Turns by which the board looks the same: the numbers that points then have.
    pub look_alikes: Vec<Vec<usize>>,
    /// Where the board was seen.
    pub sights: Vec<Sight>,
    /// True if the poses of the cameras are wanted, not only the intrinsics of each.
    pub wants_rig: bool,
    /// The most frames that are used.
    pub most_frames: usize,
}

/// A corner and its residual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// The frame.
    pub frame: usize,
    /// The number of the corner.
    pub id: usize,
    /// Where it was seen, pixels.
    pub at: Point2<f64>,
    /// Where it would be by what was found, less where it was seen, pixels.
    pub off: Vector2<f64>,
    /// True if it was left out as wrong.
    pub is_wrong: bool,
}

/// A quantity and how well it is known.
#[derive(Debug, Clone, PartialEq)]
pub struct Known {
    /// Name of the quantity, such as `focal length`.
    pub name: String,
    /// The number: pixels, metres in the world, degrees, or a coefficient.
    pub value: f64,
    /// Its standard deviation.
    pub sd: f64,
}

/// Result for a camera.
#[derive(Debug, Clone)]
pub struct CameraOutcome {
    /// The camera; in a world of its own where no rig was wanted.
    pub camera: Camera,
    /// True if its intrinsics were given.
    pub is_known: bool,
    /// Boards that were seen, and those that were used.
    pub n_boards: [usize; 2],
    /// Every corner that was used, and those left out.
    pub residuals: Vec<Residual>,
    /// Root mean square of the residuals (length, pixels) of what was used.
    pub rms_px: f64,
    /// The same with the corners that were left out.
    pub rms_of_all_px: f64,
    /// The share of the picture that the corners cover.
    pub coverage: f64,
    /// Every free number, with its standard deviation.
    pub numbers: Vec<Known>,
}

impl CameraOutcome {
    /// The share of corners that were left out.
    pub fn wrong_share(&self) -> f64 {
        let wrong = self.residuals.iter().filter(|residual| residual.is_wrong).count();
        wrong as f64 / self.residuals.len().max(1) as f64
    }
}

/// A pair of cameras that saw the board together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Together {
    /// The cameras.
    pub cameras: [usize; 2],
    /// Frames in which both saw it.
    pub n: usize,
    /// Those that agree about how the cameras stand to one another.
    pub n_agree: usize,
}

/// How all cameras together do not fit as each alone does: pictures of one frame were not taken at the same time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutOfStep {
    /// Residuals of each camera alone, pixels.
    pub alone_px: f64,
    /// Residuals of all cameras together, with free lenses, pixels.
    pub together_px: f64,
    /// The largest change of a focal length from one to the other, as a share of it.
    pub bent: f64,
}

/// A calibration.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The cameras.
    pub cameras: Vec<CameraOutcome>,
    /// Pairs that saw the board together.
    pub pairs: Vec<Together>,
    /// The board in the world, by frame.
    pub boards: Vec<(usize, Isometry3<f64>)>,
    /// Standard deviation of a corner along each axis, pixels.
    pub sigma_px: f64,
    /// Where pictures of one frame were not taken at the same time.
    pub out_of_step: Option<OutOfStep>,
    /// Reasons not to trust it.
    pub doubts: Vec<Doubt>,
}

/// Why there is no calibration.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BoardError {
    /// A camera did not see the board often enough.
    #[error(
        "camera {camera:?} saw the board in {n} pictures, at least {least} with {corners} corners are needed",
        corners = LEAST_CORNERS
    )]
    TooFewBoards {
        /// Its name.
        camera: String,
        /// Pictures with the board.
        n: usize,
        /// How many are needed.
        least: usize,
    },
    /// No start was found for a camera.
    #[error(
        "camera {camera:?}: no focal length makes a board of what it saw: is the board the right one?"
    )]
    NoStart {
        /// Its name.
        camera: String,
    },
    /// Cameras that are not connected by boards seen together.
    #[error(
        "no board connects these groups of cameras: {}; show it to a camera of each at the same time",
        .groups.iter().map(|group| group.join(", ")).collect::<Vec<_>>().join(" | ")
    )]
    Apart {
        /// The groups, by name.
        groups: Vec<Vec<String>>,
    },
    /// Numbers that are not finite came out.
    #[error("the adjustment of all cameras did not end at finite numbers")]
    NotFinite,
}
