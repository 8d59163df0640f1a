//! Draws the learning curves of a training run as SVG.

use std::fmt::Write as _;

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 240.0;
const MARGIN: f64 = 48.0;

/// A line of a diagram, with one value for every pass. Values that are not finite are left out.
#[derive(Debug, Clone, PartialEq)]
pub struct Line<'a> {
    /// Name of the line.
    pub name: &'a str,
    /// Values of the line.
    pub values: Vec<f64>,
}

impl<'a> Line<'a> {
    /// Creates a line.
    pub fn new(name: &'a str, values: impl Iterator<Item: Into<f64>>) -> Self {
        let values = values.map(Into::into).collect();
        Self { name, values }
    }
}

/// A diagram.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel<'a> {
    /// Quantity that the lines show.
    pub what: &'a str,
    /// Lines of the diagram. With more lines than colours (4), colours are used again.
    pub lines: Vec<Line<'a>>,
}

const COLOURS: [&str; 4] = ["#1f6fb4", "#c0392b", "#2e8b57", "#8e44ad"];

/// Draws diagrams one below the other. Names must be constants of the program.
///
/// * `best`: the pass that was kept, counted from 0.
pub fn svg(panels: &[Panel<'_>], best: Option<usize>) -> String {
    let (width, height) = (
        WIDTH + 2.0 * MARGIN,
        panels.len() as f64 * (HEIGHT + 2.0 * MARGIN),
    );
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    for (nth, it) in panels.iter().enumerate() {
        svg.push_str(&panel(it, best, nth as f64 * (HEIGHT + 2.0 * MARGIN)));
    }
    svg.push_str("</svg>\n");
    svg
}

/// Draws one diagram.
fn panel(Panel { what, lines }: &Panel<'_>, best: Option<usize>, top: f64) -> String {
    let all = lines.iter().flat_map(|line| &line.values);
    let all = all.filter(|value| value.is_finite());
    let [low, high] = all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(*value), high.max(*value)]
    });
    let n = lines.first().map_or(0, |line| line.values.len());
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
    for (nth, (Line { name, values }, colour)) in
        lines.iter().zip(COLOURS.into_iter().cycle()).enumerate()
    {
        let mut path = String::new();
        for (at, value) in values.iter().enumerate().filter(|sample| sample.1.is_finite()) {
            let to = if path.is_empty() { 'M' } else { 'L' };
            // Writing to a string cannot fail.
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
    fn curves_cover_all_passes_and_the_best_pass_is_marked() {
        let line = |name, values: [f64; 3]| Line::new(name, values.into_iter());
        let losses = Panel {
            what: "loss",
            lines: vec![line("a", [3.0, 2.0, 1.0]), line("b", [3.5, 2.5, 1.5])],
        };
        let area = Panel {
            what: "area",
            lines: vec![line("c", [0.75, f64::NAN, 0.75])],
        };
        let drawn = svg(&[losses, area], Some(1));
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
    fn every_line_is_drawn_even_if_there_are_more_than_colours() {
        let lines = (0..5).map(|_| Line::new("a", [1.0, 2.0].into_iter())).collect();
        let drawn = svg(
            &[Panel {
                what: "loss",
                lines,
            }],
            None,
        );
        assert_eq!(drawn.matches("stroke-width").count(), 5);
    }

    #[test]
    fn without_passes_no_curves_are_drawn() {
        let nothing = Panel {
            what: "loss",
            lines: vec![],
        };
        let drawn = svg(&[nothing], None);
        assert!(!drawn.contains("NaN") && !drawn.contains("<path"));
    }
}
