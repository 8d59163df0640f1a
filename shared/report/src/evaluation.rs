//! An evaluation as one HTML page: what was run, the tables with the paper's numbers beside ours, the figures.

mod figure;
mod pictures;

use experiment::{Group, Numbers, Summary, Version, number, overall, published};

use crate::html::{STYLE, escaped, put};
use figure::{bars, colour, curves, histogram};

pub use pictures::pictures_html;

/// The content of the page.
#[derive(Debug, Clone)]
pub struct Page<'a> {
    /// The numbers.
    pub summary: &'a Summary,
    /// The versions of the summary.
    pub versions: &'a [Version],
    /// What was run: key and value.
    pub about: &'a [(String, String)],
}

/// One self-contained page.
pub fn html(page: &Page<'_>) -> String {
    let titles: Vec<String> = page.versions.iter().map(|it| it.title()).collect();
    let mut out = head();
    about_table(&mut out, page.about);
    out.push_str("<p class=\"key\">");
    for (version, title) in titles.iter().enumerate() {
        put(
            &mut out,
            format_args!(
                "<b><span style=\"background:{}\"></span>{}</b>",
                colour(version),
                escaped(title)
            ),
        );
    }
    out.push_str("</p>\n");
    scores(&mut out, page, &titles);
    for group in overall(page.summary) {
        put(
            &mut out,
            format_args!(
                "<h2>{}, {} {}</h2>\n",
                escaped(&group.dataset),
                escaped(&group.subject),
                escaped(&group.action)
            ),
        );
        measures(&mut out, group, &titles);
        figures(&mut out, group, &titles);
    }
    predictions(&mut out, page.summary);
    out.push_str("</html>\n");
    out
}

/// The beginning of a page, up to its heading.
fn head() -> String {
    let mut out = String::from("<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\">\n");
    out.push_str("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
    out.push_str("<title>Parallax: evaluation</title>\n<style>\n");
    out.push_str(STYLE);
    out.push_str("</style>\n<h1>Parallax: evaluation</h1>\n");
    out
}

/// What was run: key and value.
fn about_table(out: &mut String, about: &[(String, String)]) {
    out.push_str("<div class=\"scroll\"><table>\n");
    for (key, value) in about {
        put(
            out,
            format_args!(
                "<tr><td>{}</td><td class=\"name\">{}</td></tr>\n",
                escaped(key),
                escaped(value)
            ),
        );
    }
    out.push_str("</table></div>\n");
}

/// The paper's main tables: PCP3D by group, with the published values.
fn scores(out: &mut String, page: &Page<'_>, titles: &[String]) {
    let confidence = 100.0 * page.summary.confidence;
    put(
        out,
        format_args!(
            "<h2>PCP3D at 0.5, %</h2>\n<p><small>Below: the {confidence:.0} % interval over frames, and what the \
         paper prints.</small></p>\n<div class=\"scroll\"><table>\n<tr><th>data set<th class=\"name\">subject\
         <th class=\"name\">sequence<th>frames"
        ),
    );
    for title in titles {
        put(out, format_args!("<th>{}", escaped(title)));
    }
    out.push_str("</tr>\n");
    for group in &page.summary.groups {
        let names = [&group.dataset, &group.subject, &group.action].map(|it| escaped(it));
        put(
            out,
            format_args!(
                "<tr><td>{}<td class=\"name\">{}<td class=\"name\">{}<td>{}",
                names[0], names[1], names[2], group.frames
            ),
        );
        for (version, it) in page.versions.iter().zip(&group.versions) {
            put(
                out,
                format_args!(
                    "<td>{}{}",
                    number(it.pcp3d, 2),
                    interval(it.pcp3d_interval, 1)
                ),
            );
            let of = published(&group.dataset, &group.subject, &group.action, *version);
            if let Some(theirs) = of {
                put(out, format_args!("<br><small>paper {theirs:.2}</small>"));
            }
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</table></div>\n");
}

fn interval(ends: Option<[f64; 2]>, digits: usize) -> String {
    ends.map_or_else(String::new, |[low, high]| {
        format!("<br><small>{low:.digits$} to {high:.digits$}</small>")
    })
}

/// All other measures of a group, a column for each version.
fn measures(out: &mut String, group: &Group, titles: &[String]) {
    type Cell = fn(&Numbers) -> String;
    let rows: [(&str, Cell); 16] = [
        ("PCP3D at 0.5, %", |it| {
            number(it.pcp3d, 2) + &interval(it.pcp3d_interval, 2)
        }),
        ("gain over the first, points", |it| {
            number(it.gain, 2) + &interval(it.gain_interval, 2)
        }),
        ("MPJPE, mm", |it| {
            number(it.mpjpe_mm, 1) + &interval(it.mpjpe_interval, 1)
        }),
        ("MPJPE after alignment, mm", |it| {
            number(it.aligned_mpjpe_mm, 1)
        }),
        ("joints within 150 mm, %", |it| number(it.pck3d, 1)),
        ("joints not found, %", |it| number(it.lost, 2)),
        ("images: PCP, %", |it| number(it.pcp2d, 1)),
        ("images: PCK at 0.1, %", |it| {
            number(it.pck2d.map(|it| it[0]), 1)
        }),
        ("images: PCK at 0.2, %", |it| {
            number(it.pck2d.map(|it| it[1]), 1)
        }),
        ("iterations until settled", |it| number(it.iterations, 2)),
        ("not settled, %", |it| number(it.unsettled, 2)),
        ("solutions a frame", |it| number(it.solutions, 1)),
        ("terms switched off, %", |it| number(it.off, 1)),
        ("joints in images improved, %", |it| {
            number(Some(it.changes.improved), 1)
        }),
        ("deteriorated, %", |it| {
            number(Some(it.changes.deteriorated), 1)
        }),
        ("deteriorated by more than 5 px, %", |it| {
            number(Some(it.changes.deteriorated_5px), 2)
        }),
    ];
    out.push_str("<div class=\"scroll\"><table>\n<tr><th>");
    for title in titles {
        put(out, format_args!("<th>{}", escaped(title)));
    }
    out.push_str("</tr>\n");
    for (name, cell) in rows {
        put(out, format_args!("<tr><td>{name}"));
        for it in &group.versions {
            put(out, format_args!("<td>{}", cell(it)));
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</table></div>\n");
}

/// Quality of the expected errors.
fn predictions(out: &mut String, summary: &Summary) {
    if summary.predictions.is_empty() {
        return;
    }
    out.push_str(
        "<h2>Expected errors</h2>\n<p><small>Views: those judged. Above: the true error exceeds the threshold. \
         Area: under the ROC of that, by the expected error; 0.5 tells nothing. Correlation: of ranks \
         (Spearman).</small></p>\n<div class=\"scroll\"><table>\n<tr><th>part<th>views<th>above, %<th>of \
         these switched off, %<th>of the others, %<th>area<th>correlation</tr>\n",
    );
    for it in &summary.predictions {
        put(
            out,
            format_args!(
                "<tr><td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}</tr>\n",
                escaped(&it.part),
                it.n,
                number(it.above, 1),
                number(it.caught, 1),
                number(it.wasted, 1),
                number(it.auc, 3),
                number(it.rank_correlation, 3)
            ),
        );
    }
    out.push_str("</table></div>\n");
}

fn figures(out: &mut String, group: &Group, titles: &[String]) {
    put(
        out,
        format_args!(
            "<h3>PCP3D of every part</h3>\n<div class=\"scroll\">{}</div>\n\
         <h3>PCP3D over the threshold</h3>\n{}\n",
            bars(group, titles),
            curves(group, titles)
        ),
    );
    for (title, it) in titles.iter().zip(&group.versions).skip(1) {
        put(
            out,
            format_args!(
                "<h3>Changes in images against {}: {}</h3>\n{}\n",
                escaped(&titles[0]),
                escaped(title),
                histogram(&it.changes)
            ),
        );
    }
}

#[cfg(test)]
mod tests;
