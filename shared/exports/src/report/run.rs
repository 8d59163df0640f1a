//! A run as one HTML page: limits and whether they were met, the skeleton in 3D, which views contributed over time, tables, pictures.
//!
//! The policy of the page forbids every request. Two short scripts (`stage.js`, `space.js`) draw the skeleton on a canvas, which can be
//! dragged to rotate it, played, paused and stepped.

mod space;
mod timeline;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use crate::report::html::{Html, STYLE, html, put};

pub use space::{Eye, Moment, Point, Space};
pub use timeline::Mark;

/// Content of the page.
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    /// Title of the page.
    pub title: String,
    /// Sentences under the title.
    pub lead: String,
    /// First line of the page; if not given, a statement of whether all limits were met.
    pub verdict: Option<Verdict>,
    /// Limits that were set for the run.
    pub limits: Vec<Limit>,
    /// The skeleton in space.
    pub space: Space,
    /// Events and their times.
    pub marks: Vec<Mark>,
    /// Tables of numbers.
    pub tables: Vec<Table>,
    /// Sentences about the pictures.
    pub legend: String,
    /// Rows of pictures.
    pub strips: Vec<Strip>,
}

/// Judgement of a run in one line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Verdict {
    /// Text of the line.
    pub text: String,
    /// True if the judgement is good.
    pub is_good: bool,
}

/// A limit that was set for the run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Limit {
    /// Quantity that is measured.
    pub what: String,
    /// Limit that was set.
    pub asked: String,
    /// Measured value.
    pub got: String,
    /// True if the limit was met.
    pub held: bool,
}

/// A table of words and numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    /// Heading of the table.
    pub heading: String,
    /// A sentence under the heading; may be empty.
    pub note: String,
    /// Headings of the columns; all empty if none are needed.
    pub columns: Vec<String>,
    /// Rows of the table.
    pub rows: Vec<Vec<String>>,
}

/// Pictures side by side, one for every view.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Strip {
    /// Caption that the pictures share.
    pub caption: String,
    /// The pictures.
    pub pictures: Vec<Picture>,
}

/// One picture, or the reason why it is missing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Name of the view.
    pub caption: String,
    /// A JPEG file, or the reason why it is missing.
    pub jpeg: Result<Vec<u8>, String>,
}

const POLICY: &str =
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'";
pub(crate) const SCRIPT: &str = concat!(include_str!("stage.js"), include_str!("run/space.js"));

/// Returns the page, which needs no other file and sends no request.
pub fn html(page: &Page) -> String {
    let mut out = html!("<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n");
    put!(
        out,
        "<meta http-equiv=\"Content-Security-Policy\" content=\"{2}\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{0}</title>\n<style>\n{3}</style>\n\
             <h1>{0}</h1>\n<p class=\"lead\">{1}</p>\n",
        page.title,
        page.lead,
        Html::constant(POLICY),
        Html::constant(STYLE)
    );
    verdict(&mut out, page);
    pictures(&mut out, page);
    space(&mut out, page);
    if !page.limits.is_empty() {
        limits(&mut out, &page.limits);
    }
    for table in &page.tables {
        tabulate(&mut out, table);
    }
    put!(
        out,
        "<script type=\"application/json\" id=\"data\">{}</script>\n<script type=\"module\">\n{}</script>\n</html>\n",
        Html::in_script(&page.space.json()),
        Html::constant(SCRIPT)
    );
    out.into_page()
}

fn verdict(out: &mut Html, page: &Page) {
    let n_limits = page.limits.len();
    let n_missed = page.limits.iter().filter(|limit| !limit.held).count();
    let of_limits = || Verdict {
        text: match n_missed {
            0 => format!("All {n_limits} limits held"),
            n => format!("{n} of {n_limits} limits missed"),
        },
        is_good: n_missed == 0,
    };
    let Verdict { text, is_good } = page.verdict.clone().unwrap_or_else(of_limits);
    let (class, verdict) = (if is_good { "held" } else { "missed" }, text);
    put!(
        out,
        "<p class=\"verdict {class}\">{verdict}</p>\n",
        [class, verdict]
    );
}

fn limits(out: &mut Html, limits: &[Limit]) {
    put!(
        out,
        "<h2>Limits</h2>\n<div class=\"scroll\"><table>\n<tr><th>limit<th>asked<th>measured<th>verdict</tr>\n"
    );
    for it in limits {
        let (class, word) = if it.held {
            ("held", "held")
        } else {
            ("missed", "missed")
        };
        put!(
            out,
            "<tr><td>{}<td>{}<td>{}<td class=\"{class}\">{word}</tr>\n",
            [class, word],
            it.what,
            it.asked,
            it.got
        );
    }
    put!(out, "</table></div>\n");
}

fn space(out: &mut Html, page: &Page) {
    let has_truth = page.space.moments.iter().any(|moment| !moment.truth.is_empty());
    let hidden = Html::constant(if has_truth { "" } else { " hidden" });
    let grey = if has_truth { "; grey: the truth" } else { "" };
    put!(
        out,
        "<h2>The skeleton in space</h2>\n\
         <canvas id=\"space\" width=\"900\" height=\"520\" role=\"img\" \
         aria-label=\"the skeleton in space\"></canvas>\n<p class=\"bar\"><button id=\"play\">pause</button> <input id=\"at\" type=\"range\" min=\"0\" value=\"0\"> \
         <label{}><input id=\"truth\" type=\"checkbox\" checked> truth</label> <span id=\"said\"></span></p>\n\
         <p class=\"note\">Drag to rotate, turn the wheel to zoom. Colours: <b class=\"right\">right</b>, \
         <b class=\"left\">left</b>, <b class=\"centre\">middle</b> of the detected body{}. \
         The squares of the floor are a metre wide; a red camera does not contribute to the frame.</p>\n\
         <h2>Cameras over time</h2>\n<div class=\"scroll\">\n",
        hidden,
        grey
    );
    put!(out, "{}", timeline::svg(&page.space, &page.marks));
    put!(
        out,
        "</div>\n<p class=\"note\">Each tick is a 3D result; it is green if the view contributed to it.</p>\n"
    );
}

fn tabulate(out: &mut Html, table: &Table) {
    put!(out, "<h2>{}</h2>\n", table.heading);
    if !table.note.is_empty() {
        put!(out, "<p class=\"note\">{}</p>\n", table.note);
    }
    put!(out, "<div class=\"scroll\"><table>\n");
    if table.columns.iter().any(|column| !column.is_empty()) {
        put!(out, "<tr>");
        for column in &table.columns {
            put!(out, "<th>{}", column);
        }
        put!(out, "</tr>\n");
    }
    for row in &table.rows {
        put!(out, "<tr>");
        for cell in row {
            put!(out, "<td>{}", cell);
        }
        put!(out, "</tr>\n");
    }
    put!(out, "</table></div>\n");
}

fn pictures(out: &mut Html, page: &Page) {
    if page.strips.is_empty() {
        return;
    }
    put!(
        out,
        "<h2>What the cameras saw</h2>\n<p class=\"note\">{}</p>\n",
        page.legend
    );
    for strip in &page.strips {
        put!(out, "<h3>{}</h3>\n<div class=\"strip\">\n", strip.caption);
        for picture in &strip.pictures {
            let name = &picture.caption;
            match &picture.jpeg {
                Ok(bytes) => {
                    let data = STANDARD.encode(bytes);
                    put!(
                        out,
                        "<img alt=\"{name}\" src=\"data:image/jpeg;base64,{data}\">\n",
                        [name, data]
                    );
                }
                Err(why) => put!(out, "<div class=\"none\">{name}: {}</div>\n", [name], why),
            }
        }
        put!(out, "</div>\n");
    }
}

#[cfg(test)]
mod tests;
