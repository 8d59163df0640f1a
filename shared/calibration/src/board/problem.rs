//! Adjustment of cameras and boards: the terms for [`geometry::bundle`].

use geometry::bundle::{Cameras, Loss, Problem, Step, Term};
use geometry::{Camera, LensModel};
use nalgebra::{Isometry3, Matrix2x3, Point2, Point3, Translation3, UnitQuaternion, Vector3};

/// Prior on every camera, as standard deviations. Pixels are square to half a percent, the principal point is within a few percent of the
/// centre, and lenses are centred. The prior determines parameters that a small number of pictures cannot determine. It has hardly any
/// influence if the board covers much of the picture: the corners then determine each parameter at least ten times better than the prior.
const PRINCIPAL_POINT: f64 = 0.04;
const ASPECT: f64 = 0.005;
const RADIAL: f64 = 0.5;
const DIVIDING: f64 = 10.0;
const TANGENTIAL: f64 = 0.005;

/// A point of the board in a picture.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Observation {
    pub(crate) camera: usize,
    /// Position on the board relative to its centre, in metres.
    pub(crate) on_board: Point3<f64>,
    /// Position in the picture, in pixels.
    pub(crate) seen: Point2<f64>,
    /// Factor by which the standard deviation is larger than for a board that stands still.
    pub(crate) spread: f64,
}

/// Cameras, and a board with a different pose in every frame.
#[derive(Debug, Clone)]
pub(crate) struct BoardProblem<'a> {
    pub(crate) cameras: Cameras,
    /// `world_from_board` of every frame; the origin of the board is its centre.
    pub(crate) boards: Vec<Isometry3<f64>>,
    /// Corners observed in every frame.
    pub(crate) seen: &'a [Vec<Observation>],
    /// Standard deviation of a corner's position, in pixels.
    pub(crate) sigma_px: f64,
    pub(crate) loss: Loss,
}

impl BoardProblem<'_> {
    /// Returns the residuals of a frame (projected minus observed position, in pixels); `None` for a point without an image.
    pub(crate) fn residuals(&self, frame: usize) -> Vec<Option<nalgebra::Vector2<f64>>> {
        let residual = |observation: &Observation| {
            let camera: &Camera = &self.cameras.cameras()[observation.camera];
            let image = camera.project(&(self.boards[frame] * observation.on_board))?;
            Some(image - observation.seen)
        };
        self.seen[frame].iter().map(residual).collect()
    }
}

impl Problem for BoardProblem<'_> {
    fn n_shared(&self) -> usize {
        self.cameras.n_parameters()
    }

    fn name(&self, parameter: usize) -> String {
        self.cameras.name(parameter)
    }

    fn locals(&self) -> Vec<usize> {
        vec![6; self.boards.len()]
    }

    fn terms_of(&self, local: usize, take: &mut dyn FnMut(&Term)) {
        let board = &self.boards[local];
        let mut term = Term::default();
        for it in &self.seen[local] {
            let turned = board.rotation * it.on_board.coords;
            let in_world = Point3::from(turned + board.translation.vector);
            let seen = (it.seen, self.sigma_px * it.spread);
            let observed = self.cameras.observe(it.camera, &in_world, seen, self.loss, &mut term);
            let by_point: Matrix2x3<f64> = observed.by_point;
            for axis in 0..3 {
                let turn = by_point * Vector3::ith(axis, 1.0).cross(&turned);
                term.by_local(axis, turn.as_slice());
                term.by_local(3 + axis, by_point.column(axis).as_slice());
            }
            take(&term);
        }
    }

    fn priors(&self, take: &mut dyn FnMut(&Term)) {
        let mut term = Term::default();
        for (nth, camera) in self.cameras.cameras().iter().enumerate() {
            for parameter in self.cameras.parameters(nth) {
                let name = self.cameras.name(parameter);
                let Some((residual, slope)) = prior(camera, &name) else {
                    continue;
                };
                term.begin(&[residual], Loss::Square);
                term.by_shared(parameter, &[slope]);
                take(&term);
            }
        }
    }

    fn moved(&self, step: &Step) -> Self {
        let boards = self.boards.iter().zip(&step.locals).map(|(board, step)| {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::new(step[0], step[1], step[2]));
            let shift = Vector3::new(step[3], step[4], step[5]);
            let mut rotation = turn * board.rotation;
            rotation.renormalize();
            let translation = Translation3::from(board.translation.vector + shift);
            Isometry3::from_parts(translation, rotation)
        });
        Self {
            cameras: self.cameras.moved(&step.shared),
            boards: boards.collect(),
            ..self.clone()
        }
    }
}

/// Returns the residual of the prior of a parameter, and its derivative; `None` for poses and focal lengths.
fn prior(camera: &Camera, name: &str) -> Option<(f64, f64)> {
    let intrinsics = &camera.intrinsics;
    let number = name.rsplit(": ").next()?;
    let off = |value: f64, sd: f64| Some((value / sd, 1.0 / sd));
    let size = intrinsics.size.map(f64::from);
    match number {
        "principal point x" => off(
            intrinsics.cx - 0.5 * (size[0] - 1.0),
            PRINCIPAL_POINT * size[0],
        ),
        "principal point y" => off(
            intrinsics.cy - 0.5 * (size[1] - 1.0),
            PRINCIPAL_POINT * size[1],
        ),
        "focal length y" => off(intrinsics.fy - intrinsics.fx, ASPECT * intrinsics.fx),
        _ => {
            let nth = number.strip_prefix("lens ")?;
            let index = ["k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"]
                .iter()
                .position(|name| *name == nth)?;
            let value = intrinsics.lens.model().coefficients().nth(index)?;
            let is_fisheye = matches!(intrinsics.lens.model(), LensModel::KannalaBrandt { .. });
            let sd = match index {
                _ if is_fisheye => RADIAL,
                6.. => TANGENTIAL,
                3..=5 => DIVIDING,
                // In a rational lens model, coefficients of the numerator and the denominator can grow together with hardly any effect on
                // the distortion.
                _ if camera
                    .intrinsics
                    .lens
                    .model()
                    .coefficients()
                    .skip(3)
                    .take(3)
                    .any(|coefficient| coefficient != 0.0) =>
                {
                    DIVIDING
                }
                _ => RADIAL,
            };
            off(value, sd)
        }
    }
}
