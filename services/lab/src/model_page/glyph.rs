//! Filters as glyphs: the edges that each cell responds to.

use fmp::{Filter, Model, N_CHANNELS};

use exports::report::html::Html;
use exports::report::{html, put};

/// Number of undirected orientations in the features.
const N_ORIENTATIONS: usize = 9;

/// Side of a cell in units of the glyph.
pub(super) const CELL: f64 = 10.0;

/// Number of brightness steps; the strokes of one step form one path.
const N_STEPS: usize = 6;

/// Returns the definitions of all glyphs, with the names `f0`, `f1` and so on, for `<use>`.
pub(super) fn symbols(model: &Model) -> Html {
    let mut out = html!("<svg class=\"hidden\"><defs>\n");
    for (index, filter) in model.spec().filters.iter().enumerate() {
        put!(out, "<g id=\"f{index}\" stroke-linecap=\"round\">", [index]);
        put!(out, "{}", strokes(filter));
        put!(out, "</g>\n");
    }
    put!(out, "</defs></svg>\n");
    out
}

/// Draws the glyph of a type, with its number and the largest weight of an orientation.
pub(super) fn of_type(model: &Model, part: usize, mixture: usize) -> Html {
    let index = model.spec().parts[part].filter_of_type[mixture];
    let filter = model.filter(part, mixture);
    let [width, height] = [filter.cols, filter.rows].map(|value| value as f64 * CELL);
    let largest = orientations(filter).into_iter().fold(0.0, f64::max);
    html!(
        "<figure><svg class=\"dark\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {width} {height}\">\
         <use href=\"#f{index}\"/></svg><figcaption>type {2} \u{b7} {largest:.3}</figcaption></figure>\n",
        [width, height, index, largest],
        width * 1.7,
        height * 1.7,
        mixture + 1
    )
}

/// Returns the positive weights of every orientation in every cell, `[row][column][orientation]`. The sum is over the contrast-sensitive
/// and the contrast-insensitive features.
fn orientations(filter: &Filter) -> Vec<f64> {
    filter
        .weights
        .as_chunks::<N_CHANNELS>()
        .0
        .iter()
        .flat_map(|cell| {
            (0..N_ORIENTATIONS).map(|i| {
                [i, i + N_ORIENTATIONS, i + 2 * N_ORIENTATIONS]
                    .iter()
                    .map(|&channel| cell[channel].max(0.0))
                    .sum()
            })
        })
        .collect()
}

fn strokes(filter: &Filter) -> Html {
    let weights = orientations(filter);
    let largest = weights.iter().copied().fold(0.0, f64::max);
    let mut paths = vec![Html::default(); N_STEPS];
    for (at, &weight) in weights.iter().enumerate() {
        let share = if largest > 0.0 { weight / largest } else { 0.0 };
        let step = (share * N_STEPS as f64).floor() as usize;
        // Strokes with the lowest brightness are not drawn, because they would only add clutter.
        if step == 0 {
            continue;
        }
        let (cell, orientation) = (at / N_ORIENTATIONS, at % N_ORIENTATIONS);
        let x = ((cell % filter.cols) as f64 + 0.5) * CELL;
        let y = ((cell / filter.cols) as f64 + 0.5) * CELL;
        // The edge is perpendicular to the gradient.
        let angle = (orientation as f64 * 180.0 / N_ORIENTATIONS as f64 + 90.0).to_radians();
        let length = CELL * (0.2 + 0.28 * share);
        let (dy, dx) = angle.sin_cos();
        let (dx, dy) = (dx * length, dy * length);
        put!(
            paths[step.min(N_STEPS - 1)],
            "M{:.1} {:.1}L{:.1} {:.1}",
            x - dx,
            y - dy,
            x + dx,
            y + dy
        );
    }
    let mut out = Html::default();
    for (step, path) in paths.iter().enumerate().filter(|step| !step.1.is_empty()) {
        let grey = 55 + 200 * step / (N_STEPS - 1);
        let width = 0.7 + 0.9 * step as f64 / (N_STEPS - 1) as f64;
        put!(
            out,
            "<path d=\"{path}\" stroke=\"rgb({grey},{grey},{grey})\" stroke-width=\"{width:.2}\"/>",
            [path, grey, width]
        );
    }
    out
}
