//! Comparison of a finished run of several people with the truth of its scene: detections, positions and identities.

use std::collections::BTreeMap;

use nalgebra::Point3;
use runfiles::{FrameLine, PersonLine};
use scene::truth::{Frame, N_JOINTS};
use serde::Serialize;
use skeleton::PARSE14;
use skeleton::body::Joints;
use statistics::score::Share;

use super::Measured;
use super::judge::{FOUND_M, Put, Score};
use super::report::{ActorReport, measured, of_actor};
use super::shelf::{N_TRUE, TruePerson};

/// Mean distances of the joints up to which a person in the output is correct, in millimetres; as in `VoxelPose`'s evaluation on Panoptic.
const RIGHT_MM: [u32; 6] = [25, 50, 75, 100, 125, 150];

/// Scores of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Everybody {
    /// Number of frames with ground truth for which the run has a line.
    pub frames: usize,
    /// Results for each true person.
    pub people: Vec<ActorReport>,
    /// Mean distance of the fourteen joints of the people who were found, in millimetres.
    pub mpjpe_mm: Option<Measured>,
    /// Average precision in percent, for each distance in millimetres up to which a person is correct. People are ordered by the standard
    /// deviations in the run's output.
    pub ap: BTreeMap<u32, f64>,
    /// Percentage of the true people for whom the output has a person within half a metre.
    pub recall: f64,
    /// Number of id changes.
    pub switches: usize,
    /// Number of id changes per minute.
    pub switches_a_minute: f64,
    /// Number of different ids in the output.
    pub ids: usize,
    /// Mean number of people in the output of a frame.
    pub put_out: f64,
    /// Mean number of true people in a frame.
    pub there: f64,
}

/// A person in the output.
struct Candidate {
    frame: usize,
    /// Mean of the standard deviations in the output, in metres.
    sd_m: f64,
    /// Mean distance to every true person, in metres.
    distances_m: Vec<f64>,
}

/// Evaluates a run.
///
/// * `rate_hz`: true frames per second.
/// * `lines`: lines of `pose3d.jsonl`. Frames without ground truth are skipped, and so are frames with ground truth but without a line.
pub fn everybody(truth: &[Frame], lines: &[FrameLine], rate_hz: f64) -> Everybody {
    let by_number: BTreeMap<u64, &Frame> = truth.iter().map(|frame| (frame.frame, frame)).collect();
    let mut tally = Tally::default();
    for line in lines {
        if let Some(frame) = by_number.get(&line.frame) {
            tally.add(frame, line);
        }
    }
    tally.sum_up(rate_hz)
}

/// Counts over all frames so far.
#[derive(Default)]
struct Tally {
    score: Score,
    candidates: Vec<Candidate>,
    n_true: usize,
    /// Distances of the people who were found, in metres, for each frame.
    errors_m: Vec<Share>,
}

impl Tally {
    fn add(&mut self, frame: &Frame, line: &FrameLine) {
        let there: Vec<Joints> = core::iter::once(&frame.joints)
            .chain(&frame.others)
            .map(|joints| joints.map(|joint| Some(Point3::from(joint))))
            .collect();
        let put: Vec<Joints> = line.people.iter().map(joints).collect();
        let people = there.iter().enumerate();
        let people = people.filter_map(|(id, joints)| true_person(id, joints));
        let each = line.people.iter().zip(&put);
        let each = each.map(|(person, joints)| Put::plain(person.id, joints));
        self.score.add(
            &people.collect::<Vec<TruePerson>>(),
            &each.collect::<Vec<Put>>(),
        );
        for (person, put) in line.people.iter().zip(&put) {
            self.candidates.push(Candidate {
                frame: self.errors_m.len(),
                sd_m: deviation(person),
                distances_m: there.iter().map(|there| distance(put, there)).collect(),
            });
        }
        let nearest = there.iter().map(|there| {
            let each = put.iter().map(|put| distance(put, there));
            each.fold(f64::INFINITY, f64::min)
        });
        self.errors_m.push(Share::of(nearest.filter(|nearest| *nearest < FOUND_M)));
        self.n_true += there.len();
    }

    fn sum_up(mut self, rate_hz: f64) -> Everybody {
        self.candidates.sort_by(|a, b| a.sd_m.total_cmp(&b.sd_m));
        let ap = RIGHT_MM.map(|mm| {
            let right_m = f64::from(mm) / 1e3;
            (
                mm,
                average_precision(&self.candidates, self.n_true, right_m),
            )
        });
        let people = self.score.actors.iter();
        let people: Vec<ActorReport> = people.map(|(id, actor)| of_actor(*id, actor)).collect();
        let switches = people.iter().map(|person| person.switches).sum();
        let n_found: f64 = self.errors_m.iter().map(|found| found.n).sum();
        let n_frames = self.errors_m.len();
        let share = |n: f64, of: usize| n / of.max(1) as f64;
        Everybody {
            frames: n_frames,
            mpjpe_mm: measured(&self.errors_m, 1e3),
            ap: ap.into(),
            recall: 100.0 * share(n_found, self.n_true),
            switches,
            switches_a_minute: 60.0 * rate_hz * share(switches as f64, n_frames),
            ids: self.score.ids.len(),
            put_out: share(self.score.n_put as f64, n_frames),
            there: share(self.n_true as f64, n_frames),
            people,
        }
    }
}

/// Returns a true person; `None` if a joint is unknown.
fn true_person(id: usize, joints: &Joints) -> Option<TruePerson> {
    let put = Put::plain(0, joints);
    let mut all = [Point3::origin(); N_TRUE];
    for (joint, place) in all.iter_mut().zip(put.joints) {
        *joint = place?;
    }
    Some(TruePerson { id, joints: all })
}

/// Returns the joints of a person in a run.
fn joints(person: &PersonLine) -> Joints {
    core::array::from_fn(|joint| {
        let placed = person.joints.get(PARSE14.joints[joint].name)?.placed()?;
        let is_known = placed.position_m.iter().all(|number| number.is_finite());
        is_known.then(|| Point3::from(placed.position_m))
    })
}

/// Returns the mean of the standard deviations in the output, in metres; infinite if there is no joint.
fn deviation(person: &PersonLine) -> f64 {
    let placed = person.joints.values().filter_map(|joint| joint.placed());
    let (mut sum, mut n) = (0.0, 0.0);
    for joint in placed {
        let [xx, _, _, yy, _, zz] = joint.covariance_m2;
        let sd = ((xx + yy + zz) / 3.0).sqrt();
        if sd.is_finite() {
            sum += sd;
            n += 1.0;
        }
    }
    if n > 0.0 { sum / n } else { f64::INFINITY }
}

/// Returns the mean distance of the joints, in metres; infinite if half of them are unknown.
fn distance(put: &Joints, there: &Joints) -> f64 {
    let both = put.iter().zip(there);
    let each: Vec<f64> = both.filter_map(|(a, b)| Some(((*a)? - (*b)?).norm())).collect();
    if 2 * each.len() <= N_JOINTS {
        return f64::INFINITY;
    }
    each.iter().sum::<f64>() / each.len() as f64
}

/// Returns the area under the curve of precision over recall, in percent. People in the output are ordered by certainty. A person is
/// correct if the nearest true person is close enough and was not matched before.
fn average_precision(candidates: &[Candidate], n_true: usize, right_m: f64) -> f64 {
    let mut taken = std::collections::BTreeSet::new();
    let (mut n_right, mut points) = (0.0, Vec::new());
    for (nth, candidate) in candidates.iter().enumerate() {
        let each = candidate.distances_m.iter().enumerate();
        let nearest = each.min_by(|a, b| a.1.total_cmp(b.1));
        let is_right = nearest.is_some_and(|(person, distance)| {
            *distance < right_m && taken.insert((candidate.frame, person))
        });
        n_right += f64::from(is_right);
        points.push((n_right / n_true.max(1) as f64, n_right / (nth + 1) as f64));
    }
    // The precision at a given recall is the highest precision at this or any higher recall.
    let (mut area, mut best, mut last) = (0.0, 0.0_f64, points.last().map_or(0.0, |point| point.0));
    for (recall, precision) in points.iter().rev() {
        area += (last - recall) * best;
        best = best.max(*precision);
        last = *recall;
    }
    100.0 * (area + last * best)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 30.0;

    fn standing(x: f64) -> [[f64; 3]; N_JOINTS] {
        core::array::from_fn(|joint| [x + 0.1 * (joint % 2) as f64, 0.0, 0.12 * joint as f64])
    }

    fn frames(n: u64) -> Vec<Frame> {
        let frame = |frame| Frame {
            frame,
            seconds: frame as f64 / RATE_HZ,
            joints: standing(0.0),
            others: vec![standing(2.0)],
            views: Vec::new(),
        };
        (0..n).map(frame).collect()
    }

    /// Returns a line of results with people of these ids at these positions.
    fn line(frame: u64, people: &[(u64, f64)]) -> FrameLine {
        let person = |(id, x): &(u64, f64)| {
            let joints = PARSE14.joints.iter().zip(standing(*x));
            let joints: serde_json::Map<String, serde_json::Value> = joints
                .map(|(joint, place)| {
                    let placed = serde_json::json!({ "covariance_m2": [1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-4],
                        "position_m": place, "reprojection_px": 1.0, "views": ["a", "b"] });
                    (joint.name.to_owned(), placed)
                })
                .collect();
            serde_json::json!({ "facing_margin": null, "id": id, "joints": joints, "pairs": 1, "status": "ok",
                "views_used": ["a", "b"] })
        };
        let people: Vec<serde_json::Value> = people.iter().map(person).collect();
        let line = serde_json::json!({ "frame": frame, "people": people, "seen": 2, "status": "ok", "time_s": null,
            "views_missing": {}, "views_present": ["a", "b"] });
        serde_json::from_value(line).unwrap()
    }

    #[test]
    fn finding_everybody_in_the_right_place_gives_a_perfect_score() {
        let truth = frames(60);
        let lines: Vec<FrameLine> = (0..60).map(|nth| line(nth, &[(1, 0.01), (2, 2.01)])).collect();
        let score = everybody(&truth, &lines, RATE_HZ);
        assert_eq!(score.ap.len(), RIGHT_MM.len());
        assert!(score.ap.values().all(|ap| (ap - 100.0).abs() < 1e-9));
        assert_eq!((score.recall, score.switches, score.ids), (100.0, 0, 2));
        assert!((score.mpjpe_mm.unwrap().value - 10.0).abs() < 1e-6);
        assert_eq!((score.put_out, score.there), (2.0, 2.0));
    }

    #[test]
    fn phantoms_and_missing_people_and_swapped_ids_are_counted() {
        let truth = frames(60);
        let lines: Vec<FrameLine> = (0..60)
            .map(|nth| match nth {
                0..20 => line(nth, &[(1, 0.06), (2, 2.06), (3, 8.0)]),
                20..40 => line(nth, &[(1, 0.06)]),
                _ => line(nth, &[(2, 0.06), (1, 2.06)]),
            })
            .collect();
        let score = everybody(&truth, &lines, RATE_HZ);
        assert_eq!(score.switches, 2);
        assert_eq!(score.switches_a_minute, 60.0);
        assert_eq!(score.ids, 3);
        assert!((score.recall - 100.0 * 100.0 / 120.0).abs() < 1e-9);
        assert_eq!(score.ap[&50], 0.0);
        // 100 of the 120 true people are found correctly, and 100 of the 120 people in the output are correct. Before the last frames, the
        // fraction of correct people is slightly higher.
        assert!((69.4..70.0).contains(&score.ap[&75]), "{:?}", score.ap);
    }
}
