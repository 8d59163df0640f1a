//! Corrects joints that were confused with the same joints on the other side of the body.

use crate::joint_track::Track;
use crate::recorded::{Recorded, Sides};
use crate::rts::{GATE, Usable, distance2};
use crate::track::usable;

/// Minimum log-odds at which one of two assignments of left and right is chosen.
const LEAST_ODDS: f64 = 3.0;
/// Maximum squared distance that one measurement can contribute; it is limited because a measurement may be wrong for many reasons.
const MOST_DISTANCE2: f64 = 40.0;

/// Swaps left and right joints that were confused, and decides left and right at instants at which they are uncertain.
///
/// * `others`: for every joint, the same joint on the other side.
/// * Returns the joints whose measurements changed. Also returns the numbers of uncertain instants that were kept, swapped and left out.
pub(crate) fn settle(
    recorded: &Recorded,
    others: &[Option<usize>],
    tracks: &mut [Track],
) -> (Vec<usize>, [usize; 3]) {
    let pairs: Vec<[usize; 2]> = others
        .iter()
        .enumerate()
        .filter_map(|(a, b)| b.filter(|b| a < *b).map(|b| [a, b]))
        .collect();
    let mut is_changed = vec![false; tracks.len()];
    let is_some_sure = recorded.is_some_sure();
    let mut counts = if is_some_sure {
        [0; 3]
    } else {
        recorded.unsure()
    };
    for at in 0..recorded.times.len() {
        if is_some_sure && recorded.sides[at] == Sides::Unsure {
            counts[unsure(recorded, &pairs, tracks, at, &mut is_changed)] += 1;
            continue;
        }
        for &pair in &pairs {
            if exchange_pair(tracks, pair, at) {
                for joint in pair {
                    is_changed[joint] = true;
                }
            }
        }
    }
    let changed = (0..tracks.len()).filter(|&i| is_changed[i]).collect();
    (changed, counts)
}

/// Returns the distance of a measurement from the track estimated without it.
fn away(track: &Track, at: usize, measured: &Usable) -> Option<f64> {
    let known = track.known[at].as_ref()?;
    Some(distance2(known, measured.as_ref()?, 0.0, track.noise.scale))
}

/// Swaps two joints if neither fits its own track, but each fits the other's track.
fn exchange_pair(tracks: &mut [Track], [a, b]: [usize; 2], at: usize) -> bool {
    let is_out = |track: &Track| track.used[at].is_some() && track.weights[at] == 0.0;
    // Where the limbs cross, one of the two joints may fit by chance.
    if !is_out(&tracks[a]) || !is_out(&tracks[b]) {
        return false;
    }
    let of_a = away(&tracks[a], at, &tracks[b].used[at]);
    let of_b = away(&tracks[b], at, &tracks[a].used[at]);
    let fits = |distance: Option<f64>| distance.is_some_and(|value| value <= GATE);
    if !fits(of_a) || !fits(of_b) {
        return false;
    }
    let (first, second) = (tracks[a].used[at], tracks[b].used[at]);
    for (track, measured) in [(a, second), (b, first)] {
        tracks[track].used[at] = measured;
        tracks[track].is_exchanged[at] = true;
    }
    true
}

/// Decides left and right at an instant at which they are uncertain, from all pairs of joints together.
///
/// * Returns 0 if the instant was kept as measured, 1 if left and right were swapped, 2 if it was left out.
fn unsure(
    recorded: &Recorded,
    pairs: &[[usize; 2]],
    tracks: &mut [Track],
    at: usize,
    is_changed: &mut [bool],
) -> usize {
    let measured =
        |joint: usize| -> Usable { usable(recorded.joints[joint].measured[at].as_ref()?) };
    let sum = |is_exchanged: bool| -> f64 {
        let one = |&[a, b]: &[usize; 2]| {
            let (own, other) = if is_exchanged { (b, a) } else { (a, b) };
            let of_a = away(&tracks[a], at, &measured(own));
            let of_b = away(&tracks[b], at, &measured(other));
            // Only complete pairs count, so that both sums cover the same measurements.
            let both = of_a.zip(of_b);
            both.map_or(0.0, |(a, b)| a.min(MOST_DISTANCE2) + b.min(MOST_DISTANCE2))
        };
        pairs.iter().map(one).sum()
    };
    // The negative log-likelihood of a Gaussian is half the squared distance.
    let odds = 0.5 * (sum(true) - sum(false));
    if odds.abs() < LEAST_ODDS {
        return 2;
    }
    let is_exchanged = odds < 0.0;
    for &[a, b] in pairs {
        for (joint, from) in [(a, b), (b, a)] {
            let from = if is_exchanged { from } else { joint };
            tracks[joint].used[at] = measured(from);
            tracks[joint].is_exchanged[at] = is_exchanged;
            is_changed[joint] = true;
        }
    }
    usize::from(is_exchanged)
}
