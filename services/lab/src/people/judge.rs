//! PCP3D of several people, by the protocol of Shelf.

use std::collections::{BTreeMap, BTreeSet};

use body::Joints;
use nalgebra::{Point3, Vector3};
use score::{Bootstrap, Share};

use super::shelf::{N_TRUE, TruePerson};

/// The parts that are judged, by the joints at their ends.
pub const PARTS: [(&str, [usize; 2]); 10] = [
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
/// A truth is found by nothing that is farther away, mean over the joints, metres.
const FOUND_M: f64 = 0.5;
/// Frames that are drawn together for an interval: a second.
const BLOCK: usize = 25;
/// Where the ears are between the neck and the top of the head, as `keypoints::joint_ways` has it.
const EARS: f64 = 1.0 / 1.8;
/// The average is over these actors.
pub const ACTORS: usize = 3;

/// A person as it was put out.
#[derive(Debug, Clone, PartialEq)]
pub struct Put {
    /// Identity.
    pub id: u64,
    /// The joints of the truth, where they were found.
    pub joints: [Option<Point3<f64>>; N_TRUE],
}

impl Put {
    /// By the rule of 4D Association: the bottom of the head is the middle of the shoulders and of the ears, its top 0.125 m along the face
    /// and 0.145 m up. The ears are [`EARS`] of the way from the neck to the top of the head.
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
            Some((shoulders? - hips?).cross(&across).normalize())
        };
        let face = face().unwrap_or_else(Vector3::zeros);
        all[13] = all[12].map(|bottom| bottom + face * 0.125 + Vector3::new(0.0, 0.0, 0.145));
        Self { id, joints: all }
    }
}

/// The score of a person.
#[derive(Debug, Clone, Default)]
pub struct Actor {
    /// Parts that are right, of each frame in which the person is there; of all kinds together, and of each.
    pub parts: Vec<Share>,
    /// By the name of the part.
    pub by_part: BTreeMap<&'static str, Share>,
    /// Distances of the twelve joints of the limbs, millimetres.
    pub errors_mm: Vec<Share>,
    /// Frames in which the person was found.
    pub n_found: usize,
    /// How often the id changed.
    pub switches: usize,
    last_id: Option<u64>,
}

/// The score of a run.
#[derive(Debug, Clone, Default)]
pub struct Score {
    /// The people who were there, by their ids in the truth.
    pub actors: BTreeMap<usize, Actor>,
    /// All ids that were put out.
    pub ids: BTreeSet<u64>,
    /// People put out in each frame.
    pub put: Vec<Share>,
}

impl Score {
    /// Adds a frame.
    pub fn add(&mut self, truth: &[TruePerson], put: &[Put]) {
        self.ids.extend(put.iter().map(|person| person.id));
        self.put.push(Share { sum: put.len() as f64, n: 1.0 });
        let distance = |person: &TruePerson, put: &Put| {
            let each = person.joints.iter().zip(&put.joints);
            let (n, sum) = each.fold((0, 0.0), |(n, sum), (a, b)| match b {
                Some(b) => (n + 1, sum + (a - b).norm()),
                None => (n, sum),
            });
            if n >= 4 { sum / f64::from(n) } else { f64::INFINITY }
        };
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for (a, person) in truth.iter().enumerate() {
            let near = put.iter().enumerate().map(|(b, put)| (distance(person, put), a, b));
            pairs.extend(near.filter(|it| it.0 < FOUND_M));
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut found = vec![None; truth.len()];
        for (_, a, b) in pairs {
            if found[a].is_none() && !found.contains(&Some(b)) {
                found[a] = Some(b);
            }
        }
        for (person, found) in truth.iter().zip(found) {
            self.actors.entry(person.id).or_default().add(person, found.map(|nth| &put[nth]));
        }
    }

    /// Mean of the first three actors' percentages, and its interval.
    pub fn mean(&self) -> Option<f64> {
        let each: Option<Vec<f64>> = (0..ACTORS).map(|id| self.actors.get(&id)?.pcp()).collect();
        Some(each?.iter().sum::<f64>() / ACTORS as f64)
    }

    /// How often any id changed.
    pub fn switches(&self) -> usize {
        self.actors.values().map(|actor| actor.switches).sum()
    }
}

impl Actor {
    fn add(&mut self, person: &TruePerson, put: Option<&Put>) {
        let error = |joint: usize| {
            put.and_then(|put| put.joints[joint]).map(|point| (point - person.joints[joint]).norm())
        };
        let right = PARTS.iter().map(|(name, [a, b])| {
            let length = (person.joints[*a] - person.joints[*b]).norm();
            let both = error(*a).zip(error(*b));
            let is_right = both.is_some_and(|(a, b)| f64::midpoint(a, b) <= 0.5 * length);
            (*name, f64::from(is_right))
        });
        let right: Vec<(&str, f64)> = right.collect();
        self.parts.push(Share::of(right.iter().map(|it| it.1)));
        for (name, is_right) in right {
            let share = self.by_part.entry(name).or_default();
            (share.sum, share.n) = (share.sum + is_right, share.n + 1.0);
        }
        self.errors_mm.push(Share::of((0..12).filter_map(error).map(|metres| 1e3 * metres)));
        if let Some(put) = put {
            self.n_found += 1;
            self.switches += usize::from(self.last_id.is_some_and(|id| id != put.id));
            self.last_id = Some(put.id);
        }
    }

    /// Parts that are right, percent.
    pub fn pcp(&self) -> Option<f64> {
        Share::mean(&self.parts).map(|share| 100.0 * share)
    }

    /// The interval of [`pcp`](Self::pcp).
    pub fn pcp_interval(&self) -> Option<[f64; 2]> {
        let bootstrap = Bootstrap { block: BLOCK, ..Bootstrap::default() };
        bootstrap.interval(&self.parts).map(|ends| ends.map(|end| 100.0 * end))
    }
}
