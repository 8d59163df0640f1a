//! Small models and synthetic evidence.

use std::sync::Arc;

use fmp::{
    Edge, Filter, Layout, LevelLayout, Model, ModelSpec, N_CHANNELS, PartSpec, Responses, Spring,
    Springs,
};

/// Pseudorandom numbers that depend only on the seed.
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        self.0 >> 33
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// Returns one of 65 values in -1..=1, so that ties occur.
    pub(crate) fn score(&mut self) -> f64 {
        (self.below(65) as f64 - 32.0) / 32.0
    }
}

/// Returns a tree of `n_parts` parts with up to three types each, and springs per child type or per pair.
pub(crate) fn tree(noise: &mut Noise, n_parts: usize) -> Arc<Model> {
    let mut parts: Vec<PartSpec> = Vec::new();
    let mut filters = Vec::new();
    for part in 0..n_parts {
        let n_types = 1 + noise.below(3);
        let first = filters.len();
        filters.extend(std::iter::repeat_n(
            Filter {
                rows: 1,
                cols: 1,
                weights: vec![0.0; N_CHANNELS],
            },
            n_types,
        ));
        let edge = (part > 0).then(|| {
            let parent = noise.below(part);
            edge(noise, parent, parts[parent].filter_of_type.len(), n_types)
        });
        parts.push(PartSpec {
            name: format!("part {part}"),
            filter_of_type: (first..first + n_types).collect(),
            edge,
        });
    }
    let spec = ModelSpec {
        name: "tree".to_owned(),
        parts,
        filters,
        root_bias: noise.score(),
        interval: 1,
        cell_px: 4,
        threshold: 0.0,
        mirror: None,
    };
    Arc::new(Model::new(spec).unwrap())
}

fn edge(noise: &mut Noise, parent: usize, n_parent: usize, n_types: usize) -> Edge {
    let mut spring = || Spring {
        w: [
            0.05 + noise.below(3) as f64 * 0.1,
            noise.score() * 0.1,
            0.05 + noise.below(3) as f64 * 0.1,
            noise.score() * 0.1,
        ],
        anchor: [noise.below(5) as i32 - 2, noise.below(5) as i32 - 2],
    };
    let per_type: Vec<_> = (0..n_types).map(|_| spring()).collect();
    let per_pair: Vec<Vec<_>> =
        (0..n_parent).map(|_| (0..n_types).map(|_| spring()).collect()).collect();
    let never: Vec<Vec<bool>> = (0..n_parent)
        .map(|_| (0..n_types).map(|k| k > 0 && noise.below(4) == 0).collect())
        .collect();
    let bias = never.iter().map(|of_type| {
        let bias = of_type.iter().map(|&never| {
            if never {
                f64::NEG_INFINITY
            } else {
                noise.score()
            }
        });
        bias.collect()
    });
    let bias = bias.collect();
    let springs = if noise.below(2) == 0 {
        Springs::PerChildType(per_type)
    } else {
        let pairs = per_pair.into_iter().zip(&never);
        Springs::PerTypePair(
            pairs
                .map(|(springs, never)| {
                    let pair = springs.into_iter().zip(never);
                    pair.map(|(spring, never)| (!never).then_some(spring)).collect()
                })
                .collect(),
        )
    };
    Edge {
        parent,
        bias,
        springs,
    }
}

/// Synthetic responses on levels of the given sizes `[rows, cols]`.
pub(crate) struct Evidence {
    pub(crate) layout: Layout,
    pub(crate) values: Vec<f32>,
    pub(crate) levels: Vec<u16>,
}

impl Evidence {
    pub(crate) fn new(noise: &mut Noise, model: &Model, sizes: &[[usize; 2]]) -> Self {
        let mut offset = 0;
        let level = |(level, &[rows, cols]): (usize, &[usize; 2])| {
            let it = LevelLayout {
                scale: 4.0 * 1.5_f64.powi(level as i32),
                image_size: [100, 100],
                padded: [rows, cols],
                rows,
                cols,
                offset,
            };
            offset += rows * cols * model.n_filters();
            it
        };
        let layout = Layout {
            image_size: [100, 100],
            levels: sizes.iter().enumerate().map(level).collect(),
            pad: [0, 0],
            n_filters: model.n_filters(),
        };
        let values = (0..layout.n_responses()).map(|_| noise.score() as f32).collect();
        Self {
            levels: (0..sizes.len() as u16).collect(),
            layout,
            values,
        }
    }

    pub(crate) fn view(&self) -> Responses<'_> {
        Responses::new(&self.layout, &self.values, &self.levels)
    }
}
