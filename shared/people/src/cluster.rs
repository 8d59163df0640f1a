//! Groups detections from different views that show the same person.

use crate::Frame;
use crate::distance::between;
use crate::frame::Place;

/// Maximum mean distance between the rays of two detections of one person, in metres, after subtracting the deviation that the detector
/// states.
const GATE_M: f64 = 0.12;

/// A detection that is assigned to a person.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Member {
    pub(crate) at: Place,
    /// True if the view labels the person's right side as left.
    pub(crate) is_exchanged: bool,
}

struct Pair {
    distance: f64,
    a: usize,
    b: usize,
    is_exchanged: bool,
}

/// Groups detections into people, largest groups first; each group has at most one detection per view.
///
/// Pairs of detections are joined in the order of their distance. Two groups are joined only if the mean distance over all pairs between
/// them stays below the limit.
///
/// * `free`: the detections that are not yet assigned to a person.
pub(crate) fn clusters(frame: &Frame, free: &[Place]) -> Vec<Vec<Member>> {
    let n = free.len();
    let mut distances = vec![None; n * n];
    let mut pairs = Vec::new();
    for a in 0..n {
        for b in a + 1..n {
            if free[a].view == free[b].view {
                continue;
            }
            let fit = between(frame.sights(free[a]), frame.sights(free[b]), frame.as_seen);
            let Some(fit) = fit else { continue };
            let beyond = fit.distance - fit.unknown;
            distances[a * n + b] = Some(beyond);
            distances[b * n + a] = Some(beyond);
            if beyond < GATE_M {
                pairs.push(Pair {
                    distance: fit.distance,
                    a,
                    b,
                    is_exchanged: fit.is_exchanged,
                });
            }
        }
    }
    pairs.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    // Group of every detection, and whether its left and right are swapped.
    let mut group: Vec<usize> = (0..n).collect();
    let mut sides = vec![false; n];
    for pair in &pairs {
        let [a, b] = [group[pair.a], group[pair.b]];
        if a == b || !may_join(free, &distances, &group, [a, b]) {
            continue;
        }
        let flip = sides[pair.a] ^ sides[pair.b] ^ pair.is_exchanged;
        for nth in 0..n {
            if group[nth] == b {
                group[nth] = a;
                sides[nth] ^= flip;
            }
        }
    }
    let member = |nth: usize| Member {
        at: free[nth],
        is_exchanged: sides[nth],
    };
    let groups = (0..n).map(|name| {
        let members = (0..n).filter(|nth| group[*nth] == name);
        members.map(member).collect::<Vec<Member>>()
    });
    let mut groups: Vec<Vec<Member>> = groups.filter(|members| members.len() >= 2).collect();
    groups.sort_by_key(|members| core::cmp::Reverse(members.len()));
    groups
}

/// Returns true if two groups share no view and their mean distance is below the limit.
fn may_join(
    free: &[Place],
    distances: &[Option<f64>],
    group: &[usize],
    [a, b]: [usize; 2],
) -> bool {
    let n = free.len();
    let (mut sum, mut count) = (0.0, 0);
    for one in (0..n).filter(|nth| group[*nth] == a) {
        for other in (0..n).filter(|nth| group[*nth] == b) {
            if free[one].view == free[other].view {
                return false;
            }
            sum += distances[one * n + other].unwrap_or(GATE_M);
            count += 1;
        }
    }
    sum <= GATE_M * f64::from(count)
}
