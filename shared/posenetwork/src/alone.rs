//! Measures of one person from the peaks of the joint maps: mean heat, position, and the direction of the head.

use crate::maps::{JointMaps, MapSettings};
use crate::network::Turn;
use crate::outline::outline_of;

/// Minimum heat, 0 to 1, at which a joint is used for the box around the person.
const FAINT: f64 = 0.02;

/// Minimum heat, 0 to 1, at which a joint is used for the direction of the head.
const SURE: f64 = 0.2;
/// Minimum number of leg joints for a direction, and minimum distance between these joints and the head, as a share of the longer side of
/// the window.
const LEGS: usize = 3;
const LONG: f64 = 0.12;
/// The picture is rotated if the angle between the direction of the head and upright is larger than this: 70 degrees, in radians. For a
/// person whose trunk is bent to the horizontal over upright legs, this angle is 63 degrees.
const MOST_LEAN: f64 = 7.0 / 18.0 * core::f64::consts::PI;

impl JointMaps {
    /// Mean heat of the joints at their peaks, 0 to 1.
    pub fn heat(&self) -> f64 {
        let peaks = self.peaks().iter();
        let sum: f64 = peaks.flatten().map(|peak| peak.score.clamp(0.0, 1.0)).sum();
        sum / self.peaks().len().max(1) as f64
    }

    /// Returns the rotation of the picture with which the network sees this person upright. The direction points from the legs to the neck
    /// and head. It changes less than the direction of the trunk when a person bends down.
    ///
    /// * `now`: rotation used so far; it is kept if the direction differs by at most 70 degrees.
    pub fn turn(&self, now: Turn) -> Turn {
        let mean = |joints: core::ops::Range<usize>, least: usize| {
            let peaks = self.peaks().get(joints)?.iter().flatten();
            let sure: Vec<[f64; 2]> =
                peaks.filter(|peak| peak.score >= SURE).map(|peak| peak.at).collect();
            let n = sure.len();
            (n >= least).then(|| {
                [0, 1].map(|axis| sure.iter().map(|sure| sure[axis]).sum::<f64>() / n as f64)
            })
        };
        let (Some(head), Some(legs)) = (mean(12..14, 1), mean(0..6, LEGS)) else {
            return now;
        };
        let towards = [head[0] - legs[0], head[1] - legs[1]];
        let [left, top, right, bottom] = self.extent();
        if towards[0].hypot(towards[1]) < LONG * (right - left).max(bottom - top) {
            return now;
        }
        now.towards(towards, MOST_LEAN)
    }

    /// Sum of the evidence of all joints at their peaks. A joint without a peak counts with the floor value, the evidence where the network
    /// sees nothing.
    pub fn score(&self, settings: &MapSettings) -> f32 {
        let floor = self.floor();
        let peaks = self.peaks().iter();
        let evidence =
            peaks.map(|peak| peak.map_or(floor, |peak| settings.of_heat(peak.score, floor)));
        evidence.sum()
    }

    /// Box around the joints at their peaks ([`outline_of`]), in pixels of the picture; `None` if no joint is seen.
    pub fn around(&self) -> Option<[f64; 4]> {
        let seen = self.peaks().iter().flatten();
        let seen = seen.filter(|peak| peak.score >= FAINT);
        outline_of(seen.map(|peak| peak.at))
    }

    /// Returns true if the maps cover any pixel of a picture.
    ///
    /// * `size`: width and height of the picture.
    pub fn overlaps(&self, size: [usize; 2]) -> bool {
        let [left, top, right, bottom] = self.extent();
        let [width, height] = size.map(|side| side as f64);
        left < right && top < bottom && left < width && top < height && right > 0.0 && bottom > 0.0
    }
}

#[cfg(test)]
mod tests {
    use keypoints::{Keypoint, LSP_14, joint_ways};

    use super::*;

    /// A standing person. The order is ankle, knee, hip; hip, knee, ankle; wrist, elbow, shoulder; shoulder, elbow, wrist; neck, head.
    const STANDING: [[f64; 2]; 14] = [
        [-8.0, 90.0],
        [-8.0, 45.0],
        [-8.0, 0.0],
        [8.0, 0.0],
        [8.0, 45.0],
        [8.0, 90.0],
        [-25.0, 0.0],
        [-22.0, -25.0],
        [-15.0, -50.0],
        [15.0, -50.0],
        [22.0, -25.0],
        [25.0, 0.0],
        [0.0, -55.0],
        [0.0, -80.0],
    ];

    fn maps(joints: [[f64; 2]; 14]) -> JointMaps {
        let names: Vec<String> = LSP_14.iter().map(|name| (*name).to_owned()).collect();
        let keypoint = |at: [f64; 2]| Keypoint {
            at: [at[0] + 200.0, at[1] + 200.0],
            score: 0.9,
        };
        let all: Vec<Option<Keypoint>> = joints.map(keypoint).map(Some).to_vec();
        let mut maps = JointMaps::default();
        let settings = MapSettings::default();
        assert!(maps.of_keypoints(&all, &joint_ways(&names), &settings, 0.02));
        maps
    }

    #[test]
    fn pictures_of_lying_people_and_handstands_are_rotated() {
        for (turned, expected) in [
            (STANDING, Turn::Up),
            (STANDING.map(|[x, y]| [-x, -y]), Turn::Down),
            (STANDING.map(|[x, y]| [-y, x]), Turn::Right),
            (STANDING.map(|[x, y]| [y, -x]), Turn::Left),
        ] {
            assert_eq!(maps(turned).turn(Turn::Up), expected);
            assert_eq!(maps(turned).turn(expected), expected);
        }
    }

    #[test]
    fn pictures_of_people_who_bend_down_are_not_rotated() {
        let mut bent = STANDING;
        for at in &mut bent[6..] {
            *at = [-at[1], at[0] + 10.0];
        }
        assert_eq!(maps(bent).turn(Turn::Up), Turn::Up);
    }

    #[test]
    fn the_rotation_is_kept_for_a_person_seen_from_the_feet() {
        let flat = STANDING.map(|[x, y]| [4.0 * x, 0.05 * y]);
        assert_eq!(maps(flat).turn(Turn::Up), Turn::Up);
        assert_eq!(maps(flat).turn(Turn::Left), Turn::Left);
    }
}
