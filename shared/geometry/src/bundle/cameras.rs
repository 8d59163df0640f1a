//! Cameras of a problem: their free parameters, and the terms of their observations.

use nalgebra::{
    Isometry3, Matrix2, Matrix2x3, Point2, Point3, Translation3, UnitQuaternion, Vector3,
};

use super::{Loss, Term};
use crate::{Camera, Lens, LensModel};

/// Residual of a point without an image (behind the camera or beyond its lens), in standard deviations.
const NO_IMAGE: f64 = 1e3;

/// The parameters of a camera that are free; all others are fixed.
#[expect(
    clippy::struct_excessive_bools,
    reason = "each parameter is free or fixed separately"
)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Free {
    /// True if the rotation (radians about the axes of the camera) and the centre (metres in the world) are free.
    pub pose: bool,
    /// True if the focal length is free; fx and fy keep their ratio.
    pub focal: bool,
    /// True if the ratio of fy to fx is free. Without `focal`, only fy is free.
    pub aspect: bool,
    /// True if the principal point is free.
    pub centre: bool,
    /// True for each free coefficient of the lens, in the order of [`LensModel::coefficients`]: k1 to k6, p1, p2, or k1 to k4.
    pub lens: [bool; 8],
}

impl Free {
    /// Only the pose is free.
    pub const POSE: Self = Self {
        pose: true,
        focal: false,
        aspect: false,
        centre: false,
        lens: [false; 8],
    };
}

/// A parameter of a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Number {
    Rotation(usize),
    Centre(usize),
    Focal,
    Aspect,
    Principal(usize),
    Lens(usize),
}

/// Cameras, and the assignment of their free parameters to the shared parameters from index 0.
#[expect(clippy::struct_field_names, reason = "the type is a list of cameras")]
#[derive(Debug, Clone, PartialEq)]
pub struct Cameras {
    cameras: Vec<Camera>,
    /// Camera and kind of each parameter.
    numbers: Vec<(usize, Number)>,
    /// Index of the first parameter of each camera, then the number of parameters.
    first: Vec<usize>,
}

/// Derivatives of a term with respect to its point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observed {
    /// Derivative of the residuals (in standard deviations) with respect to the point in the world (metres).
    pub by_point: Matrix2x3<f64>,
    /// True if the point has an image; if not, the derivatives are 0.
    pub has_image: bool,
}

impl Cameras {
    /// Creates a set of cameras with their free parameters.
    ///
    /// # Panics
    ///
    /// Panics if there is not one [`Free`] for each camera.
    pub fn new(cameras: Vec<Camera>, free: &[Free]) -> Self {
        assert_eq!(cameras.len(), free.len(), "one a camera");
        let (mut numbers, mut first) = (Vec::new(), vec![0]);
        for (nth, (camera, free)) in cameras.iter().zip(free).enumerate() {
            numbers.extend(free_numbers(camera, *free).map(|free_number| (nth, free_number)));
            first.push(numbers.len());
        }
        Self {
            cameras,
            numbers,
            first,
        }
    }

    /// Returns the cameras with their current values.
    pub fn cameras(&self) -> &[Camera] {
        &self.cameras
    }

    /// Returns the number of parameters.
    pub fn n_parameters(&self) -> usize {
        self.numbers.len()
    }

    /// Returns the name of a parameter, such as `cam02: centre x`.
    pub fn name(&self, parameter: usize) -> String {
        let Some((camera, number)) = self.numbers.get(parameter) else {
            return format!("parameter {parameter}");
        };
        let camera = &self.cameras[*camera];
        let axis = |nth: usize| ["x", "y", "z"][nth];
        let number = match *number {
            Number::Rotation(nth) => format!("rotation {}", axis(nth)),
            Number::Centre(nth) => format!("place {}", axis(nth)),
            Number::Focal => "focal length".to_owned(),
            Number::Aspect => "focal length y".to_owned(),
            Number::Principal(nth) => format!("principal point {}", axis(nth)),
            Number::Lens(nth) => {
                let brown = ["k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"];
                format!("lens {}", brown[nth])
            }
        };
        format!("{}: {number}", camera.name)
    }

    /// Returns the parameters of a camera's rotation and centre, in this order; `None` if its pose is fixed.
    pub fn pose_parameters(&self, camera: usize) -> Option<[usize; 6]> {
        let first = self.first[camera];
        let is_pose =
            matches!(self.numbers.get(first), Some((it, Number::Rotation(0))) if *it == camera);
        is_pose.then(|| core::array::from_fn(|nth| first + nth))
    }

    /// Returns the parameter of a camera's focal length; `None` if the focal length is fixed.
    pub fn focal_parameter(&self, camera: usize) -> Option<usize> {
        let own = self.first[camera]..self.first[camera + 1];
        own.into_iter().find(|i| self.numbers[*i].1 == Number::Focal)
    }

    /// Returns the parameters of a camera.
    pub fn parameters(&self, camera: usize) -> core::ops::Range<usize> {
        self.first[camera]..self.first[camera + 1]
    }

    /// Begins a term with the observation of a point by a camera: (image - seen) / sigma, with its derivatives with respect to the
    /// parameters of the camera.
    ///
    /// * `seen`: position in pixels of the recorded picture; `sigma_px`: standard deviation along each axis.
    /// * Returns the derivative with respect to the point. The caller converts it to the coordinates of its local block.
    #[expect(
        clippy::too_many_arguments,
        reason = "the observation, its camera, and the output"
    )]
    pub fn observe(
        &self,
        camera: usize,
        in_world: &Point3<f64>,
        (seen, sigma_px): (Point2<f64>, f64),
        loss: Loss,
        term: &mut Term,
    ) -> Observed {
        let Some(image) = Image::new(&self.cameras[camera], in_world) else {
            term.begin(&[NO_IMAGE; 2], loss);
            return Observed {
                by_point: Matrix2x3::zeros(),
                has_image: false,
            };
        };
        let residual = (image.pixel - seen) / sigma_px;
        term.begin(residual.as_slice(), loss);
        for parameter in self.parameters(camera) {
            let column = image.by(&self.cameras[camera], self.numbers[parameter].1);
            term.by_shared(parameter, &[column[0] / sigma_px, column[1] / sigma_px]);
        }
        Observed {
            by_point: image.by_world / sigma_px,
            has_image: true,
        }
    }

    /// Returns the cameras after a step of the parameters; `step` may have more numbers than there are parameters.
    #[must_use]
    pub fn moved(&self, step: &[f64]) -> Self {
        let mut cameras = self.cameras.clone();
        for (nth, camera) in cameras.iter_mut().enumerate() {
            let own = self.parameters(nth);
            let each = own.map(|i| (self.numbers[i].1, step[i]));
            move_camera(camera, each);
        }
        Self {
            cameras,
            numbers: self.numbers.clone(),
            first: self.first.clone(),
        }
    }
}

fn free_numbers(camera: &Camera, free: Free) -> impl Iterator<Item = Number> {
    let mut numbers = Vec::new();
    if free.pose {
        numbers.extend((0..3).map(Number::Rotation));
        numbers.extend((0..3).map(Number::Centre));
    }
    if free.focal {
        numbers.push(Number::Focal);
    }
    if free.aspect {
        numbers.push(Number::Aspect);
    }
    if free.centre {
        numbers.extend((0..2).map(Number::Principal));
    }
    let n_coefficients = camera.intrinsics.lens.model().coefficients().count();
    let coefficients = (0..n_coefficients.min(8)).filter(|i| free.lens[*i]);
    numbers.extend(coefficients.map(Number::Lens));
    numbers.into_iter()
}

fn move_camera(camera: &mut Camera, steps: impl Iterator<Item = (Number, f64)>) {
    let (mut turn, mut way) = (Vector3::zeros(), Vector3::zeros());
    let (mut lens, mut is_lens) = (*camera.intrinsics.lens.model(), false);
    let aspect = camera.intrinsics.fy / camera.intrinsics.fx;
    for (number, by) in steps {
        match number {
            Number::Rotation(nth) => turn[nth] = by,
            Number::Centre(nth) => way[nth] = by,
            Number::Focal => {
                camera.intrinsics.fx += by;
                camera.intrinsics.fy += aspect * by;
            }
            Number::Aspect => camera.intrinsics.fy += by,
            Number::Principal(0) => camera.intrinsics.cx += by,
            Number::Principal(_) => camera.intrinsics.cy += by,
            Number::Lens(nth) => {
                is_lens = true;
                move_lens(&mut lens, nth, by);
            }
        }
    }
    if is_lens {
        camera.intrinsics.lens = Lens::new(lens);
    }
    if turn != Vector3::zeros() || way != Vector3::zeros() {
        let centre = camera.centre_in_world() + way;
        let mut rotation =
            UnitQuaternion::from_scaled_axis(turn) * camera.camera_from_world.rotation;
        rotation.renormalize();
        let translation = Translation3::from(rotation * -centre.coords);
        camera.camera_from_world = Isometry3::from_parts(translation, rotation);
    }
}

fn move_lens(model: &mut LensModel, nth: usize, by: f64) {
    let coefficient = match model {
        LensModel::Pinhole => None,
        LensModel::BrownConrady { k, p } => k.iter_mut().chain(p).nth(nth),
        LensModel::KannalaBrandt { k } => k.get_mut(nth),
    };
    if let Some(it) = coefficient {
        *it += by;
    }
}

/// The image of a point, and the values from which its derivatives are computed.
struct Image {
    pixel: Point2<f64>,
    in_camera: Point3<f64>,
    normalised: Point2<f64>,
    distorted: Point2<f64>,
    /// Derivative with respect to the point in camera coordinates, then in world coordinates.
    by_camera: Matrix2x3<f64>,
    by_world: Matrix2x3<f64>,
}

impl Image {
    fn new(camera: &Camera, in_world: &Point3<f64>) -> Option<Self> {
        let (pixel, by_world) = camera.project_with_jacobian(in_world)?;
        let in_camera = camera.camera_from_world * in_world;
        let normalised = Point2::new(in_camera.x / in_camera.z, in_camera.y / in_camera.z);
        let rotation = camera.camera_from_world.rotation.to_rotation_matrix();
        Some(Self {
            pixel,
            in_camera,
            normalised,
            distorted: camera.intrinsics.normalised(&pixel),
            by_camera: by_world * rotation.matrix().transpose(),
            by_world,
        })
    }

    /// Returns the derivative of the pixel with respect to a parameter of the camera.
    fn by(&self, camera: &Camera, number: Number) -> [f64; 2] {
        let intrinsics = &camera.intrinsics;
        let column = match number {
            // A rotation w moves the point by w x point.
            Number::Rotation(nth) => {
                let axis = Vector3::ith(nth, 1.0);
                self.by_camera * axis.cross(&self.in_camera.coords)
            }
            Number::Centre(nth) => -self.by_world.column(nth).into_owned(),
            Number::Focal => {
                let aspect = intrinsics.fy / intrinsics.fx;
                nalgebra::Vector2::new(self.distorted.x, aspect * self.distorted.y)
            }
            Number::Aspect => nalgebra::Vector2::new(0.0, self.distorted.y),
            Number::Principal(nth) => nalgebra::Vector2::ith(nth, 1.0),
            Number::Lens(nth) => {
                let focal =
                    Matrix2::from_diagonal(&nalgebra::Vector2::new(intrinsics.fx, intrinsics.fy));
                let model = intrinsics.lens.model();
                focal * model.by_coefficient(&self.normalised.coords, nth)
            }
        };
        [column.x, column.y]
    }
}
