//! Simulated people who move, as seen by cameras with clocks of their own.

use geometry::{Camera, Intrinsics, Lens, LensModel};
use nalgebra::{
    Isometry3, Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3,
};

use crate::synchronisation::{Film, Joint, Person, Settings, Shot};

/// Number of joints of the simulated people, as in `skeleton::PARSE14`.
pub(crate) const N_JOINTS: usize = 14;

/// Positions of the joints of all people at a time, in metres.
pub(crate) type Movement = dyn Fn(f64) -> Vec<[[f64; 3]; N_JOINTS]>;

/// Returns `n` cameras of 1000 x 1000 pixels around the origin, five metres away and 1.6 m high.
pub(crate) fn ring(n: usize) -> Vec<Camera> {
    let camera = |nth: usize| {
        let angle = (0.3 + nth as f64) / n as f64 * core::f64::consts::TAU;
        let centre = Vector3::new(5.0 * angle.cos(), 5.0 * angle.sin(), 1.6);
        let forward = Unit::new_normalize(Vector3::new(0.0, 0.0, 0.9) - centre);
        let right = Unit::new_normalize(forward.cross(&Vector3::z()));
        let down = forward.cross(&right);
        let rotation =
            Matrix3::from_rows(&[right.transpose(), down.transpose(), forward.transpose()]);
        let rotation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        Camera {
            name: format!("cam{nth}"),
            intrinsics: Intrinsics {
                fx: 900.0,
                fy: 900.0,
                cx: 499.5,
                cy: 499.5,
                size: [1000, 1000],
                lens: Lens::new(LensModel::Pinhole),
            },
            camera_from_world: Isometry3::from_parts(
                Translation3::from(rotation * -centre),
                rotation,
            ),
        }
    };
    (0..n).map(camera).collect()
}

/// Returns a person at a position, facing a direction, in a phase of a step.
pub(crate) fn stepping(
    [x, y]: [f64; 2],
    turn: f64,
    phase: f64,
    stride: f64,
) -> [[f64; 3]; N_JOINTS] {
    let swing = stride * phase.sin();
    let lift = 0.03 * stride * (2.0 * phase).cos();
    // The axes are forwards, left, and up.
    let body = [
        [
            -0.35 * swing,
            -0.1,
            0.08 + 0.12 * stride * (-phase.cos()).max(0.0),
        ],
        [-0.15 * swing, -0.1, 0.5],
        [0.0, -0.1, 0.95 + lift],
        [0.0, 0.1, 0.95 + lift],
        [0.15 * swing, 0.1, 0.5],
        [
            0.35 * swing,
            0.1,
            0.08 + 0.12 * stride * phase.cos().max(0.0),
        ],
        [0.3 * swing + 0.1, -0.3, 0.9],
        [0.12 * swing, -0.28, 1.15],
        [0.0, -0.2, 1.42 + lift],
        [0.0, 0.2, 1.42 + lift],
        [-0.12 * swing, 0.28, 1.15],
        [-0.3 * swing + 0.1, 0.3, 0.9],
        [0.02, 0.0, 1.5 + lift],
        [0.05, 0.0, 1.72 + lift],
    ];
    body.map(|[forward, left, up]| {
        let (sin, cos) = turn.sin_cos();
        [
            x + forward * cos - left * sin,
            y + forward * sin + left * cos,
            up,
        ]
    })
}

/// Returns a person who walks a figure of eight around the origin, at a varying speed.
pub(crate) fn walker(time_s: f64) -> [[f64; 3]; N_JOINTS] {
    let way = |time_s: f64| time_s + 0.25 * (0.7 * time_s).sin();
    let place = |way: f64| [1.2 * (0.7 * way).sin(), 0.8 * (1.4 * way).sin()];
    let (now, next) = (place(way(time_s)), place(way(time_s + 0.01)));
    let turn = (next[1] - now[1]).atan2(next[0] - now[0]);
    stepping(now, turn, core::f64::consts::TAU * 0.95 * way(time_s), 1.0)
}

/// Simulated recording of the scene by the cameras.
#[derive(Debug, Clone)]
pub(crate) struct Recording {
    pub(crate) rates_hz: Vec<f64>,
    pub(crate) offsets_s: Vec<f64>,
    pub(crate) drifts: Vec<f64>,
    /// Start and end on the common clock.
    pub(crate) span: [f64; 2],
    pub(crate) noise_px: f64,
    /// Fractions of joints that are missing, of joints that are displaced, and of pictures in which left and right are swapped.
    pub(crate) missing: f64,
    pub(crate) outliers: f64,
    pub(crate) exchanged: f64,
    pub(crate) seed: u64,
}

impl Recording {
    /// Returns a recording with 30 pictures per second for some seconds, without flaws.
    pub(crate) fn of(n: usize, seconds: f64) -> Self {
        Self {
            rates_hz: vec![30.0; n],
            offsets_s: vec![0.0; n],
            drifts: vec![0.0; n],
            span: [0.0, seconds],
            noise_px: 0.0,
            missing: 0.0,
            outliers: 0.0,
            exchanged: 0.0,
            seed: 1,
        }
    }

    /// Adds the typical flaws of joint detectors.
    pub(crate) fn flawed(self, seed: u64) -> Self {
        Self {
            noise_px: 2.5,
            missing: 0.1,
            outliers: 0.1,
            exchanged: 0.05,
            seed,
            ..self
        }
    }

    /// Returns the films. Every camera begins at its own time 0 and covers the span.
    pub(crate) fn films(&self, cameras: &[Camera], movement: &Movement) -> Vec<Film> {
        let mut random = fastrand::Rng::with_seed(self.seed);
        let mut normal = move || -> f64 {
            let sum: f64 = (0..12).map(|_| random.f64()).sum();
            sum - 6.0
        };
        let mut dice = fastrand::Rng::with_seed(self.seed + 1000);
        let mut films = Vec::new();
        for (nth, camera) in cameras.iter().enumerate() {
            let (offset_s, drift) = (self.offsets_s[nth], self.drifts[nth]);
            let own = |common_s: f64| (common_s - offset_s) / (1.0 + drift);
            let first = (own(self.span[0]) * self.rates_hz[nth]).ceil() as i64;
            let last = (own(self.span[1]) * self.rates_hz[nth]).floor() as i64;
            let mut shots = Vec::new();
            for index in first..=last {
                let time_s = index as f64 / self.rates_hz[nth];
                let people = movement(time_s * (1.0 + drift) + offset_s);
                let person = |joints: &[[f64; 3]; N_JOINTS]| {
                    let exchanged = dice.f64() < self.exchanged;
                    let joint = |joint: usize| {
                        let from = if exchanged { mirror()[joint] } else { joint };
                        let at = camera.project(&Point3::from(joints[from]))?;
                        if dice.f64() < self.missing {
                            return None;
                        }
                        let mut at = [
                            at.x + self.noise_px * normal(),
                            at.y + self.noise_px * normal(),
                        ];
                        if dice.f64() < self.outliers {
                            at = [
                                at[0] + 200.0 * (dice.f64() - 0.5),
                                at[1] + 200.0 * (dice.f64() - 0.5),
                            ];
                        }
                        Some(Joint { at, score: 0.9 })
                    };
                    Person {
                        joints: (0..N_JOINTS).map(joint).collect(),
                    }
                };
                shots.push(Shot {
                    time_s,
                    people: people.iter().map(person).collect(),
                });
            }
            films.push(Film { shots });
        }
        films
    }
}

/// Returns, for each joint, the index of the corresponding joint on the other side of the body.
pub(crate) fn mirror() -> [usize; N_JOINTS] {
    [5, 4, 3, 2, 1, 0, 11, 10, 9, 8, 7, 6, 12, 13]
}

/// Returns the usual settings.
pub(crate) fn settings(window_s: f64) -> Settings {
    Settings {
        reference: 0,
        window_s,
        mirror: None,
        n_joints: N_JOINTS,
    }
}
