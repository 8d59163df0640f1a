//! All people of the run: counts the people besides the followed person, and summarises each person.

use std::collections::{BTreeMap, BTreeSet};

use deployment::person::Follow;
use messages::{SkeletonMessage, Skeletons, Status};
use runfiles::{People, PersonLine, PersonSummary};

use crate::pose3d::is_placed;
use crate::trust::Trusted;

/// Number of results with other people from which they are reported. In fewer frames, another person may be a false detection.
const MANY: u64 = 10;
/// After an absence of this time, in seconds, a person gets a new id. The crate `people` forgets a person after a minute.
pub(crate) const GONE_S: f64 = 61.0;

/// Counts the people in the results. Logs once that there are several.
#[derive(Debug)]
pub(crate) struct Counted {
    follow: Follow,
    n_with_others: u64,
    most: u32,
    /// Ids of all people who were followed.
    ids: BTreeSet<u64>,
    /// People who are present, or may return with the same id.
    each: BTreeMap<u64, One>,
    /// Summaries of people who would get a new id if they returned.
    gone: BTreeMap<u64, PersonSummary>,
}

/// Counts of one person so far.
#[derive(Debug, Default)]
struct One {
    frames: u64,
    first_frame: u64,
    last_frame: u64,
    /// Time of the person's last frame, in seconds.
    seen_s: f64,
    n_joints: u64,
    n_placed: u64,
    /// Sum of the squared reprojection errors, and number of errors.
    squared_px: (f64, u64),
    trusted: Trusted,
}

impl One {
    /// Counts a frame.
    ///
    /// * `placed_px`: reprojection error of each joint, in pixels; `None` for a joint without a position, NaN if the error is not known.
    fn add(&mut self, frame: u64, placed_px: impl Iterator<Item = Option<f64>>) {
        if self.frames == 0 {
            self.first_frame = frame;
        }
        (self.frames, self.last_frame) = (self.frames + 1, frame);
        for px in placed_px {
            self.n_joints += 1;
            let Some(px) = px else { continue };
            self.n_placed += 1;
            if px.is_finite() {
                self.squared_px.0 += px.powi(2);
                self.squared_px.1 += 1;
            }
        }
    }

    fn summary(&self, id: u64) -> PersonSummary {
        let (sum, n) = self.squared_px;
        PersonSummary {
            first_frame: self.first_frame,
            frames: self.frames,
            id,
            joints: self.n_placed as f64 / self.n_joints.max(1) as f64,
            last_frame: self.last_frame,
            reprojection_px: (n > 0).then(|| (sum / n as f64).sqrt()),
            trust: self.trusted.trust(),
        }
    }
}

impl Counted {
    pub(crate) fn new(follow: Follow) -> Self {
        Self {
            follow,
            n_with_others: 0,
            most: 0,
            ids: BTreeSet::new(),
            each: BTreeMap::new(),
            gone: BTreeMap::new(),
        }
    }

    /// Adds a person in a frame to the person's summary.
    ///
    /// * `limbs`: pairs of joints that are connected by a bone.
    /// * `time_s`: time of the frame in seconds, if it is known.
    pub(crate) fn person(
        &mut self,
        frame: u64,
        person: &SkeletonMessage,
        limbs: &[(usize, usize)],
        time_s: Option<f64>,
    ) {
        if person.status == Status::IMPLAUSIBLE {
            // Somebody whose bodies were all impossible has no summary.
            if let Some(one) = self.each.get_mut(&person.id) {
                one.trusted.count(person, limbs, (time_s, &[]));
            }
            return;
        }
        if person.status != Status::OK {
            return;
        }
        let one = self.each.entry(person.id).or_default();
        let px = person.listed_joints().iter();
        one.add(
            frame,
            px.map(|joint| is_placed(joint).then_some(joint.reprojection_px)),
        );
        one.trusted.count(person, limbs, (time_s, &[]));
        one.seen_s = time_s.unwrap_or(one.seen_s);
    }

    /// Reduces the data of people who have been absent for too long to return with the same id to summaries. Called after the people of a
    /// frame were added.
    pub(crate) fn forget(&mut self, now_s: f64) {
        let gone = self.each.extract_if(.., |_, one| now_s - one.seen_s > GONE_S);
        self.gone.extend(gone.map(|(id, one)| (id, one.summary(id))));
    }

    /// Adds a person from a frame that an earlier start of this process wrote before it was killed.
    pub(crate) fn line(&mut self, frame: u64, person: &PersonLine, time_s: Option<f64>) {
        if person.status != runfiles::FrameLine::OK {
            return;
        }
        let one = self.each.entry(person.id).or_default();
        one.seen_s = time_s.unwrap_or(0.0);
        let joints = person.joints.values().map(|joint| joint.placed());
        one.add(
            frame,
            joints.map(|joint| Some(joint?.reprojection_px.unwrap_or(f64::NAN))),
        );
    }

    /// Adds a result.
    pub(crate) fn add(&mut self, frame: &Skeletons) {
        self.ids.extend(frame.followed().map(|person| person.id));
        if frame.status != Status::OK && frame.status != Status::IMPLAUSIBLE {
            return;
        }
        self.most = self.most.max(frame.n_seen);
        if frame.n_seen > 1 {
            self.n_with_others += 1;
            if self.n_with_others == MANY {
                tracing::warn!("other people are in view: {}", self.people().text());
            }
        }
    }

    /// Returns the counts so far.
    pub(crate) fn people(&self) -> People {
        let each = self.each.iter().map(|(id, one)| one.summary(*id));
        let each: BTreeMap<u64, PersonSummary> =
            each.map(|one| (one.id, one)).chain(self.gone.clone()).collect();
        People {
            each: each.into_values().collect(),
            follow: self.follow.name().to_owned(),
            followed: self.ids.iter().copied().collect(),
            frames_with_others: self.n_with_others,
            most: self.most,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_with_more_than_one_person_are_counted() {
        let mut counted = Counted::new(Follow::Largest);
        for (n_seen, id, status) in [
            (1, 4, Status::OK),
            (3, 5, Status::OK),
            (2, 4, Status::IMPLAUSIBLE),
            (9, 4, Status::NO_FRAME),
        ] {
            let mut frame = Box::<Skeletons>::default();
            (frame.n_seen, frame.status, frame.n_people) = (n_seen, status, 1);
            frame.people[0].id = id;
            counted.add(&frame);
        }
        let expected = People {
            each: Vec::new(),
            follow: "largest".to_owned(),
            followed: vec![4, 5],
            frames_with_others: 2,
            most: 3,
        };
        assert_eq!(counted.people(), expected);
    }

    #[test]
    fn each_person_has_a_summary_of_their_own_frames() {
        let mut counted = Counted::new(Follow::Last);
        let mut person = SkeletonMessage {
            status: Status::OK,
            n_joints: 2,
            ..SkeletonMessage::default()
        };
        person.joints[0].status = Status::OK;
        person.joints[0].reprojection_px = 3.0;
        person.joints[1].status = Status::TOO_FEW_VIEWS;
        for (frame, id, time_s) in [(4, 7, 0.0), (5, 7, 0.1), (5, 8, 0.1), (900, 9, 90.0)] {
            person.id = id;
            counted.person(frame, &person, &[], Some(time_s));
        }
        person.status = Status::IMPLAUSIBLE;
        counted.person(901, &person, &[], Some(90.1));
        counted.forget(90.0);
        assert_eq!(counted.each.keys().copied().collect::<Vec<_>>(), [9]);
        let each = counted.people().each;
        let told = |one: &PersonSummary| (one.id, one.frames, one.first_frame, one.last_frame);
        let expected = [(7, 2, 4, 5), (8, 1, 5, 5), (9, 1, 900, 900)];
        assert_eq!(each.iter().map(told).collect::<Vec<_>>(), expected);
        assert_eq!((each[0].joints, each[0].reprojection_px), (0.5, Some(3.0)));
        assert_eq!(
            (each[1].trust.implausible, each[2].trust.implausible),
            (0.0, 1.0)
        );
    }
}
