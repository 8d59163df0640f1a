//! A summary of a model, for `parallax-lab model show`.

use crate::{Model, Spring, Springs};

/// The structure of a model, without its weights.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelSummary {
    /// Description of the model's origin.
    pub name: String,
    /// The parts, root first.
    pub parts: Vec<PartSummary>,
    /// Number of filters.
    pub n_filters: usize,
    /// The different `[rows, cols]` of the filters, in cells, in ascending order.
    pub filter_sizes: Vec<[usize; 2]>,
    /// Number of pairs of types that have a bias.
    pub n_biases: usize,
    /// Minimum and maximum bias of a pair of types; `None` if no pair has a bias.
    pub bias_range: Option<[f64; 2]>,
    /// Number of springs.
    pub n_springs: usize,
    /// True if there is one spring for each pair of types, false if there is one for each type of the child.
    pub springs_per_pair: bool,
    /// Ranges of the springs; `None` if there are no springs.
    pub springs: Option<SpringRanges>,
    /// Score of every root placement.
    pub root_bias: f64,
    /// Minimum score of the positive examples in training.
    pub threshold: f64,
    /// Minimum score reported by detection.
    pub detection_threshold: f64,
    /// Levels per octave of the pyramid.
    pub interval: usize,
    /// Side of a feature cell, in pixels.
    pub cell_px: usize,
    /// True if it is known which part is the mirror image of which.
    pub has_mirror: bool,
}

/// One part in a [`ModelSummary`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PartSummary {
    /// Name of the part.
    pub name: String,
    /// Index of the parent, counted from 0; `None` for the root.
    pub parent: Option<usize>,
    /// Number of types of the part.
    pub n_types: usize,
}

/// Minimum and maximum values over all springs of a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringRanges {
    /// Weights of `[d_x^2, d_x, d_y^2, d_y]`.
    pub w: [[f64; 2]; 4],
    /// Anchor `[x, y]`, in cells, counted from 0.
    pub anchor: [[i32; 2]; 2],
}

/// Summarises a model.
pub fn describe(model: &Model) -> ModelSummary {
    let spec = model.spec();
    let edges: Vec<_> = spec.parts.iter().filter_map(|part| part.edge.as_ref()).collect();
    let springs: Vec<&Spring> = edges
        .iter()
        .flat_map(|edge| match &edge.springs {
            Springs::PerChildType(springs) => springs.iter().collect::<Vec<_>>(),
            Springs::PerTypePair(rows) => rows.iter().flatten().flatten().collect(),
        })
        .collect();
    let biases: Vec<f64> = edges
        .iter()
        .flat_map(|edge| edge.bias.iter().flatten().copied())
        .filter(|value| value.is_finite())
        .collect();
    let mut filter_sizes: Vec<_> =
        spec.filters.iter().map(|filter| [filter.rows, filter.cols]).collect();
    filter_sizes.sort_unstable();
    filter_sizes.dedup();
    ModelSummary {
        name: spec.name.clone(),
        parts: spec
            .parts
            .iter()
            .map(|part| PartSummary {
                name: part.name.clone(),
                parent: part.edge.as_ref().map(|edge| edge.parent),
                n_types: part.filter_of_type.len(),
            })
            .collect(),
        n_filters: spec.filters.len(),
        filter_sizes,
        n_biases: biases.len(),
        bias_range: range(biases.iter().copied()),
        n_springs: springs.len(),
        springs_per_pair: edges.iter().any(|edge| matches!(edge.springs, Springs::PerTypePair(_))),
        springs: spring_ranges(&springs),
        root_bias: spec.root_bias,
        threshold: spec.threshold,
        detection_threshold: model.detection_threshold(),
        interval: spec.interval,
        cell_px: spec.cell_px,
        has_mirror: spec.mirror.is_some(),
    }
}

fn spring_ranges(springs: &[&Spring]) -> Option<SpringRanges> {
    let mut ranges = SpringRanges {
        w: [[0.0; 2]; 4],
        anchor: [[0; 2]; 2],
    };
    for (it, w) in ranges.w.iter_mut().enumerate() {
        *w = range(springs.iter().map(|spring| spring.w[it]))?;
    }
    for (it, anchor) in ranges.anchor.iter_mut().enumerate() {
        *anchor = range(springs.iter().map(|spring| spring.anchor[it]))?;
    }
    Some(ranges)
}

fn range<T: PartialOrd + Copy>(mut values: impl Iterator<Item = T>) -> Option<[T; 2]> {
    let first = values.next()?;
    Some(values.fold([first, first], |[min, max], it| {
        [
            if it < min { it } else { min },
            if it > max { it } else { max },
        ]
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::planted;

    #[test]
    fn the_summary_matches_the_planted_model() {
        let summary = describe(&Model::new(planted::three_parts()).unwrap());
        assert_eq!(summary.n_filters, 6);
        assert_eq!(summary.filter_sizes, [[2, 2]]);
        assert_eq!(summary.bias_range, Some([0.1, 4.4]));
        assert_eq!((summary.n_biases, summary.n_springs), (8, 4));
        let springs = summary.springs.unwrap();
        assert_eq!(springs.anchor, [[-1, 2], [0, 3]]);
        assert_eq!(springs.w[1], [-5.0 / 3.0, -2.0 / 3.0]);
        assert_eq!(summary.detection_threshold, -1.0);
        assert_eq!(summary.parts[2].parent, Some(0));
        assert!(!summary.springs_per_pair && !summary.has_mirror);
    }

    #[test]
    fn pairs_that_never_occur_are_not_counted() {
        let summary = describe(&Model::new(planted::per_pair()).unwrap());
        assert_eq!((summary.n_biases, summary.n_springs), (6, 6));
        assert!(summary.springs_per_pair);
        assert_eq!(summary.bias_range, Some([0.1, 4.4]));
    }

    #[test]
    fn a_model_with_only_a_root_has_no_ranges() {
        let mut spec = planted::three_parts();
        spec.parts.truncate(1);
        let summary = describe(&Model::new(spec).unwrap());
        assert_eq!((summary.bias_range, summary.springs), (None, None));
    }
}
