//! The joints of a person in space: the best on the tree, with the limbs apart, then on finer and finer grids about it.

use nalgebra::Point3;

use crate::space_apart::kept_apart;
use crate::space_tree::{
    BoneLength, N, Occupied, Places, SpacePose, SpaceSettings, SpaceView, TREE, best_on_tree, cost,
    unary,
};

/// Solves for all joints at once.
///
/// * `places`: of every joint, for example of [`places`](crate::places); a joint without one is left out.
/// * `lengths`: of the bones of [`TREE`](crate::TREE).
/// * Returns `None` if no joint has a place.
pub fn solve_in_space(
    views: &[SpaceView<'_>],
    places: &Places,
    lengths: &[BoneLength; N - 1],
    settings: &SpaceSettings,
) -> Option<SpacePose> {
    let first = best_on_tree(views, places, (lengths, &[None; N]), settings)?;
    let (mut best, occupied) = kept_apart(views, places, lengths, settings, first);
    let mut step = settings.coarsest_m;
    while step >= settings.finest_m {
        for _ in 0..2 {
            let about: Places = core::array::from_fn(|joint| match &best.joints[joint] {
                Some(at) => grid(at, step),
                None => Vec::new(),
            });
            let found = best_on_tree(views, &about, (lengths, &occupied), settings)?;
            let has_moved = found.joints != best.joints;
            best = found;
            if !has_moved {
                break;
            }
        }
        step /= 2.0;
    }
    Some(between_places(
        best,
        views,
        &Held {
            lengths,
            occupied: &occupied,
            settings,
        },
    ))
}

/// Number of times that every joint is moved between the places of the finest grid.
const N_SWEEPS: usize = 2;

/// What holds a joint besides the views.
struct Held<'a> {
    lengths: &'a [BoneLength; N - 1],
    occupied: &'a Occupied,
    settings: &'a SpaceSettings,
}

impl Held<'_> {
    /// The part of the energy that depends on the place of one joint.
    ///
    /// * `joints`: the others.
    fn energy(
        &self,
        views: &[SpaceView<'_>],
        joints: &[Option<Point3<f64>>; N],
        joint: usize,
        at: &Point3<f64>,
    ) -> f64 {
        let crowded = self.occupied[joint].map_or(0.0, |other| cost(at, &other, self.settings));
        let bones = TREE
            .iter()
            .zip(self.lengths)
            .map(|([parent, child], bone)| {
                let other = match joint {
                    it if it == *parent => joints[*child],
                    it if it == *child => joints[*parent],
                    _ => None,
                };
                other.map_or(0.0, |other| {
                    let off = ((at - other).norm() - bone.mean) / bone.sd;
                    (off * off / 2.0).min(self.settings.cap)
                })
            });
        unary(views, joint, at) - crowded - self.settings.springs * bones.sum::<f64>()
    }
}

/// Moves every joint to the maximum of a parabola along each axis through the energy at its place of the finest grid and beside it, where
/// that is better.
fn between_places(mut best: SpacePose, views: &[SpaceView<'_>], held: &Held<'_>) -> SpacePose {
    let step = held.settings.finest_m;
    for joint in (0..N_SWEEPS).flat_map(|_| 0..N) {
        let Some(at) = best.joints[joint] else {
            continue;
        };
        let energy = |at: &Point3<f64>| held.energy(views, &best.joints, joint, at);
        let here = energy(&at);
        let mut moved = at;
        for axis in 0..3 {
            let beside = |by: f64| {
                let mut place = at;
                place[axis] += by;
                energy(&place)
            };
            let [before, after] = [beside(-step), beside(step)];
            let curvature = before + after - 2.0 * here;
            if curvature < 0.0 {
                let by = (before - after) / (2.0 * curvature);
                moved[axis] += by.clamp(-1.0, 1.0) * step;
            }
        }
        let gain = energy(&moved) - here;
        if gain > 0.0 {
            best.joints[joint] = Some(moved);
            best.energy += gain;
        }
    }
    best
}

/// The 125 places of a grid about a place, that one in the middle.
fn grid(about: &Point3<f64>, step: f64) -> Vec<Point3<f64>> {
    let along = |nth: usize| (nth as f64 - 2.0) * step;
    (0..125)
        .map(|nth| {
            let by = [along(nth % 5), along(nth / 5 % 5), along(nth / 25)];
            about + nalgebra::Vector3::from(by)
        })
        .collect()
}
