//! The whole single-view method in double precision, written for readability and comparison.
//!
//! It follows the reference programs stage by stage, including the order of summation, which decides ties. It is about a hundred times
//! slower than [`Extractor`](crate::Extractor) and [`Solver`](crate::Solver), which give the same results except for rounding. It only
//! supports springs per child type.

use kernels::{
    HogShape, Planes, Rgb8View, Template, correlate_f64, hog_f64, reduce_by_taps, resize_by_taps,
    transform_f64,
};

use crate::{Edge, Layout, LevelLayout, Model, Placement, Spring, Springs};

/// Returns the image at every level of `layout`.
///
/// # Panics
///
/// If the layout belongs to another image.
pub fn pyramid(model: &Model, layout: &Layout, image: Rgb8View<'_>) -> Vec<Planes> {
    assert_eq!(layout.image_size, [image.width(), image.height()]);
    let interval = model.spec().interval;
    let mut images: Vec<Planes> = Vec::with_capacity(layout.levels.len());
    for (level, it) in layout.levels.iter().enumerate() {
        images.push(match level.checked_sub(interval) {
            None => resize_by_taps(image, it.image_size),
            Some(above) => reduce_by_taps(&images[above]),
        });
    }
    images
}

/// Returns the padded features of one level, `rows x cols x N_CHANNELS` of [`LevelLayout::padded`].
pub fn features(model: &Model, layout: &Layout, image: &Planes) -> Vec<f64> {
    let shape = HogShape {
        cell_px: model.spec().cell_px,
        pad: layout.pad.map(|pad| pad + 1),
    };
    hog_f64(image, shape)
}

/// Returns the response map of every filter on one level, each `rows x cols`.
pub fn responses(model: &Model, level: &LevelLayout, features: &[f64]) -> Vec<Vec<f64>> {
    let respond = |filter: &crate::Filter| {
        let template = Template {
            rows: filter.rows,
            cols: filter.cols,
            weights: &filter.weights,
        };
        correlate_f64(template, level.padded, features, [level.rows, level.cols])
    };
    model.spec().filters.iter().map(respond).collect()
}

/// The max-sum message of a child to its parent, for one type of the parent; every map is `rows x
/// cols`.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// The best score of the child's subtree.
    pub score: Vec<f64>,
    /// The placement of the child that gives this score.
    pub child: Vec<Placement>,
}

/// Returns the max-sum messages of a child for every type of its parent.
///
/// * `scores`: scores of the child, one map per type, with the messages of its own children added.
///
/// # Panics
///
/// If the springs are per pair of types.
pub fn messages(edge: &Edge, scores: &[Vec<f64>], size: [usize; 2]) -> Vec<Message> {
    let Springs::PerChildType(springs) = &edge.springs else {
        panic_on_pairs();
    };
    let transformed: Vec<_> = scores
        .iter()
        .zip(springs)
        .map(|(scores, &Spring { w, anchor })| {
            transform_f64(scores, size, &kernels::Spring { w, anchor })
        })
        .collect();
    let of_parent_type = |bias: &Vec<f64>| {
        let mut message = Message {
            score: vec![f64::NEG_INFINITY; size[0] * size[1]],
            child: vec![Placement::default(); size[0] * size[1]],
        };
        for (mixture, (it, bias)) in transformed.iter().zip(bias).enumerate() {
            for cell in 0..size[0] * size[1] {
                let score = it.score[cell] + bias;
                if score > message.score[cell] {
                    message.score[cell] = score;
                    message.child[cell] = Placement {
                        x: it.x[cell] as u16,
                        y: it.y[cell] as u16,
                        mixture: mixture as u8,
                    };
                }
            }
        }
        message
    };
    edge.bias.iter().map(of_parent_type).collect()
}

#[expect(
    clippy::panic,
    reason = "documented; the released models have no such springs"
)]
fn panic_on_pairs() -> ! {
    panic!("the reference takes one spring per type of the child")
}

/// The solved tree of one level.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Score of the best tree for every cell and every type of the root, bias included.
    pub root: Vec<Vec<f64>>,
    /// The messages of every part to its parent; empty for the root.
    pub messages: Vec<Vec<Message>>,
}

/// Passes all messages of one level from the leaves to the root.
///
/// * `responses`: one map per filter.
pub fn solve(model: &Model, responses: &[Vec<f64>], size: [usize; 2]) -> Solution {
    let parts = &model.spec().parts;
    let own = |part: &crate::PartSpec| {
        let filters = part.filter_of_type.iter();
        filters.map(|&filter| responses[filter].clone()).collect::<Vec<_>>()
    };
    let mut scores: Vec<_> = parts.iter().map(own).collect();
    let mut all_messages = vec![Vec::new(); parts.len()];
    for part in (0..parts.len()).rev() {
        let Some(edge) = &parts[part].edge else {
            continue;
        };
        let messages = messages(edge, &scores[part], size);
        for (scores, message) in scores[edge.parent].iter_mut().zip(&messages) {
            for (score, message) in scores.iter_mut().zip(&message.score) {
                *score += message;
            }
        }
        all_messages[part] = messages;
    }
    let mut root = scores.swap_remove(0);
    for score in root.iter_mut().flatten() {
        *score += model.spec().root_bias;
    }
    Solution {
        root,
        messages: all_messages,
    }
}

/// A pose in double precision.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferencePose {
    /// Value of the maximised energy.
    pub score: f64,
    /// Level of the pyramid, counted from 0.
    pub level: usize,
    /// One placement per part.
    pub parts: Vec<Placement>,
}

impl Solution {
    /// Returns the best score of the root, and the cell and type of the root that give it. Ties go to the first cell, then to the first
    /// type.
    pub fn best(&self) -> (f64, usize, usize) {
        let n_cells = self.root.first().map_or(0, Vec::len);
        let mut best = (f64::NEG_INFINITY, 0, 0);
        for cell in 0..n_cells {
            for (mixture, scores) in self.root.iter().enumerate() {
                if scores[cell] > best.0 {
                    best = (scores[cell], cell, mixture);
                }
            }
        }
        best
    }

    /// Returns the best tree with a root of the given type at the given cell.
    pub fn backtrack(
        &self,
        model: &Model,
        cols: usize,
        cell: usize,
        mixture: usize,
    ) -> Vec<Placement> {
        let mut parts = vec![Placement {
            x: (cell % cols) as u16,
            y: (cell / cols) as u16,
            mixture: mixture as u8,
        }];
        for (part, messages) in self.messages.iter().enumerate() {
            if let Some(edge) = &model.spec().parts[part].edge {
                let parent: Placement = parts[edge.parent];
                let cell = usize::from(parent.y) * cols + usize::from(parent.x);
                parts.push(messages[usize::from(parent.mixture)].child[cell]);
            }
        }
        parts
    }
}

/// Returns the best pose in the image; ties go to the lower level.
pub fn best(model: &Model, layout: &Layout, image: Rgb8View<'_>) -> Option<ReferencePose> {
    let mut best: Option<ReferencePose> = None;
    let images = pyramid(model, layout, image);
    for (level, (image, it)) in images.iter().zip(&layout.levels).enumerate() {
        let responses = responses(model, it, &features(model, layout, image));
        let solved = solve(model, &responses, [it.rows, it.cols]);
        let (score, cell, mixture) = solved.best();
        if best.as_ref().is_none_or(|best| score > best.score) {
            best = Some(ReferencePose {
                score,
                level,
                parts: solved.backtrack(model, it.cols, cell, mixture),
            });
        }
    }
    best
}
