//! A calibrated camera, which maps points of the world to pixels, and pixels to rays.

use nalgebra::{
    Isometry3, Matrix2, Matrix2x3, Matrix3, Matrix3x4, Point2, Point3, UnitVector3, Vector2,
    Vector3,
};

use crate::Lens;

/// Minimum distance of a point from the camera plane, in metres along the axis. Points that are nearer have no image.
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
    /// Returns the calibration matrix K, which maps normalised coordinates to pixels.
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::new(self.fx, 0.0, self.cx, 0.0, self.fy, self.cy, 0.0, 0.0, 1.0)
    }

    /// Returns the pixel of a normalised point.
    pub fn pixel(&self, normalised: &Point2<f64>) -> Point2<f64> {
        Point2::new(
            self.fx * normalised.x + self.cx,
            self.fy * normalised.y + self.cy,
        )
    }

    /// Returns the normalised point of a pixel; the inverse of [`pixel`](Self::pixel).
    pub fn normalised(&self, pixel: &Point2<f64>) -> Point2<f64> {
        Point2::new((pixel.x - self.cx) / self.fx, (pixel.y - self.cy) / self.fy)
    }
}

/// A half-line in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Start of the ray: the centre of a camera, in metres.
    pub origin: Point3<f64>,
    /// Direction of the ray.
    pub direction: UnitVector3<f64>,
}

/// A calibrated camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Name of the camera, unique in a rig.
    pub name: String,
    /// Focal lengths, principal point, image size and lens.
    pub intrinsics: Intrinsics,
    /// Transformation from the world (metres) to the camera's coordinates: x right, y down, z forward.
    pub camera_from_world: Isometry3<f64>,
}

impl Camera {
    /// Returns the pixel at which a point of the world is seen, including distortion.
    ///
    /// Returns `None` for points behind the camera or outside the valid range of the lens. The pixel may be outside the image.
    pub fn project(&self, in_world: &Point3<f64>) -> Option<Point2<f64>> {
        let in_camera = self.camera_from_world * in_world;
        let normalised = normalise(&in_camera)?;
        let distorted = self.intrinsics.lens.distort(&normalised)?;
        finite(self.intrinsics.pixel(&distorted))
    }

    /// Works like [`project`](Self::project), and also returns the derivative of the pixel with respect to the point.
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

    /// Returns the direction of a pixel as the undistorted normalised point (x / z, y / z).
    ///
    /// Returns `None` if the lens model cannot be inverted.
    pub fn undistort(&self, pixel: &Point2<f64>) -> Option<Point2<f64>> {
        self.intrinsics.lens.undistort(&self.intrinsics.normalised(pixel))
    }

    /// Returns the ideal pixel that corresponds to a pixel: the position at which the same ray is seen without distortion.
    ///
    /// Returns `None` if the lens model cannot be inverted.
    pub fn undistorted_px(&self, pixel: &Point2<f64>) -> Option<Point2<f64>> {
        self.undistort(pixel).map(|normalised| self.intrinsics.pixel(&normalised))
    }

    /// Returns the recorded pixel that corresponds to an ideal pixel; the inverse of [`undistorted_px`](Self::undistorted_px).
    ///
    /// Returns `None` outside the valid range of the lens.
    pub fn distort_px(&self, ideal: &Point2<f64>) -> Option<Point2<f64>> {
        let normalised = self.intrinsics.normalised(ideal);
        self.intrinsics
            .lens
            .distort(&normalised)
            .map(|distorted| self.intrinsics.pixel(&distorted))
    }

    /// Returns the position of the camera, in metres.
    pub fn centre_in_world(&self) -> Point3<f64> {
        let inverse = self.camera_from_world.rotation.inverse();
        Point3::from(inverse * -self.camera_from_world.translation.vector)
    }

    /// Returns the direction in which the camera looks, in the world.
    pub fn axis_in_world(&self) -> UnitVector3<f64> {
        self.camera_from_world.rotation.inverse() * Vector3::z_axis()
    }

    /// Returns the ray in the world that is seen at a pixel.
    ///
    /// Returns `None` if the lens model cannot be inverted.
    pub fn ray(&self, pixel: &Point2<f64>) -> Option<Ray> {
        let normalised = self.undistort(pixel)?;
        let in_camera = UnitVector3::new_normalize(normalised.coords.push(1.0));
        let direction = self.camera_from_world.rotation.inverse() * in_camera;
        Some(Ray {
            origin: self.centre_in_world(),
            direction,
        })
    }

    /// Returns the 3x4 projection K \[R | t\] to ideal pixels.
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
