//! The whole body in an ordinary posture, drawn as filters and as a tree.

use fmp::Model;

use super::colours::part_colour;
use super::glyph::CELL;
use super::springs::{Ellipse, ellipses, of_pair};
use exports::report::html::Html;
use exports::report::{html, put};

/// Positions of the drawn parts.
#[derive(Debug)]
pub(super) struct Figure {
    types: Vec<usize>,
    /// Top left corner of each filter, in cells.
    corner: Vec<[f64; 2]>,
    /// Spring of each part for the chosen types; `None` for the root.
    spring: Vec<Option<Ellipse>>,
    /// Bounding box of the figure: left, top, width, height, in cells.
    frame: [f64; 4],
}

/// Pixels per cell of the pictures.
const SCALE: f64 = 20.0;

impl Figure {
    pub(super) fn new(model: &Model) -> Self {
        let types = ordinary_types(model);
        let (mut corner, mut spring) = (Vec::new(), Vec::new());
        for (part, spec) in model.spec().parts.iter().enumerate() {
            let edge = spec.edge.as_ref();
            let its = edge.and_then(|edge| of_pair(edge, types[edge.parent], types[part]));
            let from = edge.map_or([0.0; 2], |edge| corner[edge.parent]);
            let offset = its.map_or([0.0; 2], |ellipse| ellipse.centre);
            corner.push([from[0] + offset[0], from[1] + offset[1]]);
            spring.push(its);
        }
        let mut ends = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for (part, at) in corner.iter().enumerate() {
            let filter = model.filter(part, types[part]);
            for (axis, size) in [filter.cols, filter.rows].into_iter().enumerate() {
                ends[0][axis] = ends[0][axis].min(at[axis] - 1.0);
                ends[1][axis] = ends[1][axis].max(at[axis] + size as f64 + 1.0);
            }
        }
        let [[left, top], [right, bottom]] = ends;
        Self {
            types,
            corner,
            spring,
            frame: [left, top, right - left, bottom - top],
        }
    }

    /// Draws the filters, each at the rest position of its spring.
    pub(super) fn filters(&self, model: &Model) -> Html {
        let mut out = self.open("dark", CELL);
        for (part, [x, y]) in self.corner.iter().enumerate() {
            let index = model.spec().parts[part].filter_of_type[self.types[part]];
            put!(
                out,
                "<use href=\"#f{index}\" x=\"{:.1}\" y=\"{:.1}\" style=\"mix-blend-mode:lighten\"/>",
                [index],
                x * CELL,
                y * CELL
            );
        }
        put!(out, "</svg><figcaption>filters</figcaption></figure>\n");
        out
    }

    /// Draws the tree, with ellipses for the springs.
    pub(super) fn tree(&self, model: &Model) -> Html {
        let mut out = self.open("light", 1.0);
        let centre = |part: usize| {
            let filter = model.filter(part, self.types[part]);
            let [x, y] = self.corner[part];
            [x + filter.cols as f64 / 2.0, y + filter.rows as f64 / 2.0]
        };
        let (mut edges, mut springs, mut nodes) =
            (Html::default(), Html::default(), Html::default());
        for (part, spec) in model.spec().parts.iter().enumerate() {
            let ([x, y], colour) = (centre(part), part_colour(&spec.name));
            if let (Some(edge), Some(spring)) = (&spec.edge, &self.spring[part]) {
                let [u, v] = centre(edge.parent);
                put!(
                    edges,
                    "<path d=\"M{u:.2} {v:.2}L{x:.2} {y:.2}\" stroke=\"{colour}\" stroke-width=\".14\"/>",
                    [u, v, x, y, colour]
                );
                let [rx, ry] = spring.radius;
                put!(
                    springs,
                    "<ellipse cx=\"{x:.2}\" cy=\"{y:.2}\" rx=\"{rx:.2}\" ry=\"{ry:.2}\" fill=\"{colour}\" fill-opacity=\".07\" \
                     stroke=\"{colour}\" stroke-opacity=\".45\" stroke-width=\".05\"/>",
                    [x, y, rx, ry, colour]
                );
                for (_, other) in ellipses(edge) {
                    let [dx, dy] = [0, 1].map(|i| other.centre[i] - spring.centre[i]);
                    put!(
                        springs,
                        "<circle cx=\"{:.2}\" cy=\"{:.2}\" r=\".1\" fill=\"{colour}\" fill-opacity=\".5\"/>",
                        [colour],
                        x + dx,
                        y + dy
                    );
                }
            }
            put!(
                nodes,
                "<g><circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\".42\" fill=\"{colour}\"/><text x=\"{x:.2}\" y=\"{:.2}\" \
                 font-size=\".5\" text-anchor=\"middle\" fill=\"#fff\">{}</text><title>{} {}, type {}</title></g>",
                [x, y, colour],
                y + 0.18,
                part + 1,
                part + 1,
                spec.name,
                self.types[part] + 1
            );
        }
        put!(out, "{}", springs);
        put!(out, "{}", edges);
        put!(out, "{}", nodes);
        put!(
            out,
            "</svg><figcaption>tree and springs</figcaption></figure>\n"
        );
        out
    }

    /// * `unit`: units of the picture's coordinates per cell.
    fn open(&self, class: &str, unit: f64) -> Html {
        let [left, top, width, height] = self.frame;
        let scale = SCALE.min(500.0 / width.max(1.0));
        html!(
            "<figure><svg class=\"{class}\" width=\"{:.0}\" height=\"{:.0}\" viewBox=\"{:.2} {:.2} {:.2} {:.2}\">",
            [class],
            width * scale,
            height * scale,
            left * unit,
            top * unit,
            width * unit,
            height * unit
        )
    }
}

/// Returns the types of an ordinary posture. Each part has the type whose rest position is nearest to the mean rest position of all its
/// types. The root has the type that fits the types of its children best. Among equally good types, the first is chosen.
///
/// The types with the largest sum of biases are not used, because they show a rare posture.
fn ordinary_types(model: &Model) -> Vec<usize> {
    let parts = &model.spec().parts;
    let mut types = vec![0; parts.len()];
    let mut root_score = vec![0.0; model.n_types(0)];
    for (part, spec) in parts.iter().enumerate() {
        let Some(edge) = &spec.edge else { continue };
        let all = ellipses(edge);
        let mean = [0, 1].map(|axis| {
            let sum: f64 = all.iter().map(|(_, it)| it.centre[axis]).sum();
            sum / all.len() as f64
        });
        let is_possible = |own: usize| {
            let parent_type = types[edge.parent];
            edge.parent == 0 || of_pair(edge, parent_type, own).is_some()
        };
        let nearness = |own: usize| {
            let of_type = all.iter().filter(|spring| spring.0 == own && is_possible(own));
            let distances =
                of_type.map(|(_, it)| (it.centre[0] - mean[0]).hypot(it.centre[1] - mean[1]));
            -distances.fold(f64::INFINITY, f64::min)
        };
        types[part] = best((0..model.n_types(part)).map(nearness));
        if edge.parent == 0 {
            for (score, row) in root_score.iter_mut().zip(&edge.bias) {
                *score += row[types[part]];
            }
        }
    }
    types[0] = best(root_score.into_iter());
    types
}

/// Returns the index of the first of the largest values; 0 if there are no values.
fn best(values: impl Iterator<Item = f64>) -> usize {
    let mut best = (0, f64::NEG_INFINITY);
    for (index, value) in values.enumerate() {
        if value > best.1 {
            best = (index, value);
        }
    }
    best.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model_page::tests::planted;

    #[test]
    fn the_part_types_whose_rest_position_is_in_the_middle_are_drawn() {
        let mut spec = planted("m");
        let edge = spec.parts[1].edge.as_mut().unwrap();
        edge.bias = vec![vec![0.0, 0.1, 9.0], vec![0.3, 0.2, 0.0]];
        let at = |x: i32| fmp::Spring {
            w: [0.01, 0.0, 0.01, 0.0],
            anchor: [x, 0],
        };
        edge.springs = fmp::Springs::PerChildType(vec![at(-9), at(1), at(5)]);
        spec.parts[1].filter_of_type.push(0);
        let model = Model::new(spec).unwrap();
        // The springs of the second child are alike, and its type 2 is impossible with type 2 of the root.
        assert_eq!(ordinary_types(&model), [0, 1, 0]);
    }
}
