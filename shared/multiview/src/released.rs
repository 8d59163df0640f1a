//! The terms that the authors' program adds to a view's scores, implemented from the program's description.
//!
//! Three points that the description calls bugs are corrected:
//!
//! * A support outside the program's table of lines adds nothing (the program draws a line around the top-left corner).
//! * A part that both views would switch off can be switched on again after a check of that part (the program always checks part 1).
//! * A type that did not occur in training adds nothing (the program's table holds NaN).

use fmp::{ExtraTerms, Pose};
use nalgebra::{Matrix3, Vector3};

use crate::consistency::{NO_SUPPORT, counterparts, support_key};
use crate::heat_map::heat_map;
use crate::{Compatibility, PairInput, Settings};

/// The terms of a pair, with everything that stays the same from iteration to iteration.
#[derive(Debug)]
pub(crate) struct ReleasedPair<'a> {
    settings: &'a Settings,
    pair: &'a PairInput<'a>,
    /// `counterpart[i]` is the part of the other view that shows the same limb as part `i` of the
    /// first.
    counterpart: Vec<usize>,
    weights: [Vec<bool>; 2],
    /// The tables `p(type in the other view | type in this view)`, one for each view.
    tables: Option<[&'a Compatibility; 2]>,
}

impl<'a> ReleasedPair<'a> {
    /// * `exchanged`: true if the two views see the person from opposite sides. Such a pair does not use the type tables, because they were
    ///   learned with the model's part names.
    pub(crate) fn new(settings: &'a Settings, pair: &'a PairInput<'a>, exchanged: bool) -> Self {
        let counterpart = counterparts(pair.views[0].plan.model(), exchanged);
        Self {
            settings,
            pair,
            weights: weights(settings, pair, &counterpart),
            counterpart,
            tables: pair
                .tables
                .filter(|_| !exchanged && settings.beta != 0.0)
                .map(|tables| tables.conditional.each_ref().map(AsRef::as_ref)),
        }
    }

    /// For each view, the parts that may support the other view.
    pub(crate) fn weights(&self) -> &[Vec<bool>; 2] {
        &self.weights
    }
}

/// The released program's extra terms for one target and a fixed support.
#[derive(Debug)]
pub(crate) struct ReleasedTerms<'a> {
    released: &'a ReleasedPair<'a>,
    target: usize,
    support: &'a Pose,
    /// One entry for every part of the target; `None` if the part adds nothing.
    lines: Vec<Option<Line>>,
}

impl<'a> ReleasedTerms<'a> {
    pub(crate) fn new(released: &'a ReleasedPair<'a>, target: usize, support: &'a Pose) -> Self {
        let pair = released.pair;
        let [target_plan, support_plan] = [target, 1 - target].map(|view| pair.views[view].plan);
        let target_from_support = pair.epipolar.support_from_target(target == 1);
        let line = |part: &usize| {
            let support_layout = support_plan.layout();
            let centre = support.centre_from_one(support_plan.model(), support_layout, *part);
            let pixel = looked_up(centre, support_layout.image_size)?;
            let size = target_plan.layout().image_size;
            released.weights[1 - target][*part]
                .then(|| Line::new(&target_from_support, pixel, size))
        };
        Self {
            lines: released.counterpart.iter().map(line).collect(),
            released,
            target,
            support,
        }
    }
}

impl ExtraTerms for ReleasedTerms<'_> {
    fn add_position(&self, part: usize, level: usize, first: usize, score: &mut [f32]) -> bool {
        let Some(Line::Across(ends)) = self.lines[part] else {
            return false;
        };
        let layout = self.released.pair.views[self.target].plan.layout();
        let level_layout = &layout.levels[level];
        let heat = heat_map(
            ends,
            layout.image_size,
            level_layout.rows,
            level_layout.cols,
        );
        for (score, heat) in score.iter_mut().zip(&heat[first..]) {
            *score += (self.released.settings.alpha * f64::from(*heat)) as f32;
        }
        true
    }

    fn of_type(&self, part: usize, mixture: usize) -> f32 {
        match (self.released.tables, self.lines[part]) {
            (Some(tables), Some(_)) => {
                let other = self.released.counterpart[part];
                let support_type = usize::from(self.support.parts[other].mixture);
                let table = tables[1 - self.target];
                (self.released.settings.beta * table.value(part, support_type, mixture)) as f32
            }
            _ => 0.0,
        }
    }

    fn max_gain(&self, part: usize) -> f32 {
        let heat = match self.lines[part] {
            // Heat is between 0 and 1.
            Some(Line::Across(_)) => (self.released.settings.alpha as f32).max(0.0),
            _ => 0.0,
        };
        let plan = self.released.pair.views[self.target].plan;
        let types = 0..plan.model().n_types(part);
        let types = types.map(|mixture| self.of_type(part, mixture));
        heat + types.fold(f32::NEG_INFINITY, f32::max)
    }

    fn key(&self, part: usize) -> Option<u64> {
        let partner = self.released.counterpart[part];
        Some(match self.lines[part] {
            Some(_) => support_key(self.support, partner),
            None => NO_SUPPORT,
        })
    }
}

/// Returns the integer pixel position, counted from 0, at which the program looks up the line of a support.
///
/// * `from_one`: centre of the support, in pixels counted from 1, as computed by the program.
/// * `size`: size of the support's image and of the program's table. The table contains the pixels
///   of the last row and column, but the program treats them as outside.
fn looked_up(from_one: [f64; 2], size: [usize; 2]) -> Option<[f64; 2]> {
    // Rounds half away from zero.
    let from_one = from_one.map(f64::round);
    let inside = |at: f64, side: usize| 0.0 < at && at < side as f64;
    (inside(from_one[0], size[0]) && inside(from_one[1], size[1]))
        .then(|| from_one.map(|side| side - 1.0))
}

/// The epipolar line of a support in the image of the target.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Line {
    /// The line misses the image and adds no heat.
    Outside,
    /// The line intersects the border at these points, `[x, y]` in pixels counted from 1.
    Across([[f64; 2]; 2]),
}

impl Line {
    fn new(target_from_support: &Matrix3<f64>, support_px: [f64; 2], size: [usize; 2]) -> Self {
        let line = target_from_support * Vector3::new(support_px[0], support_px[1], 1.0);
        let [right, bottom] = size.map(|size| size as f64 - 0.5);
        let (left, top) = (-0.5, -0.5);
        let at_x = |x: f64| [x, -(line.x * x + line.z) / line.y];
        let at_y = |y: f64| [-(line.y * y + line.z) / line.x, y];
        let sides = [at_x(left), at_x(right)];
        let sides = sides.into_iter().filter(|[_, y]| (top..=bottom).contains(y));
        let ends = [at_y(top), at_y(bottom)];
        let ends = ends.into_iter().filter(|[x, _]| left < *x && *x < right);
        let mut points = sides.chain(ends).map(|point| point.map(|point| point + 1.0));
        match (points.next(), points.next()) {
            (Some(from), Some(to)) => Self::Across([from, to]),
            _ => Self::Outside,
        }
    }
}

/// Returns the switches of each view, by its parts: off if the expected error exceeds the threshold.
///
/// If both views would be off and their expected errors differ by more than the part's median training error, the better view is switched
/// back on. The program intends the same, but checks the wrong part.
fn weights(settings: &Settings, pair: &PairInput<'_>, counterpart: &[usize]) -> [Vec<bool>; 2] {
    let n_parts = counterpart.len();
    let sigma = |view: usize, part: usize| {
        pair.views[view].sigma_px.and_then(|sigma_px| sigma_px.get(part))
    };
    let is_on = |view: usize, part: usize| {
        let expectation = pair.views[view].expectation(settings, part);
        expectation.is_none_or(|[sigma, tau]| sigma <= tau)
    };
    let mut on = [0, 1].map(|view| (0..n_parts).map(|part| is_on(view, part)).collect::<Vec<_>>());
    for (part, &other) in counterpart.iter().enumerate() {
        if let (Some(first), Some(second), Some(rescue), false, false) = (
            sigma(0, part),
            sigma(1, other),
            settings.rescue_px.get(part),
            on[0][part],
            on[1][other],
        ) && (first - second).abs() > *rescue
        {
            if second < first {
                on[1][other] = true;
            } else {
                on[0][part] = true;
            }
        }
    }
    on
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two cameras side by side: the epipolar line of a point is its own row.
    fn side_by_side() -> Matrix3<f64> {
        Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0)
    }

    #[test]
    fn a_horizontal_line_ends_at_the_outer_edges_of_the_image() {
        let line = Line::new(&side_by_side(), [7.0, 20.0], [64, 48]);
        assert_eq!(line, Line::Across([[0.5, 21.0], [64.5, 21.0]]));
    }

    #[test]
    fn a_vertical_line_ends_at_top_and_bottom() {
        let above_each_other = Matrix3::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0);
        let line = Line::new(&above_each_other, [7.0, 20.0], [64, 48]);
        assert_eq!(line, Line::Across([[8.0, 0.5], [8.0, 48.5]]));
    }

    #[test]
    fn a_line_beside_the_image_is_outside() {
        let line = Line::new(&side_by_side(), [7.0, 48.0], [64, 48]);
        assert_eq!(line, Line::Outside);
        let nowhere = Line::new(&Matrix3::zeros(), [7.0, 20.0], [64, 48]);
        assert_eq!(nowhere, Line::Outside);
    }

    #[test]
    fn a_support_is_looked_up_at_the_nearest_pixel() {
        assert_eq!(looked_up([7.4, 20.5], [64, 48]), Some([6.0, 20.0]));
    }

    /// Test case: the top of the head in `HumanEva`'s C3, at cell 35 of the eleventh level, whose cells are exactly 8 pixels.
    /// 263.49999999999983 + 1 was rounded down.
    #[test]
    fn a_support_between_two_pixels_is_rounded_as_in_the_program() {
        let filter = fmp::Filter {
            rows: 6,
            cols: 6,
            weights: vec![0.0; 36 * fmp::N_CHANNELS],
        };
        let head = fmp::PartSpec {
            name: "head top".to_owned(),
            filter_of_type: vec![0],
            edge: None,
        };
        let model = fmp::Model::new(fmp::ModelSpec {
            name: "head".to_owned(),
            parts: vec![head],
            filters: vec![filter],
            root_bias: 0.0,
            interval: 10,
            cell_px: 4,
            threshold: 0.0,
            mirror: None,
        })
        .expect("a model of one part");
        let layout = fmp::Layout::new(&model, 640, 480).expect("large enough");
        let at = fmp::Placement {
            x: 34,
            y: 14,
            mixture: 0,
        };
        let centre = layout.centre_from_one(10, [6, 6], at);
        assert_eq!(centre, [264.5, 104.5]);
        assert_eq!(looked_up(centre, [640, 480]), Some([264.0, 104.0]));
    }

    #[test]
    fn a_support_outside_its_image_is_not_in_the_table() {
        assert_eq!(looked_up([0.4, 21.0], [64, 48]), None);
        assert_eq!(looked_up([8.0, 101.0], [64, 48]), None);
        // The program treats the last row and column as outside.
        assert_eq!(looked_up([64.0, 21.0], [64, 48]), None);
        assert_eq!(looked_up([63.0, 47.0], [64, 48]), Some([62.0, 46.0]));
    }
}
