//! The shape of a body at rest as a union of smooth solids, each attached to a bone.

mod person;
mod solid;

use nalgebra::{Isometry3, Point3, Vector3};

use crate::body::{Angles, Bones, N_BONES, Pose, THIGH, UPPER_ARM};
use crate::subject::Subject;
use solid::Solid;

/// A solid attached to a bone.
#[derive(Debug, Clone)]
pub(crate) struct Piece {
    pub(crate) bone: usize,
    solid: Solid,
}

/// Radius over which solids are blended, in metres.
const BLEND: f32 = 0.028;

/// A body in the rest pose, in which its surface is created.
#[derive(Debug, Clone)]
pub(crate) struct BodyShape {
    pieces: Vec<Piece>,
    /// Frames of the bones in that pose.
    pub(crate) frames: [Isometry3<f64>; N_BONES],
    pub(crate) height: f32,
}

/// Returns the pose in which the surface is created. The arms and legs are spread, so that they do not touch.
pub(crate) fn rest_pose() -> Pose {
    let mut angles: Angles = [[0.0; 3]; N_BONES];
    for side in 0..2 {
        angles[UPPER_ARM[side]] = [0.0, 45.0, 0.0];
        angles[THIGH[side]] = [0.0, 9.0, 0.0];
    }
    Pose {
        root: Isometry3::identity(),
        angles,
    }
}

impl BodyShape {
    pub(crate) fn new(subject: &Subject, bones: &Bones) -> Self {
        let frames = bones.frames(&rest_pose());
        let placed = person::pieces(subject, bones).into_iter();
        let pieces = placed.map(|(bone, solid)| Piece {
            bone,
            solid: solid.moved(&frames[bone].cast()),
        });
        Self {
            pieces: pieces.collect(),
            frames,
            height: subject.proportions.height as f32,
        }
    }

    /// Returns the minimum and maximum coordinates.
    pub(crate) fn bounds(&self) -> [Vector3<f32>; 2] {
        let all = self.pieces.iter().map(|piece| piece.solid.bounds());
        all.fold(
            [Vector3::repeat(f32::MAX), Vector3::repeat(f32::MIN)],
            |[low, high], [l, h]| [low.inf(&l), high.sup(&h)],
        )
    }

    /// Signed distance to the surface, in metres, negative inside; accurate only near the surface.
    pub(crate) fn distance(&self, at: &Point3<f32>) -> f32 {
        let near = self.pieces.iter();
        near.fold(FAR, |sum, it| {
            if it.solid.is_far(at, FAR) {
                sum
            } else {
                smooth_min(sum, it.solid.distance(at))
            }
        })
    }

    /// Reduces every distance in a grid of points to the distance from the nearest solid, adding one solid after the other.
    pub(crate) fn fill(&self, grid: &mut Grid) {
        for piece in &self.pieces {
            let [low, high] = piece.solid.bounds();
            grid.each_within(low.add_scalar(-FAR), high.add_scalar(FAR), |at, value| {
                *value = smooth_min(*value, piece.solid.distance(at));
            });
        }
    }

    /// Returns the direction away from the body, with length 1 or 0.
    pub(crate) fn normal(&self, at: &Point3<f32>) -> Vector3<f32> {
        const STEP: f32 = 2e-3;
        let slope = |axis: usize| {
            let mut step = Vector3::zeros();
            step[axis] = STEP;
            self.distance(&(at + step)) - self.distance(&(at - step))
        };
        let gradient = Vector3::new(slope(0), slope(1), slope(2));
        gradient.try_normalize(1e-9).unwrap_or_default()
    }

    /// Returns the distance to the nearest solid of every bone, at most [`FAR`].
    pub(crate) fn by_bone(&self, at: &Point3<f32>) -> [f32; N_BONES] {
        let mut distances = [FAR; N_BONES];
        for piece in &self.pieces {
            if !piece.solid.is_far(at, FAR) {
                let it = piece.solid.distance(at);
                distances[piece.bone] = distances[piece.bone].min(it);
            }
        }
        distances
    }
}

/// Maximum distance; larger distances are clipped.
pub(crate) const FAR: f32 = 0.08;

/// Returns the smaller of two values, rounded where they are nearly equal (Quilez, polynomial smooth minimum).
fn smooth_min(a: f32, b: f32) -> f32 {
    let overlap = (BLEND - (a - b).abs()).max(0.0) / BLEND;
    a.min(b) - 0.25 * BLEND * overlap * overlap
}

/// Distances on a cubic lattice.
#[derive(Debug, Clone)]
pub(crate) struct Grid {
    pub(crate) origin: Point3<f32>,
    pub(crate) step: f32,
    pub(crate) size: [usize; 3],
    pub(crate) values: Vec<f32>,
}

impl Grid {
    /// Creates a lattice around a box, with an additional border.
    pub(crate) fn around([low, high]: [Vector3<f32>; 2], step: f32) -> Self {
        let origin = Point3::from(low.add_scalar(-2.5 * step));
        let extent = (high - low).add_scalar(5.0 * step) / step;
        let size = [extent.x, extent.y, extent.z].map(|value| value.ceil() as usize + 1);
        Self {
            origin,
            step,
            size,
            values: vec![FAR; size.iter().product()],
        }
    }

    pub(crate) fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }

    pub(crate) fn point(&self, [x, y, z]: [usize; 3]) -> Point3<f32> {
        self.origin + Vector3::new(x as f32, y as f32, z as f32) * self.step
    }

    fn each_within(
        &mut self,
        low: Vector3<f32>,
        high: Vector3<f32>,
        mut act: impl FnMut(&Point3<f32>, &mut f32),
    ) {
        let first = (low - self.origin.coords) / self.step;
        let last = (high - self.origin.coords) / self.step;
        let range = |axis: usize| {
            let end = (last[axis].max(0.0) as usize + 1).min(self.size[axis]);
            (first[axis].max(0.0) as usize).min(end)..end
        };
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    let (at, index) = (self.point([x, y, z]), self.index([x, y, z]));
                    act(&at, &mut self.values[index]);
                }
            }
        }
    }
}
