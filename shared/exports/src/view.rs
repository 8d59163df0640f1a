//! Points as a camera sees them.

use geometry::Camera;
use nalgebra::Matrix2;

use crate::Point;

/// A camera, and the map to its pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewCamera {
    /// Name of the view.
    pub name: String,
    /// Camera of the calibration, or camera of turned and scaled frames.
    pub camera: Camera,
    /// Map from pixels of that camera to pixels of the pictures: the two rows of an affine map.
    pub picture_from_camera: [[f64; 3]; 2],
    /// Width and height of the pictures, in pixels.
    pub size: [u32; 2],
}

/// A point in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Position, in pixels; the centre of the top-left pixel is (0, 0).
    pub at: [f64; 2],
    /// Covariance of the position: xx, xy, yy, in square pixels; `None` if it is not known.
    pub covariance: Option<[f64; 3]>,
}

impl Seen {
    /// Returns the expected root mean square error of the position, in pixels.
    pub fn deviation_px(&self) -> Option<f64> {
        let [xx, _, yy] = self.covariance?;
        (xx + yy >= 0.0).then(|| (xx + yy).sqrt())
    }
}

impl ViewCamera {
    /// Returns the position of a point in the pictures of the camera; `None` behind the camera. The position may be outside the picture.
    pub fn see(&self, point: &Point) -> Option<Seen> {
        let (pixel, jacobian) = self.camera.project_with_jacobian(&point.in_world)?;
        let [[a, b, c], [d, e, f]] = self.picture_from_camera;
        let at = [a * pixel.x + b * pixel.y + c, d * pixel.x + e * pixel.y + f];
        let jacobian = Matrix2::new(a, b, d, e) * jacobian;
        let covariance = point.covariance().map(|covariance| {
            let covariance = jacobian * covariance * jacobian.transpose();
            [covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]]
        });
        at.iter().all(|value| value.is_finite()).then_some(Seen { at, covariance })
    }

    /// Returns true if a pixel is inside the picture.
    pub fn holds(&self, [x, y]: [f64; 2]) -> bool {
        let [width, height] = self.size.map(f64::from);
        (-0.5..width - 0.5).contains(&x) && (-0.5..height - 0.5).contains(&y)
    }
}
