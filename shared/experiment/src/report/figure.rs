//! The paper's figures as SVG: bars of every part, curves over the threshold, histograms of changes.

use evaluation::SEGMENT_NAMES;

use super::escape;
use crate::{ChangesOf, Group};

/// One colour for each version, told apart without red and green alone.
const COLOURS: [&str; 8] = [
    "#b2182b", "#2166ac", "#1b7837", "#762a83", "#e08214", "#35978f", "#c51b7d", "#525252",
];

pub(super) fn colour(version: usize) -> &'static str {
    COLOURS[version % COLOURS.len()]
}

/// A plot of percentages: 0 to 100 upwards.
struct Plot {
    width: f64,
    out: String,
}

const HEIGHT: f64 = 220.0;
const LEFT: f64 = 34.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 8.0;
const BOTTOM: f64 = 34.0;

impl Plot {
    /// * `most`: the value at the top.
    fn new(width: f64, most: f64, unit: &str) -> Self {
        let mut out = String::new();
        let total = [LEFT + width + RIGHT, TOP + HEIGHT + BOTTOM];
        put(
            &mut out,
            format_args!(
                "<svg viewBox=\"0 0 {} {}\" width=\"{}\" role=\"img\">",
                total[0], total[1], total[0]
            ),
        );
        for nth in 0..=4 {
            let share = f64::from(nth) / 4.0;
            let y = TOP + HEIGHT * (1.0 - share);
            put(
                &mut out,
                format_args!(
                    "<line x1=\"{LEFT}\" x2=\"{}\" y1=\"{y:.1}\" y2=\"{y:.1}\" class=\"grid\"/>\
                 <text x=\"{}\" y=\"{:.1}\" class=\"end\">{:.0}{unit}</text>",
                    LEFT + width,
                    LEFT - 4.0,
                    y + 4.0,
                    share * most
                ),
            );
        }
        Self { width, out }
    }

    fn word(&mut self, x: f64, text: &str) {
        let y = TOP + HEIGHT + 16.0;
        let text = escape(text);
        put(
            &mut self.out,
            format_args!("<text x=\"{x:.1}\" y=\"{y:.1}\" class=\"mid\">{text}</text>"),
        );
    }

    fn bar(&mut self, x: [f64; 2], share: f64, colour: &str, title: &str) {
        let height = HEIGHT * share.clamp(0.0, 1.0);
        put(
            &mut self.out,
            format_args!(
                "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{height:.1}\" fill=\"{colour}\">\
             <title>{}</title></rect>",
                x[0],
                TOP + HEIGHT - height,
                x[1] - x[0],
                escape(title)
            ),
        );
    }

    fn end(mut self) -> String {
        self.out.push_str("</svg>\n");
        self.out
    }
}

/// PCP3D of every part, a bar for each version.
pub(super) fn bars(group: &Group, titles: &[String]) -> String {
    let n = SEGMENT_NAMES.len() as f64;
    let mut plot = Plot::new(72.0 * n, 100.0, "%");
    let slot = plot.width / n;
    let width = 0.86 * slot / titles.len().max(1) as f64;
    for (part, name) in SEGMENT_NAMES.iter().enumerate() {
        let left = LEFT + slot * (part as f64 + 0.07);
        for (version, (title, it)) in titles.iter().zip(&group.versions).enumerate() {
            let Some(value) = it.parts.get(part).copied().flatten() else {
                continue;
            };
            let x = left + width * version as f64;
            let title = format!("{name}, {title}: {value:.1} %");
            plot.bar([x, x + width], value / 100.0, colour(version), &title);
        }
        plot.word(LEFT + slot * (part as f64 + 0.5), name);
    }
    plot.end()
}

/// PCP3D over the threshold, a curve for each version.
pub(super) fn curves(group: &Group, titles: &[String]) -> String {
    let mut plot = Plot::new(420.0, 100.0, "%");
    for (version, (title, it)) in titles.iter().zip(&group.versions).enumerate() {
        let most = it.curve.last().map_or(1.0, |it| it[0]);
        let point = |[gamma, percent]: &[f64; 2]| {
            let x = LEFT + plot.width * gamma / most;
            let y = TOP + HEIGHT * (1.0 - percent / 100.0);
            format!("{x:.1},{y:.1}")
        };
        let points: Vec<String> = it.curve.iter().map(point).collect();
        put(
            &mut plot.out,
            format_args!(
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"><title>{}</title></polyline>",
                points.join(" "),
                colour(version),
                escape(title)
            ),
        );
    }
    for nth in 0..=4 {
        let gamma = f64::from(nth) / 4.0;
        let x = LEFT + plot.width * gamma;
        plot.word(x, &format!("{gamma}"));
    }
    plot.end()
}

/// Improvements (to the right) and deteriorations of one version.
pub(super) fn histogram(changes: &ChangesOf) -> String {
    // The two bins around nothing would hide all others: they are cut off.
    let far = changes
        .bins
        .iter()
        .filter(|it| it[0] != 0.0 && (it[0] + width(changes)).abs() > 1e-9);
    let most = far.map(|it| it[1]).fold(1.0, f64::max).ceil();
    let mut plot = Plot::new(420.0, most, "%");
    let n = changes.bins.len().max(1) as f64;
    let slot = plot.width / n;
    for (nth, [edge, percent]) in changes.bins.iter().enumerate() {
        let x = LEFT + slot * nth as f64;
        let colour = if *edge < 0.0 { "#b2182b" } else { "#1b7837" };
        let title = format!("{edge} to {} px: {percent:.2} %", edge + width(changes));
        plot.bar([x, x + slot - 1.0], percent / most, colour, &title);
    }
    for nth in 0..=4 {
        let share = f64::from(nth) / 4.0;
        let reach = changes.bins.first().map_or(0.0, |it| it[0].abs());
        let at = reach * (2.0 * share - 1.0);
        plot.word(LEFT + plot.width * share, &format!("{at:.0} px"));
    }
    plot.end()
}

fn width(changes: &ChangesOf) -> f64 {
    match changes.bins[..] {
        [a, b, ..] => b[0] - a[0],
        _ => 1.0,
    }
}

fn put(out: &mut String, text: std::fmt::Arguments<'_>) {
    out.push_str(&std::fmt::format(text));
}
