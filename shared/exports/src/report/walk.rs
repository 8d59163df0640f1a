//! A rig calibrated from people, as one HTML page: the verdict, the accuracy of every camera, the positions of people in its
//! picture, and the rig in space.

use calibration::people;
use calibration::refine;
use geometry::Camera;
use nalgebra::{Point3, UnitVector3, Vector3};

use crate::report::html::{Html, put};
use crate::report::parts::{about_table, begin, number, verdict, worst};
use crate::report::run::{Eye, Moment, SCRIPT, Space};

/// Number of cells of a picture along each axis, and the size of its drawing.
const CELLS: usize = 8;
const WIDTH: f64 = 160.0;
/// Text for a rig with doubts.
const UNUSABLE: &str = "not to be used";
/// Text for a rig with cautions.
const ROUGH: &str = "usable, but uncertain";
/// Legend of the drawings in pictures.
const DRAWN: &str = "Each ring is a detected joint; the line leads to the position that the rig predicts from the detections of all \
    cameras.";
/// Maximum number of skeletons that are drawn.
const MOST_MOMENTS: usize = 150;

/// The title and the head of the table of cameras.
const CAMERAS: &str = "<h2>Cameras</h2>\n<div class=\"scroll\"><table>\n<tr><th>camera<th>centre, m<th>joints<th>residual, px<th>fit, %\
         <th>rotation &#177; degrees<th>centre &#177; mm<th>focal length, px<th>difference of halves, degrees<th>difference of halves, \
         mm<th>offset, ms</tr>\n";

/// Returns the page of `calibrate people`.
///
/// * `names`: names of the cameras.
/// * `about`: description of the input, key and value.
/// * `pictures`: the pictures that fit worst, each as JPEG with a caption.
pub fn of_people(
    outcome: &people::Outcome,
    names: &[&str],
    about: &[(String, String)],
    pictures: &[(String, Vec<u8>)],
) -> String {
    let mut out = begin("Parallax: a rig from people");
    judged(&mut out, outcome, names);
    about_table(&mut out, about);
    put!(
        out,
        "<p class=\"note\">{} instants over {} s; sides of {} views swapped; scale known to within {} %.</p>\n",
        outcome.n_instants,
        number(outcome.span_s[1] - outcome.span_s[0], 1),
        outcome.n_exchanged,
        number(100.0 * outcome.scale_sd, 1)
    );
    put!(out, "{}", Html::constant(CAMERAS));
    let each = names.iter().zip(&outcome.cameras).zip(&outcome.reports);
    for ((name, camera), it) in each {
        let centre = camera.centre_in_world();
        let focal = number(camera.intrinsics.fx, 1);
        let focal = match it.focal_sd_px {
            Some(sd) => format!("{focal} \u{b1} {}", number(sd, 1)),
            None => format!("{focal}, given"),
        };
        put!(
            out,
            "<tr><td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}</tr>\n",
            name,
            format!("{:.3} {:.3} {:.3}", centre.x, centre.y, centre.z),
            it.joints,
            number(it.residual_px, 2),
            number(100.0 * it.inliers, 0),
            number(it.sd[0], 3),
            number(1e3 * it.sd[1], 1),
            focal,
            it.halves.map_or("-".to_owned(), |half| number(half[0], 2)),
            it.halves.map_or("-".to_owned(), |half| number(1e3 * half[1], 0)),
            format!(
                "{} \u{b1} {}",
                number(1e3 * it.offset_s[0], 1),
                number(1e3 * it.offset_s[1], 1)
            )
        );
    }
    put!(
        out,
        "</table></div>\n<p class=\"note\">Each &#177; is one standard deviation, estimated from the differences between blocks of the \
         recording and between its halves, after the rigs are aligned. The difference of halves is the \
         difference between the rigs of the two halves, after alignment.</p>\n"
    );
    coverage(&mut out, outcome, names);
    in_space(
        &mut out,
        (&outcome.cameras, outcome.up),
        &outcome.skeletons,
        outcome.span_s,
    );
    worst(&mut out, DRAWN, pictures);
    put!(out, "</html>\n");
    out.into_page()
}

/// Writes the verdict, with doubts, otherwise with cautions.
fn judged(out: &mut Html, outcome: &people::Outcome, names: &[&str]) {
    let (bad, reasons) = if outcome.doubts.is_empty() {
        (ROUGH, &outcome.cautions)
    } else {
        (UNUSABLE, &outcome.doubts)
    };
    let reasons: Vec<String> = reasons.iter().map(|reason| reason.text(names)).collect();
    verdict(out, ("determined", bad), &reasons);
}

/// Returns the page of `calibrate refine`.
///
/// * `names`, `about`, `pictures`: as in [`of_people`].
pub fn of_refinement(
    outcome: &refine::Outcome,
    names: &[&str],
    about: &[(String, String)],
    pictures: &[(String, Vec<u8>)],
) -> String {
    let mut out = begin("Parallax: a rig refined");
    let mut doubts: Vec<String> = outcome.doubts.iter().map(|doubt| doubt.text(names)).collect();
    if doubts.is_empty() && !outcome.is_better {
        doubts.push("the new rig is not better on held-out joints: keep the old rig".to_owned());
    }
    verdict(&mut out, ("better", UNUSABLE), &doubts);
    about_table(&mut out, about);
    put!(
        out,
        "<p class=\"note\">{} instants. The distance of held-out joints from the positions that the other cameras predict is {} px with \
         the old rig, and {} px with the new rig; {} of {} blocks improved ({} standard errors of the mean).</p>\n",
        outcome.n_instants,
        number(outcome.held_out_px[0], 2),
        number(outcome.held_out_px[1], 2),
        outcome.blocks[1],
        outcome.blocks[0],
        number(outcome.certainty, 1)
    );
    put!(
        out,
        "<h2>Cameras</h2>\n<div class=\"scroll\"><table>\n<tr><th>camera<th>moved, degrees<th>mm<th>&#177; degrees<th>&#177; mm\
         <th>held out before, px<th>after, px<th>residual, px<th>offset, ms<th></tr>\n"
    );
    for (name, it) in names.iter().zip(&outcome.changes) {
        put!(
            out,
            "<tr><td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}</tr>\n",
            name,
            number(it.moved[0], 2),
            number(1e3 * it.moved[1], 1),
            number(it.sd[0], 3),
            number(1e3 * it.sd[1], 1),
            number(it.held_out_px[0], 2),
            number(it.held_out_px[1], 2),
            number(it.residual_px, 2),
            number(1e3 * it.offset_s, 1),
            if it.is_told {
                ""
            } else {
                "kept: the joints do not determine it"
            }
        );
    }
    put!(out, "</table></div>\n");
    worst(&mut out, DRAWN, pictures);
    put!(out, "</html>\n");
    out.into_page()
}

/// Draws the positions of the joints in the picture of every camera.
fn coverage(out: &mut Html, outcome: &people::Outcome, names: &[&str]) {
    put!(
        out,
        "<h2>Where in the pictures people were</h2>\n<p><small>The darker, the more joints; what is empty tells nothing.</small></p>\n<div>\n"
    );
    for ((name, camera), it) in names.iter().zip(&outcome.cameras).zip(&outcome.reports) {
        let [width, height] = camera.intrinsics.size.map(f64::from);
        let cell = [WIDTH / CELLS as f64, WIDTH * height / width / CELLS as f64];
        let total = [WIDTH, CELLS as f64 * cell[1] + 18.0];
        put!(
            out,
            "<svg class=\"chart\" viewBox=\"0 0 {} {}\" width=\"{}\" height=\"{}\" role=\"img\"><text x=\"0\" y=\"12\">{}</text>",
            total[0],
            total[1],
            total[0],
            total[1],
            name
        );
        let most = it.cells.iter().copied().max().unwrap_or(0).max(1) as f64;
        for (nth, n) in it.cells.iter().enumerate() {
            let [column, row] = [nth % CELLS, nth / CELLS].map(|value| value as f64);
            put!(
                out,
                "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"#3a86c8\" fill-opacity=\"{:.2}\" stroke=\"#808894\" \
                 stroke-width=\"0.3\"/>",
                column * cell[0],
                18.0 + row * cell[1],
                cell[0],
                cell[1],
                (*n as f64 / most).sqrt()
            );
        }
        put!(out, "</svg>\n");
    }
    put!(out, "</div>\n");
}

/// Draws the rig and the skeletons, with the script of the page of a run.
fn in_space(
    out: &mut Html,
    (cameras, up): (&[Camera], Option<UnitVector3<f64>>),
    skeletons: &[Vec<Option<Point3<f64>>>],
    span_s: [f64; 2],
) {
    if skeletons.is_empty() {
        return;
    }
    let joints = skeleton::PARSE14.joints;
    let step = skeletons.len().div_ceil(MOST_MOMENTS);
    let seconds = (span_s[1] - span_s[0]) / (skeletons.len().max(2) - 1) as f64;
    let each = skeletons.iter().enumerate().step_by(step);
    let moments = each.map(|(nth, it)| {
        let of = |joint: usize| {
            it.get(joint).copied().flatten().map(|point| [point.x, point.y, point.z])
        };
        Moment {
            frame: nth as u64,
            seconds: seconds * nth as f64,
            found: (0..joints.len()).map(of).collect(),
            truth: Vec::new(),
            views: vec![None; cameras.len()],
        }
    });
    let up = up.unwrap_or(Vector3::z_axis());
    let space = Space {
        joints: joints.iter().map(|joint| joint.name.to_owned()).collect(),
        limbs: skeleton::PARSE14.limbs.to_vec(),
        eyes: cameras
            .iter()
            .map(|camera| {
                let (at, axis) = (camera.centre_in_world(), camera.axis_in_world());
                Eye {
                    name: camera.name.clone(),
                    at: [at.x, at.y, at.z],
                    axis: [axis.x, axis.y, axis.z],
                }
            })
            .collect(),
        up: [up.x, up.y, up.z],
        moments: moments.collect(),
    };
    let data = space.json();
    put!(
        out,
        "<h2>The rig in space</h2>\n<canvas id=\"space\" width=\"900\" height=\"520\" role=\"img\" aria-label=\"the rig in space\"></canvas>\n\
         <p class=\"bar\"><button id=\"play\">pause</button> <input id=\"at\" type=\"range\" min=\"0\" value=\"0\"> <label hidden><input id=\"truth\" type=\"checkbox\"></label> <span id=\"said\"></span></p>\n\
         <p class=\"note\">Drag to rotate, turn the wheel to zoom. The squares of the floor are a metre wide.</p>\n\
         <script type=\"application/json\" id=\"data\">{}</script>\n<script type=\"module\">{}</script>\n",
        Html::in_script(&data),
        Html::constant(SCRIPT)
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_escaped_and_reasons_are_shown() {
        let outcome = people::Outcome {
            cameras: Vec::new(),
            up: None,
            vertical: people::Vertical::Leaning,
            scale_sd: f64::NAN,
            stature_m: None,
            reports: Vec::new(),
            doubts: vec![people::Doubt::NoPeople {
                camera: 0,
                seen_s: 0.0,
                least_s: 0.5,
            }],
            cautions: Vec::new(),
            clocks_are_found: false,
            n_instants: 0,
            span_s: [0.0; 2],
            n_exchanged: 0,
            times_s: Vec::new(),
            skeletons: Vec::new(),
        };
        let about = [("a<b".to_owned(), "c&d\"".to_owned())];
        let page = of_people(&outcome, &["<script>alert(1)"], &about, &[]);
        assert!(
            !page.contains("<script>") && page.contains("&lt;script&gt;alert"),
            "{page}"
        );
        assert!(
            page.contains("a&lt;b") && page.contains("not to be used"),
            "{page}"
        );
        let rough = people::Outcome {
            doubts: Vec::new(),
            cautions: outcome.doubts.clone(),
            ..outcome
        };
        let page = of_people(
            &rough,
            &["one"],
            &about,
            &[("one <at> 1 s".to_owned(), vec![1, 2, 3])],
        );
        assert!(
            page.contains("usable, but uncertain") && page.contains("one sees a person"),
            "{page}"
        );
        assert!(
            page.contains("fit worst") && page.contains("alt=\"one &lt;at&gt; 1 s\""),
            "{page}"
        );
        let head = Some(Point3::new(0.0, 0.0, 1.7));
        let walked = people::Outcome {
            skeletons: vec![vec![head; 14]; 3],
            ..rough
        };
        let page = of_people(&walked, &["one"], &about, &[]);
        assert!(page.contains("The rig in space"));
        testkit::chromium::check_in_browser(&page);
    }
}
