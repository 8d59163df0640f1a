//! The skeleton in the form that animation programs use: a tree of nodes with rotations, in a T-pose at rest.
//!
//! At rest, the person stands with arms out, y up, looking along +z, with the left hand at +x. A node without its own landmark has the
//! position of its parent, and its rotation points its child towards the child's measured position. Every bone therefore has its own
//! rotation, and only the lengths of bones can differ from the measured ones. The joints do not show how a bone is rotated about its own
//! axis, so in this respect it follows its parent.

use nalgebra::{Matrix3, Point3, Rotation3, Unit, UnitQuaternion, Vector3};

use crate::Trial;
use crate::landmarks::Landmarks;

/// A node of the tree.
#[derive(Debug)]
pub(crate) struct Node {
    pub(crate) name: &'static str,
    pub(crate) parent: Option<usize>,
    /// Landmark at the position of the node; a node without one has the position of its parent.
    pub(crate) landmark: Option<&'static str>,
    /// Direction from the parent at rest; zero without a landmark.
    pub(crate) rest: [f64; 3],
    /// Child towards which the node points.
    pub(crate) aim: Option<usize>,
}

const fn turning(name: &'static str, parent: usize, aim: usize) -> Node {
    Node {
        name,
        parent: Some(parent),
        landmark: None,
        rest: [0.0; 3],
        aim: Some(aim),
    }
}

const fn lying(
    name: &'static str,
    parent: usize,
    landmark: &'static str,
    rest: [f64; 3],
    aim: Option<usize>,
) -> Node {
    Node {
        name,
        parent: Some(parent),
        landmark: Some(landmark),
        rest,
        aim,
    }
}

const UP: [f64; 3] = [0.0, 1.0, 0.0];
const DOWN: [f64; 3] = [0.0, -1.0, 0.0];
const LEFT: [f64; 3] = [1.0, 0.0, 0.0];
const RIGHT: [f64; 3] = [-1.0, 0.0, 0.0];

/// All nodes, parents before their children.
pub(crate) const NODES: [Node; 21] = [
    Node {
        name: "hips",
        parent: None,
        landmark: Some("pelvis"),
        rest: [0.0; 3],
        aim: None,
    },
    turning("spine", 0, 2),
    lying("neck", 1, "neck", UP, None),
    turning("skull", 2, 4),
    lying("head", 3, "head", UP, None),
    turning("left_collar", 2, 6),
    lying("left_shoulder", 5, "left shoulder", LEFT, Some(7)),
    lying("left_elbow", 6, "left elbow", LEFT, Some(8)),
    lying("left_wrist", 7, "left wrist", LEFT, None),
    turning("right_collar", 2, 10),
    lying("right_shoulder", 9, "right shoulder", RIGHT, Some(11)),
    lying("right_elbow", 10, "right elbow", RIGHT, Some(12)),
    lying("right_wrist", 11, "right wrist", RIGHT, None),
    turning("left_pelvis", 0, 14),
    lying("left_hip", 13, "left hip", LEFT, Some(15)),
    lying("left_knee", 14, "left knee", DOWN, Some(16)),
    lying("left_ankle", 15, "left ankle", DOWN, None),
    turning("right_pelvis", 0, 18),
    lying("right_hip", 17, "right hip", RIGHT, Some(19)),
    lying("right_knee", 18, "right knee", DOWN, Some(20)),
    lying("right_ankle", 19, "right ankle", DOWN, None),
];

pub(crate) const N_NODES: usize = NODES.len();

/// Returns the nearest ancestor of a node that has a landmark.
pub(crate) fn anchor(node: usize) -> Option<usize> {
    let parent = NODES[node].parent?;
    match NODES[parent].landmark {
        Some(_) => Some(parent),
        None => anchor(parent),
    }
}

/// The tree in one frame.
#[derive(Debug, Clone)]
pub(crate) struct Posed {
    /// Measured positions of the nodes' landmarks, in metres, with y up.
    pub(crate) seen: [Option<Point3<f64>>; N_NODES],
    /// Rotation of every node relative to its parent.
    pub(crate) turn: [UnitQuaternion<f64>; N_NODES],
    /// Measured position of every node in its parent's frame; the last one if it was not seen.
    pub(crate) place: [Vector3<f64>; N_NODES],
    /// True for a node whose rotation could be computed from the measurements of this frame, and for nodes that never rotate.
    pub(crate) is_turn_seen: [bool; N_NODES],
}

/// Poses the tree frame by frame. A part that is not seen keeps its pose relative to its parent.
#[derive(Debug)]
pub(crate) struct Poser<'a> {
    trial: &'a Trial,
    landmarks: Landmarks,
    world: Rotation3<f64>,
    last: Posed,
}

impl<'a> Poser<'a> {
    /// Creates a poser.
    ///
    /// * `lengths`: result of [`lengths`], which gives the positions of nodes before they are seen.
    pub(crate) fn new(trial: &'a Trial, lengths: &[Option<f64>; N_NODES]) -> Self {
        let place = core::array::from_fn(|node| {
            Vector3::from(NODES[node].rest) * lengths[node].unwrap_or(0.0)
        });
        Self {
            trial,
            landmarks: Landmarks::of(trial),
            world: trial.y_up_from_world(),
            last: Posed {
                seen: [None; N_NODES],
                turn: [UnitQuaternion::identity(); N_NODES],
                place,
                is_turn_seen: [false; N_NODES],
            },
        }
    }

    /// Poses the tree in the next frame.
    pub(crate) fn pose(&mut self, slot: usize) -> &Posed {
        let posed = &mut self.last;
        posed.seen = seen(self.trial, &self.landmarks, &self.world, slot);
        let mut turns = [UnitQuaternion::identity(); N_NODES];
        let mut places = [Point3::origin(); N_NODES];
        for node in 0..N_NODES {
            let (parent_turn, parent_place) = match NODES[node].parent {
                Some(parent) => (turns[parent], places[parent]),
                None => (UnitQuaternion::identity(), Point3::origin()),
            };
            if let Some(place) = posed.seen[node] {
                posed.place[node] = parent_turn.inverse() * (place - parent_place);
            }
            places[node] = parent_place + parent_turn * posed.place[node];
            let turn = match (node, NODES[node].aim) {
                (0, _) => facing(&posed.seen).map(|value| parent_turn.inverse() * value),
                (_, Some(child)) => towards(&posed.seen, node, child)
                    .map(|to| arc(&NODES[child].rest.into(), &(parent_turn.inverse() * to))),
                (_, None) => Some(UnitQuaternion::identity()),
            };
            posed.is_turn_seen[node] = turn.is_some();
            posed.turn[node] = turn.unwrap_or(posed.turn[node]);
            turns[node] = parent_turn * posed.turn[node];
        }
        posed
    }
}

fn seen(
    trial: &Trial,
    landmarks: &Landmarks,
    world: &Rotation3<f64>,
    slot: usize,
) -> [Option<Point3<f64>>; N_NODES] {
    core::array::from_fn(|node| {
        let landmark = NODES[node].landmark?;
        Some(world * landmarks.at(trial, slot, landmark)?)
    })
}

/// Returns the direction from a node's anchor to its child, if both were seen.
fn towards(
    seen: &[Option<Point3<f64>>; N_NODES],
    node: usize,
    child: usize,
) -> Option<Vector3<f64>> {
    let from = match NODES[node].landmark {
        Some(_) => node,
        None => anchor(node)?,
    };
    Some(seen[child]? - seen[from]?)
}

/// Returns the orientation of the hips: x from the right hip to the left one, and y as near as possible to the neck. If the neck was not
/// seen, y is as near as possible to up.
fn facing(seen: &[Option<Point3<f64>>; N_NODES]) -> Option<UnitQuaternion<f64>> {
    let [left, right] = [seen[14]?, seen[18]?];
    let spine = seen[2].zip(seen[0]).map(|ends| ends.0 - ends.1);
    let x = Unit::try_new(left - right, 1e-9)?;
    let z = Unit::try_new(x.cross(&spine.unwrap_or_else(Vector3::y)), 1e-9)?;
    let axes = Matrix3::from_columns(&[*x, z.cross(&x), *z]);
    Some(UnitQuaternion::from_rotation_matrix(
        &Rotation3::from_matrix_unchecked(axes),
    ))
}

/// Returns the shortest rotation from one direction to another.
fn arc(from: &Vector3<f64>, to: &Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(from, to).unwrap_or_else(|| {
        // Opposite directions have no shortest rotation, so this is half a turn about a perpendicular axis.
        let across = from.cross(&Vector3::z());
        let axis = Unit::try_new(across, 1e-9).unwrap_or_else(Vector3::x_axis);
        UnitQuaternion::from_axis_angle(&axis, core::f64::consts::PI)
    })
}

/// Returns the length of every node's bone, in metres: the median over the frames in which both ends were seen. `None` if there is no such
/// frame, or no such bone.
pub(crate) fn lengths(trial: &Trial) -> [Option<f64>; N_NODES] {
    let landmarks = Landmarks::of(trial);
    let none = Rotation3::identity();
    let mut all: [Vec<f64>; N_NODES] = core::array::from_fn(|_| Vec::new());
    for slot in 0..trial.slots.len() {
        let seen = seen(trial, &landmarks, &none, slot);
        for (node, lengths) in all.iter_mut().enumerate() {
            let ends = anchor(node).and_then(|i| seen[i]).zip(seen[node]);
            lengths.extend(ends.map(|(from, to)| (to - from).norm()));
        }
    }
    all.map(|mut lengths| {
        lengths.sort_by(f64::total_cmp);
        lengths.get(lengths.len() / 2).copied()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::walker;

    #[test]
    fn parents_come_before_children_and_a_bone_points_to_a_child() {
        for (index, node) in NODES.iter().enumerate() {
            assert!(node.parent.is_none_or(|parent| parent < index));
            assert_eq!(node.landmark.is_none(), node.rest == [0.0; 3] && index > 0);
            if let Some(child) = node.aim {
                assert_eq!(NODES[child].parent, Some(index), "{}", node.name);
            }
        }
        assert_eq!(anchor(14), Some(0));
        assert_eq!(anchor(6), Some(2));
    }

    #[test]
    fn nodes_of_the_tree_are_at_the_measured_landmarks() {
        let trial = walker(40);
        let mut poser = Poser::new(&trial, &lengths(&trial));
        for slot in 0..trial.slots.len() {
            let posed = poser.pose(slot).clone();
            let mut turns = [UnitQuaternion::identity(); N_NODES];
            let mut places = [Point3::origin(); N_NODES];
            for node in 0..N_NODES {
                let (turn, place) = NODES[node]
                    .parent
                    .map_or((UnitQuaternion::identity(), Point3::origin()), |parent| {
                        (turns[parent], places[parent])
                    });
                turns[node] = turn * posed.turn[node];
                places[node] = place + turn * posed.place[node];
                if let Some(seen) = posed.seen[node] {
                    assert!((seen - places[node]).norm() < 1e-9, "{}", NODES[node].name);
                    // A bone has its rest direction, because its parent points towards it.
                    let length = posed.place[node].norm();
                    let along = Vector3::from(NODES[node].rest) * length;
                    let off = (along - posed.place[node]).norm();
                    assert!(node == 0 || off < 1e-9, "{}: {off}", NODES[node].name);
                }
            }
        }
    }

    #[test]
    fn opposite_directions_give_a_rotation_by_half_a_turn() {
        for from in [Vector3::x(), Vector3::y(), Vector3::z()] {
            assert!((arc(&from, &-from) * from + from).norm() < 1e-12);
        }
    }
}
