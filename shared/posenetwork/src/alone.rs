//! The pose of one person by the maps of that person alone.

use fmp::{Layout, Pose, Region, Responses, Scope, Solver};

use crate::maps::JointMaps;
use crate::network::Turn;
use crate::springs::WINDOW_CELLS;

/// Least heat of a joint that tells where the head points, 0 to 1.
const SURE: f64 = 0.2;
/// Least number of joints of the legs, and least distance from them to the head, share of the longer side of the window.
const LEGS: usize = 3;
const LONG: f64 = 0.12;
/// By how much the head of an upright person may point elsewhere, radians: 70 degrees. That of one whose trunk is level over upright legs
/// points 63 degrees away.
const MOST_LEAN: f64 = 7.0 / 18.0 * core::f64::consts::PI;

impl JointMaps {
    /// Mean heat of the joints at their peaks, 0 to 1.
    pub fn heat(&self) -> f64 {
        let peaks = self.peaks().iter();
        let sum: f64 = peaks.flatten().map(|it| it.score.clamp(0.0, 1.0)).sum();
        sum / self.peaks().len().max(1) as f64
    }

    /// How the picture should be turned for the network to see this person upright: by where neck and head are, seen from the legs, whose
    /// direction does not change with the trunk when somebody bends down.
    ///
    /// * `now`: how it was turned; it stays so up to 70 degrees.
    pub fn turn(&self, now: Turn) -> Turn {
        let mean = |joints: core::ops::Range<usize>, least: usize| {
            let peaks = self.peaks().get(joints)?.iter().flatten();
            let sure: Vec<[f64; 2]> = peaks
                .filter(|it| it.score >= SURE)
                .map(|it| it.at)
                .collect();
            let n = sure.len();
            (n >= least)
                .then(|| [0, 1].map(|axis| sure.iter().map(|it| it[axis]).sum::<f64>() / n as f64))
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

    /// The level of a pyramid whose cells are nearest to those that the springs were learned with.
    pub fn level(&self, layout: &Layout) -> u16 {
        let [_, top, _, bottom] = self.extent();
        let cell = (bottom - top) / WINDOW_CELLS;
        let distance = |level: usize| (layout.levels[level].scale / cell).ln().abs();
        let levels = 0..layout.levels.len();
        let nearest = levels.min_by(|a, b| distance(*a).total_cmp(&distance(*b)));
        nearest.unwrap_or(0) as u16
    }

    /// The pixels of the picture that the maps cover; `None` if they lie beyond it.
    pub fn region(&self, layout: &Layout) -> Option<Region> {
        let [left, top, right, bottom] = self.extent();
        let along = |from: f64, to: f64, side: usize| {
            let from = from.floor().clamp(0.0, side as f64) as u32;
            let to = to.ceil().clamp(0.0, side as f64) as u32;
            (from < to).then_some([from, to])
        };
        let [width, height] = layout.image_size;
        Some(Region {
            x: along(left, right, width)?,
            y: along(top, bottom, height)?,
        })
    }

    /// The best pose of a tree of [`springs`](crate::springs) over these maps, on their own level; `None` if they lie beyond the
    /// picture.
    ///
    /// * `layout`: of the picture, for that tree.
    /// * `responses`: memory that is used again.
    pub fn pose(
        &mut self,
        solver: &Solver,
        layout: &Layout,
        responses: &mut Vec<f32>,
    ) -> Option<Pose> {
        let level = self.level(layout);
        let scope = Scope::new(layout, level..level + 1, self.region(layout)?).ok()?;
        responses.resize(layout.n_values(&scope), 0.0);
        self.fill(layout, &scope, responses);
        let levels = [level];
        solver.best(&Responses::within(layout, responses, &levels, scope), None)
    }
}

#[cfg(test)]
mod tests {
    use keypoints::{Keypoint, LSP_14, joint_ways};

    use super::*;
    use crate::maps::MapSettings;

    /// Somebody who stands: ankle, knee, hip; hip, knee, ankle; wrist, elbow, shoulder; shoulder, elbow, wrist; neck, head.
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
        let names: Vec<String> = LSP_14.iter().map(|it| (*it).to_owned()).collect();
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
    fn who_lies_or_stands_on_the_hands_is_turned() {
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
    fn who_bends_down_is_not() {
        let mut bent = STANDING;
        for at in &mut bent[6..] {
            *at = [-at[1], at[0] + 10.0];
        }
        assert_eq!(maps(bent).turn(Turn::Up), Turn::Up);
    }

    #[test]
    fn who_is_seen_from_the_feet_stays_as_turned() {
        let flat = STANDING.map(|[x, y]| [4.0 * x, 0.05 * y]);
        assert_eq!(maps(flat).turn(Turn::Up), Turn::Up);
        assert_eq!(maps(flat).turn(Turn::Left), Turn::Left);
    }
}
