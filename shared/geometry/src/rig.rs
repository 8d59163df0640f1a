//! A set of calibrated cameras in a common world.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, UnitVector3, Vector3};

use crate::{Camera, Intrinsics};

/// Maximum focal length, in image sizes: a hundred times the focal length of the longest telephoto lens.
const FOCAL_LIMIT: f64 = 1e4;
/// Maximum lens coefficient. Calibrations that fit noise have coefficients in the thousands.
const COEFFICIENT_LIMIT: f64 = 1e7;
/// Maximum distance of a camera from the origin; geocentric coordinates are within this distance.
const PLACE_LIMIT_METRES: f64 = 1e7;

/// Reason why a set of cameras does not form a rig.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RigError {
    /// There is no camera.
    #[error("a rig needs at least one camera")]
    NoCameras,
    /// A camera has no name.
    #[error("camera {index} has an empty name")]
    EmptyName {
        /// Index of the camera in the list, from 0.
        index: usize,
    },
    /// A name cannot be used as the name of a folder.
    #[error("camera {index} is named {name:?}; expected {PLAIN_NAME}")]
    Name {
        /// Index of the camera in the list, from 0.
        index: usize,
        /// Name of the camera.
        name: String,
    },
    /// Two cameras have the same name.
    #[error("two cameras are named {name:?}")]
    DuplicateName {
        /// The name that occurs twice.
        name: String,
    },
    /// A number is infinite or NaN.
    #[error("camera {camera:?}: {quantity} is {value}, but must be a finite number")]
    NotFinite {
        /// Name of the camera.
        camera: String,
        /// Name of the quantity.
        quantity: &'static str,
        /// Value of the quantity.
        value: f64,
    },
    /// The image has no pixels.
    #[error("camera {camera:?}: the image size is {width}x{height}, but both sides must be at least 1", width = .size[0], height = .size[1])]
    EmptyImage {
        /// Name of the camera.
        camera: String,
        /// Width and height of the image, in pixels.
        size: [u32; 2],
    },
    /// A focal length is zero or negative.
    #[error("camera {camera:?}: the focal length is {value} px, but must be positive")]
    Focal {
        /// Name of the camera.
        camera: String,
        /// Focal length, in pixels.
        value: f64,
    },
    /// The principal point is further from the image than the image is wide.
    #[error(
        "camera {camera:?}: the principal point {quantity} = {value} px is far outside the image of {extent} px"
    )]
    PrincipalPoint {
        /// Name of the camera.
        camera: String,
        /// Name of the coordinate: `cx` or `cy`.
        quantity: &'static str,
        /// Value of the coordinate, in pixels.
        value: f64,
        /// Width or height of the image.
        extent: u32,
    },
    /// A focal length is so long that all rays of the image are parallel to working precision.
    #[error(
        "camera {camera:?}: the focal length is {value} px, but the limit is {limit:e} times the size of the image, {extent} px"
    )]
    LongFocal {
        /// Name of the camera.
        camera: String,
        /// Focal length, in pixels.
        value: f64,
        /// The larger of the image's width and height.
        extent: u32,
        /// Maximum focal length, as a multiple of the extent.
        limit: f64,
    },
    /// A lens coefficient is larger than in any real lens.
    #[error(
        "camera {camera:?}: a lens coefficient is {value:e}, but the limit is {limit:e}: are the coefficients in the order of the format?"
    )]
    LensCoefficient {
        /// Name of the camera.
        camera: String,
        /// Value of the coefficient.
        value: f64,
        /// Maximum coefficient.
        limit: f64,
    },
    /// A camera is further from the origin than any place on Earth is from the Earth's centre.
    #[error(
        "camera {camera:?} is {metres:e} m from the origin of the world, but the limit is {limit:e} m: is the unit right?"
    )]
    Place {
        /// Name of the camera.
        camera: String,
        /// Distance from the origin.
        metres: f64,
        /// Maximum distance.
        limit: f64,
    },
    /// The rotation matrix is not a rotation.
    #[error("camera {camera:?}: rotation")]
    Rotation {
        /// Name of the camera.
        camera: String,
        /// Deviation from a rotation.
        source: NotARotation,
    },
}

/// Error for a matrix that is not a rotation.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the matrix is not a rotation: the largest entry of R Rᵀ - I is {deviation:e} (limit {limit:e}), and the determinant is {determinant}"
)]
pub struct NotARotation {
    /// Largest absolute entry of R Rᵀ - I.
    pub deviation: f64,
    /// Largest accepted deviation.
    pub limit: f64,
    /// Determinant of the matrix; -1 for a mirrored coordinate system.
    pub determinant: f64,
}

/// Returns the rotation nearest to a matrix that was written with few digits.
///
/// # Errors
///
/// Fails with [`NotARotation`] if an entry of R Rᵀ - I exceeds 1e-3, or if the matrix is a reflection.
pub fn rotation_from_matrix(matrix: &Matrix3<f64>) -> Result<UnitQuaternion<f64>, NotARotation> {
    const LIMIT: f64 = 1e-3;
    let deviation = (matrix * matrix.transpose() - Matrix3::identity()).abs().max();
    let determinant = matrix.determinant();
    // `Matrix::max` ignores NaN, so the entries are checked as well.
    let finite = matrix.iter().all(|entry| entry.is_finite());
    if !finite || deviation > LIMIT || determinant <= 0.0 {
        return Err(NotARotation {
            deviation,
            limit: LIMIT,
            determinant,
        });
    }
    let mut nearest = *matrix;
    // Newton's iteration for the polar decomposition, which squares the deviation at every step.
    for _ in 0..4 {
        let Some(inverse) = nearest.try_inverse() else {
            break;
        };
        nearest = (nearest + inverse.transpose()) * 0.5;
    }
    Ok(UnitQuaternion::from_rotation_matrix(
        &Rotation3::from_matrix_unchecked(nearest),
    ))
}

/// A camera for which a calibration file has no pose.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LeftOut {
    /// Name of the camera.
    pub camera: String,
    /// Reason why the pose is not known, as text for the user.
    pub why: &'static str,
}

/// Calibrated cameras in a common world, validated on construction.
#[derive(Debug, Clone, PartialEq)]
pub struct Rig {
    cameras: Vec<Camera>,
    up_in_world: Option<UnitVector3<f64>>,
    source: String,
    left_out: Vec<LeftOut>,
}

impl Rig {
    /// Creates a rig.
    ///
    /// * `up_in_world`: up direction (opposite to gravity), if known.
    /// * `source`: origin of the calibration, as free text.
    ///
    /// # Errors
    ///
    /// Returns a [`RigError`] for the first invalid camera.
    pub fn new(
        cameras: Vec<Camera>,
        up_in_world: Option<UnitVector3<f64>>,
        source: impl Into<String>,
    ) -> Result<Self, RigError> {
        if cameras.is_empty() {
            return Err(RigError::NoCameras);
        }
        for (index, camera) in cameras.iter().enumerate() {
            if camera.name.is_empty() {
                return Err(RigError::EmptyName { index });
            }
            if !is_plain_name(&camera.name) {
                let name = camera.name.clone();
                return Err(RigError::Name { index, name });
            }
            if cameras[..index].iter().any(|other| other.name == camera.name) {
                return Err(RigError::DuplicateName {
                    name: camera.name.clone(),
                });
            }
            check_camera(camera)?;
        }
        Ok(Self {
            cameras,
            up_in_world,
            source: source.into(),
            left_out: Vec::new(),
        })
    }

    /// Returns the same rig, with a list of the cameras for which its file has no pose.
    #[must_use]
    pub fn with_left_out(self, left_out: Vec<LeftOut>) -> Self {
        Self { left_out, ..self }
    }

    /// Returns the same rig with a different up direction.
    #[must_use]
    pub fn with_up(self, up_in_world: Option<UnitVector3<f64>>) -> Self {
        Self {
            up_in_world,
            ..self
        }
    }

    /// Returns the cameras for which the rig's file has no pose. If the rig was read with
    /// [`ReadOptions::lenses_suffice`](crate::files::ReadOptions::lenses_suffice), these cameras are also among [`cameras`](Self::cameras),
    /// at the origin.
    pub fn left_out(&self) -> &[LeftOut] {
        &self.left_out
    }

    /// Returns the text of an error about a missing camera, with a list of the cameras of the rig: `no camera "c"; it has a, b`.
    pub fn lacks(&self, name: &str) -> String {
        if let Some(LeftOut { why, .. }) =
            self.left_out.iter().find(|left_out| left_out.camera == name)
        {
            return format!("camera {name:?} has no pose: {why}");
        }
        let names: Vec<&str> = self.cameras.iter().map(|camera| &*camera.name).collect();
        format!("no camera {name:?}; it has {}", names.join(", "))
    }

    /// Returns the cameras, in the order of the file.
    pub fn cameras(&self) -> &[Camera] {
        &self.cameras
    }

    /// Returns the camera with a given name.
    pub fn camera(&self, name: &str) -> Option<&Camera> {
        self.cameras.iter().find(|camera| camera.name == name)
    }

    /// Returns the up direction (opposite to gravity), if known.
    pub fn up_in_world(&self) -> Option<UnitVector3<f64>> {
        self.up_in_world
    }

    /// Returns the origin of the calibration.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// Returns the point nearest to all optical axes (least squares), in metres.
    ///
    /// Returns `None` if the axes are parallel, or if there is only one camera.
    pub fn focus(&self) -> Option<Point3<f64>> {
        let origin = self.cameras.first()?.centre_in_world();
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for camera in &self.cameras {
            let axis = camera.axis_in_world().into_inner();
            let across = Matrix3::identity() - axis * axis.transpose();
            normal += across;
            right += across * (camera.centre_in_world() - origin);
        }
        let eigen = normal.symmetric_eigenvalues();
        // The limit corresponds to about half a degree between two axes; below it, they count as parallel.
        if eigen.min() < 1e-4 {
            return None;
        }
        normal.cholesky().map(|factor| origin + factor.solve(&right))
    }
}

fn check_camera(camera: &Camera) -> Result<(), RigError> {
    check_finite(camera)?;
    check_image(camera)?;
    check_size(camera)?;
    let rotation = camera.camera_from_world.rotation.to_rotation_matrix();
    rotation_from_matrix(rotation.matrix()).map_err(|source| {
        let camera = camera.name.clone();
        RigError::Rotation { camera, source }
    })?;
    Ok(())
}

fn check_finite(camera: &Camera) -> Result<(), RigError> {
    let Intrinsics {
        fx,
        fy,
        cx,
        cy,
        lens,
        ..
    } = camera.intrinsics;
    let Isometry3 {
        rotation,
        translation,
    } = camera.camera_from_world;
    let labelled = |label| move |value| (label, value);
    let numbers = [("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy)];
    let mut numbers = numbers
        .into_iter()
        .chain(lens.model().coefficients().map(labelled("a lens coefficient")))
        .chain(rotation.coords.iter().copied().map(labelled("an entry of the rotation")))
        .chain(translation.vector.iter().copied().map(labelled("an entry of the translation")));
    match numbers.find(|(_, value)| !value.is_finite()) {
        Some((quantity, value)) => {
            let camera = camera.name.clone();
            Err(RigError::NotFinite {
                camera,
                quantity,
                value,
            })
        }
        None => Ok(()),
    }
}

/// Returns an error for numbers so large that computations with them would lose too many digits.
fn check_size(camera: &Camera) -> Result<(), RigError> {
    let Intrinsics {
        fx, fy, size, lens, ..
    } = camera.intrinsics;
    let name = || camera.name.clone();
    let extent = size[0].max(size[1]);
    let longest = FOCAL_LIMIT * f64::from(extent);
    if let Some(value) = [fx, fy].into_iter().find(|&focal| focal > longest) {
        return Err(RigError::LongFocal {
            camera: name(),
            value,
            extent,
            limit: FOCAL_LIMIT,
        });
    }
    let mut coefficients = lens.model().coefficients();
    if let Some(value) = coefficients.find(|value| value.abs() > COEFFICIENT_LIMIT) {
        return Err(RigError::LensCoefficient {
            camera: name(),
            value,
            limit: COEFFICIENT_LIMIT,
        });
    }
    // `amax` stays finite even if the square of the norm overflows.
    let translation = camera.camera_from_world.translation.vector;
    let metres = translation.amax().max(translation.norm());
    if metres.is_nan() || metres > PLACE_LIMIT_METRES {
        return Err(RigError::Place {
            camera: name(),
            metres: translation.amax(),
            limit: PLACE_LIMIT_METRES,
        });
    }
    Ok(())
}

fn check_image(camera: &Camera) -> Result<(), RigError> {
    let Intrinsics {
        fx,
        fy,
        cx,
        cy,
        size,
        ..
    } = camera.intrinsics;
    let name = || camera.name.clone();
    if size.contains(&0) {
        return Err(RigError::EmptyImage {
            camera: name(),
            size,
        });
    }
    if let Some(value) = [fx, fy].into_iter().find(|&f| f <= 0.0) {
        return Err(RigError::Focal {
            camera: name(),
            value,
        });
    }
    for (quantity, value, extent) in [("cx", cx, size[0]), ("cy", cy, size[1])] {
        let extent_px = f64::from(extent);
        if value < -extent_px || value > 2.0 * extent_px {
            return Err(RigError::PrincipalPoint {
                camera: name(),
                quantity,
                value,
                extent,
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;

/// Requirement of [`is_plain_name`], as text for error messages.
pub const PLAIN_NAME: &str = "1 to 64 bytes that do not begin with . - or a space, and do not contain / \\ , \" or control characters, \
                              because each camera's name is also the name of a folder";

/// Returns true if a name can be the name of a folder and a field of a table.
pub fn is_plain_name(name: &str) -> bool {
    (1..=64).contains(&name.len())
        && !name.starts_with(['.', '-', ' '])
        && !name.contains(['/', '\\', ',', '"'])
        && !name.chars().any(char::is_control)
}
