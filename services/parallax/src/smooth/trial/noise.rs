//! The errors that measured joints have, put on true ones.

use fastrand::Rng;
use motion::{Joint, Measured, Recorded, Role, Sides};
use nalgebra::{Matrix3, Rotation3, Vector3};
use scene::truth::N_JOINTS;
use skeleton::PARSE14;

/// The errors. None of these numbers is known to a smoother.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flaws {
    /// Standard deviation of the position of a joint, root mean square over axes, metres.
    pub sd_m: f64,
    /// Share of the variance that stays from frame to frame, forgotten over [`Self::slow_s`].
    pub slow_share: f64,
    /// For how long, seconds.
    pub slow_s: f64,
    /// Share of measurements with five times the error.
    pub heavy_share: f64,
    /// How often a joint is lost, per second, and for how long at most, seconds.
    pub losses: [f64; 2],
    /// How often the joints of both arms or legs are exchanged, per second, and for how long at most, seconds.
    pub exchanges: [f64; 2],
}

impl Flaws {
    /// Errors of a size, with all that comes with them.
    pub fn of(sd_m: f64) -> Self {
        Self {
            sd_m,
            slow_share: 0.3,
            slow_s: 0.1,
            heavy_share: 0.03,
            losses: [0.2, 0.4],
            exchanges: [0.1, 0.1],
        }
    }
}

/// A standard normal number (Box & Muller 1958).
fn normal(random: &mut Rng) -> f64 {
    let radius = (-2.0 * (1.0 - random.f64()).ln()).sqrt();
    radius * (core::f64::consts::TAU * random.f64()).cos()
}

/// The true joints as they would be measured.
///
/// The covariances that come with them are right up to one factor between a quarter and four, as those of triangulation are.
pub(super) fn recorded(
    times: &[f64],
    truth: &[[[f64; 3]; N_JOINTS]],
    flaws: &Flaws,
    seed: u64,
) -> Recorded {
    let mut random = Rng::with_seed(seed);
    let dt = if times.len() > 1 {
        times[1] - times[0]
    } else {
        1.0
    };
    let told = 4.0_f64.powf(2.0 * random.f64() - 1.0);
    let mut joints: Vec<Joint> = Vec::new();
    for (nth, joint) in PARSE14.joints.iter().enumerate() {
        let path: Vec<Vector3<f64>> = truth.iter().map(|it| it[nth].into()).collect();
        joints.push(Joint {
            name: joint.name.to_owned(),
            role: Role::of(joint.name),
            measured: measured(&path, dt, flaws, told, &mut random),
        });
    }
    exchange(&mut joints, dt, flaws, &mut random);
    Recorded {
        times: times.to_vec(),
        sides: vec![Sides::Sure; times.len()],
        joints,
    }
}

fn measured(
    path: &[Vector3<f64>],
    dt: f64,
    flaws: &Flaws,
    told: f64,
    random: &mut Rng,
) -> Vec<Option<Measured>> {
    // Twice as uncertain in one direction, as of cameras that stand to one side.
    let size = flaws.sd_m * (0.7 + 0.6 * random.f64()) / 2.0_f64.sqrt();
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), core::f64::consts::PI * random.f64());
    let axes = turn.matrix() * Matrix3::from_diagonal(&Vector3::new(2.0, 1.0, 1.0)) * size;
    let kept = (-dt / flaws.slow_s).exp();
    let [slow, fast] = [flaws.slow_share.sqrt(), (1.0 - flaws.slow_share).sqrt()];
    let mut drift = Vector3::from_fn(|_, _| normal(random));
    let mut lost_for = 0.0;
    let mut all = Vec::with_capacity(path.len());
    for position in path {
        let step = Vector3::from_fn(|_, _| normal(random));
        drift = drift * kept + step * (1.0 - kept * kept).sqrt();
        let white = Vector3::from_fn(|_, _| normal(random));
        let is_heavy = random.f64() < flaws.heavy_share;
        let error = (drift * slow + white * fast) * if is_heavy { 5.0 } else { 1.0 };
        // What triangulation says of its errors varies from frame to frame.
        let varied = told * (0.3 * normal(random)).exp();
        lost_for -= dt;
        if random.f64() < flaws.losses[0] * dt {
            lost_for = flaws.losses[1] * random.f64();
        }
        all.push((lost_for <= 0.0).then(|| Measured {
            position: position + axes * error,
            covariance: Some(axes * axes.transpose() * varied),
        }));
    }
    all
}

/// Exchanges the joints of both arms, or of both legs, for a while.
fn exchange(joints: &mut [Joint], dt: f64, flaws: &Flaws, random: &mut Rng) {
    const LIMBS: [[[usize; 2]; 2]; 2] = [[[0, 5], [1, 4]], [[6, 11], [7, 10]]];
    for limb in LIMBS {
        let mut for_s = 0.0;
        let n = joints.first().map_or(0, |it| it.measured.len());
        for at in 0..n {
            for_s -= dt;
            if random.f64() < flaws.exchanges[0] * dt {
                for_s = (flaws.exchanges[1] * random.f64()).max(dt * 0.5);
            }
            if for_s > 0.0 {
                for [a, b] in limb {
                    let kept = joints[a].measured[at];
                    joints[a].measured[at] = joints[b].measured[at];
                    joints[b].measured[at] = kept;
                }
            }
        }
    }
}
