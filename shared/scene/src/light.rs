//! The light of a room: a key lamp that casts shadows, a fill lamp, and ambient light.

use nalgebra::{Vector2, Vector3};

use crate::colour::Linear;
use crate::random::Random;

/// The light of a room, in the frame of the stage, z up.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Light {
    /// Unit vector to the key lamp, which casts the shadows. Its rays are parallel.
    pub(crate) to_key: Vector3<f32>,
    pub(crate) key: Linear,
    to_fill: Vector3<f32>,
    fill: Linear,
    /// Ambient light that comes from above; the next field is the light from below.
    sky: Linear,
    ground: Linear,
    /// Two axes perpendicular to the rays of the key lamp.
    across: [Vector3<f32>; 2],
}

impl Light {
    /// Creates random lamps.
    pub(crate) fn new(mut random: Random) -> Self {
        let bearing = random.range(0.0, core::f64::consts::TAU);
        let height = random.range(48.0, 70.0_f64).to_radians();
        let direction = |bearing: f64, height: f64| {
            let (sin, cos) = height.sin_cos();
            Vector3::new(cos * bearing.cos(), cos * bearing.sin(), sin).cast::<f32>()
        };
        let warmth = random.range(-0.08, 0.12) as f32;
        let tint = |warmth: f32| Linear::new(1.0 + warmth, 1.0, 1.0 - warmth);
        let contrast = random.range(0.8, 1.5) as f32;
        let to_key = direction(bearing, height);
        let first = to_key.cross(&Vector3::z()).try_normalize(1e-6);
        let first = first.unwrap_or(Vector3::x());
        let fill_bearing = bearing + random.range(1.6, 3.4);
        Self {
            to_key,
            key: tint(warmth) * contrast * 0.62,
            to_fill: direction(fill_bearing, random.range(0.1, 0.5)),
            fill: tint(-0.5 * warmth) * random.range(0.12, 0.3) as f32,
            sky: tint(-0.3 * warmth) * random.range(0.36, 0.5) as f32,
            ground: tint(0.05) * random.range(0.14, 0.24) as f32,
            across: [first, to_key.cross(&first)],
        }
    }

    /// Returns the light on a surface with the given normal, without the key lamp.
    pub(crate) fn around(&self, normal: &Vector3<f32>) -> Linear {
        let up = 0.5 + 0.5 * normal.z;
        let fill = normal.dot(&self.to_fill).max(0.0);
        self.ground + (self.sky - self.ground) * up + self.fill * fill
    }

    /// Returns the light of the key lamp on a surface with the given normal that is not in shadow.
    pub(crate) fn direct(&self, normal: &Vector3<f32>) -> Linear {
        self.key * normal.dot(&self.to_key).max(0.0)
    }

    /// Returns the coordinates of a point perpendicular to the rays of the key lamp, and along the rays towards the lamp, in metres.
    pub(crate) fn beam(&self, at: &Vector3<f32>) -> (Vector2<f32>, f32) {
        let [a, b] = self.across;
        (Vector2::new(at.dot(&a), at.dot(&b)), at.dot(&self.to_key))
    }
}
