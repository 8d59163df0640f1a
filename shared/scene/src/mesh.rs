//! The surface of a body as a triangle mesh, and its skinning to the bones.

mod nets;

use nalgebra::{Isometry3, Matrix3, Matrix3x4, Point3, Vector3};

use crate::body::{Bones, N_BONES, THIGH};
use crate::shape::{BodyShape, FAR, Grid};

/// Spacing of the lattice on which the surface is created, in metres.
const STEP: f32 = 0.012;

/// Difference in distance, in metres, up to which a point follows both of two bones.
const SHARED: f32 = 0.02;

/// Maximum number of bones that a point follows.
const N_WEIGHTS: usize = 4;

/// The surface at rest.
#[derive(Debug, Clone)]
pub(crate) struct Mesh {
    pub(crate) points: Vec<Point3<f32>>,
    pub(crate) normals: Vec<Vector3<f32>>,
    /// Triangles, with their corners anticlockwise as seen from outside.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// The bones that each point follows and their weights, which sum to 1.
    weights: Vec<[(u8, f32); N_WEIGHTS]>,
    rest_from_body: [Isometry3<f64>; N_BONES],
}

/// The surface of a pose.
#[derive(Debug, Clone, Default)]
pub(crate) struct Posed {
    pub(crate) points: Vec<Point3<f32>>,
    pub(crate) normals: Vec<Vector3<f32>>,
}

impl Mesh {
    pub(crate) fn new(shape: &BodyShape) -> Self {
        let mut grid = Grid::around(shape.bounds(), STEP);
        shape.fill(&mut grid);
        let (mut points, triangles) = nets::surface(&grid);
        for point in &mut points {
            // The grid has smoothed the surface; Newton steps move the points back onto it.
            for _ in 0..2 {
                let off = shape.distance(point).clamp(-STEP, STEP);
                *point -= shape.normal(point) * off;
            }
        }
        let normals = points.iter().map(|point| shape.normal(point)).collect();
        let weights = points.iter().map(|point| weights(shape, point)).collect();
        Self {
            points,
            normals,
            triangles,
            weights,
            rest_from_body: shape.frames,
        }
    }

    /// Moves every point as its bones move (linear blend skinning).
    ///
    /// * `frames`: frames of the bones; the points are in the same frame of reference.
    pub(crate) fn pose(&self, frames: &[Isometry3<f64>; N_BONES], posed: &mut Posed) {
        let moves: [Matrix3x4<f32>; N_BONES] = core::array::from_fn(|bone| {
            let it = frames[bone] * self.rest_from_body[bone].inverse();
            it.to_matrix().fixed_rows::<3>(0).into_owned().cast()
        });
        posed.points.clear();
        posed.normals.clear();
        for ((point, normal), weights) in self.points.iter().zip(&self.normals).zip(&self.weights) {
            let mut blend = Matrix3x4::zeros();
            for (bone, share) in weights {
                if *share > 0.0 {
                    blend += moves[usize::from(*bone)] * *share;
                }
            }
            posed.points.push(Point3::from(blend * point.coords.push(1.0)));
            let turned = blend.fixed_columns::<3>(0) * normal;
            posed.normals.push(turned.try_normalize(1e-6).unwrap_or(*normal));
        }
    }
}

impl Mesh {
    /// Returns the bone that a point follows most.
    pub(crate) fn bone(&self, point: usize) -> usize {
        usize::from(self.weights[point][0].0)
    }

    /// For every bone, the rotation of directions from the rest pose.
    pub(crate) fn turns(&self, frames: &[Isometry3<f64>; N_BONES]) -> [Matrix3<f32>; N_BONES] {
        core::array::from_fn(|bone| {
            let turn = frames[bone].rotation * self.rest_from_body[bone].rotation.inverse();
            turn.to_rotation_matrix().matrix().cast()
        })
    }
}

/// Returns the bones that a point follows: those whose solids contain it, with blended weights if two are equally near.
fn weights(shape: &BodyShape, at: &Point3<f32>) -> [(u8, f32); N_WEIGHTS] {
    let mut distances = shape.by_bone(at);
    // A point of one leg never follows the other leg.
    let other = if at.y > 0.0 { THIGH[1] } else { THIGH[0] };
    distances[other..other + 3].fill(FAR);
    let mut order: [usize; N_BONES] = core::array::from_fn(|i| i);
    order.sort_by(|a, b| distances[*a].total_cmp(&distances[*b]));
    let nearest = distances[order[0]];
    let mut shares: [(u8, f32); N_WEIGHTS] = core::array::from_fn(|nth| {
        let bone = order[nth];
        let off = (distances[bone] - nearest) / SHARED;
        let share = if distances[bone] < FAR {
            (-off * off).exp()
        } else {
            0.0
        };
        (bone as u8, if share < 0.02 { 0.0 } else { share })
    });
    shares[0].1 = 1.0;
    let sum: f32 = shares.iter().map(|share| share.1).sum();
    for share in &mut shares {
        share.1 /= sum;
    }
    shares
}

/// Returns the surface of a person at rest.
pub(crate) fn of(subject: &crate::subject::Subject, bones: &Bones) -> (BodyShape, Mesh) {
    let shape = BodyShape::new(subject, bones);
    let mesh = Mesh::new(&shape);
    (shape, mesh)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::shape::rest_pose;
    use crate::subject::Subject;

    fn mesh_of(number: u64) -> (Bones, BodyShape, Mesh) {
        let subject = Subject::new(number);
        let bones = Bones::new(&subject.proportions);
        let (shape, mesh) = of(&subject, &bones);
        (bones, shape, mesh)
    }

    #[test]
    fn the_surface_is_closed_and_oriented_outward() {
        let (_, _, mesh) = mesh_of(3);
        let mut edges: BTreeMap<(u32, u32), i32> = BTreeMap::new();
        let mut volume = 0.0;
        for [a, b, c] in &mesh.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *edges.entry((*from.min(to), *from.max(to))).or_default() +=
                    if from < to { 1 } else { -1 };
            }
            let [p, q, r] = [a, b, c].map(|value| mesh.points[*value as usize].coords);
            volume += p.dot(&q.cross(&r)) / 6.0;
        }
        assert!(
            edges.values().all(|value| *value == 0),
            "every edge has two sides"
        );
        assert!((0.045..0.13).contains(&volume), "{volume} m3");
    }

    #[test]
    fn points_lie_on_the_surface_and_the_bones_inside() {
        let (bones, shape, mesh) = mesh_of(4);
        let on = mesh.points.iter().filter(|point| shape.distance(point).abs() < 1.5e-3).count();
        assert!(on as f64 > 0.98 * mesh.points.len() as f64);
        let joints = bones.joints(&shape.frames);
        for (joint, at) in skeleton::PARSE14.joints.iter().zip(joints) {
            let distance = shape.distance(&at.cast());
            assert!(distance < 0.012, "{}: {distance}", joint.name);
        }
    }

    #[test]
    fn the_rest_pose_gives_the_mesh_at_rest() {
        let (bones, _, mesh) = mesh_of(5);
        let mut posed = Posed::default();
        mesh.pose(&bones.frames(&rest_pose()), &mut posed);
        for (a, b) in posed.points.iter().zip(&mesh.points) {
            assert!((a - b).norm() < 1e-4);
        }
    }

    #[test]
    fn bending_the_left_forearm_moves_points_on_the_left_only() {
        let (bones, _, mesh) = mesh_of(6);
        let mut pose = rest_pose();
        pose.angles[crate::body::FOREARM[0]] = [90.0, 0.0, 0.0];
        let mut posed = Posed::default();
        mesh.pose(&bones.frames(&pose), &mut posed);
        let moved = posed.points.iter().zip(&mesh.points).filter(|(a, b)| (*a - *b).norm() > 0.05);
        let (mut n, mut left) = (0, 0);
        for (_, at) in moved {
            n += 1;
            left += usize::from(at.y > 0.0);
        }
        assert!(n > 300 && left == n, "{left} of {n}");
    }
}
