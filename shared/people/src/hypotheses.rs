//! Candidate positions of a person's joint: positions proposed by rays, each with its support from the views.

use geometry::Sightline;
use nalgebra::Point3;

use crate::sight::{MOST_PROPOSING, Prior, Sight, agreement, passing};

/// Two rays propose no position if the distance between them exceeds this many standard deviations.
const APART: f64 = 3.0;
/// Maximum number of candidate positions for a joint.
const MOST: usize = 12;
/// Positions closer together than this count as the same, in metres.
const SAME_M: f64 = 0.02;
/// Maximum distance of a joint from its expected position, in metres.
pub(crate) const RADIUS_M: f64 = 0.6;
/// A single view proposes a position if its ray passes the expected position within this distance, in standard deviations of the expected
/// position.
const BESIDE: f64 = 3.0;

/// A keypoint of one view that may belong to a joint of the person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Candidate {
    pub(crate) view: usize,
    pub(crate) sight: Sight,
    /// Probability that the joint belongs to this person, 0 to 1.
    pub(crate) trust: f64,
}

impl Candidate {
    /// Returns how strongly the candidate supports a position.
    pub(crate) fn support(&self, place: &Point3<f64>) -> f64 {
        self.trust * self.sight.heat * agreement(self.sight.deviations(place))
    }
}

/// A position and its support from the views.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hypothesis {
    pub(crate) place: Point3<f64>,
    pub(crate) support: f64,
}

/// Returns true if a ray can support a position near the centre of the search.
pub(crate) fn may_reach(sight: &Sight, near: &Point3<f64>) -> bool {
    sight.distance(near) < RADIUS_M + APART * sight.sd(near)
}

/// Returns the support of a position: the sum over the views of the strongest support from a candidate of that view.
///
/// * `candidates`: sorted so that the candidates of one view are adjacent.
pub(crate) fn support(candidates: &[Candidate], place: &Point3<f64>) -> f64 {
    let views = candidates.chunk_by(|a, b| a.view == b.view);
    views
        .map(|view| {
            let each = view.iter().map(|candidate| candidate.support(place));
            each.fold(0.0, f64::max)
        })
        .sum()
}

/// Returns the views whose pairs of rays propose positions: of many views, those that see the joint best from directions that cross at wide
/// angles. Also returns true if some views do not propose positions.
fn proposing(candidates: &[Candidate]) -> (Vec<usize>, bool) {
    let views = candidates.chunk_by(|a, b| a.view == b.view);
    let weight = |candidate: &Candidate| candidate.trust * candidate.sight.heat;
    let best = views.filter_map(|view| {
        let best = view.iter().max_by(|a, b| weight(a).total_cmp(&weight(b)))?;
        let line = Sightline {
            direction: best.sight.direction,
            weight: weight(best),
        };
        Some((best.view, line))
    });
    let (views, lines): (Vec<usize>, Vec<Sightline>) = best.unzip();
    let chosen = geometry::widest_apart(&lines, MOST_PROPOSING).into_iter();
    let chosen: Vec<usize> = chosen.map(|nth| views[nth]).collect();
    let is_many = chosen.len() < views.len();
    (chosen, is_many)
}

/// Returns positions that are not the same as an earlier one. With many views, computing the support of each takes long.
fn spaced(places: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let mut kept: Vec<Point3<f64>> = Vec::new();
    for place in places {
        if kept.iter().all(|other| (other - place).norm() > SAME_M) {
            kept.push(*place);
        }
    }
    kept
}

/// Returns the candidate positions of a joint, the best supported first.
///
/// * `near`: centre of the search.
/// * `prior`: the expected position.
pub(crate) fn hypotheses(
    candidates: &[Candidate],
    near: Option<Point3<f64>>,
    prior: Option<Prior>,
) -> Vec<Hypothesis> {
    let mut places = Vec::new();
    let (proposing, is_many) = proposing(candidates);
    for (nth, a) in candidates.iter().enumerate() {
        let proposes = |candidate: &Candidate| proposing.contains(&candidate.view);
        let others = candidates[nth + 1..].iter().filter(|b| b.view != a.view && proposes(b));
        for b in others.filter(|_| proposes(a)) {
            let Some(at) = passing(&a.sight, &b.sight) else {
                continue;
            };
            let variance = a.sight.sd(&at.point).powi(2) + b.sight.sd(&at.point).powi(2);
            if at.gap * at.gap < APART * APART * variance {
                places.push(at.point);
            }
        }
        if let Some(prior) = prior {
            let place = a.sight.nearest(&prior.point);
            if (place - prior.point).norm() < BESIDE * prior.sd.hypot(a.sight.sd(&place)) {
                places.push(place);
            }
        }
    }
    if let Some(near) = near {
        places.retain(|place| (place - near).norm() < RADIUS_M);
    }
    places.extend(prior.map(|prior| prior.point));
    if is_many {
        places = spaced(&places);
    }
    let each = places.into_iter().map(|place| Hypothesis {
        place,
        support: support(candidates, &place),
    });
    let mut all: Vec<Hypothesis> = each.collect();
    all.sort_by(|a, b| b.support.total_cmp(&a.support));
    let mut kept: Vec<Hypothesis> = Vec::with_capacity(MOST);
    for one in all {
        if kept.len() == MOST {
            break;
        }
        if kept.iter().all(|other| (other.place - one.place).norm() > SAME_M) {
            kept.push(one);
        }
    }
    kept
}
