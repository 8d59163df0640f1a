//! The paper's figures as SVG: bars for every part, curves of PCP3D against the threshold, and histograms of changes.

use crate::evaluation::{ChangesOf, Group};
use statistics::score::SEGMENT_NAMES;

use exports::report::html::Html;
use exports::report::put;

/// Colours of the versions. People with colour blindness can distinguish them, on light and on dark backgrounds.
const COLOURS: [&str; 8] = [
    "#d9503f", "#3a86c8", "#2f9e5b", "#9a6bd0", "#d98a00", "#1f9c95", "#d0568f", "#808894",
];

pub(super) fn colour(version: usize) -> &'static str {
    COLOURS[version % COLOURS.len()]
}

/// A plot of percentages; 0 is at the bottom.
struct Plot {
    width: f64,
    out: Html,
}

const HEIGHT: f64 = 220.0;
const LEFT: f64 = 44.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 8.0;
const BOTTOM: f64 = 34.0;

impl Plot {
    /// * `most`: the value at the top.
    fn new(width: f64, most: f64, unit: &str) -> Self {
        let mut out = Html::default();
        let total = [LEFT + width + RIGHT, TOP + HEIGHT + BOTTOM];
        put!(
            out,
            "<svg class=\"chart\" viewBox=\"0 0 {} {}\" width=\"{}\" height=\"{}\" role=\"img\">",
            total[0],
            total[1],
            total[0],
            total[1]
        );
        for nth in 0..=4 {
            let share = f64::from(nth) / 4.0;
            let y = TOP + HEIGHT * (1.0 - share);
            put!(
                out,
                "<line x1=\"{LEFT}\" x2=\"{}\" y1=\"{y:.1}\" y2=\"{y:.1}\" class=\"grid\"/>\
                 <text x=\"{}\" y=\"{:.1}\" class=\"end\">{}{unit}</text>",
                [LEFT, y, unit],
                LEFT + width,
                LEFT - 4.0,
                y + 4.0,
                tick(share * most)
            );
        }
        Self { width, out }
    }

    fn label(&mut self, x: f64, text: &str) {
        let y = TOP + HEIGHT + 16.0;
        put!(
            self.out,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" class=\"mid\">{text}</text>",
            [x, y, text]
        );
    }

    fn bar(&mut self, x: [f64; 2], share: f64, colour: &str, title: &str) {
        let height = HEIGHT * share.clamp(0.0, 1.0);
        put!(
            self.out,
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{height:.1}\" fill=\"{colour}\">\
             <title>{}</title></rect>",
            [height, colour],
            x[0],
            TOP + HEIGHT - height,
            x[1] - x[0],
            title
        );
    }

    fn end(mut self) -> Html {
        put!(self.out, "</svg>\n");
        self.out
    }
}

/// Formats the label of an axis with as few decimals as possible, at most two.
pub(super) fn tick(value: f64) -> String {
    let text = format!("{value:.2}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" {
        "0".to_owned()
    } else {
        short.to_owned()
    }
}

/// Returns the smallest value at the top of an axis with four steps for which the labels of [`tick`] are exact.
pub(super) fn top(most: f64) -> f64 {
    let tenth = 10_f64.powf(most.max(0.01).log10().floor());
    let steps = [1.0, 1.2, 1.6, 2.0, 2.4, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
    let fits = steps.into_iter().map(|step| step * tenth).find(|value| *value >= most - 1e-9);
    fits.unwrap_or(10.0 * tenth)
}

/// Draws PCP3D of every part, with a bar for each version.
pub(super) fn bars(group: &Group, titles: &[String]) -> Html {
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
        plot.label(LEFT + slot * (part as f64 + 0.5), name);
    }
    plot.end()
}

/// Draws PCP3D against the threshold, with a curve for each version.
pub(super) fn curves(group: &Group, titles: &[String]) -> Html {
    let mut plot = Plot::new(420.0, 100.0, "%");
    let ends = group.versions.iter().filter_map(|version| version.curve.last());
    let most = ends.map(|end| end[0]).fold(0.0, f64::max);
    let most = if most > 0.0 { most } else { 1.0 };
    for (version, (title, it)) in titles.iter().zip(&group.versions).enumerate() {
        let point = |[gamma, percent]: &[f64; 2]| {
            let x = LEFT + plot.width * gamma / most;
            let y = TOP + HEIGHT * (1.0 - percent / 100.0);
            format!("{x:.1},{y:.1}")
        };
        let points: Vec<String> = it.curve.iter().map(point).collect();
        put!(
            plot.out,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"><title>{}</title></polyline>",
            points.join(" "),
            colour(version),
            title
        );
    }
    for nth in 0..=4 {
        let share = f64::from(nth) / 4.0;
        plot.label(LEFT + plot.width * share, &tick(share * most));
    }
    plot.end()
}

/// Draws the histogram of changes for one version; improvements are on the right.
pub(super) fn histogram(changes: &ChangesOf) -> Html {
    // The two bins around 0 are much higher than all others, so they are cut off.
    let far = changes
        .bins
        .iter()
        .filter(|bin| bin[0] != 0.0 && (bin[0] + width(changes)).abs() > 1e-9);
    let most = top(far.map(|far| far[1]).fold(1.0, f64::max));
    let mut plot = Plot::new(420.0, most, "%");
    let n = changes.bins.len().max(1) as f64;
    let slot = plot.width / n;
    for (nth, [edge, percent]) in changes.bins.iter().enumerate() {
        let x = LEFT + slot * nth as f64;
        let colour = if *edge < 0.0 { COLOURS[0] } else { COLOURS[2] };
        let title = format!("{edge} to {} px: {percent:.2} %", edge + width(changes));
        plot.bar([x, x + slot - 1.0], percent / most, colour, &title);
    }
    for nth in 0..=4 {
        let share = f64::from(nth) / 4.0;
        let reach = changes.bins.first().map_or(0.0, |bin| bin[0].abs());
        let at = reach * (2.0 * share - 1.0);
        plot.label(LEFT + plot.width * share, &format!("{} px", tick(at)));
    }
    plot.end()
}

fn width(changes: &ChangesOf) -> f64 {
    match changes.bins[..] {
        [a, b, ..] => b[0] - a[0],
        _ => 1.0,
    }
}
