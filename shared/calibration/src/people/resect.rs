//! Pose of a camera from joints with known positions.

use fastrand::Rng;
use geometry::Camera;
use geometry::bundle::{Cameras, Free, Loss, Problem, Settings, Step, Term, solve};
use nalgebra::{
    Isometry3, Matrix3, Point2, Point3, Rotation3, SMatrix, SVector, SymmetricEigen, Translation3,
    UnitQuaternion,
};

use super::two_view::normalised;

/// Number of samples of six joints.
const SAMPLES: usize = 250;
/// Number of joints with which a sample is evaluated, and number to which a pose is fitted.
const JUDGES: [usize; 2] = [250, 700];
/// Number of poses to fit: the best of the samples.
const STARTS: usize = 5;

/// A joint: its position in the world, its position in the ideal picture, and its expected error in pixels.
pub(crate) type Known = (Point3<f64>, Point2<f64>, f64);

/// Returns a camera placed according to its picture, with the mean cost of a joint; `None` if too few joints are known.
pub(crate) fn resected(
    camera: &Camera,
    known: &[Known],
    random: &mut Rng,
) -> Option<(Camera, f64)> {
    if known.len() < 12 {
        return None;
    }
    let judges = thinned(known, JUDGES[0]);
    let mut starts: Vec<(f64, Camera)> = Vec::new();
    for _ in 0..SAMPLES {
        let sample: [Known; 6] = core::array::from_fn(|_| known[random.usize(..known.len())]);
        let Some(pose) = linear(camera, &sample) else {
            continue;
        };
        let placed = Camera {
            camera_from_world: pose,
            ..camera.clone()
        };
        let cost = mean_cost(&placed, &judges);
        starts.push((cost, placed));
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        starts.truncate(STARTS);
    }
    let fitted = thinned(known, JUDGES[1]);
    let ends = starts.into_iter().map(|(_, start)| {
        let problem = Resection {
            cameras: Cameras::new(vec![start], &[Free::POSE]),
            known: &fitted,
        };
        let settings = Settings {
            max_iterations: 40,
            least_gain: 1e-7,
        };
        let (end, _) = solve(problem, &settings);
        let placed = end.cameras.cameras()[0].clone();
        let cost = mean_cost(&placed, &fitted);
        (placed, cost)
    });
    ends.min_by(|a, b| a.1.total_cmp(&b.1))
}

fn thinned(known: &[Known], most: usize) -> Vec<Known> {
    let step = known.len().div_ceil(most).max(1);
    known.iter().step_by(step).copied().collect()
}

fn mean_cost(camera: &Camera, known: &[Known]) -> f64 {
    let cost = |(point, seen, sigma): &Known| {
        let away = camera.project(point).map(|value| (value - seen).norm() / sigma);
        away.unwrap_or(1e3).powi(2).ln_1p()
    };
    known.iter().map(cost).sum::<f64>() / known.len() as f64
}

/// Returns the linear solution for six joints, with the nearest rotation.
fn linear(camera: &Camera, sample: &[Known; 6]) -> Option<Isometry3<f64>> {
    let centre = sample.iter().map(|sample| sample.0.coords).sum::<nalgebra::Vector3<f64>>() / 6.0;
    let mut normal = SMatrix::<f64, 12, 12>::zeros();
    for (point, seen, _) in sample {
        let seen = normalised(camera, seen);
        let at = (point - centre).coords.push(1.0);
        for (axis, seen) in [(0, seen.x), (1, seen.y)] {
            let row = SVector::<f64, 12>::from_fn(|nth, _| match nth / 4 {
                it if it == axis => at[nth % 4],
                2 => -seen * at[nth % 4],
                _ => 0.0,
            });
            normal += row * row.transpose();
        }
    }
    let eigen = SymmetricEigen::new(normal);
    let vector = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let mut left = Matrix3::from_fn(|i, j| vector[4 * i + j]);
    let mut right = nalgebra::Vector3::from_fn(|i, _| vector[4 * i + 3]);
    if left.determinant() < 0.0 {
        (left, right) = (-left, -right);
    }
    let svd = left.svd(true, true);
    let scale = svd.singular_values.mean();
    let matrix = svd.u? * svd.v_t?;
    if scale <= 1e-12 || matrix.determinant() < 0.0 {
        return None;
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    let translation = right / scale - rotation * centre;
    let pose = Isometry3::from_parts(Translation3::from(translation), rotation);
    translation.iter().all(|value| value.is_finite()).then_some(pose)
}

/// Adjustment problem with one camera and fixed positions of joints.
#[derive(Clone)]
struct Resection<'a> {
    cameras: Cameras,
    known: &'a [Known],
}

impl Problem for Resection<'_> {
    fn n_shared(&self) -> usize {
        self.cameras.n_parameters()
    }

    fn name(&self, parameter: usize) -> String {
        self.cameras.name(parameter)
    }

    fn locals(&self) -> Vec<usize> {
        Vec::new()
    }

    fn terms_of(&self, _local: usize, _take: &mut dyn FnMut(&Term)) {}

    fn priors(&self, take: &mut dyn FnMut(&Term)) {
        let mut term = Term::default();
        for (point, seen, sigma) in self.known {
            self.cameras.observe(0, point, (*seen, *sigma), Loss::Cauchy(2.0), &mut term);
            take(&term);
        }
    }

    fn moved(&self, step: &Step) -> Self {
        Self {
            cameras: self.cameras.moved(&step.shared),
            known: self.known,
        }
    }
}
