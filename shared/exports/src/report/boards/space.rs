//! Draws cameras and boards in space, from three sides.

use nalgebra::{Matrix2x3, Point3, Vector2};

use super::Page;
use crate::report::html::{Html, html, put};

/// Side of a view in the page.
const SIDE: f64 = 300.0;
const MARGIN: f64 = 30.0;
/// Maximum number of boards that are drawn.
const MOST: usize = 60;

/// Returns three views: oblique, from above, from the side. The world is the frame of the first camera: x right, y down, z forward.
pub(super) fn views(page: &Page<'_>) -> Html {
    let oblique = Matrix2x3::new(0.87, 0.0, -0.5, 0.25, 0.87, -0.43);
    let above = Matrix2x3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    let side = Matrix2x3::new(0.0, 0.0, 1.0, 0.0, 1.0, 0.0);
    let mut out = html!("<div class=\"strip\">\n");
    for (name, map) in [
        ("oblique", oblique),
        ("from above", above),
        ("from the side", side),
    ] {
        put!(out, "<figure>");
        view(&mut out, page, &map);
        put!(out, "<figcaption>{}</figcaption></figure>\n", name);
    }
    put!(out, "</div>\n");
    out
}

struct Frame {
    low: Vector2<f64>,
    scale: f64,
}

impl Frame {
    fn around(points: &[Vector2<f64>]) -> Self {
        let finite = points.iter().filter(|point| point.iter().all(|c| c.is_finite()));
        let low = finite.clone().fold(Vector2::repeat(f64::MAX), |low, it| low.inf(it));
        let high = finite.fold(Vector2::repeat(f64::MIN), |high, it| high.sup(it));
        let extent = (high - low).max().max(1e-6);
        Self {
            low: (low + high - Vector2::repeat(extent)) * 0.5,
            scale: (SIDE - 2.0 * MARGIN) / extent,
        }
    }

    fn place(&self, point: Vector2<f64>) -> Vector2<f64> {
        (point - self.low) * self.scale + Vector2::repeat(MARGIN)
    }
}

fn view(out: &mut Html, page: &Page<'_>, map: &Matrix2x3<f64>) {
    let cameras: Vec<(Vector2<f64>, Vector2<f64>)> = page
        .outcome
        .cameras
        .iter()
        .map(|camera| {
            let centre = camera.camera.centre_in_world();
            let ahead = centre + camera.camera.axis_in_world().into_inner() * 0.3;
            (map * centre.coords, map * ahead.coords)
        })
        .collect();
    let step = page.outcome.boards.len().div_ceil(MOST).max(1);
    let boards: Vec<[Vector2<f64>; 4]> = page
        .outcome
        .boards
        .iter()
        .step_by(step)
        .map(|(_, pose)| {
            page.outline
                .map(|outline| map * (pose * Point3::new(outline.x, outline.y, 0.0)).coords)
        })
        .collect();
    let ends = cameras.iter().flat_map(|camera| [camera.0, camera.1]);
    let all: Vec<Vector2<f64>> = ends.chain(boards.iter().flatten().copied()).collect();
    let frame = Frame::around(&all);
    put!(
        out,
        "<svg class=\"chart\" viewBox=\"0 0 {SIDE} {SIDE}\" width=\"{SIDE}\" height=\"{SIDE}\" role=\"img\">",
        [SIDE]
    );
    outlines(out, &frame, boards);
    for ((centre, ahead), name) in cameras.into_iter().zip(page.names) {
        let (at, to) = (frame.place(centre), frame.place(ahead));
        put!(
            out,
            "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"#2f9e5b\" stroke-width=\"2\"/>\
             <circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"4\" fill=\"#3a86c8\"/><text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            at.x,
            at.y,
            to.x,
            to.y,
            at.x,
            at.y,
            at.x + 6.0,
            at.y - 6.0,
            name
        );
    }
    ruler(out, frame.scale);
    put!(out, "</svg>");
}

fn outlines(out: &mut Html, frame: &Frame, boards: Vec<[Vector2<f64>; 4]>) {
    for corners in boards {
        let [a, b, c, d] = corners.map(|corner| frame.place(corner));
        put!(
            out,
            "<path d=\"M{:.1} {:.1}L{:.1} {:.1}L{:.1} {:.1}L{:.1} {:.1}Z\" fill=\"#808894\" fill-opacity=\"0.08\" stroke=\"#808894\" \
             stroke-width=\"0.5\"/>",
            a.x,
            a.y,
            b.x,
            b.y,
            c.x,
            c.y,
            d.x,
            d.y
        );
    }
}

/// Draws a scale bar whose length is a round number.
fn ruler(out: &mut Html, scale: f64) {
    let metres = [
        0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0,
    ];
    let fitting = metres.iter().rev().find(|value| *value * scale <= 0.4 * SIDE);
    let Some(length) = fitting else {
        return;
    };
    put!(
        out,
        "<line x1=\"10\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"#808894\" stroke-width=\"2\"/>\
         <text x=\"10\" y=\"{:.1}\">{} m</text>",
        SIDE - 8.0,
        10.0 + length * scale,
        SIDE - 8.0,
        SIDE - 12.0,
        length
    );
}
