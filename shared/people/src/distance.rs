//! How far apart in space two views' detections are, or a detection and a person.

use nalgebra::Point3;
use skeleton::body::Joints;

use crate::sight::{Sights, passing};
use crate::{MIRROR, N};

/// Detections with fewer joints in common cannot be compared.
pub(crate) const LEAST_JOINTS: usize = 4;
/// This share of the joints, the farthest ones, does not count: a limb may be covered, or another person's.
const TRIMMED: usize = 4;

/// How well a detection fits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fit {
    /// Trimmed mean of the joints' distances, each weighted by its heat over its variance; metres.
    pub(crate) distance: f64,
    /// Standard deviation of these distances by what the detector states, metres.
    pub(crate) unknown: f64,
    /// Set if it fits with left and right exchanged.
    pub(crate) is_exchanged: bool,
}

/// Means over the joints.
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

/// The trimmed mean of the distances; `None` of too few.
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

/// The better of the two ways to call the sides; the exchanged one only where views call them as they see them.
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

/// The joint of a detection that is a joint of the person.
pub(crate) fn named(joint: usize, is_exchanged: bool) -> usize {
    if is_exchanged { MIRROR[joint] } else { joint }
}

/// How far a detection's rays are from the joints of a person; `None` if they have too few joints in common.
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

/// How far the rays of two detections of different views pass each other.
///
/// * Returns `None` if they have too few joints in common that pass in front of both cameras.
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

/// Mean distance of the joints that two people have in common, metres; `None` if these are too few.
pub(crate) fn of_people(a: &Joints, b: &Joints) -> Option<f64> {
    let both = a.iter().zip(b).filter_map(|(a, b)| Some(((*a)?, (*b)?)));
    let (n, sum) = both.fold((0, 0.0), |(n, sum), (a, b)| (n + 1, sum + (a - b).norm()));
    (n >= LEAST_JOINTS).then(|| sum / n as f64)
}
