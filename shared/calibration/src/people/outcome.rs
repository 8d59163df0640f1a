//! Result of a calibration from people.

use geometry::Camera;
use nalgebra::{Point3, UnitVector3};

use super::doubt::Doubt;
use super::frame::Vertical;

/// Result for a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraReport {
    /// Joints that took part.
    pub joints: usize,
    /// Median residual, pixels.
    pub residual_px: f64,
    /// Share of joints within three times their expected error.
    pub inliers: f64,
    /// Joints in each of 8 x 8 cells of the picture, row by row.
    pub cells: Vec<usize>,
    /// How far it may be from where it is, by the residuals, the rigs being laid upon one another: degrees, metres.
    pub sd: [f64; 2],
    /// Standard deviation of the focal length, pixels, where it was estimated.
    pub focal_sd_px: Option<f64>,
    /// Difference between halves of the recording: degrees, metres.
    pub halves: Option<[f64; 2]>,
    /// Offset added to its times to have common ones, seconds, and the standard deviation.
    pub offset_s: [f64; 2],
}

/// Result of a calibration from people.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The cameras with their new poses; as given where there is no answer at all.
    pub cameras: Vec<Camera>,
    /// Against gravity.
    pub up: Option<UnitVector3<f64>>,
    /// Where that comes from.
    pub vertical: Vertical,
    /// Standard deviation of the scale as a share, as far as the bones determine it.
    pub scale_sd: f64,
    /// The standing height of the person by the lengths of the bones, metres.
    pub stature_m: Option<f64>,
    /// One for each camera; none where there is no answer.
    pub reports: Vec<CameraReport>,
    /// Every reason not to use it.
    pub doubts: Vec<Doubt>,
    /// Warnings about cameras that are known less well than is good.
    pub cautions: Vec<Doubt>,
    /// True if time offsets were found, the joints contradicting those that were given; else they are as given.
    pub clocks_are_found: bool,
    /// Instants that were looked at.
    pub n_instants: usize,
    /// Their first and last, seconds on the common clock.
    pub span_s: [f64; 2],
    /// Views whose left and right were exchanged.
    pub n_exchanged: usize,
    /// The instants that were looked at, seconds on the common clock.
    pub times_s: Vec<f64>,
    /// The skeletons that were found on the way, metres: by instant and joint.
    pub skeletons: Vec<Vec<Option<Point3<f64>>>>,
}
