//! Relative pose of two cameras, from joints that both see.

use fastrand::Rng;
use nalgebra::{
    Isometry3, Matrix3, Point2, Rotation3, SMatrix, SVector, SymmetricEigen, Translation3,
    UnitQuaternion, Vector2, Vector3,
};

/// Number of samples of eight joints.
const SAMPLES: usize = 400;
/// Number of matches with which a sample is evaluated, and number to which a pose is fitted.
const JUDGES: [usize; 2] = [250, 700];
/// Number of poses to fit: the best of the samples.
const STARTS: usize = 6;
/// Number of steps of a fit.
const STEPS: usize = 25;

/// A joint in both cameras: normalised coordinates (x / z, y / z).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Match {
    pub(crate) a: Vector2<f64>,
    pub(crate) b: Vector2<f64>,
}

/// Relative pose of two cameras, and the quality of its fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Relative {
    /// Pose of the second camera; the length of the translation is 1.
    pub(crate) b_from_a: Isometry3<f64>,
    /// Mean of log(1 + (residual / sigma)^2) over the matches.
    pub(crate) cost: f64,
    /// Fraction of matches within three sigma and in front of both cameras.
    pub(crate) inliers: f64,
    /// Median angle between the rays of a match, in radians.
    pub(crate) parallax: f64,
}

/// Returns the pose that fits the matches best; `None` for fewer than 12 matches, or if all fits fail.
///
/// * `sigma`: expected error of a match, in normalised coordinates.
pub(crate) fn relative(matches: &[Match], sigma: f64, random: &mut Rng) -> Option<Relative> {
    if matches.len() < 12 {
        return None;
    }
    let judges = thinned(matches, JUDGES[0]);
    let fitted = thinned(matches, JUDGES[1]);
    let mut starts: Vec<(f64, Isometry3<f64>)> = Vec::new();
    for _ in 0..SAMPLES {
        let mut sample = [matches[0]; 8];
        for it in &mut sample {
            *it = matches[random.usize(..matches.len())];
        }
        let Some(essential) = eight_points(&sample) else {
            continue;
        };
        let cost = mean_cost(&judges, &essential, sigma);
        let is_good = starts.len() < STARTS || starts.last().is_some_and(|start| cost < start.0);
        if is_good && let Some(pose) = decompose(&essential, &judges, sigma) {
            starts.push((cost, pose));
            starts.sort_by(|a, b| a.0.total_cmp(&b.0));
            starts.truncate(STARTS);
        }
    }
    let poses = starts.iter().map(|start| fit(start.1, &fitted, sigma));
    let best = poses
        .map(|pose| (mean_cost(&fitted, &essential_of(&pose), sigma), pose))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    // The fit determines only the essential matrix, so one of its four poses is selected again with the matches.
    let pose = decompose(&essential_of(&best.1), &fitted, sigma)?;
    Some(judged(pose, best.0, &fitted, sigma))
}

fn judged(pose: Isometry3<f64>, cost: f64, matches: &[Match], sigma: f64) -> Relative {
    let essential = essential_of(&pose);
    let good = |pair: &&Match| sampson(pair, &essential).abs() < 3.0 * sigma;
    let (mut n, mut angles) = (0, Vec::new());
    for it in matches.iter().filter(good) {
        if let Some((depths, angle)) = depths(&pose, it)
            && depths.iter().all(|depth| *depth > 0.0)
        {
            n += 1;
            angles.push(angle);
        }
    }
    angles.sort_by(f64::total_cmp);
    Relative {
        b_from_a: pose,
        cost,
        inliers: f64::from(n) / matches.len() as f64,
        parallax: angles.get(angles.len() / 2).copied().unwrap_or(0.0),
    }
}

/// Returns every n-th match, so that about `most` are left.
fn thinned(matches: &[Match], most: usize) -> Vec<Match> {
    let step = matches.len().div_ceil(most).max(1);
    matches.iter().step_by(step).copied().collect()
}

/// Returns the first-order distance of a match from its epipolar constraint (Sampson), in normalised coordinates.
pub(crate) fn sampson(it: &Match, essential: &Matrix3<f64>) -> f64 {
    let (a, b) = (it.a.push(1.0), it.b.push(1.0));
    let (of_a, of_b) = (essential * a, essential.tr_mul(&b));
    let slope = of_a.x * of_a.x + of_a.y * of_a.y + of_b.x * of_b.x + of_b.y * of_b.y;
    b.dot(&of_a) / slope.max(f64::MIN_POSITIVE).sqrt()
}

/// Returns the essential matrix of a pose.
pub(crate) fn essential_of(b_from_a: &Isometry3<f64>) -> Matrix3<f64> {
    let rotation = b_from_a.rotation.to_rotation_matrix();
    b_from_a.translation.vector.cross_matrix() * rotation.matrix()
}

fn mean_cost(matches: &[Match], essential: &Matrix3<f64>, sigma: f64) -> f64 {
    let each = matches.iter().map(|hit| (sampson(hit, essential) / sigma).powi(2).ln_1p());
    each.sum::<f64>() / matches.len() as f64
}

/// Returns the linear solution for eight matches (Hartley 1997), with singular values 1, 1, 0.
fn eight_points(sample: &[Match; 8]) -> Option<Matrix3<f64>> {
    let of_a = normaliser(&sample.map(|sample| sample.a))?;
    let of_b = normaliser(&sample.map(|sample| sample.b))?;
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    for it in sample {
        let (a, b) = (of_a * it.a.push(1.0), of_b * it.b.push(1.0));
        let row = SVector::<f64, 9>::from_fn(|nth, _| b[nth / 3] * a[nth % 3]);
        normal += row * row.transpose();
    }
    let eigen = SymmetricEigen::new(normal);
    let vector = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let matrix = Matrix3::from_fn(|i, j| vector[3 * i + j]);
    let svd = (of_b.transpose() * matrix * of_a).svd(true, true);
    let essential = svd.u? * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 0.0)) * svd.v_t?;
    essential.iter().all(|value| value.is_finite()).then_some(essential)
}

/// Returns the map that moves points to the origin and to a mean distance of √2.
fn normaliser(points: &[Vector2<f64>; 8]) -> Option<Matrix3<f64>> {
    let centre = points.iter().sum::<Vector2<f64>>() / 8.0;
    let away = points.iter().map(|point| (point - centre).norm()).sum::<f64>() / 8.0;
    let scale = core::f64::consts::SQRT_2 / away;
    let [x, y] = [-scale * centre.x, -scale * centre.y];
    let matrix = Matrix3::new(scale, 0.0, x, 0.0, scale, y, 0.0, 0.0, 1.0);
    scale.is_finite().then_some(matrix)
}

/// Returns the pose for which most matches are in front of both cameras, among the four poses of an essential matrix.
fn decompose(essential: &Matrix3<f64>, matches: &[Match], sigma: f64) -> Option<Isometry3<f64>> {
    let svd = essential.svd(true, true);
    let (mut u, mut v_t) = (svd.u?, svd.v_t?);
    if u.determinant() < 0.0 {
        u = -u;
    }
    if v_t.determinant() < 0.0 {
        v_t = -v_t;
    }
    // The null direction belongs to the smallest singular value.
    let least = svd.singular_values.imin();
    if least != 2 {
        return None;
    }
    let turn = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let translation = u.column(2).into_owned();
    let rotation = |turn: &Matrix3<f64>| {
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(u * turn * v_t))
    };
    let [one, other] = [rotation(&turn), rotation(&turn.transpose())];
    let poses = [(one, 1.0), (one, -1.0), (other, 1.0), (other, -1.0)];
    let poses = poses.map(|(rotation, sign)| {
        Isometry3::from_parts(Translation3::from(sign * translation), rotation)
    });
    let good: Vec<&Match> = matches
        .iter()
        .filter(|hit| sampson(hit, essential).abs() < 3.0 * sigma)
        .take(60)
        .collect();
    let in_front = |pose: &Isometry3<f64>| {
        let front = |pair: &&&Match| {
            depths(pose, pair).is_some_and(|found| found.0.iter().all(|depth| *depth > 0.0))
        };
        good.iter().filter(front).count()
    };
    let best = poses.iter().max_by_key(|pose| in_front(pose))?;
    (2 * in_front(best) > good.len()).then_some(*best)
}

/// Returns the depths of a match in both cameras, and the angle between its rays.
fn depths(b_from_a: &Isometry3<f64>, it: &Match) -> Option<([f64; 2], f64)> {
    let a = b_from_a.rotation * it.a.push(1.0);
    let b = it.b.push(1.0);
    // a * depth_a + t = b * depth_b
    let t = b_from_a.translation.vector;
    let (aa, ab, bb) = (a.norm_squared(), a.dot(&b), b.norm_squared());
    let determinant = aa * bb - ab * ab;
    if determinant <= 1e-12 * aa * bb {
        return None;
    }
    let (at, bt) = (a.dot(&t), b.dot(&t));
    let depth_a = (ab * bt - bb * at) / determinant;
    let depth_b = (aa * bt - ab * at) / determinant;
    Some(([depth_a, depth_b], a.angle(&b)))
}

/// Refines the rotation and the direction of the translation robustly (damped Gauss-Newton steps with updated weights).
fn fit(start: Isometry3<f64>, matches: &[Match], sigma: f64) -> Isometry3<f64> {
    const STEP: f64 = 1e-6;
    let (mut at, mut damping) = (start, 1e-3);
    let mut cost = mean_cost(matches, &essential_of(&at), sigma);
    for _ in 0..STEPS {
        let here = essential_of(&at);
        let moved: [Matrix3<f64>; 5] = core::array::from_fn(|nth| {
            let step = SVector::<f64, 5>::ith(nth, STEP);
            essential_of(&turned(&at, &step))
        });
        let mut normal = SMatrix::<f64, 5, 5>::zeros();
        let mut gradient = SVector::<f64, 5>::zeros();
        for it in matches {
            let r = sampson(it, &here) / sigma;
            let by =
                SVector::<f64, 5>::from_fn(|nth, _| (sampson(it, &moved[nth]) / sigma - r) / STEP);
            let weight = 1.0 / (1.0 + r * r);
            normal += weight * by * by.transpose();
            gradient += weight * r * by;
        }
        let mut is_better = false;
        for _ in 0..6 {
            let mut damped = normal;
            for nth in 0..5 {
                damped[(nth, nth)] *= 1.0 + damping;
            }
            let Some(step) = damped.cholesky().map(|cholesky| cholesky.solve(&-gradient)) else {
                break;
            };
            let next = turned(&at, &step);
            let next_cost = mean_cost(matches, &essential_of(&next), sigma);
            if next_cost < cost {
                is_better = cost - next_cost > 1e-9 * cost;
                (at, cost, damping) = (next, next_cost, 0.2 * damping);
                break;
            }
            damping *= 5.0;
        }
        if !is_better {
            break;
        }
    }
    at
}

/// Returns a pose changed by a rotation (3 parameters) and a rotation of its translation (2 parameters).
fn turned(pose: &Isometry3<f64>, step: &SVector<f64, 5>) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(step[0], step[1], step[2]));
    let way = pose.translation.vector;
    let aside = if way.x.abs() < 0.6 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let first = way.cross(&aside);
    let first = first / first.norm();
    let second = way.cross(&first);
    let way = way + step[3] * first + step[4] * second;
    Isometry3::from_parts(Translation3::from(way / way.norm()), turn * pose.rotation)
}

/// Returns a position in an ideal picture in normalised coordinates.
pub(crate) fn normalised(camera: &geometry::Camera, at: &Point2<f64>) -> Vector2<f64> {
    camera.intrinsics.normalised(at).coords
}
