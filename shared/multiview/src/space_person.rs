//! A person of whom nothing is known, solved in space: which views name left and right the other way round, which look elsewhere, and
//! how tall the person is.

use geometry::Camera;
use nalgebra::Point3;

use crate::front::{FrontEvidence, front_log_ratio_of};
use crate::space_solve::solve_in_space;
use crate::space_tree::{
    LIMBS, N, SpacePose, SpaceSettings, SpaceView, best_on_tree, lengths_of, places,
};

/// A person in space, and what was decided about the views.
#[derive(Debug, Clone, PartialEq)]
pub struct SolvedPerson {
    /// The joints.
    pub pose: SpacePose,
    /// By view: whether the names of left and right were exchanged, of the arms and of the legs. `None` for a view that was left out
    /// because it contradicts all others.
    pub views: Vec<Option<[bool; 2]>>,
}

/// Solves for a person of whom nothing is known.
///
/// 1. Where pairs of views put the joints, and the bones of people of any stature, give a first solution.
/// 2. Unless it fits every view: of three views or more, one whose exchange of left and right gives a better first solution is
///    exchanged. Where left and right follow the picture ([`SpaceSettings::as_seen`]), those of every view may be exchanged
///    against those of the first; then what the views say of the direction in which the person faces counts as well.
/// 3. The arms or the legs of any view that fit better exchanged are exchanged.
/// 4. Unless the first solution fits every view: of four views or more, those that contradict all others are left out: their camera
///    was moved, or they look at somebody else.
/// 5. The bones of a person of the first solution's stature, and finer and finer grids, give the second one.
///
/// * Returns `None` if no joint is seen by two views.
pub fn solve_person(views: &[SpaceView<'_>], settings: &SpaceSettings) -> Option<SolvedPerson> {
    let mut used: Vec<usize> = (0..views.len()).collect();
    let mut views = views.to_vec();
    let n_views = views.len();
    let mut first = coarse(&views, settings)?;
    let fits_view = |it: &SpaceView<'_>| shortfall(it, &first, MOST) <= settings.good_fit;
    let fits = views.iter().all(fits_view);
    if settings.as_seen {
        first = first_as_seen(&mut views, first, settings)?;
    } else if !fits {
        first = first_of(&mut views, first, settings)?;
    }
    let mut changed = views.iter().any(|it| it.exchanged != [false; 2]);
    changed |= exchange(&mut views, &first, settings.margin);
    while !fits && let Some(worst) = contradicts(&views, settings) {
        views.remove(worst);
        used.remove(worst);
        changed = true;
    }
    if changed {
        first = coarse(&views, settings)?;
    }
    let all = places(&views, settings.n_places);
    let lengths = lengths_of(Some(&first.joints));
    let pose = solve_in_space(&views, &all, &lengths, settings)?;
    let mut of_views = vec![None; n_views];
    for (view, it) in used.into_iter().zip(&views) {
        of_views[view] = Some(it.exchanged);
    }
    Some(SolvedPerson {
        pose,
        views: of_views,
    })
}

/// The best choice among the places of the joints, for a person of any stature.
fn coarse(views: &[SpaceView<'_>], settings: &SpaceSettings) -> Option<SpacePose> {
    let all = places(views, settings.n_places);
    let lengths = lengths_of(None);
    best_on_tree(views, &all, (&lengths, &[None; N]), settings)
}

/// The best first solution with no view, or one view, exchanged.
///
/// * `best`: the one with none.
fn first_of(
    views: &mut [SpaceView<'_>],
    mut best: SpacePose,
    settings: &SpaceSettings,
) -> Option<SpacePose> {
    if views.len() < 3 {
        // Which one of two is exchanged cannot be told.
        return Some(best);
    }
    let mut exchanged = None;
    let mut most = best.energy + settings.margin;
    for nth in 0..views.len() {
        views[nth].exchanged = [true; 2];
        let found = coarse(views, settings)?;
        views[nth].exchanged = [false; 2];
        if found.energy > most {
            (most, exchanged, best) = (found.energy, Some(nth), found);
        }
    }
    if let Some(nth) = exchanged {
        views[nth].exchanged = [true; 2];
    }
    Some(best)
}

/// Most views of which every combination is tried.
const MOST_COMBINED: usize = 5;

/// The best first solution with any of the views but the first exchanged: of all combinations for a few views, else by exchanging one
/// after the other as long as that helps.
///
/// * `best`: the one with none.
fn first_as_seen(
    views: &mut [SpaceView<'_>],
    mut best: SpacePose,
    settings: &SpaceSettings,
) -> Option<SpacePose> {
    let mut chosen = 0usize;
    let n = views.len().min(usize::BITS as usize);
    if n <= MOST_COMBINED {
        for combination in (2..1usize << n).step_by(2) {
            if improves(views, combination, (&mut best, settings))? {
                chosen = combination;
            }
        }
    } else {
        let mut any = true;
        while any {
            any = false;
            for nth in 1..n {
                let combination = chosen ^ 1 << nth;
                if improves(views, combination, (&mut best, settings))? {
                    (chosen, any) = (combination, true);
                }
            }
        }
    }
    set_exchanged(views, chosen);
    Some(best)
}

/// Exchanges the views whose bits are set; whether the first solution is better than the best one, which it then becomes.
fn improves(
    views: &mut [SpaceView<'_>],
    combination: usize,
    (best, settings): (&mut SpacePose, &SpaceSettings),
) -> Option<bool> {
    set_exchanged(views, combination);
    let found = coarse(views, settings)?;
    let with_front = |it: &SpacePose| it.energy + front_agreement(views, it);
    let is_better = with_front(&found) > with_front(best);
    if is_better {
        *best = found;
    }
    Some(is_better)
}

/// How well the direction in which a solution faces, or the opposite one, agrees with what the views say of it, nats: whether the names
/// of all views are exchanged is decided elsewhere.
///
/// Shoulders that are turned by an angle to the viewing directions of two pairs of opposite cameras, and shoulders that are turned by as
/// much the other way, look alike but for their names: where left and right follow the picture, this alone tells them apart.
fn front_agreement(views: &[SpaceView<'_>], found: &SpacePose) -> f64 {
    let said = views.iter().map(|it| (it.camera, it.front));
    let said: Vec<(&Camera, FrontEvidence)> = said.collect();
    front_log_ratio_of(&found.joints, &said).abs() / 2.0
}

fn set_exchanged(views: &mut [SpaceView<'_>], combination: usize) {
    for (nth, view) in views.iter_mut().enumerate() {
        view.exchanged = [combination >> nth & 1 == 1; 2];
    }
}

/// The view without which the others agree best, if most of its joints lie elsewhere than in their solution; `None` if there is
/// none, or for fewer than four views, of which it cannot be told.
///
/// A view of which half is covered fits with the other half; one whose camera was turned fits with nothing.
fn contradicts(views: &[SpaceView<'_>], settings: &SpaceSettings) -> Option<usize> {
    const LEAST: usize = 4;
    if views.len() < LEAST {
        return None;
    }
    let judged = |nth: usize| -> Option<(usize, f64, f64)> {
        let others: Vec<SpaceView<'_>> = (0..views.len())
            .filter(|it| *it != nth)
            .map(|it| views[it])
            .collect();
        let found = coarse(&others, settings)?;
        let misfits = others.iter().map(|it| shortfall(it, &found, QUARTER));
        Some((nth, shortfall(&views[nth], &found, QUARTER), misfits.sum()))
    };
    let all = (0..views.len()).filter_map(judged);
    let contradicting = all.filter(|it| it.1 > settings.most_misfit);
    let worst = contradicting.min_by(|a, b| a.2.total_cmp(&b.2))?;
    Some(worst.0)
}

/// Share of the joints that fall short by at most the [`shortfall`] of a view: one that holds for a quarter only is exceeded by three
/// quarters.
const QUARTER: f64 = 0.25;
const MOST: f64 = 0.75;

/// By how much the joints that were found fit a view less than the best places that it knows for them: the smallest amount that
/// holds for a share of them.
fn shortfall(view: &SpaceView<'_>, found: &SpacePose, share: f64) -> f64 {
    let of_joint = |(joint, at): (usize, &Option<Point3<f64>>)| {
        let named = view.named(joint);
        let best = view.evidence.maxima(named).iter().map(|it| it.1);
        let best = f64::from(best.fold(view.evidence.floor(), f32::max));
        Some(best - view.at(named, &(*at)?))
    };
    let mut short: Vec<f64> = found
        .joints
        .iter()
        .enumerate()
        .filter_map(of_joint)
        .collect();
    short.sort_by(f64::total_cmp);
    let nth = (short.len() as f64 * share) as usize;
    short.get(nth).copied().unwrap_or(0.0)
}

/// Exchanges left and right in views that then fit better; returns whether there were any.
fn exchange(views: &mut [SpaceView<'_>], found: &SpacePose, margin: f64) -> bool {
    let mut any = false;
    for view in views {
        for (limb, pairs) in LIMBS.iter().enumerate() {
            let sum = |exchanged: bool| -> f64 {
                let of = |[right, left]: &[usize; 2]| {
                    let names = if exchanged {
                        [left, right]
                    } else {
                        [right, left]
                    };
                    let at = |name: usize, joint: usize| {
                        found.joints[joint].map_or(0.0, |it| view.at(name, &it))
                    };
                    at(*names[0], *right) + at(*names[1], *left)
                };
                pairs.iter().map(of).sum()
            };
            let own = view.exchanged[limb];
            if sum(!own) > sum(own) + margin {
                view.exchanged[limb] = !own;
                any = true;
            }
        }
    }
    any
}
