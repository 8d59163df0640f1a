//! The synchronisation of cameras as one HTML page: the result, the reasons for or against trusting it, and for every pair of cameras a
//! curve of the matching cost against the time offset.

use core::fmt::Write as _;

use calibration::synchronisation::{Curve, Outcome, PairReport};

use crate::report::html::{Html, put};
use crate::report::parts::{about_table, begin, number, verdict};

const WIDTH: f64 = 560.0;
const HEIGHT: f64 = 150.0;
const LEFT: f64 = 44.0;
const TOP: f64 = 10.0;
const BOTTOM: f64 = 34.0;

/// The content of the page.
#[derive(Debug, Clone)]
pub struct Page<'a> {
    /// Names of the cameras.
    pub names: &'a [&'a str],
    /// Outcome of the synchronisation.
    pub outcome: &'a Outcome,
    /// True if sounds were compared instead of joint motion.
    pub is_heard: bool,
    /// Description of the input: key and value.
    pub about: &'a [(String, String)],
}

/// Returns the page, which needs no other file.
pub fn html(page: &Page<'_>) -> String {
    let mut out = begin("Parallax: clocks of cameras");
    let doubts = page.outcome.doubts.iter().map(|doubt| doubt.text(page.names));
    let doubts: Vec<String> = doubts.collect();
    verdict(&mut out, ("determined", "not to be used"), &doubts);
    about_table(&mut out, page.about);
    cameras(&mut out, page);
    let cost = if page.is_heard {
        "One minus the cosine between the beginnings of sounds"
    } else {
        "Mean cost of a joint, log(1 + (residual / expected error)&#178;)"
    };
    put!(
        out,
        "<h2>Cost of every pair over its offset</h2>\n<p><small>{}: lower is better. Add the offset to a time of the first camera to \
         get the time of the second. Line: the best offset of the pair; dashes: its second best offset; grey: the offset from all \
         cameras together.</small></p>\n",
        Html::constant(cost)
    );
    for (curve, pair) in page.outcome.curves.iter().zip(&page.outcome.pairs) {
        pair_plot(&mut out, page.names, curve, pair);
    }
    put!(out, "</html>\n");
    out.into_page()
}

fn cameras(out: &mut Html, page: &Page<'_>) {
    put!(
        out,
        "<h2>Cameras</h2>\n<div class=\"scroll\"><table>\n<tr><th>camera<th>offset, ms<th>standard error, ms<th>drift, ppm\
         <th>standard error, ppm<th>{}<th>residual before, px<th>after, px</tr>\n",
        if page.is_heard { "sounds" } else { "joints" }
    );
    for (name, it) in page.names.iter().zip(&page.outcome.cameras) {
        let drift_error = it.drift_error;
        put!(
            out,
            "<tr><td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}</tr>\n",
            name,
            number(1e3 * it.offset_s, 2),
            number(1e3 * it.error_s, 2),
            drift_error.map_or("-".to_owned(), |_| number(1e6 * it.drift, 1)),
            drift_error.map_or("footage too short".to_owned(), |drift_error| number(
                1e6 * drift_error,
                1
            )),
            it.n,
            number(it.before_px, 2),
            number(it.after_px, 2)
        );
    }
    put!(out, "</table></div>\n");
}

fn pair_plot(out: &mut Html, names: &[&str], curve: &Curve, pair: &PairReport) {
    let [a, b] = curve.cameras.map(|camera| names.get(camera).copied().unwrap_or("?"));
    put!(
        out,
        "<h3>{} and {}</h3>\n<p><small>best {} ms, second best {} ms ({} % as good), all cameras together {} ms; {} samples\
         </small></p>\n",
        a,
        b,
        number(1e3 * pair.best_s, 0),
        number(1e3 * pair.second_s, 0),
        number(100.0 * pair.ratio, 0),
        number(1e3 * pair.offset_s, 1),
        pair.n
    );
    let total = [LEFT + WIDTH + 12.0, TOP + HEIGHT + BOTTOM];
    put!(
        out,
        "<svg class=\"chart\" viewBox=\"0 0 {} {}\" width=\"{}\" height=\"{}\" role=\"img\">",
        total[0],
        total[1],
        total[0],
        total[1]
    );
    let known = curve.cost.iter().filter(|cost| cost.is_finite());
    let [low, high] = known.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], it| {
        [low.min(*it), high.max(*it)]
    });
    if low.is_finite() {
        let first = curve.first_s;
        let last = curve.offset_s(curve.cost.len() - 1);
        let x = |offset_s: f64| LEFT + WIDTH * (offset_s - first) / (last - first).max(1e-9);
        let y = |cost: f64| TOP + HEIGHT * (1.0 - (cost - low) / (high - low).max(1e-9));
        axes(out, [low, high], [first, last]);
        put!(
            out,
            "<path d=\"{}\" fill=\"none\" stroke=\"#3a86c8\" stroke-width=\"1.5\"/>",
            path(curve, x, y)
        );
        marks(out, pair, x);
    }
    put!(out, "</svg>\n");
}

/// Draws the offsets of a pair: the one computed from all cameras together, the best one of the pair alone, and the second best one.
fn marks(out: &mut Html, pair: &PairReport, x: impl Fn(f64) -> f64) {
    let bottom = TOP + HEIGHT;
    for (offset_s, style) in [
        (
            pair.offset_s,
            "stroke=\"#808894\" stroke-width=\"4\" stroke-opacity=\"0.5\"",
        ),
        (pair.best_s, "stroke=\"#2f9e5b\" stroke-width=\"1.5\""),
        (
            pair.second_s,
            "stroke=\"#d9503f\" stroke-width=\"1.5\" stroke-dasharray=\"4 3\"",
        ),
    ] {
        put!(
            out,
            "<line x1=\"{:.1}\" x2=\"{:.1}\" y1=\"{TOP}\" y2=\"{bottom}\" {}/>",
            [TOP, bottom],
            x(offset_s),
            x(offset_s),
            Html::constant(style)
        );
    }
}

fn axes(out: &mut Html, [low, high]: [f64; 2], [first, last]: [f64; 2]) {
    for (value, y) in [(high, TOP), (low, TOP + HEIGHT)] {
        put!(
            out,
            "<line x1=\"{LEFT}\" x2=\"{}\" y1=\"{y}\" y2=\"{y}\" class=\"grid\"/><text x=\"{}\" y=\"{:.1}\" class=\"end\">{value:.2}\
             </text>",
            [LEFT, y, value],
            LEFT + WIDTH,
            LEFT - 4.0,
            y + 4.0
        );
    }
    for nth in 0..=4 {
        let share = f64::from(nth) / 4.0;
        let seconds = first + share * (last - first);
        put!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" class=\"mid\">{seconds:.1} s</text>",
            [seconds],
            LEFT + share * WIDTH,
            TOP + HEIGHT + 16.0
        );
    }
}

fn path(curve: &Curve, x: impl Fn(f64) -> f64, y: impl Fn(f64) -> f64) -> String {
    let mut path = String::new();
    let mut is_down = false;
    for (nth, cost) in curve.cost.iter().enumerate() {
        if cost.is_finite() {
            let to = if is_down { 'L' } else { 'M' };
            let at = [x(curve.offset_s(nth)), y(*cost)];
            // Writing to a string cannot fail.
            write!(path, "{to}{:.1} {:.1}", at[0], at[1]).unwrap_or_default();
        }
        is_down = cost.is_finite();
    }
    path
}

#[cfg(test)]
mod tests {
    use calibration::synchronisation::{CameraClock, Doubt};

    use super::*;

    fn outcome(doubts: Vec<Doubt>) -> Outcome {
        let camera = CameraClock {
            offset_s: 0.0123,
            error_s: f64::INFINITY,
            drift: 0.0,
            drift_error: None,
            n: 5,
            before_px: f64::NAN,
            after_px: 1.25,
        };
        Outcome {
            cameras: vec![camera.clone(), camera],
            pairs: Vec::new(),
            curves: Vec::new(),
            second_best: 0.3,
            doubts,
            length_s: 3.0,
        }
    }

    #[test]
    fn the_clock_page_shows_results_and_rejected_offsets() {
        let doubt = Doubt::NoPeople {
            camera: 1,
            seen_s: 0.0,
            least_s: 0.5,
        };
        let page = |outcome: &Outcome| {
            html(&Page {
                names: &["<left>", "right"],
                outcome,
                is_heard: false,
                about: &[("deployment".to_owned(), "a & b".to_owned())],
            })
        };
        let good = page(&outcome(Vec::new()));
        assert!(
            good.contains("determined") && good.contains("12.30"),
            "{good}"
        );
        assert!(
            good.contains("&lt;left&gt;") && good.contains("a &amp; b"),
            "{good}"
        );
        assert!(!good.contains("NaN") && !good.contains("inf<"), "{good}");
        testkit::chromium::check_in_browser(&good);
        let bad = page(&outcome(vec![doubt]));
        assert!(
            bad.contains("not to be used") && bad.contains("followed for 0.0 s"),
            "{bad}"
        );
    }
}
