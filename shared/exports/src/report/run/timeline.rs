//! The views that contributed over time: a row for every view, a tick for every result.

use super::space::Space;
use crate::report::html::{Html, put};

/// An event during the run.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// Time of the event, in seconds since the first frame.
    pub seconds: f64,
    /// Name of the event, in a word or two.
    pub what: String,
}

const WIDTH: f64 = 900.0;
const LEFT: f64 = 60.0;
const TOP: f64 = 22.0;
const ROW: f64 = 18.0;

/// Draws the views of all results over time.
pub(crate) fn svg(space: &Space, marks: &[Mark]) -> Html {
    let times = space.moments.iter().map(|moment| moment.seconds);
    let end = times.fold(1.0, f64::max);
    let x = |seconds: f64| LEFT + WIDTH * (seconds / end).clamp(0.0, 1.0);
    let bottom = TOP + ROW * space.eyes.len() as f64;
    let size = [LEFT + WIDTH + 20.0, bottom + 24.0];
    let mut out = Html::default();
    put!(
        out,
        "<svg viewBox=\"0 0 {} {}\" role=\"img\" class=\"time\">\n",
        size[0],
        size[1]
    );
    for row in 0..space.eyes.len() {
        ticks(&mut out, space, row, &x);
    }
    for (nth, mark) in marks.iter().enumerate() {
        // If marks follow each other closely, their words are on opposite sides.
        let (class, dx) = if nth == 0 { ("end", -4.0) } else { ("", 4.0) };
        let at = x(mark.seconds);
        put!(
            out,
            "<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"4\" y2=\"{bottom}\" class=\"mark\"/>\
                 <text x=\"{:.1}\" y=\"14\" class=\"{class}\">{}</text>\n",
            [at, bottom, class],
            at + dx,
            mark.what
        );
    }
    for nth in 0..=4 {
        let seconds = end * f64::from(nth) / 4.0;
        put!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" class=\"mid\">{seconds:.1} s</text>\n",
            [seconds],
            x(seconds),
            bottom + 16.0
        );
    }
    put!(out, "</svg>\n");
    out
}

/// Draws one view: its name, and a tick for every result.
fn ticks(out: &mut Html, space: &Space, row: usize, x: &dyn Fn(f64) -> f64) {
    let y = TOP + ROW * row as f64;
    put!(
        out,
        "<text x=\"{}\" y=\"{}\" class=\"end\">{}</text>\n",
        LEFT - 8.0,
        y + 0.75 * ROW,
        space.eyes[row].name
    );
    for moment in &space.moments {
        let Some(view) = moment.views.get(row) else {
            continue;
        };
        let class = if view.is_some() { "gone" } else { "there" };
        let why = view.as_deref().unwrap_or("used");
        put!(
            out,
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"3\" height=\"{:.1}\" class=\"{class}\">\
                 <title>frame {}: {}</title></rect>\n",
            [class],
            x(moment.seconds) - 1.5,
            y + 2.0,
            ROW - 4.0,
            moment.frame,
            why
        );
    }
}
