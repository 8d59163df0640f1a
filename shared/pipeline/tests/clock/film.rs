//! Moving people, and their joints as seen by cameras with noise and with separate clocks.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use geometry::Camera;
use nalgebra::{Point2, Point3, Vector2};
use scene::{Action, RigChoice, Scene, Settings};
use skeleton::PARSE14;

/// Number of joints in `skeleton::PARSE14`.
pub(crate) const N: usize = PARSE14.joints.len();
/// Frames per second.
pub(crate) const RATE_HZ: f64 = 30.0;

/// A person in front of a rig.
pub(crate) struct Film {
    scene: Arc<Scene>,
    cameras: Vec<Camera>,
    /// Standard deviation of a joint in a picture along each axis, in pixels.
    pub(crate) noise_px: f64,
    random: Random,
}

impl Film {
    /// * `seed`: seed of the person, the motion and the noise.
    pub(crate) fn new(rig: &str, action: Action, seed: u64) -> Self {
        let rig = RigChoice::parse(rig).expect("a rig");
        let cameras = rig.rig().expect("a rig").cameras().to_vec();
        Self {
            scene: scene_of(rig, action, seed),
            cameras,
            noise_px: 2.5,
            random: Random::new(seed),
        }
    }

    /// Restarts the noise with another seed.
    pub(crate) fn reseed(&mut self, seed: u64) {
        self.random = Random::new(seed);
    }

    pub(crate) fn cameras(&self) -> &[Camera] {
        &self.cameras
    }

    /// True positions of the joints at a time.
    pub(crate) fn truth(&self, seconds: f64) -> [Point3<f64>; N] {
        self.scene.joints(seconds).map(Point3::from)
    }

    /// Draws the noise of a picture.
    pub(crate) fn noise(&mut self) -> [Vector2<f64>; N] {
        let mut one = || self.random.normal() * self.noise_px;
        core::array::from_fn(|_| Vector2::new(one(), one()))
    }

    /// Returns the joints that a camera sees at a time.
    pub(crate) fn see(
        &self,
        camera: &Camera,
        seconds: f64,
        noise: &[Vector2<f64>; N],
    ) -> [Point2<f64>; N] {
        let joints = self.truth(seconds);
        core::array::from_fn(|joint| {
            camera.project(&joints[joint]).expect("in view") + noise[joint]
        })
    }
}

/// Cached scenes, keyed by whether the rig is a ring, by action and by seed.
type Made = BTreeMap<(bool, &'static str, u64), Arc<Scene>>;

/// Returns a scene from the cache, since creating one takes a while. All rings are around the same place.
fn scene_of(rig: RigChoice, action: Action, seed: u64) -> Arc<Scene> {
    static MADE: Mutex<Made> = Mutex::new(Made::new());
    let is_ring = matches!(rig, RigChoice::Ring { .. });
    let settings = Settings {
        rig,
        action,
        seed,
        subject: seed,
        ..Settings::default()
    };
    let mut made = MADE.lock().expect("no test panics in here");
    let make = || Arc::new(Scene::new(&settings).expect("a scene"));
    let scene = made.entry((is_ring, action.name(), seed)).or_insert_with(make);
    Arc::clone(scene)
}

/// Pseudorandom numbers that are the same in every run.
struct Random(u64);

impl Random {
    fn new(seed: u64) -> Self {
        let mut random = Self(seed);
        // The first numbers of neighbouring seeds are similar.
        (0..20).for_each(|_| {
            random.unit();
        });
        random
    }

    /// Draws from the uniform distribution between 0 and 1.
    fn unit(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// Draws from a normal distribution of mean 0 and standard deviation 1.
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.unit().ln()).sqrt();
        radius * (core::f64::consts::TAU * self.unit()).cos()
    }
}
