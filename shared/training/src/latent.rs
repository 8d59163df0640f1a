//! Finds the best pose of a person near the annotated parts (latent positive examples).

#[cfg(test)]
mod tests;

use fmp::{FeaturePyramid, Layout, Model, Placement, Pose, Springs};
use kernels::N_CHANNELS;

/// An annotated person in an image.
#[derive(Debug, Clone, PartialEq)]
pub struct Marked {
    /// Centres of the parts, in pixels; the centre of the top-left pixel is (0, 0).
    pub parts: Vec<[f64; 2]>,
    /// Side of every part's box, in pixels.
    pub side: f64,
    /// Required types of the parts; `None` if any type is allowed.
    pub types: Option<Vec<usize>>,
}

impl Marked {
    /// The rectangle `[x1, y1, x2, y2]` in which the person is searched for. It encloses all boxes and is enlarged on every side by half
    /// the sum of its width and height (Yang & Ramanan 2013).
    pub fn surroundings(&self) -> [f64; 4] {
        let half = self.side / 2.0;
        let low = |axis: usize| {
            self.parts.iter().map(|part| part[axis] - half).fold(f64::INFINITY, f64::min)
        };
        let high = |axis: usize| {
            self.parts
                .iter()
                .map(|part| part[axis] + half)
                .fold(f64::NEG_INFINITY, f64::max)
        };
        let around = [low(0), low(1), high(0), high(1)];
        let grow = (around[2] - around[0] + around[3] - around[1]) / 2.0;
        [
            around[0] - grow,
            around[1] - grow,
            around[2] + grow,
            around[3] + grow,
        ]
    }
}

/// A possible cell of a part.
#[derive(Debug, Clone, Copy)]
struct Cell {
    x: usize,
    y: usize,
    overlap: f64,
}

/// The highest-scoring pose whose parts all overlap the marked boxes.
///
/// The result is exact over all levels: since few cells have enough overlap, all pairs of cells are compared. Returns `None` if there is no
/// level on which all parts can overlap. This happens for people who are smaller than the model.
///
/// * `overlap`: minimum intersection over union of every part's box with the marked box.
pub(crate) fn best_near(
    model: &Model,
    pyramid: &FeaturePyramid<'_>,
    layout: &Layout,
    marked: &Marked,
    overlap: f64,
) -> Option<Pose> {
    let mut best: Option<Pose> = None;
    for level in 0..layout.levels.len() {
        let Some(cells) = cells_near(model, layout, level, marked, overlap) else {
            continue;
        };
        let search = Search {
            model,
            pyramid,
            level,
            marked,
            cells,
        };
        let pose = search.best();
        if best.as_ref().is_none_or(|best| pose.score > best.score) {
            best = Some(pose);
        }
    }
    best
}

/// The pose whose boxes have the largest overlap with the marked boxes, regardless of its score.
///
/// Returns `None` in the same cases as [`best_near`].
pub(crate) fn nearest(
    model: &Model,
    layout: &Layout,
    marked: &Marked,
    overlap: f64,
) -> Option<Pose> {
    let mut best: Option<(f64, Pose)> = None;
    for level in 0..layout.levels.len() {
        let Some(cells) = cells_near(model, layout, level, marked, overlap) else {
            continue;
        };
        let nearest = |cells: &Vec<Cell>| {
            let first = cells[0];
            let closer = |a: Cell, b: &Cell| if b.overlap > a.overlap { *b } else { a };
            cells.iter().fold(first, closer)
        };
        let picked: Vec<Cell> = cells.iter().map(nearest).collect();
        let sum = picked.iter().map(|picked| picked.overlap).sum();
        if best.as_ref().is_none_or(|best| sum > best.0) {
            let mixture = |part: usize| marked.types.as_ref().map_or(0, |kind| kind[part]);
            let placed = picked.iter().enumerate();
            let placed = placed.map(|(part, it)| placement(it, mixture(part)));
            let pose = Pose {
                score: 0.0,
                level: level as u16,
                parts: placed.collect(),
            };
            best = Some((sum, pose));
        }
    }
    best.map(|best| best.1)
}

fn placement(cell: &Cell, mixture: usize) -> Placement {
    Placement {
        x: cell.x as u16,
        y: cell.y as u16,
        mixture: mixture as u8,
    }
}

/// The cells of a level at which each part overlaps its marked box; `None` if a part has no such cell.
fn cells_near(
    model: &Model,
    layout: &Layout,
    level: usize,
    marked: &Marked,
    least: f64,
) -> Option<Vec<Vec<Cell>>> {
    let it = &layout.levels[level];
    let [rows, cols] = model.max_filter();
    let size = [cols as f64 * it.scale, rows as f64 * it.scale];
    let area = size[0] * size[1];
    let ratio = area / (marked.side * marked.side);
    if ratio.min(1.0 / ratio) < least {
        return None; // even concentric boxes would not do
    }
    let cells_of = |centre: &[f64; 2]| {
        let mut found = Vec::new();
        // Position in cells at which a box of the level is concentric with the marked box.
        let begin = |axis: usize| {
            let pad = layout.pad[1 - axis] as f64;
            (centre[axis] - (size[axis] - 1.0) / 2.0) / it.scale + pad
        };
        let reach = (rows.max(cols) as f64).ceil();
        let range = |axis: usize, n: usize| {
            let low = (begin(axis) - reach).ceil().max(0.0) as usize;
            low..((begin(axis) + reach).floor() + 1.0).clamp(0.0, n as f64) as usize
        };
        for y in range(1, it.rows) {
            for x in range(0, it.cols) {
                let shift = [x as f64 - begin(0), y as f64 - begin(1)].map(|d| d.abs() * it.scale);
                let common = |axis: usize| {
                    let half = f64::midpoint(size[axis], marked.side) - shift[axis];
                    half.min(size[axis]).min(marked.side).max(0.0)
                };
                let common = common(0) * common(1);
                let overlap = common / (area + marked.side * marked.side - common);
                if overlap >= least {
                    found.push(Cell { x, y, overlap });
                }
            }
        }
        (!found.is_empty()).then_some(found)
    };
    marked.parts.iter().map(cells_of).collect()
}

struct Search<'a> {
    model: &'a Model,
    pyramid: &'a FeaturePyramid<'a>,
    level: usize,
    marked: &'a Marked,
    cells: Vec<Vec<Cell>>,
}

/// Scores of a part, `[cell][type]`.
type Scores = Vec<Vec<f64>>;

impl Search<'_> {
    fn best(&self) -> Pose {
        let n_parts = self.model.n_parts();
        let mut scores: Vec<Scores> = (0..n_parts).map(|i| self.own(i)).collect();
        // The best cell for every cell of the parent and type of the child: `[part][cell][type]`.
        let mut choices: Vec<Vec<Vec<(f64, usize)>>> = vec![Vec::new(); n_parts];
        for part in (1..n_parts).rev() {
            let Some(edge) = &self.model.spec().parts[part].edge else {
                continue;
            };
            let choice = self.votes(part, &scores[part]);
            for (of_cell, choice) in scores[edge.parent].iter_mut().zip(&choice) {
                for (of_type, bias) in of_cell.iter_mut().zip(&edge.bias) {
                    let best = choice.iter().zip(bias).map(|(vote, bias)| vote.0 + bias);
                    *of_type += best.fold(f64::NEG_INFINITY, f64::max);
                }
            }
            choices[part] = choice;
        }
        self.backtrack(&scores[0], &choices)
    }

    /// Returns the responses of the filters, `-inf` for types that the part may not have.
    fn own(&self, part: usize) -> Scores {
        let map = self.pyramid.level(self.level);
        let n_types = self.model.n_types(part);
        let response = |cell: &Cell, mixture: usize| {
            let wanted = self.marked.types.as_ref().map(|kind| kind[part]);
            if wanted.is_some_and(|wanted| wanted != mixture) {
                return f64::NEG_INFINITY;
            }
            let filter = self.model.filter(part, mixture);
            let len = filter.cols * N_CHANNELS;
            let rows = filter.weights.chunks(len).enumerate();
            rows.map(|(row, weights)| {
                let first = ((cell.y + row) * map.cols + cell.x) * N_CHANNELS;
                let cells = map.cells[first..first + len].iter();
                cells.zip(weights).map(|(a, b)| f64::from(*a) * b).sum::<f64>()
            })
            .sum()
        };
        let of_cell = |cell: &Cell| (0..n_types).map(|i| response(cell, i)).collect();
        self.cells[part].iter().map(of_cell).collect()
    }

    /// For every cell of the parent and type of the part, the best score and the cell that gives it.
    fn votes(&self, part: usize, scores: &Scores) -> Vec<Vec<(f64, usize)>> {
        let Some(edge) = &self.model.spec().parts[part].edge else {
            return Vec::new();
        };
        let Springs::PerChildType(springs) = &edge.springs else {
            return Vec::new();
        };
        let vote = |parent: &Cell, mixture: usize| {
            let spring = &springs[mixture];
            let mut best = (f64::NEG_INFINITY, 0);
            for (it, cell) in self.cells[part].iter().enumerate() {
                let dx = parent.x as f64 + f64::from(spring.anchor[0]) - cell.x as f64;
                let dy = parent.y as f64 + f64::from(spring.anchor[1]) - cell.y as f64;
                let [xx, x, yy, y] = spring.w;
                let score = scores[it][mixture] - (xx * dx * dx + x * dx + yy * dy * dy + y * dy);
                if score > best.0 {
                    best = (score, it);
                }
            }
            best
        };
        let of_cell = |parent: &Cell| (0..springs.len()).map(|i| vote(parent, i)).collect();
        self.cells[edge.parent].iter().map(of_cell).collect()
    }

    fn backtrack(&self, root: &Scores, choices: &[Vec<Vec<(f64, usize)>>]) -> Pose {
        let mut picked = vec![(0, 0); self.model.n_parts()];
        let mut score = f64::NEG_INFINITY;
        for (cell, of_cell) in root.iter().enumerate() {
            for (mixture, &it) in of_cell.iter().enumerate() {
                if it > score {
                    score = it;
                    picked[0] = (cell, mixture);
                }
            }
        }
        for part in 1..picked.len() {
            let Some(edge) = &self.model.spec().parts[part].edge else {
                continue;
            };
            let (cell, parent_type) = picked[edge.parent];
            let mut best = f64::NEG_INFINITY;
            for (mixture, choice) in choices[part][cell].iter().enumerate() {
                let it = choice.0 + edge.bias[parent_type][mixture];
                if it > best {
                    best = it;
                    picked[part] = (choice.1, mixture);
                }
            }
        }
        let placed = picked.iter().zip(&self.cells);
        Pose {
            score: (score + self.model.spec().root_bias) as f32,
            level: self.level as u16,
            parts: placed.map(|((cell, k), of)| placement(&of[*cell], *k)).collect(),
        }
    }
}
