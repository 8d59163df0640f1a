//! Where to look for the people of a view in the next frame.

use posenetwork::Turn;
use skeleton::body::N_JOINTS;

/// Fraction of the distance to the box around the pose by which each side of the search box moves inward per frame.
const INWARD: f64 = 0.5;
/// A pose is much worse than usual if its score is lower by at least the score of this many perfectly seen joints.
pub(crate) const MUCH_WORSE: f32 = 1.5;
/// Weight of a new score in the usual score.
const NEW_SCORE: f32 = 0.1;
/// Amount by which a box is enlarged to check whether more of the person is outside it, as a fraction of the longer side.
const WIDER: f64 = 0.25;
/// Amount by which a box is enlarged for a person who may have moved on, and its maximum, as fractions of the longer side. The amount is
/// for one maximum gap between frames (0.4 s), in which a running person moves by half of the body height.
const MOVED: f64 = 0.5;
const MOST_MOVED: f64 = 1.0;
/// Maximum displacement of a person who stands still, as a fraction of the height of the network's window; less than the error
/// of the network.
const STILL: f64 = 0.01;
/// Maximum displacement of every joint of a person who stands still, as a fraction of the height of the network's window. A person who
/// stands on one leg and swings the other one has to be looked at.
const STILL_JOINT: f64 = 0.02;
/// If a person's last step exceeds this multiple of [`STILL`], the person has moved, whatever the mean velocity.
const MOST_STEP: f64 = 3.0;
/// Weight of the earlier velocity after a frame. It is high because, between two frames, the error of the network exceeds the motion of a
/// standing person.
const KEPT: f64 = 0.7;

/// Motion of the limbs of a person whose trunk stands still, per frame, as a fraction of the height of the network's window.
const LIMBS: f64 = 0.02;

/// Where to look for a person in the next frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Track {
    /// The box, in pixels: left, top, right, bottom.
    pub(crate) outline: [f64; 4],
    /// Rotation of the picture for the network.
    pub(crate) turn: Turn,
    /// Usual score of the person's poses.
    pub(crate) usual_score: f32,
    /// True if the score of this frame is so much lower than usual that the box may not fit.
    pub(crate) is_doubtful: bool,
    /// Index of the person among the people of the frame.
    pub(crate) index: usize,
    /// Number of frames since the network last ran on the person.
    pub(crate) n_held: u64,
    /// How the person moves in the picture; `None` after a single sighting.
    pub(crate) pace: Option<Pace>,
    /// True if the person has already been seen in this frame.
    pub(crate) is_seen: bool,
}

/// Motion of a person in the picture, as fractions of the height of the network's window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pace {
    /// Mean velocity per frame, with more weight on the most recent sightings.
    velocity: [f64; 2],
    /// Distance between the last two sightings.
    step: f64,
    /// Mean velocity of every joint.
    joints: [[f64; 2]; N_JOINTS],
}

/// Displacement of a person between two sightings, as fractions of the height of the network's window.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moved {
    pub(crate) whole: [f64; 2],
    /// Displacement of every joint; `None` for joints that are not clearly visible.
    pub(crate) joints: [Option<[f64; 2]>; N_JOINTS],
}

impl Pace {
    /// Returns the motion after another sighting.
    ///
    /// * `moved`, `n_frames`: displacement and number of frames since the last sighting.
    pub(crate) fn next(before: Option<Self>, moved: &Moved, n_frames: u64) -> Self {
        let n_frames = n_frames.max(1) as f64;
        let kept = if before.is_some() {
            KEPT.powf(n_frames)
        } else {
            0.0
        };
        let mean = |last: [f64; 2], by: [f64; 2]| -> [f64; 2] {
            core::array::from_fn(|axis| kept * last[axis] + (1.0 - kept) * (by[axis] / n_frames))
        };
        let last = before.map_or([0.0; 2], |before| before.velocity);
        let mut joints = before.map_or([[0.0; 2]; N_JOINTS], |before| before.joints);
        for (velocity, by) in joints.iter_mut().zip(&moved.joints) {
            *velocity = by.map_or(*velocity, |by| mean(*velocity, by));
        }
        Self {
            velocity: mean(last, moved.whole),
            step: moved.whole[0].hypot(moved.whole[1]),
            joints,
        }
    }

    /// Returns the mean speed of the fastest joint per frame.
    fn fastest_joint(&self) -> f64 {
        let speeds = self.joints.iter().map(|[x, y]| x.hypot(*y));
        speeds.fold(0.0, f64::max)
    }

    /// Returns true if a person with this motion hardly moves in `n_frames` frames.
    fn is_still(&self, n_frames: u64) -> bool {
        let [x, y] = self.velocity;
        let n_frames = n_frames as f64;
        self.step <= MOST_STEP * STILL
            && x.hypot(y) * n_frames <= STILL
            && self.fastest_joint() * n_frames <= STILL_JOINT
    }
}

impl Track {
    /// Returns where to look for a person next.
    ///
    /// The result is the box around the pose, but its sides move inward only step by step. So if the head or a leg is missing from a pose
    /// in one frame, the next box still contains it. A pose that is much worse than usual does not move any side.
    ///
    /// * `looked_at`: the box of this frame, and the rotation of the picture; `usual_score`: usual score of the person's poses; `None` for
    ///   a new person.
    /// * `around`, `score`: the box around the seen pose, and its score.
    /// * `most_lost`: maximum amount by which a score may be below the usual score.
    pub(crate) fn next(
        ((looked_at, turn), usual_score): (([f64; 4], Turn), Option<f32>),
        (around, score): ([f64; 4], f32),
        most_lost: f32,
    ) -> Self {
        let usual_score = usual_score.unwrap_or(score);
        let is_doubtful = score < usual_score - most_lost;
        let moved = |side: usize| {
            let by = around[side] - looked_at[side];
            let is_inward = (by > 0.0) == (side < 2);
            looked_at[side] + if is_inward { INWARD * by } else { by }
        };
        Self {
            outline: if is_doubtful {
                looked_at
            } else {
                core::array::from_fn(moved)
            },
            turn,
            usual_score: usual_score + NEW_SCORE * (score - usual_score),
            is_doubtful,
            index: 0,
            n_held: 0,
            pace: None,
            is_seen: false,
        }
    }

    /// Returns how far the person may have moved since the last run of the network, as a fraction of the height of the network's window.
    ///
    /// * `n_frames`: number of frames since that run.
    pub(crate) fn doubt(&self, n_frames: u64) -> f64 {
        let speed = self.pace.map_or(f64::INFINITY, |pace| {
            pace.velocity[0].hypot(pace.velocity[1])
        });
        n_frames as f64 * (speed + LIMBS)
    }

    /// Moves the box with the person.
    ///
    /// * `n_frames`: number of frames for which the person moves on; `window_px`: height of the network's window, in pixels.
    pub(crate) fn moved_on(self, n_frames: u64, window_px: f64) -> Self {
        let velocity = self.pace.map_or([0.0; 2], |pace| pace.velocity);
        let by = velocity.map(|by| by * n_frames as f64 * window_px);
        Self {
            outline: core::array::from_fn(|side| self.outline[side] + by[side % 2]),
            ..self
        }
    }

    /// Returns true if the person has hardly moved since the last run of the network.
    ///
    /// * `n_frames`: number of frames since that run.
    pub(crate) fn is_still(&self, n_frames: u64) -> bool {
        !self.is_doubtful && self.pace.is_some_and(|pace| pace.is_still(n_frames))
    }
}

/// Returns a box that contains more of the surroundings of a person of the previous frame.
pub(crate) fn wider(outline: [f64; 4]) -> [f64; 4] {
    enlarged(outline, WIDER)
}

/// Returns a box that still contains a person of an earlier frame.
///
/// * `apart`: time since that frame, as a multiple of the maximum gap between frames.
pub(crate) fn moved(outline: [f64; 4], apart: f64) -> [f64; 4] {
    enlarged(outline, (MOVED * apart).min(MOST_MOVED))
}

/// Enlarges a box on all sides by a fraction of its longer side.
fn enlarged([left, top, right, bottom]: [f64; 4], share: f64) -> [f64; 4] {
    let more = share * (right - left).max(bottom - top);
    [left - more, top - more, right + more, bottom + more]
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: [f64; 4] = [100.0, 50.0, 180.0, 250.0];

    /// A displacement of the whole person, with all joints.
    fn by(whole: [f64; 2]) -> Moved {
        Moved {
            whole,
            joints: [Some(whole); N_JOINTS],
        }
    }

    #[test]
    fn a_side_of_the_box_moves_outward_at_once_and_inward_gradually() {
        let around = [90.0, 150.0, 170.0, 260.0];
        let next = Track::next(((BOX, Turn::Up), None), (around, -20.0), 6.0);
        assert_eq!(next.outline, [90.0, 100.0, 175.0, 260.0]);
        assert!(!next.is_doubtful, "nothing is usual for somebody new");
    }

    #[test]
    fn a_much_worse_pose_than_usual_does_not_move_the_box() {
        let legs = [120.0, 150.0, 200.0, 250.0];
        let next = Track::next(((BOX, Turn::Up), Some(-18.0)), (legs, -25.0), 6.0);
        assert_eq!(next.outline, BOX);
        assert!(next.is_doubtful);
        assert!(!Track::next(((BOX, Turn::Up), Some(-18.0)), (legs, -23.0), 6.0).is_doubtful);
    }

    #[test]
    fn a_still_person_keeps_the_last_position_as_long_as_the_speed_allows() {
        let track = Track::next(((BOX, Turn::Up), Some(-18.0)), (BOX, -18.0), 6.0);
        assert!(!track.is_still(1), "one look tells no pace");
        let with = |speed: f64| Track {
            pace: Some(Pace::next(None, &by([0.0, speed]), 1)),
            ..track
        };
        let longest = |speed: f64| (1..=8).filter(|n| with(speed).is_still(*n)).count();
        assert_eq!([0.0, 0.002, 0.009, 0.02].map(longest), [8, 5, 1, 0]);
        let doubtful = Track {
            is_doubtful: true,
            ..with(0.0)
        };
        assert!(!doubtful.is_still(1));
    }

    #[test]
    fn the_network_runs_first_on_the_person_with_the_largest_possible_movement() {
        let track = Track::next(((BOX, Turn::Up), None), (BOX, -20.0), 6.0);
        let with = |speed: f64| Track {
            pace: Some(Pace::next(None, &by([speed, 0.0]), 1)),
            ..track
        };
        assert!(
            track.doubt(1) > with(0.5).doubt(9),
            "a new person comes first"
        );
        assert!(with(0.1).doubt(1) > with(0.01).doubt(1));
        assert!(
            with(0.0).doubt(7) > with(0.1).doubt(1),
            "nobody is forgotten"
        );
        let moved = with(0.1).moved_on(2, 200.0);
        assert_eq!(moved.outline, [140.0, 50.0, 220.0, 250.0]);
    }

    #[test]
    fn network_noise_does_not_count_as_movement_and_steps_do() {
        let after = |moved: &[f64]| {
            let looks = moved.iter().fold(None, |before, moved| {
                Some(Pace::next(before, &by([*moved, 0.0]), 1))
            });
            looks.unwrap()
        };
        let n_still = |moved: &[f64]| (1..=8).filter(|n| after(moved).is_still(*n)).count();
        assert!(n_still(&[0.006, -0.006, 0.006, -0.006]) >= 4);
        assert_eq!(n_still(&[0.006, -0.006, 0.04]), 0, "a step");
        assert_eq!(n_still(&[0.009; 8]), 1, "a slow walk");
        assert_eq!(
            n_still(&[0.0, 0.0, 0.02]),
            1,
            "a person who begins to walk is not held over the next frame"
        );
    }

    #[test]
    fn a_person_who_swings_one_leg_does_not_count_as_still() {
        let swing = |swing: Option<f64>| {
            let mut moved = by([0.0; 2]);
            moved.joints[3] = swing.map(|swing| [swing, 0.0]);
            let first = Pace::next(None, &by([0.0; 2]), 1);
            let pace = (0..5).fold(first, |pace, _| Pace::next(Some(pace), &moved, 1));
            (1..=8).filter(|n| pace.is_still(*n)).count()
        };
        assert_eq!(swing(Some(0.001)), 8);
        assert_eq!(swing(Some(0.01)), 2);
        assert_eq!(swing(Some(0.03)), 0);
        assert_eq!(swing(None), 8, "a hidden joint");
    }

    #[test]
    fn a_lasting_lower_score_becomes_the_usual_one() {
        let mut track = Track::next(((BOX, Turn::Up), Some(-18.0)), (BOX, -30.0), 6.0);
        let mut n_doubtful = 0;
        while track.is_doubtful {
            n_doubtful += 1;
            assert!(n_doubtful < 20);
            track = Track::next(
                ((track.outline, track.turn), Some(track.usual_score)),
                (BOX, -30.0),
                6.0,
            );
        }
        assert!(n_doubtful > 2);
    }

    #[test]
    fn the_box_of_a_moving_person_grows_with_time() {
        assert_eq!(moved(BOX, 1.5), [-50.0, -100.0, 330.0, 400.0]);
        assert_eq!(moved(BOX, 90.0), [-100.0, -150.0, 380.0, 450.0]);
    }
}
