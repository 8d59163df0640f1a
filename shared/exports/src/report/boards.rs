//! A calibration from a board as one HTML page: the accuracy of the results, the corners in the pictures, the rig in space, and the worst
//! pictures.

mod pictures;
mod space;

use calibration::board::{CameraOutcome, Outcome};
use nalgebra::Point2;

use crate::report::html::{Html, put};
use crate::report::parts::{about_table, begin, number, verdict, worst};

/// The content of the page.
#[derive(Debug, Clone)]
pub struct Page<'a> {
    /// Names of the cameras.
    pub names: &'a [String],
    /// Outcome of the calibration.
    pub outcome: &'a Outcome,
    /// True if the poses of the cameras were requested too.
    pub has_rig: bool,
    /// Corners of the board's outline, in order around the board, in metres.
    pub outline: [Point2<f64>; 4],
    /// Description of the input: key and value.
    pub about: &'a [(String, String)],
    /// Reasons for doubt in addition to those of the outcome.
    pub more_doubts: &'a [String],
    /// The worst pictures, each as JPEG with a caption.
    pub worst: &'a [(String, Vec<u8>)],
}

/// Returns the page, which needs no other file.
pub fn html(page: &Page<'_>) -> String {
    let mut out = begin("Parallax: cameras by a board");
    let own = page.outcome.doubts.iter().map(|doubt| doubt.text(page.names));
    let doubts: Vec<String> = page.more_doubts.iter().cloned().chain(own).collect();
    let said = ("calibrated", "doubtful");
    verdict(&mut out, said, &doubts);
    about_table(&mut out, page.about);
    cameras(&mut out, page);
    put!(
        out,
        "<h2>Where the corners were, and how they fit</h2>\n<p><small>Left: every corner in the picture, with its residual enlarged 25 \
         times; red: left out as wrong. The lens is not known where there is no corner. Right: all residuals from one point; the circle \
         has a radius of 1 px. A pattern (all outward, all to one side) indicates an unsuitable lens model, or a board that is not \
         flat.</small></p>\n"
    );
    for (name, camera) in page.names.iter().zip(&page.outcome.cameras) {
        put!(out, "<h3>{}</h3>\n", name);
        put!(out, "{}", pictures::corners(camera));
    }
    if page.has_rig {
        put!(
            out,
            "<h2>The cameras in space</h2>\n<p><small>Seen obliquely, from above and from the side of the first camera; the line in \
             front of each camera is its viewing \
             direction; grey: the board in every frame that was used. The scale is in metres.</small></p>\n"
        );
        put!(out, "{}", space::views(page));
        pairs(&mut out, page);
    }
    numbers(&mut out, page);
    let drawn =
        "Ring: the detected corner (purple: left out); line: its residual, enlarged 20 times.";
    worst(&mut out, drawn, page.worst);
    put!(out, "</html>\n");
    out.into_page()
}

fn focal(camera: &CameraOutcome) -> (String, String) {
    let known = camera.numbers.iter().find(|number| number.name == "focal length");
    let intrinsics = &camera.camera.intrinsics;
    let sd = known.map_or("given".to_owned(), |known| number(known.sd, 2));
    (format!("{:.1}, {:.1}", intrinsics.fx, intrinsics.fy), sd)
}

fn cameras(out: &mut Html, page: &Page<'_>) {
    put!(
        out,
        "<h2>Cameras</h2>\n<div class=\"scroll\"><table>\n<tr><th>camera<th>pictures with the board<th>pictures used\
         <th>corners used<th>corners left out<th>residual, px<th>residual with corners left out, px<th>picture covered\
         <th>focal lengths, px<th>standard deviation, px</tr>\n"
    );
    for (name, it) in page.names.iter().zip(&page.outcome.cameras) {
        let (focal, sd) = focal(it);
        let wrong = it.residuals.iter().filter(|residual| residual.is_wrong).count();
        put!(
            out,
            "<tr><td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{} %<td>{}<td>{}</tr>\n",
            name,
            it.n_boards[0],
            it.n_boards[1],
            it.residuals.len() - wrong,
            wrong,
            number(it.rms_px, 3),
            number(it.rms_of_all_px, 3),
            number(100.0 * it.coverage, 0),
            focal,
            sd
        );
    }
    put!(
        out,
        "</table></div>\n<p><small>Residual: root mean square of the distance between where a corner was seen and where it is by the \
         calibration.</small></p>\n"
    );
}

fn pairs(out: &mut Html, page: &Page<'_>) {
    put!(
        out,
        "<h2>Pairs of cameras</h2>\n<div class=\"scroll\"><table>\n<tr><th>pair<th>frames with the board in both<th>frames that \
         agree<th>distance, m</tr>\n"
    );
    for it in &page.outcome.pairs {
        let [a, b] = it.cameras;
        let centre = |nth: usize| page.outcome.cameras[nth].camera.centre_in_world();
        put!(
            out,
            "<tr><td>{} - {}<td>{}<td>{}<td>{}</tr>\n",
            page.names[a],
            page.names[b],
            it.n,
            it.n_agree,
            number((centre(a) - centre(b)).norm(), 4)
        );
    }
    put!(out, "</table></div>\n");
}

fn numbers(out: &mut Html, page: &Page<'_>) {
    put!(
        out,
        "<h2>Every number</h2>\n<p><small>With its standard deviation, if corners are off by {} px (standard deviation along an axis) \
         and nothing else is wrong. Positions are in metres, in the coordinates of the first camera; rotations are in \
         degrees.</small></p>\n",
        number(page.outcome.sigma_px, 3)
    );
    for (name, camera) in page.names.iter().zip(&page.outcome.cameras) {
        if camera.numbers.is_empty() {
            continue;
        }
        put!(
            out,
            "<h3>{}</h3>\n<div class=\"scroll\"><table>\n<tr><th>number<th>value<th>standard deviation</tr>\n",
            name
        );
        for it in &camera.numbers {
            put!(
                out,
                "<tr><td>{}<td>{}<td>{}</tr>\n",
                it.name,
                number(it.value, 5),
                number(it.sd, 5)
            );
        }
        put!(out, "</table></div>\n");
    }
}

#[cfg(test)]
mod tests;
