//! Sightings from films: the joints of one person in every camera at common instants.

use crate::synchronisation::{Film, Track, tracks};
use geometry::{Camera, Lens};
use nalgebra::{Point2, Vector2};
use statistics::Sorted;

/// Standard deviation of the kernel that smooths positions over time, in intervals between pictures and in seconds.
const SMOOTHING: [f64; 2] = [0.75, 0.015];
/// Largest gap between two tracks of a camera that may show the same person, in seconds.
const LONGEST_GAP_S: f64 = 3.0;
/// Largest overlap in time of two tracks in the same place that may show the same person, in seconds. For a moment, one person may be
/// detected in two poses.
const LONGEST_OVERLAP_S: f64 = 0.25;
/// The end of one track and the start of another count as the same place if their distance is at most this, in sizes of the person.
const ONE_PLACE: f64 = 0.3;
/// Maximum number of chains of a camera. The chains in which the person is seen best are used.
const MOST_CHAINS: usize = 3;
/// Minimum length of a chain relative to the longest one.
const LEAST_SHARE: f64 = 0.15;

/// A joint in a camera at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sight {
    /// Position, in ideal pixels.
    pub(crate) at: Point2<f64>,
    /// Speed, in ideal pixels per second; 0 if it is not known.
    pub(crate) speed: Vector2<f64>,
    /// Weight, 0 to 1.
    pub(crate) weight: f64,
}

/// Successive tracks in one camera that may show the same person.
#[derive(Debug, Clone)]
pub(crate) struct Chain {
    tracks: Vec<Track>,
    /// Time between two pictures, in seconds.
    interval_s: f64,
}

impl Chain {
    /// Returns the time for which the person is seen, in seconds.
    pub(crate) fn seen_s(&self) -> f64 {
        let each = self.tracks.iter().map(Track::span);
        each.map(|[from, to]| to - from).sum()
    }

    /// Returns the likely usefulness of the chain: its duration, weighted by size and score. An object that a network takes for a person,
    /// such as a chair, may be seen for as long as a person, but is small or has a low score.
    fn worth(&self) -> f64 {
        let of = |track: &Track| (track.span()[1] - track.span()[0]) * track.size() * track.score();
        self.tracks.iter().map(of).sum()
    }

    /// Returns the first and last time, by the clock of the camera.
    pub(crate) fn span(&self) -> [f64; 2] {
        let each = self.tracks.iter().map(Track::span);
        each.fold([f64::INFINITY, f64::NEG_INFINITY], |span, it| {
            [span[0].min(it[0]), span[1].max(it[1])]
        })
    }

    /// Returns the size of the person, in ideal pixels.
    pub(crate) fn size(&self) -> f64 {
        let mut each: Vec<f64> = self.tracks.iter().map(Track::size).collect();
        each.sort_by(f64::total_cmp);
        each.get(each.len() / 2).copied().unwrap_or(1.0)
    }

    fn sight(&self, joint: usize, time_s: f64) -> Option<Sight> {
        let is_at = |track: &&Track| (track.span()[0]..=track.span()[1]).contains(&time_s);
        let mut tracks = self.tracks.iter().filter(is_at);
        let (track, place) = tracks.find_map(|track| Some((track, track.place(joint, time_s)?)))?;
        Some(Sight {
            at: place.at.into(),
            speed: self.speed(track, joint, time_s),
            weight: place.weight.clamp(0.05, 1.0),
        })
    }

    /// Returns the speed of a joint, from its positions one picture before and one after.
    ///
    /// The slope of the line from which the position is computed is not suitable: between two pictures, its errors are correlated with
    /// those of the position. An adjustment would then move clocks until both errors cancel, half a picture away from the truth.
    fn speed(&self, track: &Track, joint: usize, time_s: f64) -> Vector2<f64> {
        let at = |time_s: f64| Some(Vector2::from(track.place(joint, time_s)?.at));
        let ends = [-1.0, 1.0].map(|sign| at(time_s + sign * self.interval_s));
        let [Some(before), Some(after)] = ends else {
            return Vector2::zeros();
        };
        (after - before) / (2.0 * self.interval_s)
    }

    /// Returns the gap in seconds before a track with which this chain may continue; negative if they overlap.
    fn gap(&self, track: &Track, n_joints: usize) -> Option<f64> {
        let [[_, end], [begin, track_end]] = [self.span(), track.span()];
        let gap = begin - end;
        let may_be = gap >= 0.0 || (track_end > end && self.is_in_place(track, n_joints));
        let can_be = (-LONGEST_OVERLAP_S..LONGEST_GAP_S).contains(&gap);
        (can_be && may_be).then_some(gap)
    }

    /// Returns true if a track begins near the position at which the chain's last track ends.
    fn is_in_place(&self, track: &Track, n_joints: usize) -> bool {
        let Some(last) = self.tracks.last() else {
            return false;
        };
        // Returns the first or last visible position of a joint, which may not be visible at the very end.
        let near = |track: &Track, joint: usize, from_s: f64, sign: f64| {
            let n = (LONGEST_OVERLAP_S / self.interval_s).ceil() as i32;
            let mut times = (0..=n).map(|nth| from_s + sign * self.interval_s * f64::from(nth));
            let place = times.find_map(|time_s| track.place(joint, time_s));
            place.map(|place| Vector2::from(place.at))
        };
        let apart = (0..n_joints).filter_map(|joint| {
            let before = near(last, joint, last.span()[1], -1.0)?;
            let after = near(track, joint, track.span()[0], 1.0)?;
            Some((before - after).norm())
        });
        let apart = Sorted::new(apart.collect::<Vec<_>>()).upper_median();
        apart.is_some_and(|apart| apart < ONE_PLACE * last.size().max(track.size()))
    }
}

/// Returns the people whom a camera sees longest, in descending order of how well and how long they are seen.
pub(crate) fn chains(film: &Film, camera: &Camera, n_joints: usize, interval_s: f64) -> Vec<Chain> {
    let own_s = self::interval_s(film).unwrap_or(interval_s);
    let sigma_s = (SMOOTHING[0] * interval_s).max(SMOOTHING[1]);
    let mut found = tracks(film, camera, n_joints, sigma_s);
    found.sort_by(|a, b| a.span()[0].total_cmp(&b.span()[0]));
    let mut chains: Vec<Chain> = Vec::new();
    for track in found {
        let gaps = chains.iter().enumerate();
        let gaps = gaps.filter_map(|(nth, it)| Some((nth, it.gap(&track, n_joints)?)));
        match gaps.min_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((nth, _)) => chains[nth].tracks.push(track),
            None => chains.push(Chain {
                tracks: vec![track],
                interval_s: own_s,
            }),
        }
    }
    chains.sort_by(|a, b| b.worth().total_cmp(&a.worth()));
    let least = LEAST_SHARE * longest(&chains).map_or(0.0, Chain::seen_s);
    chains.retain(|chain| chain.seen_s() >= least);
    chains.truncate(MOST_CHAINS);
    chains
}

/// Returns the person that a camera sees longest.
pub(crate) fn longest(chains: &[Chain]) -> Option<&Chain> {
    let each = chains.iter();
    each.max_by(|a, b| a.seen_s().total_cmp(&b.seen_s()))
}

/// Returns the camera without distortion; its pixels are the ideal pixels.
pub(crate) fn ideal(camera: &Camera) -> Camera {
    let mut camera = camera.clone();
    camera.intrinsics.lens = Lens::default();
    camera
}

/// Returns the time between two pictures of a film, in seconds.
pub(crate) fn interval_s(film: &Film) -> Option<f64> {
    let each = film.shots.array_windows();
    let steps: Vec<f64> = each.map(|[a, b]| b.time_s - a.time_s).collect();
    Sorted::new(steps).upper_median().filter(|upper_median| *upper_median > 0.0)
}

/// Joints of one person, by instant, camera and joint.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sightings {
    pub(crate) times_s: Vec<f64>,
    pub(crate) seen: Vec<Vec<Vec<Option<Sight>>>>,
}

impl Sightings {
    /// Finds the joints in all cameras at instants of the common clock.
    ///
    /// * `chains`: the person in every camera; `None` if the person is not known there.
    /// * `offsets_s`: offsets to add to the times of each camera to get common times.
    pub(crate) fn new(
        chains: &[Option<&Chain>],
        times_s: &[f64],
        offsets_s: &[f64],
        n_joints: usize,
    ) -> Self {
        let of = |camera: usize, time_s: f64| -> Vec<Option<Sight>> {
            let own_s = time_s - offsets_s[camera];
            let look = |joint| chains[camera]?.sight(joint, own_s);
            (0..n_joints).map(look).collect()
        };
        let at = |time_s: &f64| (0..chains.len()).map(|i| of(i, *time_s)).collect();
        Self {
            times_s: times_s.to_vec(),
            seen: times_s.iter().map(at).collect(),
        }
    }

    /// Swaps left and right of a camera at one instant.
    pub(crate) fn exchange(&mut self, instant: usize, camera: usize, sides: &[usize]) {
        let own = &self.seen[instant][camera];
        let other = sides.iter().map(|side| own.get(*side).copied().flatten());
        self.seen[instant][camera] = other.collect();
    }

    /// Swaps left and right of a camera at all instants.
    pub(crate) fn exchange_all(&mut self, camera: usize, sides: &[usize]) {
        for instant in 0..self.seen.len() {
            self.exchange(instant, camera, sides);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::synchronisation::{Joint, Person, Shot};
    use fastrand::Rng;

    use super::*;
    use crate::people::testing::{N_JOINTS, ring};

    /// Returns a film of a person who stands, with noise, at 10 Hz.
    fn standing() -> Film {
        let mut random = Rng::with_seed(2);
        let mut normal = || (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
        let mut joint = |nth: usize| {
            let at = [400.0 + 10.0 * nth as f64, 300.0 + 25.0 * nth as f64];
            let at = at.map(|at| at + 3.0 * normal());
            Some(Joint { at, score: 0.9 })
        };
        let mut shot = |nth: i32| Shot {
            time_s: 0.1 * f64::from(nth),
            people: vec![Person {
                joints: (0..N_JOINTS).map(&mut joint).collect(),
            }],
        };
        Film {
            shots: (0..300).map(&mut shot).collect(),
        }
    }

    #[test]
    fn a_large_and_certain_person_is_preferred_to_one_seen_longer() {
        let mut film = standing();
        let chair = |joint: Joint| Joint {
            at: joint.at.map(|at| 100.0 + 0.3 * (at - 300.0)),
            score: 0.4,
        };
        for (nth, shot) in film.shots.iter_mut().enumerate() {
            let joints = shot.people[0].joints.iter();
            let joints = joints.map(|joint| joint.map(chair)).collect();
            shot.people.insert(0, Person { joints });
            if nth >= 240 {
                shot.people.truncate(1);
            }
        }
        let camera = ideal(&ring(3)[0]);
        let chains = chains(&film, &camera, N_JOINTS, 0.1);
        let seen_s = chains.iter().map(Chain::seen_s);
        assert_eq!(seen_s.map(f64::round).collect::<Vec<_>>(), [24.0, 30.0]);
        let sizes = [&chains[0], longest(&chains).unwrap()].map(Chain::size);
        assert!(sizes[0] > 3.0 * sizes[1], "{sizes:?}");
    }

    /// Returns a film at 60 Hz of a person whose detected pose changes after one second; for a moment, both poses are detected.
    fn in_two_poses(away_px: f64) -> Film {
        let mut film = standing();
        film.shots.truncate(120);
        for (nth, shot) in film.shots.iter_mut().enumerate() {
            shot.time_s = nth as f64 / 60.0;
            let joints = shot.people[0].joints.iter().enumerate();
            let other = |(joint, it): (usize, &Option<Joint>)| {
                it.map(|seen| Joint {
                    at: [
                        seen.at[0] + if joint < 9 { away_px } else { 0.0 },
                        seen.at[1],
                    ],
                    ..seen
                })
            };
            let other = Person {
                joints: joints.map(other).collect(),
            };
            match nth {
                ..60 => {}
                60..66 => shot.people.push(other),
                _ => shot.people = vec![other],
            }
        }
        film
    }

    #[test]
    fn a_person_with_two_candidates_for_a_moment_stays_one_person() {
        let camera = ideal(&ring(3)[0]);
        let size = chains(&standing(), &camera, N_JOINTS, 0.1)[0].size();
        for (share, n, seen_s) in [(0.28, 1, 2.0), (0.5, 2, 1.0)] {
            let film = in_two_poses(share * size);
            let chains = chains(&film, &camera, N_JOINTS, 1.0 / 60.0);
            assert_eq!(chains.len(), n, "{share} of the size away");
            let chain = &chains[0];
            assert!(
                chain.span()[1] - chain.span()[0] > 0.9 * seen_s,
                "{chain:?}"
            );
            let times = (3..57).map(|i| chain.span()[0] + seen_s * f64::from(i) / 60.0);
            let n = times.filter(|time| chain.sight(12, *time).is_some()).count();
            assert!(n > 50, "{n} of 54");
        }
    }

    #[test]
    fn errors_of_the_velocity_are_independent_of_errors_of_the_position() {
        let camera = ideal(&ring(3)[0]);
        let chains = chains(&standing(), &camera, N_JOINTS, 0.1);
        let chain = &chains[0];
        for phase in [0.0, 0.025, 0.05, 0.075] {
            let (mut both, mut squares) = (0.0, [0.0; 2]);
            for joint in 0..N_JOINTS {
                let times = (5..295).map(|i| 0.1 * f64::from(i) + phase);
                let each: Vec<Sight> = times.filter_map(|time| chain.sight(joint, time)).collect();
                let n = each.len() as f64;
                let middle = each.iter().map(|sight| sight.at.coords).sum::<Vector2<f64>>() / n;
                for it in &each {
                    let error = it.at.coords - middle;
                    both += error.dot(&it.speed);
                    squares[0] += error.norm_squared();
                    squares[1] += it.speed.norm_squared();
                }
            }
            let correlation = both / (squares[0] * squares[1]).sqrt();
            // The correlation is computed from about 8000 numbers.
            assert!(correlation.abs() < 0.04, "{correlation} at {phase} s");
        }
    }
}
