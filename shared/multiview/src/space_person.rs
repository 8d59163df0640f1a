//! Solves for a person in space without prior knowledge. Decides which views have left and right swapped, which views show something else,
//! and how tall the person is.

use geometry::{Camera, Sightline};
use nalgebra::Point3;

use crate::front::{FrontEvidence, front_log_ratio_of};
use crate::space_places::{Choices, Crossings, Used};
use crate::space_solve::solve_in_space;
use crate::space_tree::{BoneLength, SpacePose, SpaceSettings, TREE, best_on_tree, lengths_of};
use crate::space_view::{LIMBS, N, SpaceView};

/// A person in space, and the decisions about the views.
#[derive(Debug, Clone, PartialEq)]
pub struct SolvedPerson {
    /// Positions of the joints.
    pub pose: SpacePose,
    /// For every view, whether left and right were swapped, for the arms and for the legs. `None` for a view that was left out because it
    /// contradicts all others.
    pub views: Vec<Option<[bool; 2]>>,
}

/// Solves for a person about whom nothing is known.
///
/// 1. A first solution is found among the places suggested by pairs of views, with bone lengths for people of any stature.
/// 2. If the first solution does not fit every view, and there are at least three views, left and right are swapped in one view after the
///    other. A swap is kept if it gives a better first solution. If views name left and right as they appear in the picture
///    ([`SpaceSettings::as_seen`]), any view may be swapped relative to the first. Then the views' evidence of the direction in which the
///    person faces counts as well.
/// 3. Left and right arms, or left and right legs, of a view are swapped if they fit better that way.
/// 4. If the first solution does not fit every view, and there are at least four views, views that contradict all others are left out.
///    Their camera was moved, or they show another person.
/// 5. A second solution is found on finer and finer grids, with bone lengths for the stature of the first solution.
///
/// With many views, steps 1 to 4 use only those that see the person best. Each other view is compared with their solution: its left and right
/// are swapped if it then fits better, and it is left out if it contradicts the solution.
///
/// * Returns `None` if no joint is seen by at least two views.
pub fn solve_person(views: &[SpaceView<'_>], settings: &SpaceSettings) -> Option<SolvedPerson> {
    let first = first_views(views);
    let found = solve_from(&first, views, settings);
    if found.is_some() || first.len() == views.len() {
        return found;
    }
    solve_from(&(0..views.len()).collect::<Vec<_>>(), views, settings)
}

/// Solves for a person; the first solution is found from the views of the given indices.
fn solve_from(
    first: &[usize],
    views: &[SpaceView<'_>],
    settings: &SpaceSettings,
) -> Option<SolvedPerson> {
    let shown: Vec<SpaceView<'_>> = first.iter().map(|view| views[*view]).collect();
    let mut solver = FirstSolver {
        views: &shown,
        crossings: Crossings::new(&shown),
        lengths: lengths_of(None),
        settings,
    };
    let (used, pose) = solver.decide()?;
    let mut choices = solver.choices(&used);
    let coarse: Vec<SpaceView<'_>> = used.iter().map(|view| solver.shown(*view)).collect();
    let mut exchanged = vec![None; views.len()];
    for view in used {
        exchanged[first[view.view]] = Some(view.exchanged);
    }
    for (nth, view) in views.iter().enumerate().filter(|(nth, _)| !first.contains(nth)) {
        let view = SpaceView {
            exchanged: better_sides(view, &pose, settings).unwrap_or(view.exchanged),
            ..*view
        };
        if shortfall(&view, &pose, QUARTER) <= settings.most_misfit {
            exchanged[nth] = Some(view.exchanged);
        }
    }
    let used = views.iter().zip(&exchanged);
    let used = used.filter_map(|(view, exchanged)| {
        Some(SpaceView {
            exchanged: (*exchanged)?,
            ..*view
        })
    });
    let used: Vec<SpaceView<'_>> = used.collect();
    let needs_all = first.len() < views.len() && choices.complete(&used, settings.n_places);
    let coarse = if needs_all { &used } else { &coarse };
    let lengths = lengths_of(Some(&pose.joints));
    Some(SolvedPerson {
        pose: solve_in_space([&used, coarse], &choices, &lengths, settings)?,
        views: exchanged,
    })
}

/// Maximum number of views from which the first solution is found. Its time grows with the cube of their number.
const MOST_FIRST: usize = 6;

/// Returns the views from which the first solution is found: those that see the person well, from directions that cross at wide angles.
fn first_views(views: &[SpaceView<'_>]) -> Vec<usize> {
    if views.len() <= MOST_FIRST {
        return (0..views.len()).collect();
    }
    let lines: Vec<Sightline> = views.iter().map(SpaceView::sightline).collect();
    geometry::widest_apart(&lines, MOST_FIRST)
}

/// Maximum number of views for which every combination is tried.
const MOST_COMBINED: usize = 5;

/// Computes first solutions: for a person of any stature, among the places suggested by pairs of views.
struct FirstSolver<'a> {
    views: &'a [SpaceView<'a>],
    crossings: Crossings<'a>,
    lengths: [BoneLength; TREE.len()],
    settings: &'a SpaceSettings,
}

impl<'a> FirstSolver<'a> {
    /// Returns the views that agree, with their left and right as in the solution, and the first solution.
    fn decide(&mut self) -> Option<(Vec<Used>, SpacePose)> {
        let given = self.views.iter().enumerate();
        let given = given.map(|(view, shown)| Used {
            view,
            exchanged: shown.exchanged,
        });
        let mut used: Vec<Used> = given.collect();
        let mut first = self.solve(&used)?;
        let fits = used
            .iter()
            .all(|view| shortfall(&self.shown(*view), &first, MOST) <= self.settings.good_fit);
        if self.settings.as_seen {
            first = self.as_seen(&mut used, first)?;
        } else if !fits {
            first = self.with_one_exchanged(&mut used, first)?;
        }
        let mut changed = used.iter().any(|view| view.exchanged != [false; 2]);
        changed |= self.exchange(&mut used, &first);
        while !fits && let Some(worst) = self.contradicts(&used) {
            used.remove(worst);
            changed = true;
        }
        if changed {
            first = self.solve(&used)?;
        }
        Some((used, first))
    }

    fn choices(&mut self, used: &[Used]) -> Choices {
        self.crossings.choices(used, self.settings.n_places)
    }

    fn solve(&mut self, used: &[Used]) -> Option<SpacePose> {
        let choices = self.choices(used);
        best_on_tree(&choices, (&self.lengths, &[None; N]), self.settings)
    }

    fn shown(&self, used: Used) -> SpaceView<'a> {
        SpaceView {
            exchanged: used.exchanged,
            ..self.views[used.view]
        }
    }

    /// Returns the best first solution with left and right swapped in no view, or in one view.
    ///
    /// * `best`: the solution with no view swapped.
    fn with_one_exchanged(&mut self, used: &mut [Used], mut best: SpacePose) -> Option<SpacePose> {
        if used.len() < 3 {
            // With two views, it is unknown which one is swapped.
            return Some(best);
        }
        let mut exchanged = None;
        let mut most = best.energy + self.settings.margin;
        for nth in 0..used.len() {
            used[nth].exchanged = [true; 2];
            let found = self.solve(used)?;
            used[nth].exchanged = [false; 2];
            if found.energy > most {
                (most, exchanged, best) = (found.energy, Some(nth), found);
            }
        }
        if let Some(nth) = exchanged {
            used[nth].exchanged = [true; 2];
        }
        Some(best)
    }

    /// Returns the best first solution with left and right swapped in any of the views except the first. With few views, all combinations
    /// are tried; otherwise, views are swapped one after the other as long as that helps.
    ///
    /// * `best`: the solution with no view swapped.
    fn as_seen(&mut self, used: &mut [Used], mut best: SpacePose) -> Option<SpacePose> {
        let mut chosen = 0usize;
        let n = used.len().min(usize::BITS as usize);
        if n <= MOST_COMBINED {
            for combination in (2..1usize << n).step_by(2) {
                if self.improves(used, combination, &mut best)? {
                    chosen = combination;
                }
            }
        } else {
            let mut any = true;
            while any {
                any = false;
                for nth in 1..n {
                    let combination = chosen ^ 1 << nth;
                    if self.improves(used, combination, &mut best)? {
                        (chosen, any) = (combination, true);
                    }
                }
            }
        }
        set_exchanged(used, chosen);
        Some(best)
    }

    /// Swaps left and right in the views whose bits are set. If this gives a better first solution than `best`, replaces `best` and returns
    /// true.
    fn improves(
        &mut self,
        used: &mut [Used],
        combination: usize,
        best: &mut SpacePose,
    ) -> Option<bool> {
        set_exchanged(used, combination);
        let found = self.solve(used)?;
        let with_front = |pose: &SpacePose| pose.energy + front_agreement(self.views, pose);
        let is_better = with_front(&found) > with_front(best);
        if is_better {
            *best = found;
        }
        Some(is_better)
    }

    /// Returns the view without which the others agree best, if most of its joints contradict the solution of the others. Returns `None` if
    /// there is no such view. Also returns `None` for fewer than four views, because they cannot show which view is wrong.
    ///
    /// If half of the person is hidden in a view, the other half still fits; if the camera was moved, nothing fits.
    fn contradicts(&mut self, used: &[Used]) -> Option<usize> {
        const LEAST: usize = 4;
        if used.len() < LEAST {
            return None;
        }
        let mut worst: Option<(usize, f64)> = None;
        for nth in 0..used.len() {
            let mut others = used.to_vec();
            let own = self.shown(others.remove(nth));
            let Some(found) = self.solve(&others) else {
                continue;
            };
            if shortfall(&own, &found, QUARTER) <= self.settings.most_misfit {
                continue;
            }
            let misfits = others.iter().map(|view| self.shown(*view));
            let misfit = misfits.map(|view| shortfall(&view, &found, QUARTER)).sum();
            if worst.is_none_or(|(_, least)| misfit < least) {
                worst = Some((nth, misfit));
            }
        }
        worst.map(|(nth, _)| nth)
    }

    /// Swaps left and right in the views that then fit better; returns true if there were any.
    fn exchange(&self, used: &mut [Used], found: &SpacePose) -> bool {
        let mut any = false;
        for used in used {
            if let Some(exchanged) = better_sides(&self.shown(*used), found, self.settings) {
                used.exchanged = exchanged;
                any = true;
            }
        }
        any
    }
}

/// Returns the swaps of left and right with which a view fits a solution better; `None` if it fits best as it is.
fn better_sides(
    view: &SpaceView<'_>,
    found: &SpacePose,
    settings: &SpaceSettings,
) -> Option<[bool; 2]> {
    let mut best = view.exchanged;
    for (limb, pairs) in LIMBS.iter().enumerate() {
        let sum = |exchanged: bool| -> f64 {
            let pair = |[right, left]: &[usize; 2]| {
                let names = if exchanged {
                    [left, right]
                } else {
                    [right, left]
                };
                let at = |name: usize, joint: usize| {
                    found.joints[joint].map_or(0.0, |place| view.at(name, &place))
                };
                at(*names[0], *right) + at(*names[1], *left)
            };
            pairs.iter().map(pair).sum()
        };
        let own = view.exchanged[limb];
        if sum(!own) > sum(own) + settings.margin {
            best[limb] = !own;
        }
    }
    (best != view.exchanged).then_some(best)
}

fn set_exchanged(used: &mut [Used], combination: usize) {
    for (nth, view) in used.iter_mut().enumerate() {
        view.exchanged = [combination >> nth & 1 == 1; 2];
    }
}

/// Returns how well the direction in which a solution faces, or the opposite direction, agrees with the evidence of the views, in nats.
/// Elsewhere, it is decided whether left and right are swapped in all views.
///
/// Consider two pairs of opposite cameras, and a person whose shoulders are rotated by some angle from the viewing directions. If the
/// shoulders are rotated by the same angle in the other direction, the pictures are the same except for the names of left and right. If
/// views name left and right as they appear in the picture, only this function distinguishes the two cases.
fn front_agreement(views: &[SpaceView<'_>], found: &SpacePose) -> f64 {
    let said = views.iter().map(|view| (view.camera, view.front));
    let said: Vec<(&Camera, FrontEvidence)> = said.collect();
    front_log_ratio_of(&found.joints, &said).abs() / 2.0
}

/// Quantile of the joints used for the [`shortfall`] of a view: three quarters of the joints fall short by more than this quantile.
const QUARTER: f64 = 0.25;
const MOST: f64 = 0.75;

/// Returns by how much less the solved joints fit a view than the view's own best positions do, as a quantile over the joints.
fn shortfall(view: &SpaceView<'_>, found: &SpacePose, share: f64) -> f64 {
    let of_joint = |(joint, at): (usize, &Option<Point3<f64>>)| {
        let named = view.named(joint);
        let best = view.evidence.maxima(named).iter().map(|maximum| maximum.1);
        let best = f64::from(best.fold(view.evidence.floor(), f32::max));
        Some(best - view.at(named, &(*at)?))
    };
    let mut short: Vec<f64> = found.joints.iter().enumerate().filter_map(of_joint).collect();
    short.sort_by(f64::total_cmp);
    let nth = (short.len() as f64 * share) as usize;
    short.get(nth).copied().unwrap_or(0.0)
}
