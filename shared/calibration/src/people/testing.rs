//! A simulated walking person, as seen by a ring of cameras.

use core::f64::consts::TAU;

use crate::synchronisation::{Film, Joint, Person, Shot};
use fastrand::Rng;
use geometry::{Camera, Intrinsics, Lens, LensModel};
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

pub(crate) const N_JOINTS: usize = 14;
pub(crate) const RADIUS: f64 = 5.0;

/// Returns, for each joint, the index of the corresponding joint on the other side of the body.
pub(crate) fn sides() -> Vec<usize> {
    vec![5, 4, 3, 2, 1, 0, 11, 10, 9, 8, 7, 6, 12, 13]
}

/// Returns a camera at a position, looking at a point 0.9 m above the origin.
pub(crate) fn looking(name: String, centre: Vector3<f64>, lens: LensModel) -> Camera {
    let forward = Vector3::new(0.0, 0.0, 0.9) - centre;
    let forward = forward / forward.norm();
    let right = forward.cross(&Vector3::z());
    let right = right / right.norm();
    let down = forward.cross(&right);
    let matrix = Matrix3::from_rows(&[right.transpose(), down.transpose(), forward.transpose()]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    Camera {
        name,
        intrinsics: Intrinsics {
            fx: 900.0,
            fy: 900.0,
            cx: 499.5,
            cy: 499.5,
            size: [1000, 1000],
            lens: Lens::new(lens),
        },
        camera_from_world: Isometry3::from_parts(Translation3::from(rotation * -centre), rotation),
    }
}

/// Returns `n` cameras in a ring, at different heights.
pub(crate) fn ring(n: usize) -> Vec<Camera> {
    let lens = LensModel::BrownConrady {
        k: [-0.05, 0.02, 0.0, 0.0, 0.0, 0.0],
        p: [0.0005, 0.0],
    };
    let camera = |nth: usize| {
        let angle = (0.3 + nth as f64) / n as f64 * TAU;
        let height = 1.4 + 0.5 * (nth % 3) as f64;
        let centre = Vector3::new(RADIUS * angle.cos(), RADIUS * angle.sin(), height);
        looking(format!("cam{nth}"), centre, lens)
    };
    (0..n).map(camera).collect()
}

/// Returns a person at a position, facing a direction, in a phase of a step. The person is 1.75 m tall, with bones of constant lengths.
fn stepping([x, y]: [f64; 2], turn: f64, phase: f64) -> [[f64; 3]; N_JOINTS] {
    let swing = 0.45 * phase.sin();
    let legs = |sign: f64| {
        // The hip is above the floor; thigh and shank are 0.43 m each, and the knee bends while the leg swings.
        let hip = [0.0, -0.09 * sign, 0.92];
        let angle = sign * swing;
        let bend = 0.9 * (sign * phase.cos()).max(0.0);
        let knee = [0.43 * angle.sin(), hip[1], hip[2] - 0.43 * angle.cos()];
        let shank = angle - bend;
        let ankle = [
            knee[0] + 0.43 * shank.sin(),
            hip[1],
            knee[2] - 0.43 * shank.cos(),
        ];
        [ankle, knee, hip]
    };
    let arms = |sign: f64| {
        let shoulder = [0.0, -0.17 * sign, 1.43];
        let angle = -sign * swing;
        let elbow = [
            0.32 * angle.sin(),
            shoulder[1],
            shoulder[2] - 0.32 * angle.cos(),
        ];
        let fore = angle + 0.6;
        let wrist = [
            elbow[0] + 0.25 * fore.sin(),
            shoulder[1],
            elbow[2] - 0.25 * fore.cos(),
        ];
        [wrist, elbow, shoulder]
    };
    let [ra, rk, rh] = legs(1.0);
    let [la, lk, lh] = legs(-1.0);
    let [rw, re, rs] = arms(1.0);
    let [lw, le, ls] = arms(-1.0);
    let body = [
        ra,
        rk,
        rh,
        lh,
        lk,
        la,
        rw,
        re,
        rs,
        ls,
        le,
        lw,
        [0.0, 0.0, 1.45],
        [0.03, 0.0, 1.75],
    ];
    // The lower ankle stands on the floor.
    let lift = ra[2].min(la[2]) - 0.07;
    body.map(|[forward, left, up]| {
        let (sin, cos) = turn.sin_cos();
        [
            x + forward * cos - left * sin,
            y + forward * sin + left * cos,
            up - lift,
        ]
    })
}

/// Returns a person who walks a figure of eight around the origin, and stops now and then.
pub(crate) fn walker(time_s: f64, size: f64) -> [[f64; 3]; N_JOINTS] {
    // The person stops for 0.4 s every two seconds.
    let way = |time_s: f64| {
        let share = (time_s.rem_euclid(2.0) / 1.6).min(1.0);
        2.0 * ((time_s / 2.0).floor() + share * share * (3.0 - 2.0 * share))
    };
    let place = |way: f64| {
        [
            1.4 * size * (0.7 * way).sin(),
            1.0 * size * (1.4 * way).sin(),
        ]
    };
    let (now, next) = (place(way(time_s)), place(way(time_s) + 0.01));
    let turn = (next[1] - now[1]).atan2(next[0] - now[0]);
    stepping(now, turn, TAU * 0.95 * way(time_s))
}

/// Simulated flaws of the cameras and of the joint detector.
#[derive(Debug, Clone)]
pub(crate) struct Flaws {
    pub(crate) seconds: f64,
    pub(crate) noise_px: f64,
    pub(crate) missing: f64,
    pub(crate) wrong: f64,
    pub(crate) exchanged: f64,
    pub(crate) offsets_s: Vec<f64>,
    /// Size of the figure of eight.
    pub(crate) size: f64,
    pub(crate) seed: u64,
}

impl Flaws {
    pub(crate) fn none(seed: u64) -> Self {
        Self {
            seconds: 12.0,
            noise_px: 1.0,
            missing: 0.0,
            wrong: 0.0,
            exchanged: 0.0,
            offsets_s: Vec::new(),
            size: 1.0,
            seed,
        }
    }

    /// Returns typical flaws: left and right swapped in 5 % of the pictures, 10 % of the joints wrong, 10 % missing, and 3 px of noise.
    pub(crate) fn usual(seed: u64) -> Self {
        Self {
            noise_px: 3.0,
            missing: 0.1,
            wrong: 0.1,
            exchanged: 0.05,
            ..Self::none(seed)
        }
    }

    pub(crate) fn films(&self, cameras: &[Camera]) -> Vec<Film> {
        let mut random = Rng::with_seed(self.seed);
        let each = cameras.iter().enumerate();
        each.map(|(nth, camera)| self.film(nth, camera, &mut random)).collect()
    }

    fn film(&self, nth: usize, camera: &Camera, random: &mut Rng) -> Film {
        const RATE_HZ: f64 = 15.0;
        let offset_s = self.offsets_s.get(nth).copied().unwrap_or(0.0);
        let start = 3.0 * self.seed as f64;
        let mut shots = Vec::new();
        for index in 0..(self.seconds * RATE_HZ) as usize {
            let time_s = index as f64 / RATE_HZ;
            let joints = walker(start + time_s + offset_s, self.size);
            let is_exchanged = random.f64() < self.exchanged;
            let mut normal = || (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
            let noise: Vec<[f64; 2]> = joints.iter().map(|_| [normal(), normal()]).collect();
            let joint = |joint: usize| {
                let from = if is_exchanged { sides()[joint] } else { joint };
                let at = camera.project(&Point3::from(joints[from]))?;
                let mut at = [0, 1].map(|axis| at[axis] + self.noise_px * noise[joint][axis]);
                if random.f64() < self.wrong {
                    at = at.map(|at| at + 250.0 * (random.f64() - 0.5));
                }
                let is_seen = random.f64() >= self.missing
                    && at.iter().all(|coordinate| (0.0..1000.0).contains(coordinate));
                is_seen.then_some(Joint { at, score: 0.9 })
            };
            let person = Person {
                joints: (0..N_JOINTS).map(joint).collect(),
            };
            shots.push(Shot {
                time_s,
                people: vec![person],
            });
        }
        Film { shots }
    }
}
