//! Where a joint of a person may be: places that rays propose, and how far the views support each.

use nalgebra::Point3;

use crate::sight::{Prior, Sight, agreement, passing};

/// Rays that pass each other at more standard deviations propose nothing.
const APART: f64 = 3.0;
/// The most places of a joint.
const MOST: usize = 12;
/// Places that are nearer are the same, metres.
const SAME_M: f64 = 0.02;
/// A joint is at most this far from where it was expected, metres.
const RADIUS_M: f64 = 0.6;
/// A single view proposes a place if it passes by as near as this, in standard deviations of what is expected.
const BESIDE: f64 = 3.0;

/// A place in a view that may be a joint of a person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Candidate {
    pub(crate) view: usize,
    pub(crate) sight: Sight,
    /// How likely it is this person's, 0 to 1.
    pub(crate) trust: f64,
}

impl Candidate {
    /// How far it supports a place.
    pub(crate) fn support(&self, place: &Point3<f64>) -> f64 {
        self.trust * self.sight.heat * agreement(self.sight.deviations(place))
    }
}

/// A place, and how far the views support it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hypothesis {
    pub(crate) place: Point3<f64>,
    pub(crate) support: f64,
}

/// Support of a place: in every view that of the candidate that supports it most.
///
/// * `candidates`: those of a view lie together.
pub(crate) fn support(candidates: &[Candidate], place: &Point3<f64>) -> f64 {
    let views = candidates.chunk_by(|a, b| a.view == b.view);
    views
        .map(|view| {
            let each = view.iter().map(|candidate| candidate.support(place));
            each.fold(0.0, f64::max)
        })
        .sum()
}

/// The places of a joint, the most supported first.
///
/// * `near`: where the joint is looked for.
/// * `prior`: where it is expected.
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
