//! Chooses which of several people to follow.

use std::sync::Arc;

use geometry::Camera;
use multiview::ViewPlan;
use nalgebra::Point3;

use crate::people::{Found, Person, bodies_of_poses, find};
use crate::view_result::ViewResult;

/// Rule for choosing which of several people to follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Follow {
    /// The person nearest to the followed person of the previous frame; in the first frame, the clearest person.
    #[default]
    Last,
    /// The person who is largest in the pictures.
    Largest,
    /// The person who is seen by the most views, and most clearly.
    Clearest,
}

/// Maximum distance in metres between the followed person's positions in two frames. The limit grows by the same amount for every frame
/// without the person.
const REACH_M: f64 = 1.0;
const REACH_PER_FRAME_M: f64 = 0.1;
/// A missing person is waited for as many frames as the person was seen in, up to this maximum.
const MOST_PATIENCE: u32 = 30;

/// Follows one person from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct Following {
    follow: Follow,
    last: Option<Point3<f64>>,
    /// Number of frames left to wait for the person.
    patience: u32,
    n_without: u32,
    /// Id of the person, counted from 1; 0 before the first person.
    id: u64,
}

/// The candidates of a frame that are not the followed person.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Others {
    of_views: Vec<u64>,
    /// Bit `v` is set if view `v` sees other people, but not the followed person.
    without: u64,
    /// For each view, the candidate that shows the followed person.
    own: Vec<Option<usize>>,
}

impl Others {
    fn new(found: &Found, followed: Option<usize>) -> Self {
        Self {
            of_views: found.others(followed),
            without: followed.map_or(0, |followed| found.without(followed)),
            own: followed.map_or_else(Vec::new, |followed| {
                found.people[followed].candidates.clone()
            }),
        }
    }

    /// Candidates of a view that show other people: bit `c` is set for candidate `c`.
    pub fn of_view(&self, view: usize) -> u64 {
        self.of_views.get(view).copied().unwrap_or(0)
    }

    /// Returns the candidate of a view that shows the followed person; `None` if the view does not show the person, or nobody is followed.
    pub fn own(&self, view: usize) -> Option<usize> {
        self.own.get(view).copied().flatten()
    }

    /// Returns true if a view sees other people but not the followed person. Such a view is left out of the frame.
    pub fn only(&self, view: usize) -> bool {
        self.without >> view & 1 == 1
    }
}

impl Following {
    /// Creates the state before the first frame.
    pub fn new(follow: Follow) -> Self {
        Self {
            follow,
            ..Self::default()
        }
    }

    /// Chooses the person of the next frame, and returns the candidates that show other people.
    pub fn others(&mut self, plans: &[Arc<ViewPlan>], answers: &[Option<ViewResult>]) -> Others {
        let views = plans.iter().zip(answers);
        let views = views.map(|(plan, answer)| bodies_of_poses(plan, answer.as_ref()));
        let cameras: Vec<&Camera> = plans.iter().map(|plan| plan.camera()).collect();
        let found = find(&cameras, views.collect());
        let followed = self.choose(&found);
        Others::new(&found, followed)
    }

    /// Returns the followed person; `None` if the person was not found.
    fn choose(&mut self, found: &Found) -> Option<usize> {
        let people = || found.people.iter().enumerate();
        let first = people().next().map(|person| person.0);
        let chosen = match self.follow {
            Follow::Clearest => first,
            Follow::Largest => people()
                .max_by(|a, b| a.1.size_px.total_cmp(&b.1.size_px))
                .map(|person| person.0),
            Follow::Last => return self.nearest(&found.people),
        };
        if let Some(chosen) = chosen {
            let place = found.people[chosen].place;
            let is_same = self.last.is_some_and(|last| (place - last).norm() <= REACH_M);
            self.id += u64::from(!is_same);
            self.last = Some(place);
        }
        chosen
    }

    /// Returns the person nearest to the last known position, or the first person if the followed person has been missing for too long.
    fn nearest(&mut self, people: &[Person]) -> Option<usize> {
        let near = self.last.and_then(|last| {
            let reach = REACH_M + REACH_PER_FRAME_M * f64::from(self.n_without);
            let each = people.iter().map(|person| (person.place - last).norm()).enumerate();
            each.filter(|candidate| candidate.1 <= reach).min_by(|a, b| a.1.total_cmp(&b.1))
        });
        if let Some((chosen, _)) = near {
            self.patience = (self.patience + 1).min(MOST_PATIENCE);
            self.n_without = 0;
            self.last = Some(people[chosen].place);
            return Some(chosen);
        }
        self.patience = self.patience.saturating_sub(1);
        self.n_without += 1;
        if self.patience > 0 {
            return None;
        }
        // Starts to follow a new person.
        let first = people.first()?;
        (self.last, self.patience, self.n_without) = (Some(first.place), 1, 0);
        self.id += 1;
        Some(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::people::tests::{camera, found};

    /// Returns the position of the chosen person, frame by frame.
    fn chosen(follow: Follow, frames: &[&[([f64; 2], f64)]]) -> Vec<Option<f64>> {
        let cameras: Vec<_> = (0..4).map(camera).collect();
        let mut following = Following::new(follow);
        let frames = frames.iter().map(|people| {
            let found = found(&cameras, people);
            let index = following.choose(&found)?;
            Some((found.people[index].place.x * 1e3).round() / 1e3)
        });
        frames.collect()
    }

    #[test]
    fn the_person_of_the_last_frame_is_followed_even_if_another_is_clearer() {
        let frames: [&[([f64; 2], f64)]; 4] = [
            &[([-0.5, 0.0], 1.0), ([1.0, 0.5], 0.8)],
            &[([-0.3, 0.0], 0.6), ([1.0, 0.5], 1.0)],
            // The person is not found for one frame.
            &[([1.0, 0.5], 1.0)],
            &[([-0.1, 0.0], 0.6), ([1.0, 0.5], 1.0)],
        ];
        let last = [Some(-0.5), Some(-0.3), None, Some(-0.1)];
        assert_eq!(chosen(Follow::Last, &frames), last);
        let clearest = [Some(-0.5), Some(1.0), Some(1.0), Some(1.0)];
        assert_eq!(chosen(Follow::Clearest, &frames), clearest);
    }

    #[test]
    fn the_candidates_of_the_followed_person_are_known_for_every_view() {
        // The order of the people differs from view to view.
        let people: &[([f64; 2], f64)] = &[([-0.5, 0.0], 1.0), ([1.0, 0.5], 0.8)];
        let cameras: Vec<_> = (0..4).map(camera).collect();
        let found = found(&cameras, people);
        let followed = Following::new(Follow::Clearest).choose(&found);
        let others = Others::new(&found, followed);
        let own: Vec<Option<usize>> = (0..4).map(|view| others.own(view)).collect();
        assert_eq!(own, [Some(0), Some(1), Some(0), Some(1)]);
        let nobody = Others::new(&found, None);
        assert_eq!(nobody.own(0), None);
    }

    #[test]
    fn another_person_is_followed_after_the_person_has_been_away_for_long() {
        let both: &[([f64; 2], f64)] = &[([-1.0, 0.0], 1.0), ([1.0, 0.0], 0.6)];
        let one: &[([f64; 2], f64)] = &[([1.0, 0.0], 0.6)];
        let n = MOST_PATIENCE as usize;
        let frames = [vec![both; n + 10], vec![one; n], vec![both; 2]].concat();
        let got = chosen(Follow::Last, &frames);
        assert!(got[..n + 10].iter().all(|place| *place == Some(-1.0)));
        // For ten frames, the other person, two metres away, is too far away to be the followed person.
        assert!(got[n + 10..n + 20].iter().all(Option::is_none));
        assert_eq!(got.last(), Some(&Some(1.0)), "the new one is kept");
    }

    #[test]
    fn an_id_lasts_while_the_person_is_followed_and_is_never_reused() {
        let both: &[([f64; 2], f64)] = &[([-1.0, 0.0], 1.0), ([1.0, 0.0], 0.6)];
        let one: &[([f64; 2], f64)] = &[([1.0, 0.0], 0.6)];
        let cameras: Vec<_> = (0..4).map(camera).collect();
        let ids = |follow: Follow| {
            let mut following = Following::new(follow);
            let frames = [vec![both; 3], vec![one; 10], vec![both; 3]].concat();
            let each = frames.into_iter().map(|people| {
                following.choose(&found(&cameras, people));
                following.id
            });
            let mut ids: Vec<u64> = each.collect();
            ids.dedup();
            ids
        };
        assert_eq!(ids(Follow::Last), [1, 2]);
        assert_eq!(ids(Follow::Clearest), [1, 2, 3]);
    }

    #[test]
    fn a_single_false_detection_does_not_delay_following_a_person() {
        let frames: [&[([f64; 2], f64)]; 2] = [&[([-1.0, 0.0], 0.3)], &[([1.0, 0.0], 1.0)]];
        assert_eq!(chosen(Follow::Last, &frames), [Some(-1.0), Some(1.0)]);
    }

    #[test]
    fn the_largest_person_is_the_one_largest_in_the_pictures() {
        // The first camera is at x = 5 m; the other cameras surround the people.
        let near_and_far: &[([f64; 2], f64)] = &[([0.0, 0.0], 1.0), ([1.2, 1.2], 0.7)];
        let cameras: Vec<_> = (0..3).map(camera).collect();
        let found = found(&cameras, near_and_far);
        let sizes: Vec<f64> = found.people.iter().map(|person| person.size_px).collect();
        let index = Following::new(Follow::Largest).choose(&found).unwrap();
        assert!(sizes.iter().all(|size| *size <= sizes[index]), "{sizes:?}");
        assert_ne!(sizes[0], sizes[1]);
    }

    #[test]
    fn nobody_is_followed_in_an_empty_room() {
        assert_eq!(chosen(Follow::Last, &[&[], &[]]), [None, None]);
    }
}
