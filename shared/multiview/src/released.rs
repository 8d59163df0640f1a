//! What the authors' program adds to a view's scores, as its description has it.
//!
//! Three things are corrected where the description calls them bugs: a support outside its table adds
//! nothing (the program draws a line around the top-left corner), the rescue of a part that both
//! views would switch off looks at that part (the program looks at part 1), and a type never seen in
//! training adds nothing (the program's table holds NaN).

use fmp::{Extra, Pose};
use nalgebra::Vector3;

use crate::consistency::counterparts;
use crate::heat_map::heat_map;
use crate::{Compatibility, PairInput, Settings};

/// The released program's extra scores for one target and a fixed support.
#[derive(Debug)]
pub(crate) struct ReleasedTerms<'a> {
    settings: &'a Settings,
    pair: &'a PairInput<'a>,
    target: usize,
    support: &'a Pose,
    counterpart: Vec<usize>,
    /// Border points of every part's epipolar line, or nothing where the part adds nothing.
    lines: Vec<Option<[[f64; 2]; 2]>>,
    table: Option<&'a Compatibility>,
}

impl<'a> ReleasedTerms<'a> {
    /// * `active`: switches of the support view, by its parts.
    pub(crate) fn new(
        settings: &'a Settings,
        pair: &'a PairInput<'a>,
        target: usize,
        support: &'a Pose,
        (active, exchanged): (&[bool], bool),
    ) -> Self {
        let model = pair.views[0].plan.model();
        let counterpart = counterparts(model, exchanged);
        let [target_plan, support_plan] = [target, 1 - target].map(|it| pair.views[it].plan);
        let target_from_support = pair.epipolar.support_from_target(target != 0);
        let lines = (0..support.parts.len())
            .map(|part| {
                let other = counterpart[part];
                if !active[other] {
                    return None;
                }
                let centre = support_plan.layout();
                let [x, y] = support.centre(support_plan.model(), centre, other);
                let size = target_plan.layout().image_size;
                line_ends(&target_from_support, [x, y], size)
            })
            .collect();
        let table = pair
            .tables
            .filter(|_| !exchanged && settings.beta != 0.0)
            .map(|it| it.conditional[1 - target].as_ref());
        Self {
            settings,
            pair,
            target,
            support,
            counterpart,
            lines,
            table,
        }
    }
}

impl Extra for ReleasedTerms<'_> {
    fn add_position(&self, part: usize, level: usize, score: &mut [f32]) -> bool {
        let Some(ends) = self.lines[part] else {
            return false;
        };
        let layout = self.pair.views[self.target].plan.layout();
        let it = &layout.levels[level];
        let heat = heat_map(ends, layout.image_size, it.rows, it.cols);
        for (score, heat) in score.iter_mut().zip(heat) {
            *score += (self.settings.alpha * f64::from(heat)) as f32;
        }
        true
    }

    fn of_type(&self, part: usize, mixture: usize) -> f32 {
        match (self.table, self.lines[part]) {
            (Some(table), Some(_)) => {
                let seen = usize::from(self.support.parts[self.counterpart[part]].mixture);
                (self.settings.beta * table.value(part, seen, mixture)) as f32
            }
            _ => 0.0,
        }
    }
}

/// Where the epipolar line of a support meets the border of the target image, counted from 1.
///
/// * `support_px`: centre of the support, pixels from 0; the program looks its line up at the
///   nearest whole pixel.
/// * Returns `None` if the support lies outside the image; two equal points outside if its line
///   misses the image, which warms nothing.
fn line_ends(
    target_from_support: &nalgebra::Matrix3<f64>,
    support_px: [f64; 2],
    size: [usize; 2],
) -> Option<[[f64; 2]; 2]> {
    const MISSED: [[f64; 2]; 2] = [[-1.0, -1.0]; 2];
    let [width, height] = size.map(|it| it as f64);
    // Rounding half away from zero happens to the coordinate counted from 1.
    let [x, y] = support_px.map(|it| (it + 1.0).round());
    if x <= 0.0 || y <= 0.0 || x >= width || y >= height {
        return None;
    }
    let line = target_from_support * Vector3::new(x - 1.0, y - 1.0, 1.0);
    let (left, right) = (-0.5, width - 0.5);
    let (top, bottom) = (-0.5, height - 0.5);
    let at_x = |x: f64| [x, -(line.x * x + line.z) / line.y];
    let at_y = |y: f64| [-(line.y * y + line.z) / line.x, y];
    let mut ends: Vec<[f64; 2]> = [at_x(left), at_x(right)]
        .into_iter()
        .filter(|[_, y]| (top..=bottom).contains(y))
        .chain(
            [at_y(top), at_y(bottom)]
                .into_iter()
                .filter(|[x, _]| left < *x && *x < right),
        )
        .collect();
    ends.truncate(2);
    match ends[..] {
        [from, to] => Some([from, to].map(|end| end.map(|it| it + 1.0))),
        _ => Some(MISSED),
    }
}

/// Switches of either view, by its parts: off where its expected error exceeds the threshold.
///
/// Where both views would be off and their expectations differ by more than the part's median
/// training error, the better one is switched back on (the intended form of the program's
/// rescue; its own test looks at the wrong part).
pub(crate) fn weights(settings: &Settings, pair: &PairInput<'_>) -> [Vec<bool>; 2] {
    let n_parts = pair.views[0].plan.model().n_parts();
    let sigma = |view: usize, part: usize| pair.views[view].sigma_px.and_then(|it| it.get(part));
    let mut on = [vec![true; n_parts], vec![true; n_parts]];
    for part in 0..n_parts {
        let Some(tau) = settings.tau_px.get(part) else {
            continue;
        };
        for (view, on) in on.iter_mut().enumerate() {
            on[part] = sigma(view, part).is_none_or(|it| it <= tau);
        }
        if let (Some(first), Some(second), false, false) =
            (sigma(0, part), sigma(1, part), on[0][part], on[1][part])
            && (first - second).abs() > settings.rescue_px.get(part).copied().unwrap_or(f32::MAX)
        {
            on[usize::from(second < first)][part] = true;
        }
    }
    on
}
