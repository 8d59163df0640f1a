//! Result of a calibration from people.

use geometry::Camera;
use nalgebra::{Point3, UnitVector3};

use super::doubt::Doubt;
use super::frame::Vertical;

/// Result for one camera.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraReport {
    /// Number of joints that were used.
    pub joints: usize,
    /// Median residual, in pixels.
    pub residual_px: f64,
    /// Fraction of joints within three times their expected error.
    pub inliers: f64,
    /// Number of joints in each of 8 x 8 cells of the picture, row by row.
    pub cells: Vec<usize>,
    /// Standard deviation of the pose in degrees and metres, from the residuals, after alignment of the whole rig.
    pub sd: [f64; 2],
    /// Standard deviation of the focal length in pixels, if it was estimated.
    pub focal_sd_px: Option<f64>,
    /// Difference between the camera's poses from the two halves of the recording, in degrees and metres.
    pub halves: Option<[f64; 2]>,
    /// Offset to add to the camera's times to get common times, and its standard deviation, in seconds.
    pub offset_s: [f64; 2],
}

/// Result of a calibration from people.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The cameras with their new poses; unchanged if there is no result.
    pub cameras: Vec<Camera>,
    /// Up direction, opposite to gravity.
    pub up: Option<UnitVector3<f64>>,
    /// Source of the up direction.
    pub vertical: Vertical,
    /// Relative standard deviation of the scale, if the bones determine it.
    pub scale_sd: f64,
    /// Standing height of the person from the lengths of the bones, in metres.
    pub stature_m: Option<f64>,
    /// Results for the cameras; empty if there is no result.
    pub reports: Vec<CameraReport>,
    /// Every reason not to use the result.
    pub doubts: Vec<Doubt>,
    /// Warnings about cameras that are less certain than they should be.
    pub cautions: Vec<Doubt>,
    /// True if time offsets were estimated because the joints contradict the given ones; otherwise the offsets are unchanged.
    pub clocks_are_found: bool,
    /// Number of instants that were used.
    pub n_instants: usize,
    /// First and last instant, in seconds on the common clock.
    pub span_s: [f64; 2],
    /// Number of pictures in which left and right were swapped.
    pub n_exchanged: usize,
    /// Instants that were used, in seconds on the common clock.
    pub times_s: Vec<f64>,
    /// Skeletons found during the calibration, by instant and joint, in metres.
    pub skeletons: Vec<Vec<Option<Point3<f64>>>>,
}
