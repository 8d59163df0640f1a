//! Observations of one point, undistorted once, and sets of observations.

use nalgebra::{Point2, Point3, Vector2};

use super::{MAX_VIEWS, Observation, TriangulateError};

/// A set of observations, given by their indices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Subset(u32);

impl Subset {
    pub(super) fn bits(self) -> u32 {
        self.0
    }

    pub(super) fn count(self) -> usize {
        self.0.count_ones() as usize
    }

    pub(super) fn without(self, view: usize) -> Self {
        Self(self.0 & !(1 << view))
    }

    /// Returns the indices in ascending order.
    pub(super) fn iter(self) -> impl Iterator<Item = usize> {
        (0..MAX_VIEWS).filter(move |view| self.0 & (1 << view) != 0)
    }
}

/// The observations with their directions.
pub(super) struct Views<'a> {
    observations: &'a [Observation<'a>],
    normalised: [Option<Point2<f64>>; MAX_VIEWS],
}

impl<'a> Views<'a> {
    pub(super) fn new(observations: &'a [Observation<'a>]) -> Result<Self, TriangulateError> {
        if observations.len() > MAX_VIEWS {
            return Err(TriangulateError::TooManyViews {
                views: observations.len(),
            });
        }
        let mut normalised = [None; MAX_VIEWS];
        for (view, (seen, slot)) in observations.iter().zip(&mut normalised).enumerate() {
            let Observation {
                camera,
                point_px: Point2 { coords },
                sigma_px,
            } = *seen;
            let finite = coords.iter().all(|c| c.is_finite()) && sigma_px.is_finite();
            if !finite || sigma_px <= 0.0 {
                let (x, y) = (coords.x, coords.y);
                return Err(TriangulateError::BadObservation {
                    view,
                    x,
                    y,
                    sigma_px,
                });
            }
            *slot = camera.undistort(&seen.point_px);
        }
        Ok(Self {
            observations,
            normalised,
        })
    }

    /// Returns the observations whose pixels are in the valid range of the lens.
    pub(super) fn usable(&self) -> Subset {
        let bits = self.normalised.iter().enumerate();
        Subset(bits.fold(0, |bits, (view, n)| bits | (u32::from(n.is_some()) << view)))
    }

    /// Returns the observations of a subset with their undistorted normalised points.
    pub(super) fn iter(
        &self,
        used: Subset,
    ) -> impl Iterator<Item = (usize, &'a Observation<'a>, Point2<f64>)> + '_ {
        used.iter().filter_map(|view| {
            let observation = self.observations.get(view)?;
            Some((view, observation, self.normalised[view]?))
        })
    }

    /// Returns the distances between image and observation; NaN if there is no image.
    pub(super) fn residuals(&self, in_world: &Point3<f64>) -> [f64; MAX_VIEWS] {
        let mut residuals = [f64::NAN; MAX_VIEWS];
        for (seen, slot) in self.observations.iter().zip(&mut residuals) {
            let error = seen.camera.project(in_world).map(|image| image - seen.point_px);
            *slot = error.as_ref().map_or(f64::NAN, Vector2::norm);
        }
        residuals
    }
}
