//! A run as one HTML page: limits that held or did not, the skeleton in space, who was there when, tables, pictures.
//!
//! The page forbids every request by its policy. The view of the skeleton is a canvas that a short script of ours draws
//! (`space.js`): drag to turn, play, pause, step.

mod space;
mod timeline;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use crate::html::{STYLE, escaped, in_script, put};

pub use space::{Eye, Moment, Point, Space};
pub use timeline::Mark;

/// What the page says.
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    /// Its title.
    pub title: String,
    /// Sentences under the title.
    pub lead: String,
    /// What was asked of the run.
    pub limits: Vec<Limit>,
    /// The skeleton in space.
    pub space: Space,
    /// What happened when.
    pub marks: Vec<Mark>,
    /// Numbers.
    pub tables: Vec<Table>,
    /// Sentences about the pictures.
    pub legend: String,
    /// Pictures.
    pub strips: Vec<Strip>,
}

/// Something that was asked of the run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Limit {
    /// What is measured.
    pub what: String,
    /// What was asked.
    pub asked: String,
    /// What was measured.
    pub got: String,
    /// Whether that will do.
    pub held: bool,
}

/// A table of words and numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    /// Its heading.
    pub heading: String,
    /// A sentence under it; may be empty.
    pub note: String,
    /// The heads of its columns; all empty if there is nothing to say.
    pub columns: Vec<String>,
    /// Its rows.
    pub rows: Vec<Vec<String>>,
}

/// Pictures side by side, one for every view.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Strip {
    /// What they have in common.
    pub caption: String,
    /// The pictures.
    pub pictures: Vec<Picture>,
}

/// One picture, or why there is none.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// The view.
    pub caption: String,
    /// A JPEG file, or why there is none.
    pub jpeg: Result<Vec<u8>, String>,
}

const POLICY: &str =
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'";
const SCRIPT: &str = include_str!("run/space.js");

/// One page that needs no other file and asks for none.
pub fn html(page: &Page) -> String {
    let mut out = String::from("<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n");
    put(
        &mut out,
        format_args!(
            "<meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{0}</title>\n<style>\n{STYLE}</style>\n\
             <h1>{0}</h1>\n<p class=\"lead\">{1}</p>\n",
            escaped(&page.title),
            escaped(&page.lead)
        ),
    );
    verdict(&mut out, &page.limits);
    space(&mut out, page);
    limits(&mut out, &page.limits);
    for table in &page.tables {
        tabulate(&mut out, table);
    }
    pictures(&mut out, page);
    put(
        &mut out,
        format_args!(
            "<script type=\"application/json\" id=\"data\">{}</script>\n<script>\n{SCRIPT}</script>\n</html>\n",
            in_script(&page.space.json())
        ),
    );
    out
}

fn verdict(out: &mut String, limits: &[Limit]) {
    let n_missed = limits.iter().filter(|it| !it.held).count();
    let (class, verdict) = match n_missed {
        0 => ("held", format!("All {} limits held", limits.len())),
        n => ("missed", format!("{n} of {} limits missed", limits.len())),
    };
    put(
        out,
        format_args!("<p class=\"verdict {class}\">{verdict}</p>\n"),
    );
}

fn limits(out: &mut String, limits: &[Limit]) {
    out.push_str(
        "<h2>Limits</h2>\n<div class=\"scroll\"><table>\n<tr><th>limit<th>asked<th>measured<th>verdict</tr>\n",
    );
    for it in limits {
        let (class, word) = if it.held {
            ("held", "held")
        } else {
            ("missed", "missed")
        };
        put(
            out,
            format_args!(
                "<tr><td>{}<td>{}<td>{}<td class=\"{class}\">{word}</tr>\n",
                escaped(&it.what),
                escaped(&it.asked),
                escaped(&it.got)
            ),
        );
    }
    out.push_str("</table></div>\n");
}

fn space(out: &mut String, page: &Page) {
    out.push_str(
        "<canvas id=\"space\" width=\"900\" height=\"520\" role=\"img\" \
         aria-label=\"the skeleton in space, beside the truth\"></canvas>\n<p class=\"bar\"><button id=\"play\">pause</button> <input id=\"at\" type=\"range\" min=\"0\" value=\"0\"> \
         <label><input id=\"truth\" type=\"checkbox\" checked> truth</label> <span id=\"said\"></span></p>\n\
         <p class=\"note\">Drag to turn, wheel to come nearer. Colours: <b class=\"right\">right</b>, \
         <b class=\"left\">left</b>, <b class=\"centre\">middle</b> of the body as it was found; grey: where it is. \
         The squares of the floor are a metre wide; a red camera has no part in the frame.</p>\n\
         <h2>Who was there</h2>\n<div class=\"scroll\">\n",
    );
    out.push_str(&timeline::svg(&page.space, &page.marks));
    out.push_str(
        "</div>\n<p class=\"note\">A tick is a result in space, green where the view has a part in it.</p>\n",
    );
}

fn tabulate(out: &mut String, table: &Table) {
    put(out, format_args!("<h2>{}</h2>\n", escaped(&table.heading)));
    if !table.note.is_empty() {
        put(
            out,
            format_args!("<p class=\"note\">{}</p>\n", escaped(&table.note)),
        );
    }
    out.push_str("<div class=\"scroll\"><table>\n");
    if table.columns.iter().any(|it| !it.is_empty()) {
        out.push_str("<tr>");
        for column in &table.columns {
            put(out, format_args!("<th>{}", escaped(column)));
        }
        out.push_str("</tr>\n");
    }
    for row in &table.rows {
        out.push_str("<tr>");
        for cell in row {
            put(out, format_args!("<td>{}", escaped(cell)));
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</table></div>\n");
}

fn pictures(out: &mut String, page: &Page) {
    if page.strips.is_empty() {
        return;
    }
    put(
        out,
        format_args!(
            "<h2>What the cameras saw</h2>\n<p class=\"note\">{}</p>\n",
            escaped(&page.legend)
        ),
    );
    for strip in &page.strips {
        put(
            out,
            format_args!(
                "<h3>{}</h3>\n<div class=\"strip\">\n",
                escaped(&strip.caption)
            ),
        );
        for picture in &strip.pictures {
            let name = escaped(&picture.caption);
            match &picture.jpeg {
                Ok(bytes) => {
                    let data = STANDARD.encode(bytes);
                    put(
                        out,
                        format_args!(
                            "<img alt=\"{name}\" src=\"data:image/jpeg;base64,{data}\">\n"
                        ),
                    );
                }
                Err(why) => put(
                    out,
                    format_args!("<div class=\"none\">{name}: {}</div>\n", escaped(why)),
                ),
            }
        }
        out.push_str("</div>\n");
    }
}

#[cfg(test)]
mod tests;
