//! Time of the readable reference implementation on one thread, and the score ranges of the parts.

use std::hint::black_box;

use fmp::{Model, Springs, reference};

use crate::clock::Clock;
use crate::stages::StageTimes;
use crate::workload::Workload;

/// Time of the reference implementation in milliseconds, and the score ranges from which the lower limits are computed.
pub(crate) struct Readable {
    pub(crate) ms: StageTimes,
    pub(crate) ranges: Ranges,
}

/// Difference between the largest and the smallest score of every part and type on one level, with the
/// messages of the part's children added.
pub(crate) type Ranges = Vec<Vec<f64>>;

impl Readable {
    /// Runs the reference implementation once. Filters and messages run on one level, the first of the second octave; their times are
    /// extrapolated from the fraction of all cells on that level.
    pub(crate) fn measure(workload: &Workload) -> Self {
        let Workload { model, layout, .. } = workload;
        let clock = Clock::new(1, true);
        let mut images = Vec::new();
        let shrink = clock.measure(|| images = reference::pyramid(model, layout, workload.image()));
        let mut features = Vec::new();
        let hog = clock.measure(|| {
            let maps = images.iter().map(|image| reference::features(model, layout, image));
            features = maps.collect();
        });
        let at = model.spec().interval.min(layout.levels.len() - 1);
        let level = &layout.levels[at];
        let size = [level.rows, level.cols];
        let mut responses = Vec::new();
        let filters =
            clock.measure(|| responses = reference::responses(model, level, &features[at]));
        let messages = clock.measure(|| drop(black_box(reference::solve(model, &responses, size))));
        let cells =
            |level_layout: &fmp::LevelLayout| (level_layout.rows * level_layout.cols) as f64;
        let share = layout.levels.iter().map(cells).sum::<f64>() / cells(level);
        Self {
            ms: StageTimes {
                shrink: shrink.min,
                hog: hog.min,
                filters: filters.min * share,
                messages: messages.min * share,
            },
            ranges: ranges(model, &responses, size),
        }
    }
}

fn ranges(model: &Model, responses: &[Vec<f64>], size: [usize; 2]) -> Ranges {
    let parts = &model.spec().parts;
    let own = |part: &fmp::PartSpec| {
        let filters = part.filter_of_type.iter();
        filters.map(|&filter| responses[filter].clone()).collect::<Vec<_>>()
    };
    let mut scores: Vec<_> = parts.iter().map(own).collect();
    for part in (1..parts.len()).rev() {
        let Some(edge) = &parts[part].edge else {
            continue;
        };
        if matches!(edge.springs, Springs::PerTypePair(_)) {
            continue;
        }
        let messages = reference::messages(edge, &scores[part], size);
        for (scores, message) in scores[edge.parent].iter_mut().zip(messages) {
            for (score, message) in scores.iter_mut().zip(message.score) {
                *score += message;
            }
        }
    }
    let range = |plane: &Vec<f64>| {
        let largest = plane.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        largest - plane.iter().copied().fold(f64::INFINITY, f64::min)
    };
    let of_part = |planes: &Vec<Vec<f64>>| planes.iter().map(range).collect();
    scores.iter().map(of_part).collect()
}
