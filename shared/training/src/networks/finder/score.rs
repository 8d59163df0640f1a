//! Quality of a network on pictures with a box for each person.

use serde::{Deserialize, Serialize};

use super::picture::Around;

/// Minimum overlap (intersection over union) for a found box to match a true one.
const SAME: f32 = 0.5;
/// A found box does not count as false if its overlap with an ignored person is larger than this.
const UNASKED: f32 = 0.3;

/// Measures of a network's quality.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Number of pictures.
    pub pictures: usize,
    /// Number of people to be found in the pictures.
    pub people: usize,
    /// Share of the people to be found who are found.
    pub recall: f32,
    /// Number of boxes without a person, per picture.
    pub false_boxes: f32,
    /// Number of pictures without people.
    pub empty: usize,
    /// Share of the pictures without people in which no box is found.
    pub quiet: f32,
}

impl core::fmt::Display for Score {
    fn fmt(&self, to: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(
            to,
            "{} held-out pictures: {:.1} % of {} people found, {:.2} false boxes per picture, no box in {:.1} % of {} pictures without people",
            self.pictures,
            100.0 * self.recall,
            self.people,
            self.false_boxes,
            100.0 * self.quiet,
            self.empty
        )
    }
}

/// The counts from which a score is computed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    pictures: usize,
    people: usize,
    found: usize,
    wrong: usize,
    empty: usize,
    quiet: usize,
}

impl Tally {
    /// Adds a picture.
    ///
    /// * `found`: the found boxes, the most certain first. A found box matches at most one person, and a person at most one found box.
    pub fn add(&mut self, people: &[Around], found: &[[f32; 4]]) {
        let mut left: Vec<&Around> = people.iter().filter(|person| person.counts).collect();
        self.pictures += 1;
        self.people += left.len();
        if people.is_empty() {
            self.empty += 1;
            self.quiet += usize::from(found.is_empty());
        }
        for outline in found {
            let own = Around {
                outline: *outline,
                counts: true,
            };
            let best = (0..left.len()).max_by(|a, b| {
                let [a, b] = [*a, *b].map(|at| own.overlap(left[at]));
                a.total_cmp(&b)
            });
            if let Some(best) = best.filter(|best| own.overlap(left[*best]) >= SAME) {
                left.swap_remove(best);
                self.found += 1;
                continue;
            }
            let mut unasked = people.iter().filter(|person| !person.counts);
            let is_unasked = unasked.any(|person| {
                own.overlap(person) >= UNASKED || own.cut(person.outline).area() > 0.5 * own.area()
            });
            self.wrong += usize::from(!is_unasked);
        }
    }

    /// The score of all pictures.
    pub fn score(&self) -> Score {
        let share = |n: usize, of: usize| n as f32 / of.max(1) as f32;
        Score {
            pictures: self.pictures,
            people: self.people,
            recall: share(self.found, self.people),
            false_boxes: share(self.wrong, self.pictures),
            empty: self.empty,
            quiet: share(self.quiet, self.empty),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_person_is_matched_by_one_box_and_boxes_on_excluded_people_are_not_false_alarms() {
        let around = |left: f32, counts| Around {
            outline: [left, 0.0, left + 10.0, 30.0],
            counts,
        };
        let people = [around(0.0, true), around(50.0, true), around(100.0, false)];
        let found = [0.0, 1.0, 101.0, 200.0].map(|left| around(left, true).outline);
        let mut tally = Tally::default();
        tally.add(&people, &found);
        tally.add(&[], &[]);
        let score = tally.score();
        assert_eq!(
            [score.recall, score.false_boxes, score.quiet],
            [0.5, 1.0, 1.0]
        );
    }
}
