//! Draws the corners of a camera in its picture, and their residuals.

use calibration::board::{CameraOutcome, Residual};

use crate::report::html::{Html, html, put};

/// Width of the picture in the page.
const WIDTH: f64 = 420.0;
/// Factor by which residuals are enlarged in the drawing.
const LONGER: f64 = 25.0;
/// Side of the plot of residuals; the next constant is the length of one pixel in the plot.
const PLOT: f64 = 180.0;
const PIXEL: f64 = 40.0;
/// Maximum number of corners that are drawn.
const MOST: usize = 1500;

/// Returns both drawings.
pub(super) fn corners(camera: &CameraOutcome) -> Html {
    let [width, height] = camera.camera.intrinsics.size.map(f64::from);
    let scale = WIDTH / width.max(1.0);
    let drawn = scale * height;
    let total = [WIDTH + 20.0 + PLOT, drawn.max(PLOT)];
    let mut out = html!(
        "<svg class=\"chart\" viewBox=\"0 0 {:.0} {:.0}\" width=\"{:.0}\" height=\"{:.0}\" role=\"img\">",
        total[0],
        total[1],
        total[0],
        total[1]
    );
    put!(
        out,
        "<rect x=\"0\" y=\"0\" width=\"{WIDTH:.1}\" height=\"{drawn:.1}\" fill=\"none\" stroke=\"#808894\"/>",
        [WIDTH, drawn]
    );
    let step = camera.residuals.len().div_ceil(MOST).max(1);
    // Only few corners were left out, so all of these are drawn.
    let shown = camera.residuals.iter().enumerate();
    for (_, it) in shown.filter(|(nth, it)| it.is_wrong || nth % step == 0) {
        corner(&mut out, it, scale);
    }
    let middle = [WIDTH + 20.0 + 0.5 * PLOT, 0.5 * PLOT];
    put!(
        out,
        "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{PIXEL}\" fill=\"none\" stroke=\"#808894\"/>",
        [PIXEL],
        middle[0],
        middle[1]
    );
    for it in camera
        .residuals
        .iter()
        .step_by(step)
        .filter(|residual| !residual.is_wrong && is_known(residual))
    {
        let at =
            [0, 1].map(|axis| middle[axis] + (PIXEL * it.off[axis]).clamp(-0.5 * PLOT, 0.5 * PLOT));
        put!(
            out,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"1.2\" fill=\"#3a86c8\" fill-opacity=\"0.5\"/>",
            at[0],
            at[1]
        );
    }
    put!(out, "</svg>\n");
    out
}

fn is_known(corner: &Residual) -> bool {
    corner.off.iter().all(|value| value.is_finite())
}

fn corner(out: &mut Html, it: &Residual, scale: f64) {
    let at = [scale * it.at.x, scale * it.at.y];
    let colour = Html::constant(if it.is_wrong { "#d9503f" } else { "#3a86c8" });
    put!(
        out,
        "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"1.2\" fill=\"{colour}\" fill-opacity=\"0.6\"/>",
        [colour],
        at[0],
        at[1]
    );
    if !it.is_wrong && is_known(it) {
        let to = [0, 1].map(|axis| at[axis] + scale * LONGER * it.off[axis]);
        put!(
            out,
            "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"#e69f00\" stroke-width=\"0.7\"/>",
            at[0],
            at[1],
            to[0],
            to[1]
        );
    }
}
