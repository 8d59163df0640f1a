//! Cloth: its colours, its pattern and its folds.

use nalgebra::{Vector2, Vector3};

use crate::colour::{Linear, srgb};
use crate::random::{Random, noise};

/// The pattern of a fabric.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Pattern {
    Plain,
    /// Stripes around the body, with their number per metre.
    Stripes(f32),
    /// Stripes along the body, with their number per metre.
    Bars(f32),
    Checks(f32),
    /// A mixture of threads of two colours.
    Melange,
    Blotches(f32),
    /// One broad stripe at this height above the hips, in metres.
    Band(f32),
}

impl Pattern {
    /// The patterns for tops, from which one is chosen; plain patterns are listed more often.
    pub(crate) const ON_TOPS: &'static [Self] = &[
        Self::Plain,
        Self::Plain,
        Self::Plain,
        Self::Melange,
        Self::Stripes(14.0),
        Self::Stripes(26.0),
        Self::Bars(30.0),
        Self::Checks(18.0),
        Self::Blotches(16.0),
        Self::Band(0.36),
    ];
    pub(crate) const ON_BOTTOMS: &'static [Self] = &[
        Self::Plain,
        Self::Plain,
        Self::Plain,
        Self::Melange,
        Self::Melange,
        Self::Bars(24.0),
        Self::Checks(30.0),
    ];
}

/// A piece of cloth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fabric {
    colour: Linear,
    second: Linear,
    pattern: Pattern,
    /// Strength of the effect of folds on the surface normal.
    folds: f32,
    seed: u32,
}

impl Fabric {
    pub(crate) const TOPS: &'static [[u8; 3]] = &[
        [232, 230, 224],
        [40, 42, 48],
        [150, 30, 36],
        [46, 78, 140],
        [70, 120, 78],
        [200, 170, 70],
        [128, 130, 134],
        [120, 70, 110],
        [210, 120, 70],
        [90, 150, 190],
        [170, 180, 190],
        [60, 64, 44],
    ];
    pub(crate) const BOTTOMS: &'static [[u8; 3]] = &[
        [44, 56, 84],
        [70, 88, 124],
        [30, 30, 34],
        [120, 108, 88],
        [86, 84, 82],
        [168, 156, 132],
        [60, 48, 42],
        [44, 60, 50],
    ];

    pub(crate) fn any(random: &mut Random, colours: &[[u8; 3]], patterns: &[Pattern]) -> Self {
        let colour = srgb(*random.pick(colours)) * random.range(0.85, 1.15) as f32;
        let second = if random.chance(0.5) {
            srgb(*random.pick(colours))
        } else {
            colour * random.range(0.35, 0.7) as f32
        };
        Self {
            colour,
            second,
            pattern: *random.pick(patterns),
            folds: random.range(0.25, 0.6) as f32,
            seed: random.bits() as u32,
        }
    }

    /// Returns the colour at a point.
    ///
    /// * `at`: position around the body and along it, in metres of the cloth.
    /// * `place`: position on the body at rest, in metres.
    pub(crate) fn colour(&self, at: Vector2<f32>, place: &Vector3<f32>) -> Linear {
        let odd = |value: f32| value.rem_euclid(1.0) < 0.5;
        let second = match self.pattern {
            Pattern::Plain => 0.0,
            Pattern::Stripes(per_metre) => f32::from(odd(at.y * per_metre)),
            Pattern::Bars(per_metre) => f32::from(odd(at.x * per_metre)),
            Pattern::Checks(per_metre) => {
                0.5 * (f32::from(odd(at.x * per_metre)) + f32::from(odd(at.y * per_metre)))
            }
            Pattern::Melange => 0.25 + 0.25 * noise(&(place * 250.0), self.seed),
            Pattern::Blotches(per_metre) => {
                f32::from(noise(&(place * per_metre), self.seed) > 0.15)
            }
            Pattern::Band(height) => f32::from((at.y - height).abs() < 0.06),
        };
        let worn = 1.0 + 0.08 * noise(&(place * 9.0), self.seed ^ 1);
        (self.colour + (self.second - self.colour) * second) * worn
    }

    /// Returns what the folds add to the normal, in the frame of the body at rest.
    pub(crate) fn folds(&self, place: &Vector3<f32>) -> Vector3<f32> {
        // Folds run across limbs more than along them.
        let at = Vector3::new(place.x * 13.0, place.y * 13.0, place.z * 22.0);
        let turn = Vector3::new(
            noise(&at, self.seed ^ 2),
            noise(&at, self.seed ^ 3),
            noise(&at, self.seed ^ 4),
        );
        turn * self.folds
    }
}
