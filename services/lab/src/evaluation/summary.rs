//! Aggregates scores by sequence, by action over all subjects, by subject, and over all sequences.

use serde::Serialize;
use statistics::score::{Bootstrap, Changes, PcpRule, Report, Share};

use crate::evaluation::{FrameScore, Judgement};

/// Error in 3D up to which a joint counts as correct, in metres.
const PCK_M: f64 = 0.15;
/// The paper's threshold in eq. 13.
const GAMMA: f64 = 0.5;
/// Number of thresholds in the curves: from 0 in steps of 0.05.
const N_GAMMAS: usize = 21;
/// Range of the histogram of changes, in either direction, in pixels.
const REACH_PX: f64 = 50.0;
/// Number of bins of the histogram of changes.
const N_BINS: usize = 40;
/// Change below which a joint counts as unchanged, in pixels.
const SAME_PX: f64 = 1.0;
/// Increase of a joint's error above which the joint is also counted separately, in pixels.
const FAR_PX: f64 = 5.0;

/// Scores of one sequence.
#[derive(Debug, Clone)]
pub struct Measured {
    /// Name of the data set.
    pub dataset: String,
    /// The subject.
    pub subject: String,
    /// The action.
    pub action: String,
    /// Scores as `[frame][version]`.
    pub scores: Vec<Vec<FrameScore>>,
}

/// All numbers of a report.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Version of the report format.
    pub schema_version: u32,
    /// Names of the versions, in the order of [`Group::versions`].
    pub versions: Vec<String>,
    /// Baseline of the gains and changes; `None` if there is only one version.
    pub compared_with: Option<String>,
    /// Confidence level of the intervals.
    pub confidence: f64,
    /// Groups: first the sequences, then sets of several sequences.
    pub groups: Vec<Group>,
    /// Quality of the expected errors: first the mean over the parts, then each part; empty without a network.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub predictions: Vec<Judgement>,
}

/// A group of sequences; every frame has the same weight.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Group {
    /// Name of the data set.
    pub dataset: String,
    /// The subject; `All` for several.
    pub subject: String,
    /// The action; `Overall` for several.
    pub action: String,
    /// Number of frames per camera.
    pub frames: usize,
    /// The numbers of every version.
    pub versions: Vec<Numbers>,
}

/// The numbers of one version on one group.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Numbers {
    /// Segments found (eq. 13 at 0.5), in percent.
    pub pcp3d: Option<f64>,
    /// Confidence interval of `pcp3d` over frames.
    pub pcp3d_interval: Option<[f64; 2]>,
    /// Gain over the first version, in percentage points.
    pub gain: Option<f64>,
    /// Confidence interval of `gain`, from frame-by-frame differences from the first version.
    pub gain_interval: Option<[f64; 2]>,
    /// PCP3D of each segment, in percent, in the order of `statistics::score::SEGMENT_NAMES`.
    pub parts: Vec<Option<f64>>,
    /// PCP3D as a function of the threshold: pairs of threshold and percentage.
    pub curve: Vec<[f64; 2]>,
    /// Mean error of the joints that were found, in mm.
    pub mpjpe_mm: Option<f64>,
    /// Confidence interval of `mpjpe_mm`.
    pub mpjpe_interval: Option<[f64; 2]>,
    /// Mean error of the joints after the best alignment of every frame, in mm.
    pub aligned_mpjpe_mm: Option<f64>,
    /// Percentage of frames in which left and right of the whole body are swapped.
    pub exchanged: Option<f64>,
    /// Confidence interval of `exchanged`.
    pub exchanged_interval: Option<[f64; 2]>,
    /// Percentage of joints with an error of at most 150 mm. Joints that were not found count as wrong.
    pub pck3d: Option<f64>,
    /// Percentage of joints that could not be triangulated.
    pub lost: Option<f64>,
    /// PCP in images, in percent, by the mean error of both ends of a segment.
    pub pcp2d: Option<f64>,
    /// PCK in images at a tenth and a fifth of the person's size, in percent.
    pub pck2d: Option<[f64; 2]>,
    /// Mean number of single-view solutions until a pair, or all views, converged.
    pub iterations: Option<f64>,
    /// Percentage of pairs of views (or of solutions of all views at once) that did not converge.
    pub unsettled: Option<f64>,
    /// Single-view solutions per frame, over all pairs and hypotheses.
    pub solutions: Option<f64>,
    /// Percentage of consistency terms that were switched off.
    pub off: Option<f64>,
    /// Changes of the 2D joints relative to the first version.
    pub changes: ChangesOf,
}

/// Improvements and deteriorations relative to the first version.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChangesOf {
    /// Percentage of 2D joints whose error decreased by more than a pixel.
    pub improved: f64,
    /// Percentage of 2D joints whose error increased by more than a pixel.
    pub deteriorated: f64,
    /// Percentage of 2D joints whose error increased by more than five pixels.
    pub deteriorated_5px: f64,
    /// Bins of the histogram: the lower edge in pixels (positive values are improvements), and the percentage of joints. The outermost bins
    /// include all larger changes.
    pub bins: Vec<[f64; 2]>,
}

/// Aggregates scores.
///
/// * `versions`: names of the versions; the first is the baseline.
pub fn summarise(sequences: &[Measured], versions: &[String], bootstrap: &Bootstrap) -> Summary {
    let mut groups: Vec<Group> = Vec::new();
    let add = |groups: &mut Vec<Group>, names: [&str; 3], of: Vec<&Measured>| {
        let scores: Vec<&Vec<FrameScore>> =
            of.iter().flat_map(|sequence| &sequence.scores).collect();
        let [dataset, subject, action] = names.map(str::to_owned);
        let numbers = (0..versions.len()).map(|i| numbers(&scores, i, bootstrap));
        groups.push(Group {
            dataset,
            subject,
            action,
            frames: scores.len(),
            versions: numbers.collect(),
        });
    };
    for it in sequences {
        let names = [&it.dataset, &it.subject, &it.action].map(String::as_str);
        add(&mut groups, names, vec![it]);
    }
    for dataset in distinct(sequences.iter().map(|sequence| &sequence.dataset)) {
        let own: Vec<&Measured> =
            sequences.iter().filter(|sequence| sequence.dataset == dataset).collect();
        let several = |of: &[&Measured]| of.len() > 1;
        for action in distinct(own.iter().map(|sequence| &sequence.action)) {
            let of: Vec<&Measured> =
                own.iter().copied().filter(|sequence| sequence.action == action).collect();
            if several(&of) {
                add(&mut groups, [dataset, "All", action], of);
            }
        }
        let subjects = distinct(own.iter().map(|sequence| &sequence.subject));
        for subject in subjects.iter().filter(|_| subjects.len() > 1) {
            let of: Vec<&Measured> =
                own.iter().copied().filter(|sequence| sequence.subject == *subject).collect();
            if several(&of) {
                add(&mut groups, [dataset, subject, "Overall"], of);
            }
        }
        if several(&own) {
            add(&mut groups, [dataset, "All", "Overall"], own);
        }
    }
    Summary {
        schema_version: 1,
        versions: versions.to_vec(),
        compared_with: versions.first().cloned(),
        confidence: bootstrap.confidence,
        groups,
        predictions: Vec::new(),
    }
}

/// Returns the names without duplicates, in the order of their first occurrence.
fn distinct<'a>(names: impl Iterator<Item = &'a String>) -> Vec<&'a str> {
    let mut all: Vec<&str> = Vec::new();
    for name in names {
        if !all.contains(&name.as_str()) {
            all.push(name);
        }
    }
    all
}

/// Returns the segments found in one frame (eq. 13), in percent.
fn correct(frame: &FrameScore) -> Share {
    let judged = frame.segments.iter().flatten();
    Share::of(judged.map(|judged| percent(*judged <= GAMMA)))
}

/// Returns the gain of one version over another in a frame, in percentage points.
fn gain(own: &FrameScore, first: &FrameScore) -> Share {
    let (own, first) = (correct(own), correct(first));
    Share {
        sum: own.sum - first.sum,
        n: own.n,
    }
}

/// Returns the errors of the joints that were found, in mm.
fn errors_mm(errors: &[Option<f64>]) -> Share {
    let found = errors.iter().flatten().filter(|error| error.is_finite());
    Share::of(found.map(|value| 1000.0 * value))
}

fn numbers(frames: &[&Vec<FrameScore>], version: usize, bootstrap: &Bootstrap) -> Numbers {
    let own: Vec<&FrameScore> = frames.iter().filter_map(|frame| frame.get(version)).collect();
    let first: Vec<&FrameScore> = frames.iter().filter_map(|frame| frame.first()).collect();
    let each = |share: fn(&FrameScore) -> Share| -> Vec<Share> {
        own.iter().map(|score| share(score)).collect()
    };
    let of_joints = |test: fn(f64) -> bool| {
        let known = own.iter().flat_map(|score| score.joints_m.iter().flatten());
        Share::mean(&[Share::of(known.map(|error| percent(test(*error))))])
    };
    let segment = |nth: usize| {
        let errors = own.iter().filter_map(|score| *score.segments.get(nth)?);
        Share::mean(&[Share::of(errors.map(|error| percent(error <= GAMMA)))])
    };
    let pcp = each(correct);
    let gains = own.iter().zip(&first).map(|(own, first)| gain(own, first));
    let gains: Vec<Share> = gains.collect();
    let errors = each(|score| errors_mm(&score.joints_m));
    let exchanged = each(|score| Share::of(score.is_exchanged.map(percent)));
    let images = images(&own);
    let effort = own.iter().flat_map(|score| &score.iterations);
    let effort = Share::of(effort.map(|effort| f64::from(*effort)));
    let n_unsettled: u32 = own.iter().map(|score| score.unsettled).sum();
    let off = |frame_score: &FrameScore| Share::of(frame_score.on.map(|on| 100.0 * (1.0 - on)));
    let is_compared = version > 0;
    Numbers {
        pcp3d: Share::mean(&pcp),
        pcp3d_interval: bootstrap.interval(&pcp),
        gain: Share::mean(&gains).filter(|_| is_compared),
        gain_interval: bootstrap.interval(&gains).filter(|_| is_compared),
        parts: (0..statistics::score::SEGMENT_NAMES.len()).map(segment).collect(),
        curve: curve(&own),
        mpjpe_mm: Share::mean(&errors),
        mpjpe_interval: bootstrap.interval(&errors),
        aligned_mpjpe_mm: Share::mean(&each(|score| errors_mm(&score.aligned_m))),
        exchanged: Share::mean(&exchanged),
        exchanged_interval: bootstrap.interval(&exchanged),
        pck3d: of_joints(|value| value <= PCK_M),
        lost: of_joints(|value| !value.is_finite()),
        pcp2d: images.as_ref().map(|image| image.pcp(PcpRule::MeanOfEnds).percent()),
        pck2d: images.map(|image| [0, 1].map(|share| image.pck(share).percent())),
        iterations: Share::mean(&[effort]),
        unsettled: (effort.n > 0.0).then(|| 100.0 * f64::from(n_unsettled) / effort.n),
        solutions: Share::mean(&each(|score| Share::of([f64::from(score.solutions)]))),
        off: Share::mean(&each(off)),
        changes: changes(&first, &own),
    }
}

fn percent(is_right: bool) -> f64 {
    if is_right { 100.0 } else { 0.0 }
}

fn curve(frames: &[&FrameScore]) -> Vec<[f64; 2]> {
    let errors: Vec<f64> = frames
        .iter()
        .flat_map(|frame| frame.segments.iter().flatten().copied())
        .collect();
    let point = |nth: usize| {
        let gamma = 0.05 * nth as f64;
        // The steps are not exact in binary, but the value at 0.5 must agree with the tables.
        let gamma = (gamma * 100.0).round() / 100.0;
        let n = errors.iter().filter(|error| **error <= gamma).count();
        [gamma, 100.0 * n as f64 / errors.len().max(1) as f64]
    };
    (0..N_GAMMAS).map(point).collect()
}

fn images(frames: &[&FrameScore]) -> Option<Report> {
    let mut report = Report::default();
    for (found, truth) in frames.iter().flat_map(|frame| frame.views.iter().flatten()) {
        report.add(found.as_ref(), truth);
    }
    (report.n_images() > 0).then_some(report)
}

fn changes(before: &[&FrameScore], after: &[&FrameScore]) -> ChangesOf {
    let mut changes = Changes::new(REACH_PX, N_BINS, SAME_PX);
    let mut n_far = 0;
    for (before, after) in before.iter().zip(after) {
        for (before, after) in before.views.iter().zip(&after.views) {
            let (Some((Some(before), truth)), Some((Some(after), _))) = (before, after) else {
                continue;
            };
            for ((before, after), truth) in before.iter().zip(after).zip(truth) {
                let off = |joint: &[f64; 2]| (joint[0] - truth[0]).hypot(joint[1] - truth[1]);
                changes.add(off(before), off(after));
                n_far += usize::from(off(after) - off(before) > FAR_PX);
            }
        }
    }
    let share = |n: usize| 100.0 * n as f64 / changes.total().max(1) as f64;
    ChangesOf {
        improved: share(changes.improved()),
        deteriorated: share(changes.deteriorated()),
        deteriorated_5px: share(n_far),
        bins: changes.bins().map(|(edge, n)| [edge, share(n)]).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a frame in which the first `n_right` of twelve segments are within the threshold, and all other segments exceed it by half.
    fn frame(n_right: usize) -> FrameScore {
        let error = |nth: usize| Some(if nth < n_right { 0.25 } else { 0.75 });
        let truth = [[5.0, 5.0]; 14];
        FrameScore {
            is_exchanged: None,
            segments: (0..12).map(error).collect(),
            joints_m: vec![Some(0.1), Some(0.2), Some(f64::INFINITY), None],
            aligned_m: vec![Some(0.05)],
            views: vec![
                Some((Some([[5.0, 5.0 + 12.0 - n_right as f64]; 14]), truth)),
                None,
            ],
            iterations: vec![4, 6],
            unsettled: 1,
            solutions: 20,
            on: Some(0.75),
        }
    }

    fn measured(subject: &str, action: &str, frames: &[[usize; 2]]) -> Measured {
        let of_frame = |counts: &[usize; 2]| counts.map(frame).to_vec();
        Measured {
            dataset: "HumanEva".to_owned(),
            subject: subject.to_owned(),
            action: action.to_owned(),
            scores: frames.iter().map(of_frame).collect(),
        }
    }

    fn summary(sequences: &[Measured]) -> Summary {
        let versions = ["fmp", "geometry"].map(str::to_owned);
        summarise(sequences, &versions, &Bootstrap::default())
    }

    #[test]
    fn the_mean_of_a_group_weights_frames_equally_and_not_sequences() {
        let sequences = [
            measured("S1", "Box", &[[6, 9]; 3]),
            measured("S2", "Box", &[[12, 12]]),
            measured("S1", "Jog", &[[6, 12]; 4]),
        ];
        let got = summary(&sequences);
        let names: Vec<_> = got
            .groups
            .iter()
            .map(|group| (group.subject.as_str(), group.action.as_str()))
            .collect();
        let expected = [
            ("S1", "Box"),
            ("S2", "Box"),
            ("S1", "Jog"),
            ("All", "Box"),
            ("S1", "Overall"),
            ("All", "Overall"),
        ];
        assert_eq!(names, expected);
        let boxes = &got.groups[3];
        assert_eq!(boxes.frames, 4);
        assert_eq!(
            boxes.versions[0].pcp3d,
            Some(62.5),
            "three times 50 and once 100"
        );
        assert_eq!(
            boxes.versions[1].gain,
            Some(75.0 * 0.75 + 100.0 * 0.25 - 62.5)
        );
        assert_eq!(boxes.versions[0].gain, None, "nothing to compare with");
    }

    #[test]
    fn all_results_of_a_version_are_counted() {
        let got = summary(&[measured("S1", "Box", &[[6, 9]; 3])]);
        let [own] = &got.groups[..] else {
            panic!("{} groups", got.groups.len())
        };
        let it = &own.versions[1];
        assert_eq!(it.pcp3d_interval, Some([75.0; 2]), "every frame is alike");
        assert_eq!(it.parts[8..10], [Some(100.0), Some(0.0)]);
        assert!(
            (it.mpjpe_mm.unwrap() - 150.0).abs() < 1e-9,
            "of those found"
        );
        assert_eq!(it.aligned_mpjpe_mm, Some(50.0));
        let third = 100.0 / 3.0;
        assert!(
            (it.pck3d.unwrap() - third).abs() < 1e-9 && (it.lost.unwrap() - third).abs() < 1e-9
        );
        assert_eq!(
            (it.iterations, it.unsettled, it.solutions),
            (Some(5.0), Some(50.0), Some(20.0))
        );
        assert_eq!(it.off, Some(25.0));
        assert_eq!(it.changes.improved, 100.0, "from 6 to 3 pixels");
        let at = |gamma: f64| it.curve.iter().find(|point| point[0] == gamma).unwrap()[1];
        assert_eq!(
            [at(0.2), at(0.25), at(0.5), at(0.75)],
            [0.0, 75.0, 75.0, 100.0]
        );
    }

    #[test]
    fn without_frames_there_are_no_numbers() {
        let got = summary(&[measured("S1", "Box", &[])]);
        let it = &got.groups[0].versions[0];
        assert_eq!(
            (it.pcp3d, it.mpjpe_mm, it.pcp2d, it.iterations),
            (None, None, None, None)
        );
    }
}
