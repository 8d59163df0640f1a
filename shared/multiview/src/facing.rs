//! Which views see the person from behind: ranked by the energies of all pairs, followed over time.

/// What one pair found under either assumption about its two views.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairEnergies {
    /// The views.
    pub views: [usize; 2],
    /// Joint energy if both views see the same side of the body, and if they see opposite sides.
    pub same_or_opposite: [f64; 2],
}

/// Most views for which all assignments are tried.
const MAX_VIEWS: usize = 16;

/// One exchange of left and right per view, bit `v` for view `v`.
pub type Exchanges = u32;

/// The assignments of exchanges that the pairs like best.
///
/// A pair tells only whether its two views agree, so the first view that is there is never exchanged
/// here; exchanging all views is another matter (see [`FacingFilter`]). Of a view without a pair the
/// energies say nothing: it is exchanged and not.
///
/// * `present`: bit `v` is set if view `v` is there; the pairs' views are.
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
    let paired = pairs.iter().flat_map(|it| it.views);
    let present = paired.fold(present, |mask, view| mask | 1 << view);
    let seen: Vec<usize> = (0..Exchanges::BITS as usize)
        .filter(|view| is_exchanged(present, *view))
        .collect();
    assert!(seen.len() <= MAX_VIEWS, "at most {MAX_VIEWS} views");
    let spread = |free: u32| {
        let later = seen.iter().skip(1).enumerate();
        later.fold(0, |mask, (i, view)| mask | (free >> i & 1) << view)
    };
    let energy = |mask: Exchanges| -> f64 {
        let of_pair = |it: &PairEnergies| {
            let opposite = is_exchanged(mask, it.views[0]) != is_exchanged(mask, it.views[1]);
            it.same_or_opposite[usize::from(opposite)]
        };
        pairs.iter().map(of_pair).sum()
    };
    let mut ranked: Vec<(Exchanges, f64)> = (0..1_u32 << seen.len().saturating_sub(1))
        .map(spread)
        .map(|mask| (mask, energy(mask)))
        .collect();
    ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
    ranked.truncate(limit.max(1));
    ranked
}

/// Whether a view is exchanged.
pub fn is_exchanged(exchanges: Exchanges, view: usize) -> bool {
    exchanges >> view & 1 == 1
}

/// One assignment of a frame, and what speaks for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FacingHypothesis {
    /// Exchanges with respect to the first view.
    pub exchanges: Exchanges,
    /// Energy of all views together under it.
    pub energy: f64,
    /// How much the labelled skeleton looks anatomically right under it; the complement looks as much
    /// wrong (see [`anatomical_evidence`](crate::anatomical_evidence)).
    pub anatomy: f64,
}

/// How strongly a frame's facing holds on to that of the frame before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FacingSettings {
    /// Energy that it costs to exchange one view from one frame to the next.
    pub change_cost: f64,
    /// Share of what earlier frames said that is still believed in the next one, 0..1. The default
    /// forgets half in 34 frames: people keep facing one way for longer than a stoop or a stride lasts.
    pub memory: f64,
    /// Energy of one unit of anatomical evidence.
    pub anatomy_weight: f64,
}

impl Default for FacingSettings {
    fn default() -> Self {
        Self {
            change_cost: 1.0,
            memory: 0.98,
            anatomy_weight: 1.0,
        }
    }
}

/// The decision of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facing {
    /// Which views see the person from behind.
    pub exchanges: Exchanges,
    /// The hypothesis it belongs to, an index into those given.
    pub hypothesis: usize,
    /// How far it is ahead of the best assignment in which other views agree; infinite if there is none.
    pub margin: f64,
}

/// Follows the facing of all views over time: a hidden Markov model, filtered by its best path.
///
/// The score of an assignment is what this frame says for it plus the best way to get there from the
/// frame before, where every exchanged view costs. One frame alone is decided by its own energies.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FacingFilter {
    scores: Vec<(Exchanges, f64)>,
}

impl FacingFilter {
    /// Decides a frame.
    ///
    /// * `hypotheses`: the frame's assignments, relative to the first view; never empty.
    /// * `present`: bit `v` is set if view `v` has a say in this frame.
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
        let mut scored: Vec<(usize, Exchanges, f64)> = Vec::with_capacity(2 * hypotheses.len());
        for (i, it) in hypotheses.iter().enumerate() {
            let anatomy = settings.anatomy_weight * it.anatomy;
            let complement = !it.exchanges & present;
            for (exchanges, said) in [
                (it.exchanges, it.energy + anatomy),
                (complement, it.energy - anatomy),
            ] {
                let score = said + self.best_way(settings, exchanges, present);
                scored.push((i, exchanges, score));
            }
        }
        assert!(!scored.is_empty(), "at least one hypothesis");
        let (hypothesis, exchanges, top) =
            scored
                .iter()
                .copied()
                .fold((0, 0, f64::NEG_INFINITY), |best, it| {
                    if it.2 > best.2 { it } else { best }
                });
        let runner_up = scored
            .iter()
            .filter(|it| it.0 != hypothesis)
            .map(|it| it.2)
            .fold(f64::NEG_INFINITY, f64::max);
        self.scores = scored.iter().map(|it| (it.1, it.2 - top)).collect();
        Facing {
            exchanges,
            hypothesis,
            margin: top - runner_up,
        }
    }

    fn best_way(&self, settings: &FacingSettings, to: Exchanges, present: Exchanges) -> f64 {
        let from = |&(exchanges, score): &(Exchanges, f64)| {
            let changed = ((exchanges ^ to) & present).count_ones();
            settings.memory * score - settings.change_cost * f64::from(changed)
        };
        let best = self
            .scores
            .iter()
            .map(from)
            .fold(f64::NEG_INFINITY, f64::max);
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

    fn hypothesis(exchanges: Exchanges, energy: f64, anatomy: f64) -> FacingHypothesis {
        FacingHypothesis {
            exchanges,
            energy,
            anatomy,
        }
    }

    #[test]
    fn views_from_behind_are_told_from_those_in_front() {
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
    fn one_pair_is_outvoted_by_the_others() {
        // The pair (1, 2) alone would say "same".
        let pairs = [
            pair(0, 1, 2.0, 1.0),
            pair(0, 2, 1.0, 2.0),
            pair(1, 2, 1.2, 1.0),
        ];
        assert_eq!(rank_facing(0b111, &pairs, 1)[0].0, 0b100);
    }

    #[test]
    fn a_view_that_is_missing_is_left_alone() {
        let got = rank_facing(0b110, &[pair(1, 2, 0.0, 1.0)], 8);
        assert_eq!(got, [(0b100, 1.0), (0b000, 0.0)]);
    }

    #[test]
    fn of_a_view_without_a_pair_both_are_possible() {
        let got = rank_facing(0b111, &[pair(1, 2, 0.0, 1.0)], 8);
        let opposite = [(0b010, 1.0), (0b100, 1.0)];
        assert_eq!(got, [opposite, [(0b000, 0.0), (0b110, 0.0)]].concat());
        assert_eq!(rank_facing(0b11, &[], 8), [(0b00, 0.0), (0b10, 0.0)]);
    }

    #[test]
    fn anatomy_tells_an_assignment_from_its_complement() {
        let mut filter = FacingFilter::default();
        let settings = FacingSettings::default();
        let got = filter.decide(&settings, &[hypothesis(0b010, 1.0, -0.3)], 0b011);
        assert_eq!(got.exchanges, 0b001);
        assert_eq!(got.margin, f64::INFINITY);
    }

    #[test]
    fn the_previous_frame_breaks_a_near_tie() {
        let mut filter = FacingFilter::default();
        let settings = FacingSettings::default();
        let clear = [hypothesis(0b000, 2.0, 0.2), hypothesis(0b010, 0.0, 0.0)];
        assert_eq!(filter.decide(&settings, &clear, 0b011).exchanges, 0b000);
        let unclear = [hypothesis(0b000, 1.0, 0.1), hypothesis(0b010, 1.1, 0.1)];
        assert_eq!(filter.decide(&settings, &unclear, 0b011).exchanges, 0b000);
        let alone = FacingFilter::default().decide(&settings, &unclear, 0b011);
        assert_eq!(alone.exchanges, 0b010);
    }

    #[test]
    fn a_person_who_turns_round_is_followed() {
        let mut filter = FacingFilter::default();
        let settings = FacingSettings::default();
        let front = [hypothesis(0b00, 1.0, 0.5)];
        let back = [hypothesis(0b00, 1.0, -0.5)];
        for _ in 0..5 {
            assert_eq!(filter.decide(&settings, &front, 0b11).exchanges, 0b00);
        }
        let n_held = (0..30)
            .take_while(|_| filter.decide(&settings, &back, 0b11).exchanges == 0b00)
            .count();
        assert!((1..30).contains(&n_held), "held for {n_held} frames");
    }

    #[test]
    fn a_view_that_is_missing_has_no_say_in_a_change() {
        let mut filter = FacingFilter::default();
        let settings = FacingSettings::default();
        let all = [hypothesis(0b110, 2.0, 0.2), hypothesis(0b000, 0.0, 0.2)];
        assert_eq!(filter.decide(&settings, &all, 0b111).exchanges, 0b110);
        // Without view 1 the same state is called 0b100.
        let without = [hypothesis(0b100, 1.0, 0.1), hypothesis(0b000, 1.0, 0.1)];
        assert_eq!(filter.decide(&settings, &without, 0b101).exchanges, 0b100);
    }
}
