//! Heights of people in the searched frames.

use std::collections::BTreeMap;

use geometry::search_size::USABLE_PX;
use messages::{FusedView, MAX_PARTS, Skeletons, Status};

use crate::Scene;

/// Number of poses of a view from which its median height is judged.
const MIN_POSES: u64 = 20;

/// Counts the heights of people, by view.
#[derive(Debug)]
pub(crate) struct Heights {
    /// For each view, the number of poses by height in whole pixels.
    counts: Vec<BTreeMap<u32, u64>>,
    has_warned: bool,
}

impl Heights {
    pub(crate) fn new(n_views: usize) -> Self {
        Self {
            counts: vec![BTreeMap::new(); n_views],
            has_warned: false,
        }
    }

    /// Adds a result. Warns once if people are too small or too large for the search.
    pub(crate) fn add(&mut self, scene: &Scene, frame: &Skeletons) {
        let people = frame.listed().iter();
        for person in people.filter(|person| person.status == Status::OK) {
            let views = person.listed_views().iter().zip(&mut self.counts);
            for (view, (fused, counts)) in views.enumerate() {
                let is_used = person.views_used >> view & 1 == 1 && fused.status == Status::OK;
                if let Some(px) = height_px(fused).filter(|_| is_used) {
                    *counts.entry(px.round() as u32).or_default() += 1;
                }
            }
        }
        self.warn(scene);
    }

    fn warn(&mut self, scene: &Scene) {
        // A network sees every person in a window of its own size, so the size in the picture does not matter.
        if self.has_warned || scene.has_maps {
            return;
        }
        let known = self.counts.iter().enumerate();
        let mut known = known.filter(|(_, counts)| counts.values().sum::<u64>() >= MIN_POSES);
        let outside = known.find_map(|(view, counts)| {
            let px = median(counts)?;
            let [least, most] = USABLE_PX;
            (!(least..=most).contains(&px)).then_some((view, px))
        });
        if let Some((view, px)) = outside {
            self.has_warned = true;
            tracing::warn!(
                "people are {px:.0} px high in the frames of {}, but {} to {} px are best for the search: adjust capture.scale",
                scene.views[view].name,
                USABLE_PX[0],
                USABLE_PX[1],
            );
        }
    }

    /// Returns the median height of every view that has poses, in pixels of the frame, by name.
    pub(crate) fn medians(
        &self,
        names: impl Iterator<Item = String>,
    ) -> BTreeMap<String, Option<f64>> {
        names.zip(self.counts.iter().map(median)).collect()
    }
}

/// Returns the longer side of the rectangle around the centres of the parts, in pixels of the frame.
pub(crate) fn height_px(fused: &FusedView) -> Option<f64> {
    let parts = &fused.centres_px[..(fused.n_parts as usize).min(MAX_PARTS)];
    let known = parts.iter().copied().filter(|part| part.iter().all(|side| side.is_finite()));
    geometry::longer_side(known)
}

/// Returns the lower median.
fn median(counts: &BTreeMap<u32, u64>) -> Option<f64> {
    let half = counts.values().sum::<u64>().div_ceil(2);
    let mut n = 0;
    let found = counts.iter().find(|count| {
        n += count.1;
        n >= half
    });
    found.map(|entry| f64::from(*entry.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{scene, skeletons};

    fn of_height(px: f64) -> Box<Skeletons> {
        let mut pose = skeletons(0);
        for view in &mut pose.people[0].views[..2] {
            view.n_parts = 3;
            view.centres_px[..3].copy_from_slice(&[[40.0, 5.0], [60.0, 5.0 + px], [50.0, 9.0]]);
        }
        pose
    }

    #[test]
    fn the_height_is_the_longer_side_of_the_box_around_the_parts_used() {
        let scene = scene();
        let mut heights = Heights::new(2);
        for px in [90.0, 400.0, 120.0] {
            heights.add(&scene, &of_height(px));
        }
        let mut other = of_height(500.0);
        other.people[0].views_used = 0b01;
        other.people[0].views[0].status = Status::NO_DETECTION;
        heights.add(&scene, &other);
        other.people[0].status = Status::NO_DETECTION;
        heights.add(&scene, &other);
        let names = || scene.views.iter().map(|view| view.name.clone());
        let both = heights.medians(names());
        assert_eq!(
            both,
            ["left", "right"].map(|name| (name.to_owned(), Some(120.0))).into()
        );
        assert_eq!(Heights::new(2).medians(names())["left"], None);
        let lying = FusedView {
            n_parts: 2,
            centres_px: core::array::from_fn(|i| [70.0 * i as f64, 1.0]),
            ..FusedView::default()
        };
        assert_eq!(height_px(&lying), Some(70.0));
    }

    #[test]
    fn enough_poses_outside_the_good_heights_give_a_warning() {
        let scene = scene();
        let warns = |px: f64, n: u64| {
            let mut heights = Heights::new(2);
            (0..n).for_each(|_| heights.add(&scene, &of_height(px)));
            heights.has_warned
        };
        assert!(warns(109.0, MIN_POSES) && warns(351.0, MIN_POSES));
        assert!(
            !warns(110.0, MIN_POSES) && !warns(350.0, MIN_POSES) && !warns(20.0, MIN_POSES - 1)
        );
    }
}
