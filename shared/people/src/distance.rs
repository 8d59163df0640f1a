//! Distances in space: between the detections of two views, or between a detection and a person.

use nalgebra::Point3;
use skeleton::body::Joints;

use crate::sight::{Sights, passing};
use crate::{MIRROR, N};

/// Minimum number of joints that two detections must share to be compared.
pub(crate) const LEAST_JOINTS: usize = 4;
/// One in this many joints is ignored, the farthest first: a limb may be hidden, or belong to another person.
const TRIMMED: usize = 4;

/// How well a detection fits a person or another detection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fit {
    /// Trimmed mean of the joints' distances, in metres; each is weighted by its heat over its variance.
    pub(crate) distance: f64,
    /// Standard deviation of these distances that follows from the detector's stated deviations, in metres.
    pub(crate) unknown: f64,
    /// True if the detection fits with left and right swapped.
    pub(crate) is_exchanged: bool,
}

/// Weighted means over the joints.
#[derive(Debug, Clone, Copy)]
struct Mean {
    distance: f64,
    unknown: f64,
}

/// A joint's distance, its deviation and its weight.
#[derive(Debug, Clone, Copy)]
struct Term {
    distance: f64,
    unknown: f64,
    weight: f64,
}

/// Returns the trimmed mean of the distances; `None` if there are too few.
fn trimmed(terms: impl Iterator<Item = Option<Term>>) -> Option<Mean> {
    let mut kept = [Term {
        distance: 0.0,
        unknown: 0.0,
        weight: 0.0,
    }; N];
    let mut n = 0;
    for term in terms.flatten().take(N) {
        kept[n] = term;
        n += 1;
    }
    if n < LEAST_JOINTS {
        return None;
    }
    let kept = &mut kept[..n];
    kept.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    let kept = &kept[..n - n / TRIMMED];
    let weight: f64 = kept.iter().map(|term| term.weight).sum();
    let mean = |of: fn(&Term) -> f64| {
        let sum: f64 = kept.iter().map(|term| term.weight * of(term)).sum();
        sum / weight
    };
    Some(Mean {
        distance: mean(|term| term.distance),
        unknown: mean(|term| term.unknown),
    })
}

/// Returns the better of two fits, with left and right as labelled and swapped. Swapping is tried only if views name left and right as they
/// appear in the picture.
fn better(as_seen: bool, mean: impl Fn(bool) -> Option<Mean>) -> Option<Fit> {
    let fit = |is_exchanged: bool| {
        let mean = mean(is_exchanged)?;
        Some(Fit {
            distance: mean.distance,
            unknown: mean.unknown,
            is_exchanged,
        })
    };
    let named = fit(false);
    let exchanged = if as_seen { fit(true) } else { None };
    match (named, exchanged) {
        (Some(a), Some(b)) if b.distance < a.distance => Some(b),
        (a, b) => a.or(b),
    }
}

/// Returns the joint of a detection that corresponds to a joint of the person.
pub(crate) fn named(joint: usize, is_exchanged: bool) -> usize {
    if is_exchanged { MIRROR[joint] } else { joint }
}

/// Returns the distance of a detection's rays from the joints of a person; `None` if they share too few joints.
pub(crate) fn to_person(sights: &Sights, joints: &Joints, as_seen: bool) -> Option<Fit> {
    better(as_seen, |is_exchanged| {
        trimmed((0..N).map(|joint| {
            let sight = sights[named(joint, is_exchanged)].as_ref()?;
            let point: Point3<f64> = joints[joint]?;
            let distance = sight.distance(&point);
            let weight = sight.heat / sight.sd(&point).powi(2);
            let unknown = sight.stated(&point);
            distance.is_finite().then_some(Term {
                distance,
                unknown,
                weight,
            })
        }))
    })
}

/// Returns the distance between the rays of two detections from different views.
///
/// * Returns `None` if they share too few joints whose rays meet in front of both cameras.
pub(crate) fn between(a: &Sights, b: &Sights, as_seen: bool) -> Option<Fit> {
    better(as_seen, |is_exchanged| {
        trimmed((0..N).map(|joint| {
            let a = a[joint].as_ref()?;
            let b = b[named(joint, is_exchanged)].as_ref()?;
            let at = passing(a, b)?;
            let variance = a.sd(&at.point).powi(2) + b.sd(&at.point).powi(2);
            let weight = (a.heat * b.heat).sqrt() / variance;
            Some(Term {
                distance: at.gap,
                unknown: a.stated(&at.point).hypot(b.stated(&at.point)),
                weight,
            })
        }))
    })
}

/// Returns the mean distance of the joints that two people share, in metres; `None` if they share too few.
pub(crate) fn of_people(a: &Joints, b: &Joints) -> Option<f64> {
    let both = a.iter().zip(b).filter_map(|(a, b)| Some(((*a)?, (*b)?)));
    let (n, sum) = both.fold((0, 0.0), |(n, sum), (a, b)| (n + 1, sum + (a - b).norm()));
    (n >= LEAST_JOINTS).then(|| sum / n as f64)
}
