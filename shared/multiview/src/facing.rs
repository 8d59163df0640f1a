//! Decides which views see the person from behind: ranks the possible assignments by the energies of all pairs, and tracks them over time.

/// The result of one pair under each assumption about its two views.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairEnergies {
    /// The views.
    pub views: [usize; 2],
    /// Joint energy if both views see the same side of the body, and if they see opposite sides.
    pub same_or_opposite: [f64; 2],
}

/// Maximum number of views for which all assignments are enumerated.
const MAX_VIEWS: usize = 16;

/// A bit set of views: bit `v` is set if left and right of view `v` are swapped.
pub type Exchanges = u32;

/// Ranks the possible assignments of swapped views by the sum of the pairs' energies.
///
/// A pair only shows whether its two views agree. So the first view is never taken as swapped here; [`SidesFilter`](crate::SidesFilter)
/// decides whether all views are swapped. For a view without a pair, both assignments are returned.
///
/// * `present`: bit `v` is set if view `v` is present; the views of all pairs must be present.
/// * Returns at most `limit` assignments with the sum of the pairs' energies, best first.
///
/// # Panics
///
/// If there are more than 16 views.
pub fn rank_facing(
    present: Exchanges,
    pairs: &[PairEnergies],
    limit: usize,
) -> Vec<(Exchanges, f64)> {
    let paired = pairs.iter().flat_map(|pair| pair.views);
    let present = paired.fold(present, |mask, view| mask | 1 << view);
    let views: Vec<usize> = (0..Exchanges::BITS as usize)
        .filter(|view| is_exchanged(present, *view))
        .collect();
    assert!(views.len() <= MAX_VIEWS, "at most {MAX_VIEWS} views");
    let spread = |free: u32| {
        let later = views.iter().skip(1).enumerate();
        later.fold(0, |mask, (i, view)| mask | (free >> i & 1) << view)
    };
    let energy = |mask: Exchanges| -> f64 {
        let of_pair = |pair: &PairEnergies| {
            let opposite = is_exchanged(mask, pair.views[0]) != is_exchanged(mask, pair.views[1]);
            pair.same_or_opposite[usize::from(opposite)]
        };
        pairs.iter().map(of_pair).sum()
    };
    let mut ranked: Vec<(Exchanges, f64)> = (0..1_u32 << views.len().saturating_sub(1))
        .map(spread)
        .map(|mask| (mask, energy(mask)))
        .collect();
    ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
    ranked.truncate(limit.max(1));
    ranked
}

/// Returns true if a view is swapped.
pub fn is_exchanged(exchanges: Exchanges, view: usize) -> bool {
    exchanges >> view & 1 == 1
}

/// One possible assignment for a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FacingHypothesis {
    /// The views whose left and right are swapped relative to the first view.
    pub exchanges: Exchanges,
    /// Energy of all views under this assignment.
    pub energy: f64,
}

/// How strongly the decision of a frame depends on the previous frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FacingSettings {
    /// Energy cost of one view changing between front and back from one frame to the next.
    pub change_cost: f64,
    /// Weight of the earlier frames' scores in the next frame, from 0 to 1. The default halves the weight in 34 frames, because people face
    /// the same way for longer than it takes to bend down or to take a step.
    pub memory: f64,
}

impl Default for FacingSettings {
    fn default() -> Self {
        Self {
            change_cost: 1.0,
            memory: 0.98,
        }
    }
}

/// The decision of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facing {
    /// The views that see the person from the opposite side to the first view.
    pub exchanges: Exchanges,
    /// Index of the chosen hypothesis.
    pub hypothesis: usize,
    /// Lead over the best other assignment; infinite if there is no other.
    pub margin: f64,
}

/// Tracks over time which views see the person from the same side: a hidden Markov model with a Viterbi
/// filter. An assignment and its complement count as the same; [`SidesFilter`](crate::SidesFilter)
/// decides between them.
///
/// The total score of an assignment is its score in this frame plus the best score of a path from the previous frame; every view that
/// changes between front and back adds a cost. The first frame is decided by its energies alone.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FacingFilter {
    scores: Vec<(Exchanges, f64)>,
}

impl FacingFilter {
    /// Decides a frame.
    ///
    /// * `hypotheses`: the frame's assignments, relative to the first view; not empty.
    /// * `present`: bit `v` is set if view `v` contributes to this frame.
    ///
    /// # Panics
    ///
    /// If there is no hypothesis.
    pub fn decide(
        &mut self,
        settings: &FacingSettings,
        hypotheses: &[FacingHypothesis],
        present: Exchanges,
    ) -> Facing {
        assert!(!hypotheses.is_empty(), "at least one hypothesis");
        let score = |facing_hypothesis: &FacingHypothesis| {
            let path = self.best_path(settings, facing_hypothesis.exchanges, present);
            (facing_hypothesis.exchanges, facing_hypothesis.energy + path)
        };
        let scored: Vec<(Exchanges, f64)> = hypotheses.iter().map(score).collect();
        let better = |best: (usize, f64), (i, next): (usize, &(Exchanges, f64))| {
            if next.1 > best.1 { (i, next.1) } else { best }
        };
        let all = scored.iter().enumerate();
        let (hypothesis, top) = all.fold((0, f64::NEG_INFINITY), better);
        let others = scored.iter().enumerate().filter(|other| other.0 != hypothesis);
        let runner_up = others.map(|other| other.1.1).fold(f64::NEG_INFINITY, f64::max);
        self.scores = scored.iter().map(|scored| (scored.0, scored.1 - top)).collect();
        Facing {
            exchanges: scored[hypothesis].0,
            hypothesis,
            margin: top - runner_up,
        }
    }

    fn best_path(&self, settings: &FacingSettings, to: Exchanges, present: Exchanges) -> f64 {
        let n = present.count_ones();
        let from = |&(exchanges, score): &(Exchanges, f64)| {
            let changed = ((exchanges ^ to) & present).count_ones();
            let changed = changed.min(n - changed);
            settings.memory * score - settings.change_cost * f64::from(changed)
        };
        let best = self.scores.iter().map(from).fold(f64::NEG_INFINITY, f64::max);
        if best.is_finite() { best } else { 0.0 }
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

    fn hypothesis(exchanges: Exchanges, energy: f64) -> FacingHypothesis {
        FacingHypothesis { exchanges, energy }
    }

    #[test]
    fn views_from_behind_are_distinguished_from_those_in_front() {
        let pairs = [
            pair(0, 1, 2.0, 1.0),
            pair(0, 2, 1.0, 1.5),
            pair(1, 2, 1.0, 1.5),
        ];
        let got = rank_facing(0b111, &pairs, 8);
        assert_eq!(got.len(), 4);
        assert_eq!(got[0], (0b100, 5.0));
    }

    #[test]
    fn one_contradicting_pair_is_outvoted_by_the_others() {
        // The pair (1, 2) alone would prefer that both views see the same side.
        let pairs = [
            pair(0, 1, 2.0, 1.0),
            pair(0, 2, 1.0, 2.0),
            pair(1, 2, 1.2, 1.0),
        ];
        assert_eq!(rank_facing(0b111, &pairs, 1)[0].0, 0b100);
    }

    #[test]
    fn a_missing_view_is_not_swapped() {
        let got = rank_facing(0b110, &[pair(1, 2, 0.0, 1.0)], 8);
        assert_eq!(got, [(0b100, 1.0), (0b000, 0.0)]);
    }

    #[test]
    fn both_assignments_of_a_view_without_a_pair_are_returned() {
        let got = rank_facing(0b111, &[pair(1, 2, 0.0, 1.0)], 8);
        let opposite = [(0b010, 1.0), (0b100, 1.0)];
        assert_eq!(got, [opposite, [(0b000, 0.0), (0b110, 0.0)]].concat());
        assert_eq!(rank_facing(0b11, &[], 8), [(0b00, 0.0), (0b10, 0.0)]);
    }

    #[test]
    fn a_single_assignment_has_an_infinite_margin() {
        let mut filter = FacingFilter::default();
        let got = filter.decide(&FacingSettings::default(), &[hypothesis(0b010, 1.0)], 0b011);
        assert_eq!((got.exchanges, got.margin), (0b010, f64::INFINITY));
    }

    #[test]
    fn the_previous_frame_decides_a_near_tie() {
        let mut filter = FacingFilter::default();
        let settings = FacingSettings::default();
        let clear = [hypothesis(0b000, 2.0), hypothesis(0b010, 0.0)];
        assert_eq!(filter.decide(&settings, &clear, 0b011).exchanges, 0b000);
        let unclear = [hypothesis(0b000, 1.0), hypothesis(0b010, 1.1)];
        assert_eq!(filter.decide(&settings, &unclear, 0b011).exchanges, 0b000);
        let alone = FacingFilter::default().decide(&settings, &unclear, 0b011);
        assert_eq!(alone.exchanges, 0b010);
    }

    #[test]
    fn an_assignment_and_its_complement_are_equivalent() {
        let mut filter = FacingFilter::default();
        let settings = FacingSettings::default();
        let first = [hypothesis(0b011, 2.0), hypothesis(0b010, 0.0)];
        filter.decide(&settings, &first, 0b111);
        let then = [hypothesis(0b010, 1.1), hypothesis(0b100, 1.0)];
        assert_eq!(filter.decide(&settings, &then, 0b111).exchanges, 0b100);
    }

    #[test]
    fn a_missing_view_does_not_count_as_a_change() {
        let mut filter = FacingFilter::default();
        let settings = FacingSettings::default();
        let all = [hypothesis(0b110, 2.0), hypothesis(0b000, 0.0)];
        assert_eq!(filter.decide(&settings, &all, 0b111).exchanges, 0b110);
        // Without view 1 the same state is 0b100.
        let without = [hypothesis(0b100, 1.0), hypothesis(0b000, 1.0)];
        assert_eq!(filter.decide(&settings, &without, 0b101).exchanges, 0b100);
    }
}
