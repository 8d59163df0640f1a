//! Constant error of a joint in a camera. For example, a joint detector finds a hip in a different place in a front view than in a side
//! view.
//!
//! Such errors do not average out over a recording in which a person stays in one place. Each error is therefore an unknown. Its prior
//! has mean 0 and a standard deviation estimated from the residuals. If people walk about, the estimated error is close to 0.

use geometry::bundle::{Loss, Term};
use nalgebra::Vector2;
use statistics::Sorted;

use super::instant::Instant;

/// A joint has a bias of its own in a camera only if the camera sees it at least this number of times.
const LEAST: usize = 6;
/// Largest prior standard deviation of a constant error, as a fraction of the size of the person.
const MOST: f64 = 0.02;
/// A constant error below this fraction of the person's size counts as negligible.
const NOTHING: f64 = 0.0005;
/// Median of the square of a standard normal variable.
const MEDIAN_SQUARE: f64 = 0.4549;

/// Bias of every joint in every camera.
#[derive(Debug, Clone, Default)]
pub(super) struct Biases {
    /// Index of the first bias parameter; each bias has two.
    first: usize,
    /// Index of the bias, by camera and joint.
    places: Vec<Vec<Option<usize>>>,
    /// Values of the biases, in pixels.
    values: Vec<Vector2<f64>>,
    /// Prior standard deviation of each bias, in pixels.
    sd_px: Vec<f64>,
}

impl Biases {
    /// Creates biases of 0.
    ///
    /// * `first`: index of the first parameter; `sd_px`: prior standard deviation, by camera.
    pub(super) fn new(first: usize, sd_px: &[f64], instants: &[Instant]) -> Self {
        let n_joints = instants.iter().flat_map(|instant| &instant.joints).max();
        let mut counts = vec![vec![0_usize; n_joints.map_or(0, |joint| joint + 1)]; sd_px.len()];
        for instant in instants {
            for seen in &instant.seen {
                counts[seen.camera][instant.joints[seen.point]] += 1;
            }
        }
        let mut it = Self {
            first,
            ..Self::default()
        };
        for (counts, sd) in counts.iter().zip(sd_px) {
            let mut places = Vec::new();
            for n in counts {
                let is_seen = *n >= LEAST;
                places.push(is_seen.then_some(it.values.len()));
                if is_seen {
                    it.values.push(Vector2::zeros());
                    it.sd_px.push(*sd);
                }
            }
            it.places.push(places);
        }
        it
    }

    pub(super) fn n_parameters(&self) -> usize {
        2 * self.values.len()
    }

    fn place(&self, camera: usize, joint: usize) -> Option<usize> {
        self.places.get(camera)?.get(joint).copied()?
    }

    /// Returns the bias of a joint in a camera, in pixels; 0 if it has no bias.
    pub(super) fn of(&self, camera: usize, joint: usize) -> Vector2<f64> {
        self.place(camera, joint).map_or_else(Vector2::zeros, |i| self.values[i])
    }

    /// Adds the derivatives of an observed joint with respect to its bias.
    pub(super) fn observed(&self, (camera, joint): (usize, usize), sigma_px: f64, term: &mut Term) {
        if let Some(place) = self.place(camera, joint) {
            let parameter = self.first + 2 * place;
            term.by_shared(parameter, &[1.0 / sigma_px, 0.0]);
            term.by_shared(parameter + 1, &[0.0, 1.0 / sigma_px]);
        }
    }

    /// Passes the prior terms to `take`.
    pub(super) fn priors(&self, take: &mut dyn FnMut(&Term)) {
        let mut term = Term::default();
        for (nth, (value, sd)) in self.values.iter().zip(&self.sd_px).enumerate() {
            let parameter = self.first + 2 * nth;
            term.begin((value / *sd).as_slice(), Loss::Square);
            term.by_shared(parameter, &[1.0 / sd, 0.0]);
            term.by_shared(parameter + 1, &[0.0, 1.0 / sd]);
            take(&term);
        }
    }

    pub(super) fn step(&mut self, shared: &[f64]) {
        for (nth, value) in self.values.iter_mut().enumerate() {
            let parameter = self.first + 2 * nth;
            *value += Vector2::new(shared[parameter], shared[parameter + 1]);
        }
    }
}

/// Returns the constant error of joints over all joints and cameras, from their residuals, as a fraction of the size of the person.
/// Returns `None` if the error is negligible.
///
/// * `residuals`: residuals of each joint in each camera, as fractions of the size.
pub(super) fn share_of(residuals: &[Vec<Vector2<f64>>]) -> Option<f64> {
    let mut squares = Vec::new();
    for of_joint in residuals.iter().filter(|residual| residual.len() >= LEAST) {
        for axis in 0..2 {
            let each: Vec<f64> = of_joint.iter().map(|residual| residual[axis]).collect();
            let middle = Sorted::new(each.clone()).upper_median()?;
            let away = each.iter().map(|value| (value - middle).abs());
            let noise = 1.4826 * Sorted::new(away.collect::<Vec<_>>()).upper_median()?;
            // The variance of the median of n numbers is pi / 2 times the variance of their mean.
            let chance = core::f64::consts::FRAC_PI_2 * noise.powi(2) / of_joint.len() as f64;
            squares.push(middle.powi(2) - chance);
        }
    }
    let share = (Sorted::new(squares).upper_median()? / MEDIAN_SQUARE).max(0.0).sqrt();
    (share > NOTHING).then(|| share.min(MOST))
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;

    use super::*;

    /// Returns residuals of 40 joints over 60 instants, with noise and with a constant error for each joint.
    fn residuals(noise: f64, bias: f64) -> Vec<Vec<Vector2<f64>>> {
        let mut random = Rng::with_seed(3);
        let mut normal = || (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
        let mut of_joint = || {
            let always = bias * Vector2::new(normal(), normal());
            let each = (0..60).map(|_| always + noise * Vector2::new(normal(), normal()));
            each.collect()
        };
        (0..40).map(|_| of_joint()).collect()
    }

    #[test]
    fn a_constant_error_of_joints_is_distinguished_from_noise() {
        let found = share_of(&residuals(0.006, 0.008)).unwrap();
        assert!((0.006..0.010).contains(&found), "{found}");
        let noise = share_of(&residuals(0.006, 0.0));
        assert!(noise.is_none_or(|noise| noise < 0.001), "{noise:?}");
        assert_eq!(share_of(&residuals(0.0, 0.0)), None);
        assert_eq!(share_of(&residuals(0.0, 1.0)), Some(MOST));
        assert_eq!(share_of(&[]), None);
    }

    #[test]
    fn a_rarely_seen_joint_has_no_constant_error() {
        let seen = |camera| super::super::instant::Seen {
            camera,
            point: 0,
            at: nalgebra::Point2::origin(),
            speed: Vector2::zeros(),
            sigma_px: 1.0,
        };
        let instant = |nth| Instant {
            nth,
            joints: vec![2],
            points: vec![nalgebra::Point3::origin()],
            shares: vec![1.0],
            seen: if nth < LEAST - 1 {
                vec![seen(0), seen(1)]
            } else {
                vec![seen(0)]
            },
        };
        let instants: Vec<Instant> = (0..LEAST).map(instant).collect();
        let mut biases = Biases::new(5, &[2.0, 2.0], &instants);
        assert_eq!(biases.n_parameters(), 2);
        biases.step(&[0.0, 0.0, 0.0, 0.0, 0.0, 1.5, -2.5]);
        assert_eq!(biases.of(0, 2), Vector2::new(1.5, -2.5));
        assert_eq!(biases.of(1, 2), Vector2::zeros());
        assert_eq!(biases.of(0, 9), Vector2::zeros());
        let mut squares = 0.0;
        biases.priors(&mut |term| squares += term.square());
        assert_eq!(squares, (1.5_f64.powi(2) + 2.5_f64.powi(2)) / 4.0);
    }
}
