//! How many people there are besides the one who is followed.

use std::collections::BTreeSet;

use deployment::person::Follow;
use messages::{Skeletons, Status};
use runfiles::People;

/// Results with others before it is said: a ghost of few frames is not worth a warning.
const MANY: u64 = 10;

/// Counts the people of the results; says once that there are several.
#[derive(Debug)]
pub(crate) struct Counted {
    follow: Follow,
    n_with_others: u64,
    most: u32,
    /// Ids of all who were followed.
    ids: BTreeSet<u64>,
}

impl Counted {
    pub(crate) fn new(follow: Follow) -> Self {
        Self {
            follow,
            n_with_others: 0,
            most: 0,
            ids: BTreeSet::new(),
        }
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
                tracing::warn!("others are in view: {}", self.people().text());
            }
        }
    }

    /// Returns the counts so far.
    pub(crate) fn people(&self) -> People {
        People {
            follow: self.follow.name().to_owned(),
            followed: self.ids.len() as u64,
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
            follow: "largest".to_owned(),
            followed: 2,
            frames_with_others: 2,
            most: 3,
        };
        assert_eq!(counted.people(), expected);
    }
}
