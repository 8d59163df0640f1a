//! Keeps the right and the left limbs of a person apart, even if the evidence places both at one point.
//!
//! The tree has no bone between the two legs. If a network shows both ankles in the map of either ankle, both legs may end up at the ankle
//! that is seen better. The evidence for that ankle then counts twice, and the evidence for the other ankle is ignored. A term on pairs of
//! joints prevents this:
//!
//! `E_apart(X) = - a sum_(r,l) max(0, 1 - |X_r - X_l| / d)`
//!
//! where `d` is the minimum distance of a pair. The term closes loops, so the tree alone is no longer exact. Instead, one side is kept away
//! from the position of the other, and the tree is solved again. The better of the two solutions is chosen.

use crate::space_places::Choices;
use crate::space_tree::{BoneLength, Occupied, SpacePose, SpaceSettings, TREE, best_on_tree, cost};
use crate::space_view::{LIMBS, N};

/// Returns the cost of a limb's right and left joints being close to each other.
fn crowding(joints: &Occupied, pairs: &[[usize; 2]], settings: &SpaceSettings) -> f64 {
    let of_pair = |[right, left]: &[usize; 2]| match (&joints[*right], &joints[*left]) {
        (Some(right), Some(left)) => cost(right, left, settings),
        _ => 0.0,
    };
    pairs.iter().map(of_pair).sum()
}

/// Where limbs coincide, computes new solutions in which one arm or leg is kept away from the opposite one. Returns the best of these and
/// of the given solution.
///
/// * `first`: the best solution on the tree.
/// * Returns the solution, and the places that its joints are kept away from.
pub(crate) fn kept_apart(
    choices: &Choices,
    lengths: &[BoneLength; TREE.len()],
    settings: &SpaceSettings,
    first: SpacePose,
) -> (SpacePose, Occupied) {
    let mut best = first;
    let mut occupied: Occupied = [None; N];
    for pairs in &LIMBS {
        let crowded = crowding(&best.joints, pairs, settings);
        if crowded <= 0.0 {
            continue;
        }
        let (from, own) = (best.joints, occupied);
        let mut most = best.energy - crowded;
        for side in [0, 1] {
            let mut kept = own;
            for pair in pairs {
                kept[pair[side]] = from[pair[1 - side]];
            }
            let Some(found) = best_on_tree(choices, (lengths, &kept), settings) else {
                continue;
            };
            // The other side may have moved as well, so the energy is computed from the new places of both.
            let known: f64 = pairs
                .iter()
                .filter_map(|pair| {
                    Some(cost(
                        &found.joints[pair[side]]?,
                        &kept[pair[side]]?,
                        settings,
                    ))
                })
                .sum();
            let energy = found.energy + known - crowding(&found.joints, pairs, settings);
            if energy > most {
                (most, best, occupied) = (energy, found, kept);
            }
        }
    }
    (best, occupied)
}
