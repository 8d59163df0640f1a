//! The start of fusion for a frame: each view's candidate that shows the person, and whether each view sees the person from the front or
//! from behind.

use crate::consistency::PairTerms;
use crate::{Epipolar, PairInput, Settings, TypeTables, ViewInput};

/// Maximum number of combinations of candidates and swaps for an exhaustive search.
const MAX_STATES: usize = 200_000;

/// Maximum number of views, not counting the first, for which every assumption about front and back views is tried.
const MAX_FREE: usize = 6;

/// The common start of all views of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// Candidate of every view.
    pub candidates: Vec<usize>,
    /// For every view, true if left and right are swapped relative to the first view.
    pub exchanged: Vec<bool>,
    /// Sum of the joint energies (eq. 3) of all pairs at the start.
    pub energy: f64,
}

/// Chooses the candidates, and the swaps of left and right, that have the highest energy over all pairs.
///
/// The sum of eq. 3 over all pairs of views is maximised. The variables are one candidate per view, and for each view except the first,
/// whether it is swapped. (A swap in all views would change no energy.) With one candidate per view and `facing` off, this is the paper's
/// start. Up to 200 000 combinations are searched exhaustively. Beyond that, views are added one by one and then revised until nothing
/// changes. Ties go to the lower candidates. The terms between views are always the paper's, even under
/// [`EnergyKind::Released`](crate::EnergyKind::Released), because the authors' program does not choose a start. The alpha of that program
/// is meant for heat maps, and gives these terms a large weight.
///
/// * `views`: the views with a result, in a fixed order.
/// * `tables`: part-type tables of a pair of indices into `views`.
pub fn choose_start<'a>(
    settings: &Settings,
    views: &[ViewInput<'a>],
    tables: &dyn Fn(usize, usize) -> Option<&'a TypeTables>,
) -> Start {
    let all = views.iter().enumerate();
    let all = all.map(|(view, view_input)| states(settings, view_input, view));
    best_of(settings, views, tables, &all.collect::<Vec<_>>())
}

/// Returns the best start under every assumption about which views see the person from behind, highest
/// energy first.
///
/// For `n` views, there are `2^(n - 1)` assumptions if `facing` must be decided, otherwise one. With more than
/// seven views, only the assumption of [`choose_start`] and those that differ from it in one view are tried. Ties are
/// ordered by the binary number with bit `v - 1` for view `v`.
pub fn rank_starts<'a>(
    settings: &Settings,
    views: &[ViewInput<'a>],
    tables: &dyn Fn(usize, usize) -> Option<&'a TypeTables>,
) -> Vec<Start> {
    let can_exchange = |view: &ViewInput<'_>| view.plan.model().spec().mirror.is_some();
    let n_free = if settings.facing && views.iter().all(can_exchange) {
        views.len().saturating_sub(1)
    } else {
        0
    };
    let start = |pattern: usize| {
        let states = views.iter().enumerate().map(|(view, view_input)| {
            let exchanged = view > 0 && pattern >> (view - 1) & 1 == 1;
            let state = |candidate| State {
                candidate,
                exchanged,
            };
            tried(settings, view_input).map(state).collect()
        });
        best_of(settings, views, tables, &states.collect::<Vec<_>>())
    };
    let patterns: Vec<usize> = if n_free <= MAX_FREE {
        (0..1 << n_free).collect()
    } else {
        let best = choose_start(settings, views, tables).exchanged;
        let flipped = best.iter().skip(1).enumerate();
        let best = flipped.fold(0, |pattern, (bit, it)| pattern | usize::from(*it) << bit);
        // If the first view alone is swapped, all others are swapped instead.
        let all = (1 << n_free) - 1;
        let one = (0..n_free).map(|bit| best ^ 1 << bit);
        let mut some: Vec<usize> = one.chain([best, best ^ all]).collect();
        some.sort_unstable();
        some
    };
    let mut starts: Vec<Start> = patterns.into_iter().map(start).collect();
    starts.sort_by(|a, b| b.energy.total_cmp(&a.energy));
    starts
}

/// Returns the combination with the highest energy over all pairs.
fn best_of<'a>(
    settings: &Settings,
    views: &[ViewInput<'a>],
    tables: &dyn Fn(usize, usize) -> Option<&'a TypeTables>,
    states: &[Vec<State>],
) -> Start {
    let unary: Vec<Vec<f64>> = views
        .iter()
        .zip(states)
        .map(|(view_input, states)| {
            let weight = views.len().saturating_sub(1).max(1) as f64;
            let score = |state: &State| f64::from(view_input.candidates[state.candidate].score);
            states.iter().map(|state| weight * score(state)).collect()
        })
        .collect();
    let problem = Problem {
        unary,
        between: between(settings, views, states, tables),
    };
    let (chosen, energy) = problem.solve();
    let pick = |view: usize| states[view][chosen[view]];
    Start {
        candidates: (0..views.len()).map(|view| pick(view).candidate).collect(),
        exchanged: (0..views.len()).map(|view| pick(view).exchanged).collect(),
        energy,
    }
}

#[derive(Debug, Clone, Copy)]
struct State {
    candidate: usize,
    exchanged: bool,
}

fn states(settings: &Settings, view_input: &ViewInput<'_>, view: usize) -> Vec<State> {
    let can_exchange =
        settings.facing && view_input.plan.model().spec().mirror.is_some() && view > 0;
    [false, true]
        .into_iter()
        .take(1 + usize::from(can_exchange))
        .flat_map(|exchanged| {
            tried(settings, view_input).map(move |candidate| State {
                candidate,
                exchanged,
            })
        })
        .collect()
}

/// Returns the candidates of a view that may be the start: the best candidates that do not show another person.
fn tried(settings: &Settings, view_input: &ViewInput<'_>) -> impl Iterator<Item = usize> {
    let all = 0..view_input.candidates.len();
    let own = all.filter(|candidate| !view_input.is_other(*candidate));
    own.take(settings.n_candidates.max(1))
}

/// Energies between two views, indexed as `[first][second - first - 1][state of first][state of second]`.
type Between = Vec<Vec<Vec<Vec<f64>>>>;

fn between<'a>(
    settings: &Settings,
    views: &[ViewInput<'a>],
    states: &[Vec<State>],
    tables: &dyn Fn(usize, usize) -> Option<&'a TypeTables>,
) -> Between {
    let pair = |first: usize, second: usize| -> Vec<Vec<f64>> {
        let input = PairInput {
            views: [views[first], views[second]],
            epipolar: Epipolar::new(views[first].plan, views[second].plan),
            tables: tables(first, second),
        };
        let terms = [false, true].map(|exchanged| PairTerms::new(settings, &input, exchanged));
        let value = |a: &State, b: &State| {
            terms[usize::from(a.exchanged != b.exchanged)].between(
                &views[first].candidates[a.candidate],
                &views[second].candidates[b.candidate],
            )
        };
        states[first]
            .iter()
            .map(|a| states[second].iter().map(|b| value(a, b)).collect())
            .collect()
    };
    (0..views.len())
        .map(|first| (first + 1..views.len()).map(|second| pair(first, second)).collect())
        .collect()
}

/// A small pairwise maximisation over the complete graph of views.
#[derive(Debug)]
struct Problem {
    unary: Vec<Vec<f64>>,
    between: Between,
}

impl Problem {
    fn solve(&self) -> (Vec<usize>, f64) {
        let n_states = self
            .unary
            .iter()
            .try_fold(1_usize, |product, states| product.checked_mul(states.len()));
        if n_states.is_some_and(|n| n <= MAX_STATES) {
            let mut best = (vec![0; self.unary.len()], f64::NEG_INFINITY);
            self.search(&mut Vec::new(), 0.0, &mut best);
            best
        } else {
            self.climb()
        }
    }

    /// Returns the gain from `state` in the next view, given the views chosen so far.
    fn gain(&self, chosen: &[usize], state: usize) -> f64 {
        let view = chosen.len();
        let pairs: f64 = chosen
            .iter()
            .enumerate()
            .map(|(other, &other_state)| self.between[other][view - other - 1][other_state][state])
            .sum();
        self.unary[view][state] + pairs
    }

    fn search(&self, chosen: &mut Vec<usize>, value: f64, best: &mut (Vec<usize>, f64)) {
        if chosen.len() == self.unary.len() {
            if value > best.1 {
                *best = (chosen.clone(), value);
            }
            return;
        }
        for state in 0..self.unary[chosen.len()].len() {
            let gain = self.gain(chosen, state);
            chosen.push(state);
            self.search(chosen, value + gain, best);
            chosen.pop();
        }
    }

    fn value(&self, chosen: &[usize]) -> f64 {
        (0..chosen.len()).map(|view| self.gain(&chosen[..view], chosen[view])).sum()
    }

    /// Greedy search from every state of the first view, then coordinate ascent until nothing changes.
    fn climb(&self) -> (Vec<usize>, f64) {
        let mut best = (vec![0; self.unary.len()], f64::NEG_INFINITY);
        for first in 0..self.unary[0].len() {
            let mut chosen = vec![first];
            while chosen.len() < self.unary.len() {
                let next = argmax(self.unary[chosen.len()].len(), |state| {
                    self.gain(&chosen, state)
                });
                chosen.push(next);
            }
            let mut value = self.value(&chosen);
            loop {
                for view in 0..chosen.len() {
                    chosen[view] = argmax(self.unary[view].len(), |state| {
                        let mut trial = chosen.clone();
                        trial[view] = state;
                        self.value(&trial)
                    });
                }
                let raised = self.value(&chosen);
                if raised <= value {
                    break;
                }
                value = raised;
            }
            if value > best.1 {
                best = (chosen, value);
            }
        }
        best
    }
}

fn argmax(n: usize, value: impl Fn(usize) -> f64) -> usize {
    let mut best = (0, f64::NEG_INFINITY);
    for idx in 0..n {
        let value = value(idx);
        if value > best.1 {
            best = (idx, value);
        }
    }
    best.0
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;

    fn problems() -> impl Strategy<Value = Problem> {
        vec(vec(-2.0..2.0_f64, 3), 4).prop_flat_map(|unary| {
            let pairs = vec(vec(vec(-2.0..2.0_f64, 3), 3), 6);
            pairs.prop_map(move |mut pairs| {
                let between =
                    (0..4).map(|first| (first + 1..4).map(|_| pairs.remove(0)).collect()).collect();
                Problem {
                    unary: unary.clone(),
                    between,
                }
            })
        })
    }

    proptest! {
        #[test]
        fn the_exhaustive_search_finds_the_best_assignment(problem in problems()) {
            let (chosen, value) = problem.solve();
            prop_assert!((problem.value(&chosen) - value).abs() < 1e-9);
            for state in 0..81 {
                let other = [state % 3, state / 3 % 3, state / 9 % 3, state / 27];
                prop_assert!(problem.value(&other) <= value + 1e-9);
            }
        }

        #[test]
        fn the_greedy_search_ends_where_no_single_view_can_improve(problem in problems()) {
            let (chosen, value) = problem.climb();
            for view in 0..4 {
                for state in 0..3 {
                    let mut other = chosen.clone();
                    other[view] = state;
                    prop_assert!(problem.value(&other) <= value + 1e-9);
                }
            }
        }
    }
}
