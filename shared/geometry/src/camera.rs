//! One calibrated camera: from a point in the world to a pixel, and from a pixel to a ray.

use nalgebra::{
    Isometry3, Matrix2, Matrix2x3, Matrix3, Matrix3x4, Point2, Point3, UnitVector3, Vector2,
    Vector3,
};

use crate::Lens;

/// Points nearer to the plane of the camera than this (metres, along its axis) have no image.
const NEAREST: f64 = 1e-9;

/// The intrinsic parameters of a camera: focal lengths, principal point, image size and lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intrinsics {
    /// Focal length along the rows, in pixels.
    pub fx: f64,
    /// Focal length along the columns, in pixels.
    pub fy: f64,
    /// Column of the principal point, in pixels.
    pub cx: f64,
    /// Row of the principal point, in pixels.
    pub cy: f64,
    /// Width and height of the calibrated image, in pixels.
    pub size: [u32; 2],
    /// Lens distortion.
    pub lens: Lens,
}

impl Intrinsics {
    /// The calibration matrix K, which maps normalised coordinates to pixels.
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::new(self.fx, 0.0, self.cx, 0.0, self.fy, self.cy, 0.0, 0.0, 1.0)
    }

    /// The pixel of a normalised point.
    pub fn pixel(&self, normalised: &Point2<f64>) -> Point2<f64> {
        Point2::new(
            self.fx * normalised.x + self.cx,
            self.fy * normalised.y + self.cy,
        )
    }

    /// The normalised point of a pixel: inverse of [`pixel`](Self::pixel).
    pub fn normalised(&self, pixel: &Point2<f64>) -> Point2<f64> {
        Point2::new((pixel.x - self.cx) / self.fx, (pixel.y - self.cy) / self.fy)
    }
}

/// A half-line in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it begins: the centre of a camera, in metres.
    pub origin: Point3<f64>,
    /// Its direction.
    pub direction: UnitVector3<f64>,
}

/// A calibrated camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Name of the view, unique in a rig.
    pub name: String,
    /// Focal lengths, principal point, image size and lens.
    pub intrinsics: Intrinsics,
    /// Takes a point of the world (metres) to the camera's frame: x right, y down, z forward.
    pub camera_from_world: Isometry3<f64>,
}

impl Camera {
    /// The pixel in which a point of the world is seen, distortion included.
    ///
    /// `None` behind the camera and outside the valid range of the lens; the pixel may lie outside the image.
    pub fn project(&self, in_world: &Point3<f64>) -> Option<Point2<f64>> {
        let in_camera = self.camera_from_world * in_world;
        let normalised = normalise(&in_camera)?;
        let distorted = self.intrinsics.lens.distort(&normalised)?;
        finite(self.intrinsics.pixel(&distorted))
    }

    /// [`project`](Self::project) with the derivative of the pixel by the point of the world.
    pub fn project_with_jacobian(
        &self,
        in_world: &Point3<f64>,
    ) -> Option<(Point2<f64>, Matrix2x3<f64>)> {
        let in_camera = self.camera_from_world * in_world;
        let normalised = normalise(&in_camera)?;
        let (distorted, by_normalised) = self.intrinsics.lens.distort_with_jacobian(&normalised)?;
        let depth = in_camera.z;
        let by_camera = Matrix2x3::new(
            1.0 / depth,
            0.0,
            -normalised.x / depth,
            0.0,
            1.0 / depth,
            -normalised.y / depth,
        );
        let focal = Matrix2::from_diagonal(&Vector2::new(self.intrinsics.fx, self.intrinsics.fy));
        let rotation = self.camera_from_world.rotation.to_rotation_matrix();
        let jacobian = focal * by_normalised * by_camera * rotation.matrix();
        Some((finite(self.intrinsics.pixel(&distorted))?, jacobian))
    }

    /// The direction of a pixel as the undistorted normalised point (x / z, y / z).
    ///
    /// `None` where the lens model cannot be inverted.
    pub fn undistort(&self, pixel: &Point2<f64>) -> Option<Point2<f64>> {
        self.intrinsics.lens.undistort(&self.intrinsics.normalised(pixel))
    }

    /// The ideal pixel of a pixel: where the same ray falls without distortion.
    ///
    /// `None` where the lens model cannot be inverted.
    pub fn undistorted_px(&self, pixel: &Point2<f64>) -> Option<Point2<f64>> {
        self.undistort(pixel).map(|normalised| self.intrinsics.pixel(&normalised))
    }

    /// The pixel of an ideal pixel: inverse of [`undistorted_px`](Self::undistorted_px).
    ///
    /// `None` outside the valid range of the lens.
    pub fn distort_px(&self, ideal: &Point2<f64>) -> Option<Point2<f64>> {
        let normalised = self.intrinsics.normalised(ideal);
        self.intrinsics
            .lens
            .distort(&normalised)
            .map(|distorted| self.intrinsics.pixel(&distorted))
    }

    /// Where the camera stands, in metres.
    pub fn centre_in_world(&self) -> Point3<f64> {
        let inverse = self.camera_from_world.rotation.inverse();
        Point3::from(inverse * -self.camera_from_world.translation.vector)
    }

    /// The direction in which the camera looks, in the world.
    pub fn axis_in_world(&self) -> UnitVector3<f64> {
        self.camera_from_world.rotation.inverse() * Vector3::z_axis()
    }

    /// The ray of the world that falls on a pixel.
    ///
    /// `None` where the lens model cannot be inverted.
    pub fn ray(&self, pixel: &Point2<f64>) -> Option<Ray> {
        let normalised = self.undistort(pixel)?;
        let in_camera = UnitVector3::new_normalize(normalised.coords.push(1.0));
        let direction = self.camera_from_world.rotation.inverse() * in_camera;
        Some(Ray {
            origin: self.centre_in_world(),
            direction,
        })
    }

    /// The 3x4 projection K \[R | t\] onto ideal pixels.
    pub fn image_from_world(&self) -> Matrix3x4<f64> {
        let transform = self.camera_from_world.to_matrix();
        self.intrinsics.matrix() * transform.fixed_rows::<3>(0)
    }
}

fn normalise(in_camera: &Point3<f64>) -> Option<Point2<f64>> {
    (in_camera.z > NEAREST)
        .then(|| Point2::new(in_camera.x / in_camera.z, in_camera.y / in_camera.z))
}

fn finite(pixel: Point2<f64>) -> Option<Point2<f64>> {
    pixel.coords.iter().all(|c| c.is_finite()).then_some(pixel)
}

#[cfg(test)]
mod tests;
