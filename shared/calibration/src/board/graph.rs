//! Relative poses of cameras, from boards that pairs of them saw at the same time.

use nalgebra::{Isometry3, UnitQuaternion};

/// A board seen by two cameras at the same time.
#[derive(Debug, Clone)]
pub(crate) struct Meeting {
    /// Possible relative poses of the two cameras: one for each orientation in which the board looks the same, the most likely first.
    pub(crate) a_from_b: Vec<Isometry3<f64>>,
    /// Weight of this board.
    pub(crate) weight: f64,
}

/// The relative pose of a pair of cameras, and the number of board positions that agree with it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair {
    pub(crate) a_from_b: Isometry3<f64>,
    pub(crate) n_agree: usize,
    pub(crate) n: usize,
}

/// Two relative poses of a pair of cameras agree if they differ by at most a rotation, in radians, and a shift, as a fraction of the
/// distance between the cameras.
const SAME_TURN: f64 = 0.1;
const SAME_SHIFT: f64 = 0.15;

/// Finds the relative pose with which the largest number of shared sights of the board agree, and returns the mean over these.
pub(crate) fn pair(meetings: &[Meeting]) -> Option<Pair> {
    let step = meetings.len().div_ceil(60).max(1);
    let candidates = meetings.iter().step_by(step).flat_map(|meeting| meeting.a_from_b.iter());
    let cost = |pose: &Isometry3<f64>| -> f64 {
        let each = meetings.iter().map(|meeting| {
            let nearest = meeting.a_from_b.iter().map(|a_from_b| apart(pose, a_from_b));
            meeting.weight * nearest.fold(f64::MAX, f64::min).min(1.0)
        });
        each.sum()
    };
    let best = candidates.min_by(|a, b| cost(a).total_cmp(&cost(b)))?;
    let agreeing: Vec<(Isometry3<f64>, f64)> = meetings
        .iter()
        .filter_map(|meeting| {
            let near = meeting.a_from_b.iter().filter(|a_from_b| apart(best, a_from_b) < 1.0);
            let nearest = near.min_by(|x, y| apart(best, x).total_cmp(&apart(best, y)))?;
            Some((*nearest, meeting.weight))
        })
        .collect();
    Some(Pair {
        a_from_b: mean(best, &agreeing),
        n_agree: agreeing.len(),
        n: meetings.len(),
    })
}

/// Returns the difference between two poses, relative to the limits above.
pub(crate) fn apart(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    let turn = a.rotation.angle_to(&b.rotation);
    let length = a.translation.vector.norm().max(b.translation.vector.norm());
    let shift = (a.translation.vector - b.translation.vector).norm() / length.max(1e-9);
    (turn / SAME_TURN).max(shift / SAME_SHIFT)
}

fn mean(near: &Isometry3<f64>, poses: &[(Isometry3<f64>, f64)]) -> Isometry3<f64> {
    let total: f64 = poses.iter().map(|pose| pose.1).sum();
    let (mut turn, mut shift) = (nalgebra::Vector3::zeros(), nalgebra::Vector3::zeros());
    for (pose, weight) in poses {
        turn += *weight * (pose.rotation * near.rotation.inverse()).scaled_axis();
        shift += *weight * pose.translation.vector;
    }
    if total.is_nan() || total <= 0.0 {
        return *near;
    }
    let rotation = UnitQuaternion::from_scaled_axis(turn / total) * near.rotation;
    Isometry3::from_parts((shift / total).into(), rotation)
}

/// Groups of connected cameras, the largest group first, and the poses within that group.
#[derive(Debug, Clone)]
pub(crate) struct Standing {
    /// `camera_from_first` of every camera; `None` for cameras outside the first group.
    pub(crate) poses: Vec<Option<Isometry3<f64>>>,
    /// Groups of cameras, each in the order of the cameras.
    pub(crate) groups: Vec<Vec<usize>>,
}

/// Finds the poses of all cameras along the strongest connections: a tree of the camera pairs that saw the board together most often.
///
/// * `pairs`: cameras a < b, and their relative pose.
pub(crate) fn standing(n_cameras: usize, pairs: &[([usize; 2], Pair)]) -> Standing {
    let mut poses = vec![None; n_cameras];
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut is_in = vec![false; n_cameras];
    for first in 0..n_cameras {
        if is_in[first] {
            continue;
        }
        let mut own: Vec<(usize, Isometry3<f64>)> = vec![(first, Isometry3::identity())];
        is_in[first] = true;
        loop {
            let known =
                |camera: usize| own.iter().find(|placed| placed.0 == camera).map(|placed| placed.1);
            let outward = pairs.iter().filter_map(|([a, b], pair)| match (known(*a), known(*b)) {
                (Some(a_from_first), None) => {
                    Some((pair.n_agree, *b, pair.a_from_b.inverse() * a_from_first))
                }
                (None, Some(b_from_first)) => {
                    Some((pair.n_agree, *a, pair.a_from_b * b_from_first))
                }
                _ => None,
            });
            let Some((_, camera, pose)) = outward.max_by_key(|link| link.0) else {
                break;
            };
            is_in[camera] = true;
            own.push((camera, pose));
        }
        let mut group: Vec<usize> = own.iter().map(|placed| placed.0).collect();
        group.sort_unstable();
        groups.push(group);
        if groups.len() == 1 {
            for (camera, pose) in own {
                poses[camera] = Some(pose);
            }
        }
    }
    Standing { poses, groups }
}
