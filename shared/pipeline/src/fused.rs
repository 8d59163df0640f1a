//! The result of fusion, by pairs or by all views at once, under each assumption about which views see the person from behind.

use fmp::Pose;
use multiview::{Exchanges, PairEnergies, PairEstimate, is_exchanged, rank_facing};

use crate::{AllViewsHypothesis, AllViewsResult, PairResult};

/// Number of assumptions about front and back views that are compared over all views.
const N_HYPOTHESES: usize = 16;

/// The result of fusion, in pairs or all views at once.
pub(crate) enum Fused<'a> {
    /// The results of the pairs, in ascending order of their views.
    Pairs(Vec<&'a PairResult>),
    AllViews(&'a AllViewsResult),
}

impl<'a> Fused<'a> {
    pub(crate) fn n_pairs(&self) -> usize {
        match self {
            Self::Pairs(pairs) => pairs.len(),
            Self::AllViews(result) => result.views.len() * (result.views.len() - 1) / 2,
        }
    }

    /// Returns the best assumptions about which views see the person from behind, each with its energy over all views.
    pub(crate) fn facing(&self, present: Exchanges) -> Vec<(Exchanges, f64)> {
        match self {
            Self::Pairs(pairs) => {
                let energies = pairs.iter().filter_map(|pair| match &pair.hypotheses[..] {
                    [same, opposite] => Some(PairEnergies {
                        views: pair.views,
                        same_or_opposite: [same.energy, opposite.energy],
                    }),
                    _ => None,
                });
                rank_facing(present, &energies.collect::<Vec<_>>(), N_HYPOTHESES)
            }
            Self::AllViews(result) => {
                let all = result.hypotheses.iter();
                all.map(|hypothesis| (exchanges(result, hypothesis), hypothesis.estimate.energy))
                    .collect()
            }
        }
    }

    /// Returns the poses of a view, with their energies, under an assumption about which views see the person from behind: one per pair of
    /// the view, or a single one if all views were solved at once.
    pub(crate) fn poses(&self, view: usize, exchanged: Exchanges) -> Vec<(f64, &'a Pose)> {
        match self {
            Self::Pairs(pairs) => {
                let of_pair = |pair: &&'a PairResult| {
                    let side = pair.views.iter().position(|other| *other == view)?;
                    let estimate = chosen(pair, exchanged)?;
                    Some((estimate.energy, &estimate.poses[side]))
                };
                pairs.iter().filter_map(of_pair).collect()
            }
            Self::AllViews(result) => {
                let chosen = of_facing(result, exchanged);
                let idx = result.views.iter().position(|other| *other == view);
                let pose = |(hypothesis, idx): (&'a AllViewsHypothesis, usize)| {
                    (hypothesis.estimate.energy, &hypothesis.estimate.poses[idx])
                };
                chosen.zip(idx).map(pose).into_iter().collect()
            }
        }
    }
}

impl Fused<'_> {
    /// Returns the candidate of a view from which fusion started, under an assumption about which views see the person from behind; `None`
    /// if the view was not fused.
    pub(crate) fn start(&self, view: usize, exchanged: Exchanges) -> Option<usize> {
        match self {
            Self::Pairs(pairs) => pairs.iter().find_map(|pair| {
                let side = pair.views.iter().position(|other| *other == view)?;
                Some(chosen(pair, exchanged)?.start.candidates[side])
            }),
            Self::AllViews(result) => {
                let idx = result.views.iter().position(|other| *other == view)?;
                Some(of_facing(result, exchanged)?.candidates[idx])
            }
        }
    }
}

/// Returns the hypothesis that matches an assumption about which views see the person from behind, or the opposite assumption; otherwise
/// the best hypothesis.
fn of_facing(result: &AllViewsResult, exchanged: Exchanges) -> Option<&AllViewsHypothesis> {
    let all = result.views.iter().fold(0, |mask, view| mask | (1 << view));
    let fits = |hypothesis: &&AllViewsHypothesis| {
        [exchanged & all, !exchanged & all].contains(&exchanges(result, hypothesis))
    };
    let chosen = result.hypotheses.iter().find(fits);
    chosen.or_else(|| result.hypotheses.first())
}

/// Returns the views that a hypothesis assumes to be swapped relative to the first view.
fn exchanges(result: &AllViewsResult, hypothesis: &AllViewsHypothesis) -> Exchanges {
    let each = result.views.iter().zip(&hypothesis.exchanged);
    each.fold(0, |mask, (view, exchanged)| {
        mask | Exchanges::from(*exchanged) << view
    })
}

/// Returns the hypothesis of a pair that agrees with the decision for all views about who sees the person from behind.
fn chosen(pair: &PairResult, exchanged: Exchanges) -> Option<&PairEstimate> {
    let [first, second] = pair.views.map(|view| is_exchanged(exchanged, view));
    let opposite = first != second;
    pair.hypotheses
        .iter()
        .find(|hypothesis| hypothesis.start.exchanged == opposite)
        .or_else(|| pair.hypotheses.first())
}

#[cfg(test)]
mod tests {
    use fmp::Placement;
    use multiview::AllViewsEstimate;

    use super::*;

    /// Returns a pose identified by the column of its only part.
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

    /// Returns a result of views 1, 2 and 4 of a rig, under two assumptions.
    fn result() -> AllViewsResult {
        let hypothesis = |exchanged: [bool; 3], energy: f64, x: u16| AllViewsHypothesis {
            exchanged: exchanged.to_vec(),
            candidates: vec![0; 3],
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
    fn with_all_views_at_once_facings_are_ranked_by_energy() {
        let result = result();
        let got = Fused::AllViews(&result).facing(0b11110);
        assert_eq!(got, [(0b00100, 5.0), (0b10000, 3.0)]);
    }

    #[test]
    fn a_view_has_the_pose_of_the_chosen_facing_or_of_its_complement() {
        let result = result();
        let fused = Fused::AllViews(&result);
        let columns = |view, exchanged| {
            let poses = fused.poses(view, exchanged);
            poses.iter().map(|pose| pose.1.parts[0].x).collect::<Vec<_>>()
        };
        assert_eq!(columns(2, 0b00100), [11]);
        assert_eq!(columns(2, 0b10000), [21]);
        assert_eq!(columns(4, 0b00110), [22], "all but view 4");
        assert_eq!(columns(0, 0b00100), [0_u16; 0], "a view without a result");
    }
}
