//! The surface of a body as triangles that hang on bones, and where bent bones take them.

mod nets;

use nalgebra::{Isometry3, Matrix3, Matrix3x4, Point3, Vector3};

use crate::body::{Bones, N_BONES, THIGH};
use crate::flesh::{FAR, Flesh, Grid};

/// Distance of the lattice on which the surface is made, metres.
const STEP: f32 = 0.012;

/// Within this difference of distances (metres) a point follows two bones.
const SHARED: f32 = 0.02;

/// Bones that a point may hang on.
const N_WEIGHTS: usize = 4;

/// The surface at rest.
#[derive(Debug, Clone)]
pub(crate) struct Mesh {
    pub(crate) points: Vec<Point3<f32>>,
    pub(crate) normals: Vec<Vector3<f32>>,
    /// Anticlockwise seen from outside.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Bones and their shares, which sum to 1.
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
    pub(crate) fn new(flesh: &Flesh) -> Self {
        let mut grid = Grid::around(flesh.bounds(), STEP);
        flesh.fill(&mut grid);
        let (mut points, triangles) = nets::surface(&grid);
        for point in &mut points {
            // Newton's steps onto the surface, which the lattice has rounded off.
            for _ in 0..2 {
                let off = flesh.distance(point).clamp(-STEP, STEP);
                *point -= flesh.normal(point) * off;
            }
        }
        let normals = points.iter().map(|it| flesh.normal(it)).collect();
        let weights = points.iter().map(|it| weights(flesh, it)).collect();
        Self {
            points,
            normals,
            triangles,
            weights,
            rest_from_body: flesh.frames,
        }
    }

    /// Moves every point as its bones move (linear blend skinning).
    ///
    /// * `frames`: of the bones, in the world that the points are wanted in.
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
            posed
                .points
                .push(Point3::from(blend * point.coords.push(1.0)));
            let turned = blend.fixed_columns::<3>(0) * normal;
            posed
                .normals
                .push(turned.try_normalize(1e-6).unwrap_or(*normal));
        }
    }
}

impl Mesh {
    /// The bone that a point follows most.
    pub(crate) fn bone(&self, point: usize) -> usize {
        usize::from(self.weights[point][0].0)
    }

    /// How directions at rest are turned with every bone.
    pub(crate) fn turns(&self, frames: &[Isometry3<f64>; N_BONES]) -> [Matrix3<f32>; N_BONES] {
        core::array::from_fn(|bone| {
            let turn = frames[bone].rotation * self.rest_from_body[bone].rotation.inverse();
            turn.to_rotation_matrix().matrix().cast()
        })
    }
}

/// Which bones a point follows: those whose flesh it lies on, softly where two are as near.
fn weights(flesh: &Flesh, at: &Point3<f32>) -> [(u8, f32); N_WEIGHTS] {
    let mut distances = flesh.by_bone(at);
    // A leg never pulls at the skin of the other.
    let other = if at.y > 0.0 { THIGH[1] } else { THIGH[0] };
    distances[other..other + 3].fill(FAR);
    let mut order: [usize; N_BONES] = core::array::from_fn(|it| it);
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
    let sum: f32 = shares.iter().map(|it| it.1).sum();
    for share in &mut shares {
        share.1 /= sum;
    }
    shares
}

/// The surface of a person at rest.
pub(crate) fn of(subject: &crate::subject::Subject, bones: &Bones) -> (Flesh, Mesh) {
    let flesh = Flesh::new(subject, bones);
    let mesh = Mesh::new(&flesh);
    (flesh, mesh)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::flesh::rest_pose;
    use crate::subject::Subject;

    fn made(number: u64) -> (Bones, Flesh, Mesh) {
        let subject = Subject::new(number);
        let bones = Bones::new(&subject.proportions);
        let (flesh, mesh) = of(&subject, &bones);
        (bones, flesh, mesh)
    }

    #[test]
    fn the_surface_is_closed_and_turned_outward() {
        let (_, _, mesh) = made(3);
        let mut edges: BTreeMap<(u32, u32), i32> = BTreeMap::new();
        let mut volume = 0.0;
        for [a, b, c] in &mesh.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *edges.entry((*from.min(to), *from.max(to))).or_default() +=
                    if from < to { 1 } else { -1 };
            }
            let [p, q, r] = [a, b, c].map(|it| mesh.points[*it as usize].coords);
            volume += p.dot(&q.cross(&r)) / 6.0;
        }
        assert!(
            edges.values().all(|it| *it == 0),
            "every edge has two sides"
        );
        assert!((0.045..0.13).contains(&volume), "{volume} m3");
    }

    #[test]
    fn points_lie_on_the_surface_and_the_bones_inside() {
        let (bones, flesh, mesh) = made(4);
        let on = mesh
            .points
            .iter()
            .filter(|it| flesh.distance(it).abs() < 1.5e-3)
            .count();
        assert!(on as f64 > 0.98 * mesh.points.len() as f64);
        let joints = bones.joints(&flesh.frames);
        for (joint, at) in skeleton::PARSE14.joints.iter().zip(joints) {
            let distance = flesh.distance(&at.cast());
            assert!(distance < 0.012, "{}: {distance}", joint.name);
        }
    }

    #[test]
    fn at_rest_the_pose_is_the_rest() {
        let (bones, _, mesh) = made(5);
        let mut posed = Posed::default();
        mesh.pose(&bones.frames(&rest_pose()), &mut posed);
        for (a, b) in posed.points.iter().zip(&mesh.points) {
            assert!((a - b).norm() < 1e-4);
        }
    }

    #[test]
    fn the_left_hand_is_the_left_one_on_the_surface_too() {
        let (bones, _, mesh) = made(6);
        let mut pose = rest_pose();
        pose.angles[crate::body::FOREARM[0]] = [90.0, 0.0, 0.0];
        let mut posed = Posed::default();
        mesh.pose(&bones.frames(&pose), &mut posed);
        let moved = posed
            .points
            .iter()
            .zip(&mesh.points)
            .filter(|(a, b)| (*a - *b).norm() > 0.05);
        let (mut n, mut left) = (0, 0);
        for (_, at) in moved {
            n += 1;
            left += usize::from(at.y > 0.0);
        }
        assert!(n > 300 && left == n, "{left} of {n}");
    }
}
