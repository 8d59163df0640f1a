//! PCP3D of several people, computed by the protocol of the Shelf data set.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, Vector3};
use skeleton::body::Joints;
use statistics::score::Share;

use super::shelf::{N_TRUE, TruePerson};

/// Parts to evaluate, with the joints at their ends.
const PARTS: [(&str, [usize; 2]); 10] = [
    ("upper arms", [9, 10]),
    ("upper arms", [8, 7]),
    ("lower arms", [10, 11]),
    ("lower arms", [7, 6]),
    ("upper legs", [3, 4]),
    ("upper legs", [2, 1]),
    ("lower legs", [4, 5]),
    ("lower legs", [1, 0]),
    ("head", [12, 13]),
    ("torso", [12, 14]),
];
/// Largest mean distance between the joints of a person in the output and those of a true person for a match, in metres.
pub(super) const FOUND_M: f64 = 0.5;
/// Position of the ears between the neck and the top of the head, as in `keypoints::joint_ways`.
const EARS: f64 = 1.0 / 1.8;
/// Number of actors in the average: the first three.
pub(super) const ACTORS: usize = 3;

/// A person in the output.
#[derive(Debug, Clone, PartialEq)]
pub struct Put {
    /// Identity.
    pub id: u64,
    /// Joints in the order of the truth; `None` for a joint that was not found.
    pub joints: [Option<Point3<f64>>; N_TRUE],
}

impl Put {
    /// Uses the joints unchanged. The part `head` extends from the neck to the top of the head.
    pub fn plain(id: u64, joints: &Joints) -> Self {
        let mut all = [None; N_TRUE];
        all[..14].copy_from_slice(joints);
        all[14] = joints[2].zip(joints[3]).map(|(a, b)| nalgebra::center(&a, &b));
        Self { id, joints: all }
    }

    /// Applies the rule of 4D Association. The bottom of the head is midway between the shoulders and the ears. Its top is 0.125 m from
    /// there in the direction of the face, and 0.145 m up. The ears are at 1 / 1.8 of the distance from the neck to the top of the head.
    pub fn new(id: u64, joints: &Joints) -> Self {
        let middle = |a: usize, b: usize| Some(nalgebra::center(&joints[a]?, &joints[b]?));
        let [shoulders, hips] = [middle(8, 9), middle(2, 3)];
        let ears = joints[12].zip(joints[13]).map(|(neck, head)| neck + (head - neck) * EARS);
        let mut all = [None; N_TRUE];
        all[..12].copy_from_slice(&joints[..12]);
        all[14] = hips;
        all[12] = shoulders.zip(ears).map(|(shoulders, ears)| nalgebra::center(&shoulders, &ears));
        let face = || {
            let across = joints[8]? - joints[9]?;
            (shoulders? - hips?).cross(&across).try_normalize(1e-9)
        };
        let face = face().unwrap_or_else(Vector3::zeros);
        all[13] = all[12].map(|bottom| bottom + face * 0.125 + Vector3::new(0.0, 0.0, 0.145));
        Self { id, joints: all }
    }
}

/// Correct parts of a person in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartsOfFrame {
    /// Id of the person.
    pub actor: usize,
    /// Number of correct parts, and number of all parts.
    pub right: Share,
}

/// The score of a person.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Actor {
    /// Correct parts in each frame in which the person is present.
    pub parts: Vec<Share>,
    /// Correct parts over all frames, by the name of the part.
    pub by_part: BTreeMap<&'static str, Share>,
    /// Distances of the twelve joints of the limbs, in metres.
    pub errors_m: Vec<Share>,
    /// Number of frames in which the person was found.
    pub n_found: usize,
    /// Number of id changes.
    pub switches: usize,
    /// The id in the last frame in which the person was found.
    pub last_id: Option<u64>,
}

/// Score of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Score {
    /// True people, by their ids in the truth.
    pub actors: BTreeMap<usize, Actor>,
    /// Correct parts, for each frame.
    pub frames: Vec<Vec<PartsOfFrame>>,
    /// All ids in the output.
    pub ids: BTreeSet<u64>,
    /// Number of people in the output, over all frames.
    pub n_put: usize,
}

impl Score {
    /// Adds a frame. Each true person is matched with the nearest person of the output, the closest pairs first.
    pub fn add(&mut self, truth: &[TruePerson], put: &[Put]) {
        self.ids.extend(put.iter().map(|person| person.id));
        self.n_put += put.len();
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for (a, person) in truth.iter().enumerate() {
            let near = put.iter().enumerate();
            let near = near.filter_map(|(b, put)| Some((put.distance(person)?, a, b)));
            pairs.extend(near.filter(|pair| pair.0 < FOUND_M));
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut found = vec![None; truth.len()];
        for (_, a, b) in pairs {
            if found[a].is_none() && !found.contains(&Some(b)) {
                found[a] = Some(b);
            }
        }
        let each = truth.iter().zip(found).map(|(person, found)| {
            let actor = self.actors.entry(person.id).or_default();
            let right = actor.add(person, found.map(|nth| &put[nth]));
            PartsOfFrame {
                actor: person.id,
                right,
            }
        });
        self.frames.push(each.collect());
    }
}

impl Put {
    /// Returns the mean distance of the joints, in metres; `None` for fewer than four joints.
    fn distance(&self, person: &TruePerson) -> Option<f64> {
        let each = person.joints.iter().zip(&self.joints);
        let each = each.filter_map(|(a, b)| Some((a - (*b)?).norm()));
        let share = Share::of(each);
        (share.n >= 4.0).then(|| share.sum / share.n)
    }
}

impl Actor {
    /// Adds a frame, and returns the correct parts.
    fn add(&mut self, person: &TruePerson, put: Option<&Put>) -> Share {
        let error = |joint: usize| {
            let point = put.and_then(|put| put.joints[joint])?;
            Some((point - person.joints[joint]).norm())
        };
        let mut right = Share::default();
        for (name, [a, b]) in PARTS {
            let length = (person.joints[a] - person.joints[b]).norm();
            let both = error(a).zip(error(b));
            let is_right = both.is_some_and(|(a, b)| f64::midpoint(a, b) <= 0.5 * length);
            for share in [&mut right, self.by_part.entry(name).or_default()] {
                share.sum += f64::from(is_right);
                share.n += 1.0;
            }
        }
        self.parts.push(right);
        self.errors_m.push(Share::of((0..12).filter_map(error)));
        if let Some(put) = put {
            self.n_found += 1;
            self.switches += usize::from(self.last_id.is_some_and(|id| id != put.id));
            self.last_id = Some(put.id);
        }
        right
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a person with a height of 1.7 m at a position.
    fn person(id: usize, x: f64) -> TruePerson {
        let joint = |nth: usize| Point3::new(x + 0.1 * (nth % 2) as f64, 0.0, 0.12 * nth as f64);
        TruePerson {
            id,
            joints: core::array::from_fn(joint),
        }
    }

    fn put(id: u64, person: &TruePerson, off_m: f64) -> Put {
        let joints = person.joints.map(|joint| Some(joint + Vector3::y() * off_m));
        Put { id, joints }
    }

    #[test]
    fn a_part_is_correct_if_the_mean_error_of_its_ends_is_at_most_half_its_length() {
        let truth = [person(0, 0.0)];
        let mut score = Score::default();
        for off_m in [0.05, 0.4] {
            score.add(&truth, &[put(1, &truth[0], off_m)]);
        }
        let parts = &score.actors[&0].parts;
        assert_eq!((parts[0].sum, parts[0].n), (10.0, 10.0));
        assert_eq!(parts[1].sum, 0.0);
    }

    #[test]
    fn people_are_matched_to_the_nearest_truth_and_changes_of_id_are_counted() {
        let truth = [person(0, 0.0), person(1, 1.0)];
        let both = |ids: [u64; 2]| vec![put(ids[1], &truth[1], 0.01), put(ids[0], &truth[0], 0.02)];
        let mut score = Score::default();
        for ids in [[1, 2], [1, 2], [2, 1], [2, 3]] {
            score.add(&truth, &both(ids));
        }
        let switches = [0, 1].map(|actor| score.actors[&actor].switches);
        assert_eq!((switches, score.ids.len(), score.n_put), ([1, 2], 3, 8));
        score.add(&truth, &[]);
        let actor = &score.actors[&0];
        assert_eq!(
            (actor.n_found, actor.parts.len(), actor.parts[4].sum),
            (4, 5, 0.0)
        );
    }
}
