//! A point in space from its images in several calibrated views.

use nalgebra::{Matrix3, Point2, Point3};

use crate::Camera;

/// The most observations of one point: as many as `views_used` has bits.
pub const MAX_VIEWS: usize = 32;

/// A point seen by a camera.
#[derive(Debug, Clone, Copy)]
pub struct Observation<'a> {
    /// The camera that saw it.
    pub camera: &'a Camera,
    /// Where, in pixels of the recorded (distorted) image.
    pub point_px: Point2<f64>,
    /// Standard deviation of that position along each axis, in pixels.
    pub sigma_px: f64,
}

/// How observations are weighed and refused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Reprojection error, in pixels, beyond which an observation pulls less and less (Cauchy).
    /// Infinite for plain least squares.
    pub loss_px: f64,
    /// Observations that end further than this, in pixels, from the point's image are left out.
    pub max_reprojection_px: Option<f64>,
    /// The fewest observations that make a point; never less than 2.
    pub min_views: usize,
    /// The widest angle between two viewing rays must be at least this, in radians.
    pub min_angle: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            loss_px: 10.0,
            max_reprojection_px: None,
            min_views: 2,
            min_angle: 1e-3,
        }
    }
}

/// Why no point could be computed. Views are positions in the list of observations, from 0.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum TriangulateError {
    /// Too few observations.
    #[error("triangulation needs at least {needed} views, got {views}")]
    TooFewViews {
        /// Observations that could be used.
        views: usize,
        /// Observations asked for.
        needed: usize,
    },
    /// More observations than there are bits for.
    #[error("at most {MAX_VIEWS} views, got {views}")]
    TooManyViews {
        /// Observations given.
        views: usize,
    },
    /// A position or a deviation that is no number, or a deviation that is not positive.
    #[error("view {view}: position ({x}, {y}) px with deviation {sigma_px} px is not usable")]
    BadObservation {
        /// Which observation.
        view: usize,
        /// Column in pixels.
        x: f64,
        /// Row in pixels.
        y: f64,
        /// Standard deviation in pixels.
        sigma_px: f64,
    },
    /// The viewing rays are parallel to working precision, so depth is unknown.
    #[error("viewing rays are parallel: widest angle {angle:e} rad is below {limit:e}")]
    ParallelRays {
        /// The widest angle between two rays, radians.
        angle: f64,
        /// The smallest angle accepted.
        limit: f64,
    },
    /// The rays meet behind a camera.
    #[error("the point is behind the camera of view {view}")]
    BehindCamera {
        /// Which observation.
        view: usize,
    },
    /// No subset of enough views agrees.
    #[error(
        "no {needed} views agree: best reprojection error {residual_px} px exceeds {limit_px} px"
    )]
    Inconsistent {
        /// Observations asked for.
        needed: usize,
        /// Largest residual of the best subset, pixels.
        residual_px: f64,
        /// The largest residual accepted.
        limit_px: f64,
    },
    /// The refinement left the numbers.
    #[error("refinement diverged after {iterations} iterations")]
    Diverged {
        /// Iterations done.
        iterations: usize,
    },
}

/// A point in the world, and how well the views agree on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangulated {
    /// The point, in metres.
    pub in_world: Point3<f64>,
    /// Covariance of the point, in square metres.
    pub covariance: Matrix3<f64>,
    /// Root mean square of the reprojection errors of the views used, in pixels.
    pub reprojection_px: f64,
    /// Bit i is set if observation i was used.
    pub views_used: u32,
    /// Reprojection error of each observation, in pixels, used or not; NaN where the point has no image or no observation is.
    pub residuals_px: [f64; MAX_VIEWS],
}

/// Triangulates one point.
///
/// # Errors
///
/// See [`TriangulateError`].
pub fn triangulate(
    observations: &[Observation<'_>],
    settings: &Settings,
) -> Result<Triangulated, TriangulateError> {
    Err(TriangulateError::TooFewViews {
        views: observations.len(),
        needed: settings.min_views,
    })
}
