//! Percentage of correctly detected parts in three dimensions: the paper's eq. 13.

use skeleton::JointSet;

use crate::score::Point;

/// A segment of the body between two ends, each the mean of some joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Segment {
    /// Name, as in the paper's tables.
    pub name: &'static str,
    /// Joints whose mean is the start.
    pub from: &'static [usize],
    /// Joints whose mean is the end.
    pub to: &'static [usize],
}

/// The names of the segments that the paper judges, in the order of its tables.
///
/// The paper's text does not list the segments. But the overall PCP3D in its comparison on subject 1 (87.24 %) is the mean over these
/// twelve rows of the same table, so shoulders and hips count too.
pub const SEGMENT_NAMES: [&str; 12] = [
    "Head",
    "Shoulders",
    "U-R Arm",
    "U-L Arm",
    "L-R Arm",
    "L-L Arm",
    "Torso",
    "Hips",
    "U-R Leg",
    "U-L Leg",
    "L-R Leg",
    "L-L Leg",
];

/// Ends of the segments: neck, head, shoulders, elbows, wrists, midpoint of the hips, hips, knees, ankles;
/// the right side before the left.
type Ends = [&'static [usize]; 15];

const PARSE14: Ends = [
    &[12],
    &[13],
    &[8],
    &[9],
    &[7],
    &[10],
    &[6],
    &[11],
    &[2, 3],
    &[2],
    &[3],
    &[1],
    &[4],
    &[0],
    &[5],
];

const UMPM15: Ends = [
    &[1],
    &[2],
    &[3],
    &[6],
    &[4],
    &[7],
    &[5],
    &[8],
    &[0],
    &[9],
    &[10],
    &[11],
    &[12],
    &[13],
    &[14],
];

const HUMANEVA20: Ends = [
    &[0],
    &[19],
    &[6],
    &[2],
    &[7, 8],
    &[3, 4],
    &[9],
    &[5],
    &[1],
    &[14],
    &[10],
    &[15, 16],
    &[11, 12],
    &[17],
    &[13],
];

/// Returns the twelve segments between the joints of a set; `None` for an unknown set.
///
/// If a set has two joints for the same point (such as the elbow as the end of both arm segments), the two are averaged.
pub fn segments(set: &JointSet) -> Option<[Segment; 12]> {
    let ends = match set.name {
        "parse14" => PARSE14,
        "umpm15" => UMPM15,
        "humaneva20" => HUMANEVA20,
        _ => return None,
    };
    let [
        neck,
        head,
        shoulder_r,
        shoulder_l,
        elbow_r,
        elbow_l,
        wrist_r,
        wrist_l,
        pelvis,
        hip_r,
        hip_l,
        knee_r,
        knee_l,
        ankle_r,
        ankle_l,
    ] = ends;
    let between = [
        (neck, head),
        (shoulder_r, shoulder_l),
        (shoulder_r, elbow_r),
        (shoulder_l, elbow_l),
        (elbow_r, wrist_r),
        (elbow_l, wrist_l),
        (neck, pelvis),
        (hip_r, hip_l),
        (hip_r, knee_r),
        (hip_l, knee_l),
        (knee_r, ankle_r),
        (knee_l, ankle_l),
    ];
    let segment = |i: usize| Segment {
        name: SEGMENT_NAMES[i],
        from: between[i].0,
        to: between[i].1,
    };
    Some(std::array::from_fn(segment))
}

/// Returns the error of every segment: the mean error of its two ends divided by its true length.
///
/// A segment is correct at a threshold `gamma` if the error is at most `gamma` (eq. 13), 0.5 by convention.
///
/// * `found`, `truth`: the same joints, in the same unit and world; `None` for a missing joint.
/// * Returns `None` for a segment whose truth is not known, or has no length; infinity for a segment that was
///   not found.
///
/// # Panics
///
/// If a segment refers to a joint that is not in `found` or `truth`.
pub fn segment_errors(
    segments: &[Segment],
    found: &[Option<Point>],
    truth: &[Option<Point>],
) -> Vec<Option<f64>> {
    let of_segment = |segment: &Segment| {
        let [from, to] = [segment.from, segment.to].map(|end| mean(truth, end));
        let (from, to) = (from?, to?);
        let length = distance(from, to);
        if length == 0.0 {
            return None;
        }
        let ends = [(segment.from, from), (segment.to, to)];
        let errors = ends.map(|(end, truth)| {
            mean(found, end).map_or(f64::INFINITY, |found| distance(found, truth))
        });
        Some(f64::midpoint(errors[0], errors[1]) / length)
    };
    segments.iter().map(of_segment).collect()
}

/// Returns the mean of some joints; `None` if one is missing.
fn mean(joints: &[Option<Point>], of: &[usize]) -> Option<Point> {
    let mut sum = [0.0; 3];
    for &joint in of {
        for (sum, value) in sum.iter_mut().zip(joints[joint]?) {
            *sum += value;
        }
    }
    Some(sum.map(|sum| sum / of.len() as f64))
}

pub(crate) fn distance(a: Point, b: Point) -> f64 {
    let squares = [0, 1, 2].map(|i| (a[i] - b[i]) * (a[i] - b[i]));
    squares.iter().sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use skeleton::N_PARTS;

    use super::*;

    fn person(set: &JointSet) -> Vec<Option<Point>> {
        let part = |i: usize| [i as f64, (i * i % 7) as f64, 0.1 * i as f64];
        let parts: Vec<Point> = (0..N_PARTS).map(part).collect();
        set.from_parts(&parts).into_iter().map(Some).collect()
    }

    #[test]
    fn the_ends_of_a_segment_are_the_same_points_in_every_set() {
        let ends = |set: &JointSet| {
            let joints = person(set);
            segments(set).unwrap().map(|segment| {
                [
                    mean(&joints, segment.from).unwrap(),
                    mean(&joints, segment.to).unwrap(),
                ]
            })
        };
        let [first, others @ ..] = JointSet::ALL;
        for set in others {
            assert_eq!(ends(set), ends(first), "{}", set.name);
        }
    }

    #[test]
    fn the_overall_value_of_the_paper_is_the_mean_of_its_twelve_rows() {
        let rows = [
            100.0, 99.47, 94.52, 88.31, 76.09, 71.53, 100.0, 60.63, 100.0, 100.0, 82.69, 73.58,
        ];
        let mean = rows.iter().sum::<f64>() / rows.len() as f64;
        assert!((mean - 87.24).abs() < 0.005, "{mean}");
    }

    #[test]
    fn an_end_with_an_error_of_the_length_is_exactly_at_the_threshold() {
        let set = &skeleton::PARSE14;
        let truth = person(set);
        let segments = segments(set).unwrap();
        let mut found = truth.clone();
        let length = distance(truth[12].unwrap(), truth[13].unwrap());
        found[13].as_mut().unwrap()[2] += length;
        let got = segment_errors(&segments, &found, &truth);
        assert!((got[0].unwrap() - 0.5).abs() < 1e-12);
        assert!(got[1..].iter().all(|error| *error == Some(0.0)));
    }

    #[test]
    fn missing_joints_are_wrong_and_unknown_ones_are_not_judged() {
        let set = &skeleton::PARSE14;
        let (mut found, mut truth) = (person(set), person(set));
        found[6] = None;
        truth[0] = None;
        let got = segment_errors(&segments(set).unwrap(), &found, &truth);
        assert_eq!(got[4], Some(f64::INFINITY), "lower right arm");
        assert_eq!(got[10], None, "lower right leg");
    }

    proptest! {
        #[test]
        fn unit_and_translation_do_not_change_the_error(
            shift in prop::array::uniform3(-5.0..5.0_f64),
            off in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 14),
            scale in 0.01..1000.0_f64,
        ) {
            let set = &skeleton::PARSE14;
            let truth = person(set);
            let add = |a: Point, b: Point| [0, 1, 2].map(|i| a[i] + b[i]);
            let found: Vec<Option<Point>> =
                truth.iter().zip(&off).map(|(joint, off)| joint.map(|point| add(point, *off))).collect();
            let elsewhere = |all: &[Option<Point>]| -> Vec<Option<Point>> {
                let place = |point: Point| add(point, shift).map(|value| value * scale);
                all.iter().map(|joint| joint.map(place)).collect()
            };
            let segments = segments(set).unwrap();
            let here = segment_errors(&segments, &found, &truth);
            let there = segment_errors(&segments, &elsewhere(&found), &elsewhere(&truth));
            for (here, there) in here.iter().zip(there) {
                prop_assert!((here.unwrap() - there.unwrap()).abs() < 1e-9);
            }
        }
    }
}
