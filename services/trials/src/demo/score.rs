//! Accuracy of results: PCP3D and MPJPE.

use serde::Serialize;
use skeleton::PARSE14;
use statistics::score::{joint_errors, segment_errors, segments};

use crate::trial::Point;
use crate::trial::results::Joints;

/// The conventional threshold of PCP3D.
pub(super) const GAMMA: f64 = 0.5;

/// Accuracy of some results.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Score {
    /// Number of true skeletons: results, times the number of people.
    pub skeletons: usize,
    /// PCP3D: percentage of segments for which the mean error of both ends is at most half of the segment's length. A segment that was not
    /// found counts as wrong. `None` if there are no results.
    pub pcp3d_percent: Option<f64>,
    /// MPJPE: mean distance of the found joints from their true positions, in millimetres.
    pub mpjpe_mm: Option<f64>,
    /// Percentage of joints that were not found.
    pub lost_percent: Option<f64>,
    /// PCP3D of every segment, in percent.
    pub segments: Vec<(&'static str, Option<f64>)>,
}

/// Compares results with the truth.
///
/// * `pairs`: the found and the true joints of `skeleton::PARSE14` of each person in each result, in metres.
pub(super) fn score<T: AsRef<[Point]>>(pairs: impl Iterator<Item = (Joints, T)>) -> Score {
    let segments = segments(&PARSE14).map_or_else(Vec::new, Vec::from);
    // For each segment, the number of results in which it is correct, and the number of all results.
    let mut right = vec![[0_usize; 2]; segments.len()];
    let (mut distances, mut n_joints, mut skeletons) = (Vec::new(), 0_usize, 0);
    for (found, truth) in pairs {
        let truth: Vec<Option<Point>> = truth.as_ref().iter().copied().map(Some).collect();
        let errors = segment_errors(&segments, &found, &truth);
        for (count, error) in right.iter_mut().zip(errors.iter().flatten()) {
            count[0] += usize::from(*error <= GAMMA);
            count[1] += 1;
        }
        let errors = joint_errors(&found, &truth);
        n_joints += errors.len();
        distances.extend(errors.into_iter().flatten().filter(|error| error.is_finite()));
        skeletons += 1;
    }
    let share = |n: usize, of: usize| (of > 0).then(|| 100.0 * n as f64 / of as f64);
    let all = right.iter().fold([0; 2], |sum, counts| {
        [sum[0] + counts[0], sum[1] + counts[1]]
    });
    let mean = distances.iter().sum::<f64>() / distances.len() as f64;
    Score {
        skeletons,
        pcp3d_percent: share(all[0], all[1]),
        mpjpe_mm: (!distances.is_empty()).then_some(1000.0 * mean),
        lost_percent: share(n_joints - distances.len(), n_joints),
        segments: segments
            .iter()
            .zip(&right)
            .map(|(segment, count)| (segment.name, share(count[0], count[1])))
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns fourteen joints in a row, 0.1 m apart.
    fn truth() -> Vec<Point> {
        (0..14).map(|i| [0.1 * f64::from(i), 0.0, 0.0]).collect()
    }

    #[test]
    fn the_truth_is_right_and_distant_joints_are_wrong() {
        let truth = truth();
        let found: Vec<Option<Point>> = truth.iter().copied().map(Some).collect();
        let far: Vec<Option<Point>> =
            truth.iter().map(|truth| Some([truth[0], 9.0, 0.0])).collect();
        let pair = |found| (found, &truth[..]);
        let good = score([pair(found.clone())].into_iter());
        assert_eq!(
            (good.skeletons, good.pcp3d_percent, good.mpjpe_mm),
            (1, Some(100.0), Some(0.0))
        );
        let both = score([pair(found), pair(far)].into_iter());
        assert_eq!((both.skeletons, both.pcp3d_percent), (2, Some(50.0)));
        assert!((both.mpjpe_mm.unwrap() - 4500.0).abs() < 1e-9);
        assert_eq!(both.segments.len(), 12);
    }

    #[test]
    fn a_missing_joint_is_wrong_but_has_no_distance() {
        let (truth, nothing) = (truth(), vec![None; 14]);
        let got = score([(nothing, &truth[..])].into_iter());
        assert_eq!((got.pcp3d_percent, got.mpjpe_mm), (Some(0.0), None));
        assert_eq!(got.lost_percent, Some(100.0));
    }

    #[test]
    fn without_results_there_are_no_numbers() {
        let got = score(core::iter::empty::<(_, Vec<Point>)>());
        assert_eq!(
            (got.skeletons, got.pcp3d_percent, got.lost_percent),
            (0, None, None)
        );
    }
}
