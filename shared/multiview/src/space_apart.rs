//! The right and the left of a person are not at one place, even if the evidence of both is.
//!
//! The tree has no bone between two legs. Where a network sees both ankles in the maps of either, both legs may lie on the one that it
//! sees better: that evidence then counts twice, and the other foot is explained by nothing. A term on pairs of joints tells,
//!
//! `E_apart(X) = - a sum_(r,l) max(0, 1 - |X_r - X_l| / d)`
//!
//! with `d` the least distance of a pair. It closes loops, so that the tree alone is not exact any more: one side is kept away from where
//! the other one is, the tree solved again, and the better one of both sides chosen.

use crate::space_places::Choices;
use crate::space_tree::{BoneLength, Occupied, SpacePose, SpaceSettings, TREE, best_on_tree, cost};
use crate::space_view::{LIMBS, N};

/// Returns the cost of the nearness of the pairs of a limb.
fn crowding(joints: &Occupied, pairs: &[[usize; 2]], settings: &SpaceSettings) -> f64 {
    let of_pair = |[right, left]: &[usize; 2]| match (&joints[*right], &joints[*left]) {
        (Some(right), Some(left)) => cost(right, left, settings),
        _ => 0.0,
    };
    pairs.iter().map(of_pair).sum()
}

/// The better of a solution and of those in which the right or the left arm or leg is kept away from the other one, if both lie at one
/// place.
///
/// * `first`: the best on the tree.
/// * Returns the solution, and what its joints are kept away from.
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
            // The other side may have moved as well: judged by where both are now.
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
