//! What fusion found, by pairs or by all views at once, under every assumption about facing.

use fmp::Pose;
use multiview::{Exchanges, PairEnergies, PairEstimate, is_exchanged, rank_facing};

use crate::{AllViewsHypothesis, AllViewsResult, PairResult};

/// Assignments of facing that are compared with all views at once.
const N_HYPOTHESES: usize = 16;

/// What fusion found, either way.
pub(crate) enum Fused<'a> {
    /// In ascending order of their views.
    Pairs(Vec<&'a PairResult>),
    AllViews(&'a AllViewsResult),
}

impl<'a> Fused<'a> {
    pub(crate) fn n_pairs(&self) -> usize {
        match self {
            Self::Pairs(pairs) => pairs.len(),
            Self::AllViews(it) => it.views.len() * (it.views.len() - 1) / 2,
        }
    }

    /// The assumptions about facing that are worth a look, with the energy of all views.
    pub(crate) fn facing(&self, present: Exchanges) -> Vec<(Exchanges, f64)> {
        match self {
            Self::Pairs(pairs) => {
                let energies = pairs.iter().filter_map(|it| match &it.hypotheses[..] {
                    [same, opposite] => Some(PairEnergies {
                        views: it.views,
                        same_or_opposite: [same.energy, opposite.energy],
                    }),
                    _ => None,
                });
                rank_facing(present, &energies.collect::<Vec<_>>(), N_HYPOTHESES)
            }
            Self::AllViews(it) => {
                let all = it.hypotheses.iter();
                all.map(|of| (exchanges(it, of), of.estimate.energy))
                    .collect()
            }
        }
    }

    /// What a view was found to be under an assumption about facing: a pose of each of its pairs, or
    /// the one of all views, with its energy.
    pub(crate) fn poses(&self, view: usize, exchanged: Exchanges) -> Vec<(f64, &'a Pose)> {
        match self {
            Self::Pairs(pairs) => {
                let of_pair = |pair: &&'a PairResult| {
                    let side = pair.views.iter().position(|it| *it == view)?;
                    let estimate = chosen(pair, exchanged)?;
                    Some((estimate.energy, &estimate.poses[side]))
                };
                pairs.iter().filter_map(of_pair).collect()
            }
            Self::AllViews(found) => {
                let all = found.views.iter().fold(0, |mask, view| mask | (1 << view));
                let fits = |it: &&AllViewsHypothesis| {
                    [exchanged & all, !exchanged & all].contains(&exchanges(found, it))
                };
                let chosen = found.hypotheses.iter().find(fits);
                let chosen = chosen.or_else(|| found.hypotheses.first());
                let place = found.views.iter().position(|it| *it == view);
                let pose = |(it, place): (&'a AllViewsHypothesis, usize)| {
                    (it.estimate.energy, &it.estimate.poses[place])
                };
                chosen.zip(place).map(pose).into_iter().collect()
            }
        }
    }
}

/// The views that a hypothesis takes to be exchanged with respect to the first.
fn exchanges(found: &AllViewsResult, hypothesis: &AllViewsHypothesis) -> Exchanges {
    let each = found.views.iter().zip(&hypothesis.exchanged);
    each.fold(0, |mask, (view, it)| mask | Exchanges::from(*it) << view)
}

/// The hypothesis of a pair that agrees with the joint decision.
fn chosen(pair: &PairResult, exchanged: Exchanges) -> Option<&PairEstimate> {
    let [first, second] = pair.views.map(|view| is_exchanged(exchanged, view));
    let opposite = first != second;
    pair.hypotheses
        .iter()
        .find(|it| it.start.exchanged == opposite)
        .or_else(|| pair.hypotheses.first())
}

#[cfg(test)]
mod tests {
    use fmp::Placement;
    use multiview::AllViewsEstimate;

    use super::*;

    /// A pose that is told from others by the place of its only part.
    fn pose(x: u16) -> Pose {
        let at = Placement {
            x,
            y: 0,
            mixture: 0,
        };
        Pose {
            score: 0.0,
            level: 0,
            parts: vec![at],
        }
    }

    /// Views 1, 2 and 4 of a rig, under two assumptions.
    fn answer() -> AllViewsResult {
        let hypothesis = |exchanged: [bool; 3], energy: f64, x: u16| AllViewsHypothesis {
            exchanged: exchanged.to_vec(),
            estimate: AllViewsEstimate {
                energy,
                iterations: Vec::new(),
                converged: true,
                active: 1.0,
                poses: (0..3).map(|view| pose(x + view)).collect(),
            },
        };
        AllViewsResult {
            views: vec![1, 2, 4],
            hypotheses: vec![
                hypothesis([false, true, false], 5.0, 10),
                hypothesis([false, false, true], 3.0, 20),
            ],
        }
    }

    #[test]
    fn all_views_at_once_rank_facing_by_their_energies() {
        let answer = answer();
        let got = Fused::AllViews(&answer).facing(0b11110);
        assert_eq!(got, [(0b00100, 5.0), (0b10000, 3.0)]);
    }

    #[test]
    fn a_view_has_the_pose_of_the_assumption_that_was_chosen_or_of_its_complement() {
        let answer = answer();
        let found = Fused::AllViews(&answer);
        let place = |view, exchanged| {
            let poses = found.poses(view, exchanged);
            poses.iter().map(|it| it.1.parts[0].x).collect::<Vec<_>>()
        };
        assert_eq!(place(2, 0b00100), [11]);
        assert_eq!(place(2, 0b10000), [21]);
        assert_eq!(place(4, 0b00110), [22], "all but view 4");
        assert_eq!(place(0, 0b00100), [0_u16; 0], "it did not answer");
    }
}
