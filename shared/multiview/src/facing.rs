//! Which views see the person from behind, jointly over all pairs.

/// What one pair found under either assumption about its two views.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairEnergies {
    /// The views.
    pub views: [usize; 2],
    /// Joint energy if both views see the same side of the body, and if they see opposite sides.
    pub same_or_opposite: [f64; 2],
}

/// The joint decision.
#[derive(Debug, Clone, PartialEq)]
pub struct Facing {
    /// Whether a view is exchanged with respect to the first one.
    pub exchanged: Vec<bool>,
    /// Energy of the decision less that of the best other one; infinite if there is no other.
    pub margin: f64,
}

/// Most views for which all assignments are tried.
const MAX_VIEWS: usize = 16;

/// Maximises the sum of the pairs' final energies over one exchange per view.
///
/// A pair tells only whether its two views agree, so the first view is never exchanged here; which
/// side is the person's right is decided afterwards (see `anatomy`). Assignments whose energies differ
/// by no more than `tie` are told apart by the previous frame: the one that changes fewer views wins.
///
/// * `n_views`: views of the rig; those without a pair stay as they were, or unexchanged.
/// * `previous`: the exchanges of the previous frame, up to an exchange of all views.
///
/// # Panics
///
/// If there are more than 16 views, or a pair names a view that does not exist.
pub fn decide_facing(
    n_views: usize,
    pairs: &[PairEnergies],
    previous: Option<&[bool]>,
    tie: f64,
) -> Facing {
    assert!(n_views <= MAX_VIEWS, "at most {MAX_VIEWS} views");
    let seen: Vec<usize> = (0..n_views)
        .filter(|view| pairs.iter().any(|it| it.views.contains(view)))
        .collect();
    let bit = |mask: u32, view: usize| mask >> view & 1 == 1;
    let spread = |free: u32| {
        seen.iter()
            .skip(1)
            .enumerate()
            .fold(0, |mask, (i, view)| mask | (free >> i & 1) << view)
    };
    let energy = |mask: u32| -> f64 {
        pairs
            .iter()
            .map(|it| {
                let opposite = bit(mask, it.views[0]) != bit(mask, it.views[1]);
                it.same_or_opposite[usize::from(opposite)]
            })
            .sum()
    };
    let changed = |mask: u32| {
        let Some(previous) = previous else { return 0 };
        let flips = seen
            .iter()
            .filter(|&&view| previous.get(view).is_some_and(|it| *it != bit(mask, view)))
            .count();
        flips.min(seen.len() - flips)
    };
    let n_free = seen.len().saturating_sub(1);
    let mut ranked: Vec<(f64, u32)> = (0..1_u32 << n_free)
        .map(spread)
        .map(|mask| (energy(mask), mask))
        .collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    let top = ranked[0].0;
    let winner = ranked
        .iter()
        .take_while(|it| top - it.0 <= tie)
        .min_by_key(|it| changed(it.1))
        .copied()
        .unwrap_or(ranked[0]);
    let runner_up = ranked.iter().find(|it| it.1 != winner.1);
    Facing {
        exchanged: (0..n_views).map(|view| bit(winner.1, view)).collect(),
        margin: runner_up.map_or(f64::INFINITY, |it| winner.0 - it.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(a: usize, b: usize, same: f64, opposite: f64) -> PairEnergies {
        PairEnergies {
            views: [a, b],
            same_or_opposite: [same, opposite],
        }
    }

    #[test]
    fn views_from_behind_are_told_from_those_in_front() {
        let pairs = [
            pair(0, 1, 2.0, 1.0),
            pair(0, 2, 1.0, 1.5),
            pair(1, 2, 1.0, 1.5),
        ];
        let got = decide_facing(3, &pairs, None, 0.0);
        assert_eq!(got.exchanged, [false, false, true]);
        assert!((got.margin - 1.0).abs() < 1e-12);
    }

    #[test]
    fn one_pair_is_outvoted_by_the_others() {
        // The pair (1, 2) alone would say "same".
        let pairs = [
            pair(0, 1, 2.0, 1.0),
            pair(0, 2, 1.0, 2.0),
            pair(1, 2, 1.2, 1.0),
        ];
        let got = decide_facing(3, &pairs, None, 0.0);
        assert_eq!(got.exchanged, [false, false, true]);
    }

    #[test]
    fn the_previous_frame_breaks_a_tie() {
        let pairs = [pair(0, 1, 1.0, 1.01)];
        let previous = [true, true];
        assert!(decide_facing(2, &pairs, None, 0.05).exchanged == [false, true]);
        let got = decide_facing(2, &pairs, Some(&previous), 0.05);
        assert_eq!(got.exchanged, [false, false], "both exchanged is both not");
    }

    #[test]
    fn a_view_without_a_pair_is_left_alone() {
        let got = decide_facing(3, &[pair(0, 2, 0.0, 1.0)], None, 0.0);
        assert_eq!(got.exchanged, [false, false, true]);
    }

    #[test]
    fn nothing_to_decide_is_decided() {
        let got = decide_facing(2, &[], None, 0.0);
        assert_eq!(got.exchanged, [false, false]);
        assert_eq!(got.margin, f64::INFINITY);
    }
}
