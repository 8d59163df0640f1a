//! Small models for tests; all their numbers differ.

pub(crate) mod mat;
mod text;

pub(crate) use text::as_text;

use crate::{Edge, Filter, ModelSpec, N_CHANNELS, PartSpec, Spring, Springs};

/// Returns a model with a root and two arms that mirror each other, two types each, filters of 2x2 cells.
pub(crate) fn three_parts() -> ModelSpec {
    let part = |part_idx: usize| PartSpec {
        name: format!("part {}", part_idx + 1),
        filter_of_type: vec![2 * part_idx, 2 * part_idx + 1],
        edge: (part_idx > 0).then(|| arm(part_idx)),
    };
    ModelSpec {
        name: "unnamed".to_owned(),
        parts: (0..3).map(part).collect(),
        filters: (0..6).map(filter).collect(),
        root_bias: -0.125,
        interval: 10,
        cell_px: 4,
        threshold: 0.1,
        mirror: None,
    }
}

/// Returns the same tree with a spring for each pair of types, as in release 1.4; one pair never occurs.
pub(crate) fn per_pair() -> ModelSpec {
    let mut spec = three_parts();
    for (part_idx, part) in spec.parts.iter_mut().enumerate() {
        if let Some(edge) = &mut part.edge {
            edge.bias[0][1] = f64::NEG_INFINITY;
            edge.springs = Springs::PerTypePair(vec![
                vec![Some(spring(10 * part_idx)), None],
                vec![
                    Some(spring(10 * part_idx + 1)),
                    Some(spring(10 * part_idx + 2)),
                ],
            ]);
        }
    }
    spec
}

/// Returns the published models' 26 parts, one type each.
pub(crate) fn published_tree() -> ModelSpec {
    let mut spec = three_parts();
    spec.filters.truncate(1);
    spec.parts = skeleton::PARENT
        .iter()
        .enumerate()
        .map(|(part_idx, parent)| PartSpec {
            name: format!("part {}", part_idx + 1),
            filter_of_type: vec![0],
            edge: parent.map(|parent| Edge {
                parent,
                bias: vec![vec![0.0]],
                springs: Springs::PerChildType(vec![spring(part_idx)]),
            }),
        })
        .collect();
    spec
}

fn arm(part_idx: usize) -> Edge {
    let first = 4.0 * (part_idx as f64 - 1.0);
    Edge {
        parent: 0,
        bias: vec![
            vec![first + 0.1, first + 0.2],
            vec![first + 0.3, first + 0.4],
        ],
        springs: Springs::PerChildType(vec![spring(2 * part_idx), spring(2 * part_idx + 1)]),
    }
}

fn spring(seed: usize) -> Spring {
    let it = seed as f64;
    Spring {
        w: [0.01 + it / 64.0, -it / 3.0, 0.02 + it / 32.0, it / 7.0],
        anchor: [seed as i32 - 3, 5 - seed as i32],
    }
}

fn filter(seed: usize) -> Filter {
    let weight = |value: usize| ((seed * 1000 + value) as f64).sin();
    Filter {
        rows: 2,
        cols: 2,
        weights: (0..4 * N_CHANNELS).map(weight).collect(),
    }
}
