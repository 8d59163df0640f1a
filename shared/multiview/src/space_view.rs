//! The evidence of a view for joints at points in space.

use nalgebra::{Point3, Vector3};

use geometry::{Camera, Ray, Sightline};

use crate::front::FrontEvidence;

/// Number of joints in `skeleton::PARSE14`.
pub(crate) const N: usize = 14;

/// Places of every joint, in metres in the world.
pub(crate) type Places = [Vec<Point3<f64>>; N];

/// Returns the same joint on the other side; a joint in the middle of the body maps to itself.
pub(crate) fn other_side(joint: usize) -> usize {
    let pair = LIMBS.iter().flatten().find(|pair| pair.contains(&joint));
    pair.map_or(joint, |[right, left]| right + left - joint)
}

/// Returns the view's name of a joint of the body.
pub(crate) fn name(joint: usize, exchanged: [bool; 2]) -> usize {
    let limbs = LIMBS.iter().zip(exchanged);
    let mut exchanged = limbs.filter(|(_, is_exchanged)| *is_exchanged);
    if exchanged.any(|(pairs, _)| pairs.as_flattened().contains(&joint)) {
        other_side(joint)
    } else {
        joint
    }
}

/// The evidence of a view.
pub trait JointEvidence {
    /// Returns how well a joint fits at a point of the picture, in pixels.
    fn at(&self, joint: usize, point: [f64; 2]) -> f32;
    /// Adds how well a joint fits at each of several points of the picture to their scores.
    fn add_at(&self, joint: usize, points: &[[f64; 2]], scores: &mut [f64]) {
        for (score, point) in scores.iter_mut().zip(points) {
            *score += f64::from(self.at(joint, *point));
        }
    }
    /// Returns the possible positions of a joint, in pixels of the picture, the best first, each with its evidence.
    fn maxima(&self, joint: usize) -> &[([f64; 2], f32)];
    /// Returns the evidence for a joint that the view does not show: the floor.
    fn floor(&self) -> f32;
}

/// A view with its evidence.
#[derive(Clone, Copy)]
pub struct SpaceView<'a> {
    /// Camera of the view.
    pub camera: &'a Camera,
    /// Evidence of the view.
    pub evidence: &'a dyn JointEvidence,
    /// True if left and right are swapped in the evidence, for the arms and for the legs.
    pub exchanged: [bool; 2],
    /// Evidence of the picture about the direction in which the person faces; zeros mean no evidence.
    pub front: FrontEvidence,
}

impl SpaceView<'_> {
    /// Returns the evidence for a joint of the body at a place, after swapping left and right where the view has them swapped.
    pub fn evidence_at(&self, joint: usize, at: &Point3<f64>) -> f32 {
        self.at(self.named(joint), at) as f32
    }

    /// Returns the rays of the possible positions of a joint in the picture; positions for which the lens has no ray are left out.
    ///
    /// * `named`: the view's name of the joint.
    pub(crate) fn rays(&self, named: usize) -> Vec<Ray> {
        let maxima = self.evidence.maxima(named).iter();
        maxima.filter_map(|(at, _)| self.camera.ray(&(*at).into())).collect()
    }

    /// Returns the mean direction of the best positions of the joints, weighted by how clear they are.
    pub(crate) fn sightline(&self) -> Sightline {
        let floor = self.evidence.floor();
        let (mut sum, mut weight) = (Vector3::zeros(), 0.0);
        for (at, evidence) in (0..N).filter_map(|joint| self.evidence.maxima(joint).first()) {
            if let Some(ray) = self.camera.ray(&(*at).into()) {
                let clear = f64::from(evidence - floor).max(0.0);
                sum += ray.direction.into_inner() * clear;
                weight += clear;
            }
        }
        Sightline {
            direction: sum.try_normalize(0.0).unwrap_or_default(),
            weight,
        }
    }

    /// Returns the view's name of a joint.
    pub(crate) fn named(&self, joint: usize) -> usize {
        name(joint, self.exchanged)
    }

    /// Returns the evidence for two of the view's joint names at a place.
    pub(crate) fn evidence_of(&self, named: [usize; 2], at: &Point3<f64>) -> [f64; 2] {
        let pixel = self.camera.project(at);
        named.map(|named| {
            f64::from(pixel.map_or(self.evidence.floor(), |pixel| {
                self.evidence.at(named, [pixel.x, pixel.y])
            }))
        })
    }

    /// Returns the evidence for one of the view's joint names at a place.
    pub(crate) fn at(&self, named: usize, at: &Point3<f64>) -> f64 {
        f64::from(match self.camera.project(at) {
            Some(pixel) => self.evidence.at(named, [pixel.x, pixel.y]),
            None => self.evidence.floor(),
        })
    }
}

/// Joints of the arms and of the legs, right and left.
pub(crate) const LIMBS: [[[usize; 2]; 3]; 2] =
    [[[8, 9], [7, 10], [6, 11]], [[2, 3], [1, 4], [0, 5]]];
