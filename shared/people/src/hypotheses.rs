//! Candidate positions of a person's joint: positions proposed by rays, each with its support from the views.

use nalgebra::Point3;

use crate::sight::{Prior, Sight, agreement, passing};

/// Two rays propose no position if the distance between them exceeds this many standard deviations.
const APART: f64 = 3.0;
/// Maximum number of candidate positions for a joint.
const MOST: usize = 12;
/// Positions closer together than this count as the same, in metres.
const SAME_M: f64 = 0.02;
/// Maximum distance of a joint from its expected position, in metres.
const RADIUS_M: f64 = 0.6;
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
    for (nth, a) in candidates.iter().enumerate() {
        for b in candidates[nth + 1..].iter().filter(|b| b.view != a.view) {
            let Some(at) = passing(&a.sight, &b.sight) else {
                continue;
            };
            let sd = a.sight.sd(&at.point).hypot(b.sight.sd(&at.point));
            if at.gap < APART * sd {
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
