//! Learning curves of a training as SVG.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

/// The results of one pass over the samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pass {
    /// Mean training loss.
    pub learnt: f32,
    /// Mean validation loss after the pass.
    pub validated: f32,
    /// Mean area under the ROC of the validation samples.
    pub area: f64,
}

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 240.0;
const MARGIN: f64 = 48.0;

/// Draws the losses above, and the area under the ROC below.
///
/// * `best`: the pass that was kept, from 0.
pub fn svg(passes: &[Pass], best: Option<usize>) -> String {
    let learnt: Vec<f64> = passes.iter().map(|it| f64::from(it.learnt)).collect();
    let validated: Vec<f64> = passes.iter().map(|it| f64::from(it.validated)).collect();
    let area: Vec<f64> = passes.iter().map(|it| it.area).collect();
    let (width, height) = (WIDTH + 2.0 * MARGIN, 2.0 * (HEIGHT + 2.0 * MARGIN));
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    let losses = [
        ("learnt", "#1f6fb4", &learnt),
        ("validated", "#c0392b", &validated),
    ];
    svg.push_str(&panel("loss", &losses, best, 0.0));
    let areas = [("area under the ROC, validated", "#c0392b", &area)];
    svg.push_str(&panel("area", &areas, best, HEIGHT + 2.0 * MARGIN));
    svg.push_str("</svg>\n");
    svg
}

/// One diagram.
fn panel(what: &str, lines: &[(&str, &str, &Vec<f64>)], best: Option<usize>, top: f64) -> String {
    let all = lines.iter().flat_map(|it| it.2).filter(|it| it.is_finite());
    let [low, high] = all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(*value), high.max(*value)]
    });
    let n = lines.first().map_or(0, |it| it.2.len());
    let x = |at: usize| MARGIN + WIDTH * at as f64 / (n.max(2) - 1) as f64;
    let y = |value: f64| {
        let share = (value - low) / (high - low).max(1e-9);
        top + MARGIN + HEIGHT * (1.0 - share)
    };
    let mut out = String::new();
    let mut put = |text: String| {
        out.push_str(&text);
        out.push('\n');
    };
    put(format!(
        "<rect x=\"{MARGIN}\" y=\"{:.1}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"none\" stroke=\"#999\"/>",
        top + MARGIN
    ));
    if n == 0 || !low.is_finite() {
        return out;
    }
    for (value, at) in [(low, y(low)), (high, y(high))] {
        put(format!(
            "<text x=\"4\" y=\"{:.1}\">{value:.3}</text>",
            at + 4.0
        ));
    }
    put(format!(
        "<text x=\"{MARGIN}\" y=\"{:.1}\">{what} by pass, 1 to {n}</text>",
        top + MARGIN + HEIGHT + 20.0
    ));
    if let Some(best) = best {
        let (x, y) = (x(best), top + MARGIN);
        put(format!(
            "<path d=\"M{x:.1} {y:.1}v{HEIGHT}\" stroke=\"#999\" stroke-dasharray=\"4 4\"/>"
        ));
    }
    for (nth, (name, colour, values)) in lines.iter().enumerate() {
        let mut path = String::new();
        for (at, value) in values.iter().enumerate().filter(|it| it.1.is_finite()) {
            let to = if path.is_empty() { 'M' } else { 'L' };
            // Writing to a text cannot fail.
            write!(path, "{to}{:.1} {:.1}", x(at), y(*value)).unwrap_or_default();
        }
        put(format!(
            "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>"
        ));
        put(format!(
            "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"{colour}\">{name}</text>",
            MARGIN + 160.0 * nth as f64,
            top + MARGIN - 10.0
        ));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_drawn_from_the_first_pass_to_the_last_and_the_best_is_marked() {
        let pass = |it: f32| Pass {
            learnt: it,
            validated: it + 0.5,
            area: 0.75,
        };
        let drawn = svg(&[pass(3.0), pass(2.0), pass(1.0)], Some(1));
        assert!(drawn.starts_with("<svg") && drawn.ends_with("</svg>\n"));
        assert_eq!(drawn.matches("stroke-width").count(), 3);
        assert_eq!(drawn.matches("stroke-dasharray").count(), 2);
        // From 3.5 down to 1: the lines fall evenly.
        assert!(
            drawn.contains("M48.0 96.0L368.0 192.0L688.0 288.0"),
            "{drawn}"
        );
        assert!(!drawn.contains("NaN"));
    }

    #[test]
    fn no_passes_give_no_curves() {
        let drawn = svg(&[], None);
        assert!(!drawn.contains("NaN") && !drawn.contains("<path"));
    }
}
