//! The appearance of a person: skin, hair, face and cloth, at points of the body at rest.

use nalgebra::{Isometry3, Point3, Vector2, Vector3};

use crate::body::{FOOT, HAND, HEAD, N_BONES, PELVIS, THIGH, UPPER_ARM};
use crate::colour::{Linear, srgb};
use crate::random::noise;
use crate::shape::BodyShape;
use crate::subject::Subject;

/// Material of a point of the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Finish {
    pub(crate) colour: Linear,
    /// Fraction of the light that is reflected specularly.
    pub(crate) gloss: f32,
    /// Vector that is added to the normal of the body at rest.
    pub(crate) bump: Vector3<f32>,
}

/// The clothes and the skin of a person on their body at rest.
#[derive(Debug, Clone)]
pub(crate) struct Wear {
    subject: Subject,
    /// Line from shoulder to wrist on both sides, at rest; the next field is the line from hip to ankle.
    arms: [[Point3<f32>; 2]; 2],
    legs: [[Point3<f32>; 2]; 2],
    head_from_rest: Isometry3<f32>,
    hips: f32,
    scale: f32,
}

impl Wear {
    pub(crate) fn new(subject: &Subject, shape: &BodyShape) -> Self {
        let joint = |bone: usize| Point3::from(shape.frames[bone].translation.vector.cast::<f32>());
        let limbs = |from: [usize; 2], to: [usize; 2]| {
            [0, 1].map(|side| [joint(from[side]), joint(to[side])])
        };
        Self {
            subject: subject.clone(),
            arms: limbs(UPPER_ARM, HAND),
            legs: limbs(THIGH, FOOT),
            head_from_rest: shape.frames[HEAD].cast().inverse(),
            hips: joint(PELVIS).z,
            scale: shape.height / 1.75,
        }
    }

    /// Returns the material at a point of the body at rest.
    ///
    /// * `bone`: the bone that the point follows.
    pub(crate) fn finish(&self, at: &Point3<f32>, bone: usize) -> Finish {
        debug_assert!(bone < N_BONES, "a bone");
        let side = usize::from(at.y < 0.0);
        match bone {
            3 | HEAD => self.head(at),
            6 | 7 | 10 | 11 => self.arm(at, side),
            8 | 12 => self.skin(at),
            13..=18 => self.leg(at, side),
            _ => self.trunk(at),
        }
    }

    fn skin(&self, at: &Point3<f32>) -> Finish {
        let blotch = 1.0 + 0.06 * noise(&(at.coords * 25.0), 5);
        Finish {
            colour: self.subject.skin * blotch,
            gloss: 0.035,
            bump: Vector3::zeros(),
        }
    }

    fn cloth(&self, is_top: bool, along: Vector2<f32>, at: &Point3<f32>) -> Finish {
        let fabric = if is_top {
            &self.subject.top.fabric
        } else {
            &self.subject.bottom.fabric
        };
        Finish {
            colour: fabric.colour(along, &at.coords),
            gloss: 0.01,
            bump: fabric.folds(&at.coords),
        }
    }

    fn trunk(&self, at: &Point3<f32>) -> Finish {
        let above = at.z - self.hips;
        let around = at.y.atan2(at.x) * 0.15;
        let along = Vector2::new(around, above);
        // The neckline is lower in front.
        let neckline = self.scale * (0.505 - 0.25 * (at.x - 0.02).max(0.0));
        if above > neckline - 1.6 * (at.y.abs() - 0.07).min(0.0).abs() * f32::from(at.x > 0.0) * 0.2
            && at.y.abs() < 0.085 * self.scale
        {
            return self.skin(at);
        }
        let hem = -self.subject.top.hem + 0.008 * noise(&(at.coords * 12.0), 9);
        let is_belt = above < hem && above > hem - 0.035 && self.subject.top.hem < -0.02;
        if is_belt && !self.subject.bottom.is_skirt {
            return Finish {
                colour: srgb([40, 30, 24]),
                gloss: 0.05,
                bump: Vector3::zeros(),
            };
        }
        self.cloth(above > hem, along, at)
    }

    /// Returns the position along a limb as a fraction, and the positions around and along it in metres.
    fn along(limb: &[Point3<f32>; 2], at: &Point3<f32>) -> (f32, Vector2<f32>) {
        let axis = limb[1] - limb[0];
        let from = at - limb[0];
        let share = from.dot(&axis) / axis.norm_squared();
        let off = from - axis * share;
        let across = axis.cross(&Vector3::x()).try_normalize(1e-6).unwrap_or(Vector3::y());
        let around = off.x.atan2(off.dot(&across)) * 0.06;
        (share, Vector2::new(around, share * axis.norm()))
    }

    fn arm(&self, at: &Point3<f32>, side: usize) -> Finish {
        let (share, along) = Self::along(&self.arms[side], at);
        let edge = self.subject.top.sleeve + 0.006 * noise(&(at.coords * 20.0), 8);
        if share < edge {
            self.cloth(true, along, at)
        } else {
            self.skin(at)
        }
    }

    fn leg(&self, at: &Point3<f32>, side: usize) -> Finish {
        let (share, along) = Self::along(&self.legs[side], at);
        let above = at.z - self.hips;
        if above > -self.subject.top.hem {
            return self.trunk(at);
        }
        if share < self.subject.bottom.leg {
            self.cloth(false, along, at)
        } else if share > 0.965 {
            Finish {
                colour: self.subject.shoes * (1.0 + 0.1 * noise(&(at.coords * 40.0), 3)),
                gloss: 0.06,
                bump: Vector3::zeros(),
            }
        } else if share > 0.92 {
            Finish {
                colour: srgb([200, 198, 192]),
                gloss: 0.01,
                bump: Vector3::zeros(),
            }
        } else {
            self.skin(at)
        }
    }

    fn head(&self, at: &Point3<f32>) -> Finish {
        let p = (self.head_from_rest * at) / self.scale;
        let hair = self.subject.hair;
        let strands =
            1.0 + 0.25 * noise(&(at.coords * 90.0), 11) + 0.15 * noise(&(at.coords * 300.0), 12);
        let of_hair = Finish {
            colour: hair.colour * strands,
            gloss: 0.04,
            bump: Vector3::new(0.0, noise(&(at.coords * 120.0), 13), 0.0) * 0.3,
        };
        // The hairline runs from the forehead over the temples to behind the ears.
        let line = 0.115 - 0.9 * (0.055 - p.x).max(0.0) + 0.004 * noise(&(at.coords * 60.0), 14);
        let hangs = hair.length > 0.0 && p.x < -0.02 && p.z > -hair.length - 0.08;
        if hair.thickness > 0.0 && (p.z > line.max(-0.03) && p.z > -0.035 || hangs) {
            return of_hair;
        }
        let front = p.x > 0.05;
        let pair = |y: f32, z: f32, wide: f32, high: f32| {
            front && ((p.y.abs() - y) / wide).powi(2) + ((p.z - z) / high).powi(2) < 1.0
        };
        let dark = |share: f32| Finish {
            colour: self.subject.skin * share,
            ..self.skin(at)
        };
        if pair(0.031, 0.046, 0.0075, 0.0055) {
            return Finish {
                colour: srgb([30, 24, 22]),
                gloss: 0.1,
                bump: Vector3::zeros(),
            };
        }
        if pair(0.031, 0.046, 0.015, 0.009) {
            return Finish {
                colour: srgb([205, 200, 196]),
                ..self.skin(at)
            };
        }
        if pair(0.032, 0.064, 0.019, 0.005) {
            return of_hair;
        }
        if pair(0.031, 0.046, 0.024, 0.019) {
            return dark(0.72);
        }
        if pair(0.0, -0.027, 0.024, 0.006) {
            return Finish {
                colour: self.subject.skin.component_mul(&Linear::new(0.75, 0.42, 0.42)),
                ..self.skin(at)
            };
        }
        if hair.beard && p.z < -0.012 && p.z > -0.075 && p.x > -0.005 {
            let share = 0.75;
            return Finish {
                colour: self.subject.skin * (1.0 - share) + hair.colour * share,
                ..self.skin(at)
            };
        }
        self.skin(at)
    }
}
