//! Estimates a person's joints coarsely from the detections assigned to the person.

use skeleton::body::{Covariances, Joints};

use crate::cluster::Member;
use crate::distance::{LEAST_JOINTS, named, to_person};
use crate::sight::{Sight, meet};
use crate::{Frame, N};

/// Distance from the person seen by the other views above which a detection contradicts them: a trimmed mean over the joints, in metres.
const CONTRADICTS_M: f64 = 0.15;

/// A coarse estimate of a person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Coarse {
    pub(crate) joints: Joints,
    pub(crate) covariances: Covariances,
}

impl Coarse {
    /// An estimate in which no joint is known.
    pub(crate) const UNKNOWN: Self = Self {
        joints: [None; N],
        covariances: [None; N],
    };

    /// Returns the number of known joints, not counting the head.
    pub(crate) fn n_core(&self) -> usize {
        self.joints[..N - 1].iter().flatten().count()
    }

    /// Returns true if the bone lengths are plausible for a person.
    pub(crate) fn is_body(&self) -> bool {
        skeleton::body::check(&self.joints, &self.covariances, None).nobody.is_none()
    }
}

/// Triangulates the joints on which the views agree.
pub(crate) fn coarse(frame: &Frame, members: &[Member]) -> Coarse {
    let mut person = Coarse::UNKNOWN;
    let mut rays: Vec<Sight> = Vec::with_capacity(members.len());
    for joint in 0..N {
        rays.clear();
        rays.extend(
            members
                .iter()
                .filter_map(|member| frame.sights(member.at)[named(joint, member.is_exchanged)]),
        );
        if let Some(met) = meet(&rays) {
            person.joints[joint] = Some(met.point);
            person.covariances[joint] = Some(met.covariance);
        }
    }
    person
}

/// The detections that agree on a person, the resulting estimate, and the rejected detections.
pub(crate) struct Agreed {
    pub(crate) members: Vec<Member>,
    pub(crate) person: Coarse,
    pub(crate) refused: Vec<Member>,
}

/// Removes from a person the detections that contradict the others, the worst first.
///
/// * `expected`: the person's expected joints; if two detections contradict each other, the one nearer to these joints is kept.
pub(crate) fn agree(frame: &Frame, mut members: Vec<Member>, expected: Option<&Joints>) -> Agreed {
    let mut refused = Vec::new();
    loop {
        let person = coarse(frame, &members);
        let is_placed = person.n_core() >= LEAST_JOINTS;
        let n_common = n_common(frame, &members);
        let is_disputed = n_common >= LEAST_JOINTS && 2 * person.n_core() < n_common;
        let seen = if is_placed {
            Some(&person.joints)
        } else {
            expected
        };
        let distance = |member: &Member| {
            let fit = to_person(frame.sights(member.at), seen?, frame.as_seen);
            fit.map(|fit| fit.distance)
        };
        let each = members.iter().map(|member| distance(member).unwrap_or(0.0)).enumerate();
        let worst = each.max_by(|a, b| a.1.total_cmp(&b.1));
        let is_one_too_many = |worst: &(usize, f64)| {
            members.len() >= 2 && (is_disputed || is_placed && worst.1 > CONTRADICTS_M)
        };
        match worst.filter(is_one_too_many) {
            Some((nth, _)) => refused.push(members.remove(nth)),
            None => {
                return Agreed {
                    members,
                    person,
                    refused,
                };
            }
        }
    }
}

/// Returns the number of joints, not counting the head, that are visible in at least two detections.
fn n_common(frame: &Frame, members: &[Member]) -> usize {
    let shows = |joint: usize| {
        let each = members
            .iter()
            .filter(|member| frame.sights(member.at)[named(joint, member.is_exchanged)].is_some());
        each.count() >= 2
    };
    (0..N - 1).filter(|joint| shows(*joint)).count()
}
