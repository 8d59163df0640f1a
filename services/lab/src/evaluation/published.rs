//! The numbers published in the paper, for comparison.

use crate::evaluation::{Combining, Terms, Version};

/// Data set, subject and action; then the results of FMP, with geometry, with appearance, and with adaptive selection.
type Row = (&'static str, &'static str, &'static str, [f64; 4]);

/// PCP3D at 0.5, in percent: the paper's tables on `HumanEva` and UMPM.
const PCP3D: [Row; 16] = [
    ("HumanEva", "S1", "Box", [77.34, 82.70, 83.87, 85.31]),
    ("HumanEva", "All", "Box", [67.14, 69.45, 70.23, 71.57]),
    ("HumanEva", "S1", "Gestures", [78.91, 84.27, 84.08, 88.14]),
    ("HumanEva", "All", "Gestures", [74.68, 77.38, 78.81, 80.34]),
    ("HumanEva", "S1", "Jog", [84.91, 86.75, 86.70, 86.86]),
    ("HumanEva", "All", "Jog", [77.52, 80.16, 79.84, 80.97]),
    ("HumanEva", "S1", "Walking", [84.65, 86.71, 86.50, 87.68]),
    ("HumanEva", "All", "Walking", [78.49, 81.69, 81.96, 83.17]),
    ("HumanEva", "S1", "Overall", [82.02, 85.43, 85.49, 87.24]),
    ("HumanEva", "All", "Overall", [74.86, 77.62, 78.11, 79.40]),
    ("UMPM", "All", "Chair", [74.72, 78.09, 77.54, 79.94]),
    ("UMPM", "All", "Grab", [74.23, 76.25, 77.18, 81.92]),
    ("UMPM", "All", "Orthosyn", [72.47, 74.65, 75.22, 76.48]),
    ("UMPM", "All", "Table", [70.30, 73.49, 74.18, 77.86]),
    ("UMPM", "All", "Triangle", [73.69, 77.26, 77.81, 83.81]),
    ("UMPM", "All", "Overall", [73.07, 75.91, 76.37, 80.04]),
];

/// Returns the paper's value for a row of its tables, in percent; `None` if it has none.
///
/// The paper's rows for UMPM are averages over all people, so here a sequence with any subject is compared with the row of its action.
pub fn published(dataset: &str, subject: &str, action: &str, version: Version) -> Option<f64> {
    if version.combining != Combining::Pairs {
        return None;
    }
    let column = match version.terms {
        Terms::Single => 0,
        Terms::Geometry => 1,
        Terms::Appearance => 2,
        Terms::Adaptive => 3,
    };
    let subject = if dataset == "UMPM" { "All" } else { subject };
    let is_it = |row: &&Row| (row.0, row.1, row.2) == (dataset, subject, action);
    PCP3D.iter().find(is_it).map(|pcp3d| pcp3d.3[column])
}

#[cfg(test)]
mod tests {
    use training::datasets::sequences::PAPER_TEST;

    use super::*;

    #[test]
    fn the_overall_values_of_the_paper_are_means_weighted_by_frames() {
        for column in 0..4 {
            let mut sum = 0.0;
            let mut n = 0.0;
            for row in PCP3D
                .iter()
                .filter(|pcp3d| pcp3d.0 == "HumanEva" && pcp3d.1 == "All" && pcp3d.2 != "Overall")
            {
                let frames = PAPER_TEST.iter().filter(|paper_test| paper_test.action == row.2);
                let frames = frames.map(|frame| frame.n_frames).sum::<usize>() as f64;
                sum += frames * row.3[column];
                n += frames;
            }
            let overall = PCP3D[9].3[column];
            assert!((sum / n - overall).abs() < 0.02, "{} {overall}", sum / n);
        }
    }

    #[test]
    fn values_outside_the_tables_are_missing() {
        let adaptive = Version {
            terms: Terms::Adaptive,
            combining: Combining::Pairs,
        };
        assert_eq!(published("HumanEva", "S1", "Jog", adaptive), Some(86.86));
        assert_eq!(
            published("UMPM", "p1", "Chair", Version::SINGLE),
            Some(74.72)
        );
        assert_eq!(published("HumanEva", "S2", "Jog", adaptive), None);
        let all = Version {
            combining: Combining::AllViews,
            ..adaptive
        };
        assert_eq!(published("HumanEva", "S1", "Jog", all), None);
    }
}
