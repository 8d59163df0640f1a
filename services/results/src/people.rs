//! How many people there are besides the one who is followed.

use deployment::person::Follow;
use messages::{Pose3d, Status};
use runfiles::People;

/// Results with others before it is said: a ghost of few frames is not worth a warning.
const MANY: u64 = 10;

/// Counts the people of the results; says once that there are several.
#[derive(Debug)]
pub(crate) struct Counted {
    follow: Follow,
    n_with_others: u64,
    most: u32,
}

impl Counted {
    pub(crate) fn new(follow: Follow) -> Self {
        Self {
            follow,
            n_with_others: 0,
            most: 0,
        }
    }

    /// Adds a result.
    pub(crate) fn add(&mut self, pose: &Pose3d) {
        if pose.status != Status::OK && pose.status != Status::IMPLAUSIBLE {
            return;
        }
        self.most = self.most.max(pose.n_people);
        if pose.n_people > 1 {
            self.n_with_others += 1;
            if self.n_with_others == MANY {
                tracing::warn!("others are in view: {}", self.people().text());
            }
        }
    }

    /// What was counted so far.
    pub(crate) fn people(&self) -> People {
        People {
            follow: self.follow.name().to_owned(),
            frames_with_others: self.n_with_others,
            most: self.most,
        }
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable as _;

    use super::*;

    #[test]
    fn results_with_more_than_one_person_are_counted() {
        let mut counted = Counted::new(Follow::Largest);
        for (n_people, status) in [
            (1, Status::OK),
            (3, Status::OK),
            (2, Status::IMPLAUSIBLE),
            (9, Status::NO_FRAME),
        ] {
            let mut pose = Pose3d::zeroed();
            (pose.n_people, pose.status) = (n_people, status);
            counted.add(&pose);
        }
        let expected = People {
            follow: "largest".to_owned(),
            frames_with_others: 2,
            most: 3,
        };
        assert_eq!(counted.people(), expected);
    }
}
