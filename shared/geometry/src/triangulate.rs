//! A point in space from its images in several calibrated views.

use nalgebra::{Matrix3, Point2, Point3};

use crate::Camera;

mod views;

mod linear;

mod refine;

mod subset;

use views::Views;

/// Maximum number of observations of one point: the number of bits of `views_used`.
pub const MAX_VIEWS: usize = 32;

/// The observation of a point by a camera.
#[derive(Debug, Clone, Copy)]
pub struct Observation<'a> {
    /// Camera that observed the point.
    pub camera: &'a Camera,
    /// Position of the point, in pixels of the recorded (distorted) image.
    pub point_px: Point2<f64>,
    /// Standard deviation of the position along each axis, in pixels.
    pub sigma_px: f64,
}

/// How observations are weighted and rejected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Width of the Cauchy loss for the reprojection error, in pixels; infinite for plain least squares.
    pub loss_px: f64,
    /// Largest distance in pixels between an observation and the point's image; observations beyond it are left out.
    pub max_reprojection_px: Option<f64>,
    /// Minimum number of observations of a point; never less than 2.
    pub min_views: usize,
    /// Minimum value of the widest angle between two viewing rays, in radians.
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

/// Reason why no point was computed. Views are indices of the list of observations, from 0.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum TriangulateError {
    /// There are too few observations.
    #[error("triangulation needs at least {needed} views, but there are {views}")]
    TooFewViews {
        /// Number of usable observations.
        views: usize,
        /// Required number of observations.
        needed: usize,
    },
    /// There are more observations than [`MAX_VIEWS`].
    #[error("at most {MAX_VIEWS} views, got {views}")]
    TooManyViews {
        /// Number of observations.
        views: usize,
    },
    /// A position or a standard deviation is not finite, or a standard deviation is not positive.
    #[error(
        "view {view}: the position ({x}, {y}) px with standard deviation {sigma_px} px cannot be used"
    )]
    BadObservation {
        /// Index of the observation.
        view: usize,
        /// Column of the position, in pixels.
        x: f64,
        /// Row of the position, in pixels.
        y: f64,
        /// Standard deviation, in pixels.
        sigma_px: f64,
    },
    /// The viewing rays are parallel to working precision, so the depth is unknown.
    #[error(
        "the viewing rays are parallel: the widest angle between two rays is {angle:e} rad, but at least {limit:e} rad is needed"
    )]
    ParallelRays {
        /// Widest angle between two rays, in radians.
        angle: f64,
        /// Smallest accepted angle, in radians.
        limit: f64,
    },
    /// The rays meet behind a camera.
    #[error("the point is behind the camera of view {view}")]
    BehindCamera {
        /// Index of the observation.
        view: usize,
    },
    /// There is no sufficiently large subset of views that agree.
    #[error(
        "no {needed} views agree: the smallest reprojection error is {residual_px} px, but the limit is {limit_px} px"
    )]
    Inconsistent {
        /// Required number of observations.
        needed: usize,
        /// Largest residual of the best subset, in pixels.
        residual_px: f64,
        /// Largest accepted residual, in pixels.
        limit_px: f64,
    },
    /// The point is at a position for which the lens of a view has no image.
    #[error("the point is outside the valid range of the lens of view {view}")]
    OutsideLens {
        /// Index of the observation.
        view: usize,
    },
    /// The refinement reached values that are not finite.
    #[error("the refinement diverged after {iterations} iterations")]
    Diverged {
        /// Number of iterations.
        iterations: usize,
    },
}

/// A point in the world, and the agreement of the views about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangulated {
    /// Position of the point, in metres.
    pub in_world: Point3<f64>,
    /// Covariance of the point, in square metres.
    pub covariance: Matrix3<f64>,
    /// Root mean square of the reprojection errors of the views used, in pixels.
    pub reprojection_px: f64,
    /// Bit mask of the observations used: bit i is set if observation i was used.
    pub views_used: u32,
    /// Reprojection error of each observation, used or not, in pixels. It is NaN for a view in which the point has no image, and for
    /// indices beyond the last observation.
    pub residuals_px: [f64; MAX_VIEWS],
}

impl Triangulated {
    /// Returns true if the observation with the given index was used.
    pub fn uses(&self, view: usize) -> bool {
        view < MAX_VIEWS && self.views_used & (1 << view) != 0
    }
}

/// Triangulates one point: linearly on undistorted rays, then by minimising the reprojection error.
///
/// The refinement (Levenberg & Marquardt) minimises `Σ ρ(‖e‖²) / σ²` over the distorted pixel errors `e` with the Cauchy loss `ρ(s) = c²
/// ln(1 + s / c²)`, c = `loss_px`. The width of the loss shrinks from the worst initial error down to c, so that a single outlier does not
/// determine the minimum. If the error of a view exceeds `max_reprojection_px`, every view is left out in turn, and the subset with the
/// smallest worst error is kept. This is repeated while more than `min_views` views are left.
///
/// The covariance is the inverse of the normal matrix `Σ ρ' Jᵀ J / σ²`; it is as accurate as the given `sigma_px`. The result depends
/// only on the arguments and their order. The function does not allocate. An observation beyond the valid range of its camera's lens is not
/// used.
///
/// # Errors
///
/// See [`TriangulateError`]. A point is never behind a view that it uses.
///
/// # Examples
///
/// ```
/// # use geometry::{Camera, Intrinsics, Lens, LensModel, Observation, Settings, triangulate};
/// # use nalgebra::{Isometry3, Point3};
/// let k = [-0.29, 0.1, 0.0, 0.0, 0.0, 0.0];
/// let lens = Lens::new(LensModel::BrownConrady { k, p: [0.0; 2] });
/// let inside = Intrinsics { fx: 700.0, fy: 700.0, cx: 319.5, cy: 239.5, size: [640, 480], lens };
/// let camera = |name: &str, x: f64| Camera {
///     name: name.to_owned(),
///     intrinsics: inside,
///     camera_from_world: Isometry3::translation(-x, 0.0, 0.0), // x metres to the right
/// };
/// let cameras = [camera("left", -0.5), camera("right", 0.5)];
/// let point = Point3::new(0.3, -0.2, 4.0);
/// let seen: Vec<_> = cameras
///     .iter()
///     .filter_map(|camera| {
///         Some(Observation { camera, point_px: camera.project(&point)?, sigma_px: 1.0 })
///     })
///     .collect();
/// let got = triangulate(&seen, &Settings::default())?;
/// assert!((got.in_world - point).norm() < 1e-9);
/// assert_eq!(got.views_used, 0b11);
/// # Ok::<_, geometry::TriangulateError>(())
/// ```
pub fn triangulate(
    observations: &[Observation<'_>],
    settings: &Settings,
) -> Result<Triangulated, TriangulateError> {
    let views = Views::new(observations)?;
    let needed = settings.min_views.max(2);
    let all = views.usable();
    if all.count() < needed {
        return Err(TriangulateError::TooFewViews {
            views: all.count(),
            needed,
        });
    }
    let (used, fit) = subset::search(&views, all, settings)?;
    let covariance = fit.normal.cholesky().map(|factor| factor.inverse());
    let covariance = covariance.filter(|c| c.iter().all(|entry| entry.is_finite()));
    let Some(covariance) = covariance else {
        return Err(TriangulateError::Diverged {
            iterations: fit.iterations,
        });
    };
    Ok(Triangulated {
        in_world: fit.in_world,
        covariance,
        reprojection_px: fit.rms_px,
        views_used: used.bits(),
        residuals_px: views.residuals(&fit.in_world),
    })
}

#[cfg(test)]
mod tests;
