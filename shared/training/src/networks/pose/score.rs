//! Quality of a network on people whose joints are known.

use serde::{Deserialize, Serialize};

use super::{N_JOINTS, N_KEYPOINTS};

/// The limbs whose ends are evaluated (PCP). Each end of a limb is the mean of the listed joints.
const STICKS: [(&[usize], &[usize]); 10] = [
    (&[8, 9], &[2, 3]),
    (&[2], &[1]),
    (&[3], &[4]),
    (&[1], &[0]),
    (&[4], &[5]),
    (&[8], &[7]),
    (&[9], &[10]),
    (&[7], &[6]),
    (&[10], &[11]),
    (&[12], &[13]),
];

/// Indices of the neck and the top of the head.
const HEAD: [usize; 2] = [12, 13];

/// Found and true keypoints of one person.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// Positions of the found keypoints, in cells.
    pub found: [[f32; 2]; N_KEYPOINTS],
    /// Expected errors of the keypoints, in any unit common to all people.
    pub expected: [f32; N_KEYPOINTS],
    /// Evidence for the direction of the trunk.
    pub front: [f32; 2],
    /// True positions of the keypoints, in cells; NaN if unknown.
    pub truth: [[f32; 2]; N_KEYPOINTS],
    /// True direction of the trunk; its length is the certainty.
    pub facing: [f32; 2],
}

/// Measures of a network's quality.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Number of people.
    pub people: usize,
    /// Share of limbs for which the mean error of both ends is at most half the length of the limb.
    pub mean_of_ends: f32,
    /// Share of limbs for which the error of each end is at most half the length of the limb.
    pub both_ends: f32,
    /// Among the people whose true direction is known, the share for whom the network prefers that direction to the opposite one.
    pub front: f32,
    /// Area under the ROC curve: the probability that a joint with an error of more than half a head has a larger expected error
    /// than a joint with a smaller error.
    pub area: f32,
    /// Share of extra keypoints with an error of at most a fifth of the trunk.
    pub extras: f32,
}

fn distance(a: [f32; 2], b: [f32; 2]) -> f32 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn end(of: &[[f32; 2]], joints: &[usize]) -> [f32; 2] {
    let n = joints.len() as f32;
    [0, 1].map(|axis| joints.iter().map(|joint| of[*joint][axis]).sum::<f32>() / n)
}

impl Score {
    /// Computes the measures from the results for people.
    pub fn new(people: &[Judged]) -> Self {
        let mut limbs = [0.0f32; 3];
        let mut fronts = [0.0f32; 2];
        let mut extras = [0.0f32; 2];
        let mut joints: Vec<(f32, bool)> = Vec::new();
        for person in people {
            for (a, b) in STICKS {
                let [from, to] = [end(&person.truth, a), end(&person.truth, b)];
                let half = 0.5 * distance(from, to);
                let off = [
                    distance(end(&person.found, a), from),
                    distance(end(&person.found, b), to),
                ];
                if half.is_finite() {
                    limbs[0] += 1.0;
                    limbs[1] += f32::from(u8::from(f32::midpoint(off[0], off[1]) <= half));
                    limbs[2] += f32::from(u8::from(off[0].max(off[1]) <= half));
                }
            }
            if person.facing[0].hypot(person.facing[1]) > 0.7 {
                let along = person.front[0] * person.facing[0] + person.front[1] * person.facing[1];
                fronts[0] += 1.0;
                fronts[1] += f32::from(u8::from(along > 0.0));
            }
            let trunk = distance(end(&person.truth, &[2, 3]), person.truth[HEAD[0]]);
            for extra in N_JOINTS..N_KEYPOINTS {
                let off = distance(person.found[extra], person.truth[extra]) / trunk;
                if off.is_finite() {
                    extras[0] += 1.0;
                    extras[1] += f32::from(u8::from(off <= 0.2));
                }
            }
            let head = distance(person.truth[HEAD[0]], person.truth[HEAD[1]]);
            for joint in 0..N_JOINTS {
                let heads = distance(person.found[joint], person.truth[joint]) / head;
                if heads.is_finite() {
                    joints.push((person.expected[joint], heads > 0.5));
                }
            }
        }
        Self {
            people: people.len(),
            mean_of_ends: limbs[1] / limbs[0],
            both_ends: limbs[2] / limbs[0],
            front: fronts[1] / fronts[0],
            area: area(joints),
            extras: extras[1] / extras[0],
        }
    }
}

/// The area under the curve (Mann and Whitney); NaN if all joints are in the same class.
fn area(mut joints: Vec<(f32, bool)>) -> f32 {
    joints.sort_by(|a, b| a.0.total_cmp(&b.0));
    let far = joints.iter().filter(|joint| joint.1).count();
    let near = joints.len() - far;
    let mut below = 0u64;
    let mut pairs = 0u64;
    for (_, is_far) in &joints {
        if *is_far {
            pairs += below;
        } else {
            below += 1;
        }
    }
    (pairs as f64 / (far as f64 * near as f64)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn standing() -> [[f32; 2]; N_KEYPOINTS] {
        [
            [0.0, 40.0],
            [0.0, 30.0],
            [0.0, 20.0],
            [4.0, 20.0],
            [4.0, 30.0],
            [4.0, 40.0],
            [-4.0, 20.0],
            [-4.0, 15.0],
            [-2.0, 8.0],
            [6.0, 8.0],
            [8.0, 15.0],
            [8.0, 20.0],
            [2.0, 6.0],
            [2.0, 0.0],
            [2.0, 3.0],
            [5.0, 42.0],
            [-1.0, 42.0],
            [3.0, 43.0],
            [1.0, 43.0],
        ]
    }

    #[test]
    fn a_perfect_network_scores_one_and_a_moved_foot_costs_a_limb() {
        let mut person = Judged {
            found: standing(),
            expected: [0.1; N_KEYPOINTS],
            front: [0.0, 2.0],
            truth: standing(),
            facing: [0.0, 1.0],
        };
        let perfect = Score::new(&[person.clone()]);
        assert_eq!(
            [perfect.mean_of_ends, perfect.both_ends, perfect.front],
            [1.0; 3]
        );
        person.found[0] = [0.0, 32.0];
        person.found[N_JOINTS] = [2.0, 7.0];
        person.expected[0] = 0.5;
        person.front = [0.0, -0.1];
        let score = Score::new(&[person]);
        assert_eq!(
            [
                score.mean_of_ends,
                score.both_ends,
                score.front,
                score.extras
            ],
            [1.0, 0.9, 0.0, 0.8]
        );
        assert_eq!(
            score.area, 1.0,
            "the joint that is far off is the one that was expected to be"
        );
    }
}
