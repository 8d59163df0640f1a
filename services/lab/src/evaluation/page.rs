//! An evaluation as one HTML page: a description of the run, tables with our numbers beside those of the paper, and figures.

mod figure;
mod pictures;

use crate::evaluation::{Group, Numbers, Summary, Version, number, overall, published};

use exports::report::html::Html;
use exports::report::parts::{about_table, begin};
use exports::report::{html, put};
use figure::{bars, colour, curves, histogram};

pub use pictures::pictures_html;

/// Content of the page.
#[derive(Debug, Clone)]
pub struct Page<'a> {
    /// The numbers to show.
    pub summary: &'a Summary,
    /// The versions in the summary.
    pub versions: &'a [Version],
    /// Description of the run, as keys and values.
    pub about: &'a [(String, String)],
}

/// Returns one self-contained page.
pub fn html(page: &Page<'_>) -> String {
    let titles: Vec<String> = page.versions.iter().map(|version| version.title()).collect();
    let mut out = begin("Parallax: evaluation");
    about_table(&mut out, page.about);
    put!(out, "<p class=\"key\">");
    for (version, title) in titles.iter().enumerate() {
        put!(
            out,
            "<b><span style=\"background:{}\"></span>{}</b>",
            colour(version),
            title
        );
    }
    put!(out, "</p>\n");
    scores(&mut out, page, &titles);
    for group in overall(page.summary) {
        put!(
            out,
            "<h2>{}, {} {}</h2>\n",
            group.dataset,
            group.subject,
            group.action
        );
        measures(&mut out, group, &titles);
        figures(&mut out, group, &titles);
    }
    predictions(&mut out, page.summary);
    put!(out, "</html>\n");
    out.into_page()
}

/// Adds the paper's main tables: PCP3D by group, with the published values.
fn scores(out: &mut Html, page: &Page<'_>, titles: &[String]) {
    let confidence = 100.0 * page.summary.confidence;
    put!(
        out,
        "<h2>PCP3D at 0.5, %</h2>\n<p><small>The small numbers are the {confidence:.0} % interval over frames, and the \
         value in the paper.</small></p>\n<div class=\"scroll\"><table>\n<tr><th>data set<th class=\"name\">subject\
         <th class=\"name\">sequence<th>frames",
        [confidence]
    );
    for title in titles {
        put!(out, "<th>{}", title);
    }
    put!(out, "</tr>\n");
    for group in &page.summary.groups {
        put!(
            out,
            "<tr><td>{}<td class=\"name\">{}<td class=\"name\">{}<td>{}",
            group.dataset,
            group.subject,
            group.action,
            group.frames
        );
        for (version, it) in page.versions.iter().zip(&group.versions) {
            put!(
                out,
                "<td>{}{}",
                number(it.pcp3d, 2),
                interval(it.pcp3d_interval, 1)
            );
            let of = published(&group.dataset, &group.subject, &group.action, *version);
            if let Some(theirs) = of {
                put!(out, "<br><small>paper {theirs:.2}</small>", [theirs]);
            }
        }
        put!(out, "</tr>\n");
    }
    put!(out, "</table></div>\n");
}

fn interval(ends: Option<[f64; 2]>, digits: usize) -> Html {
    ends.map_or_else(Html::default, |[low, high]| {
        let [low, high] = [low, high].map(|end| format!("{end:.digits$}"));
        html!("<br><small>{low} to {high}</small>", [low, high])
    })
}

/// Adds all other measures of a group, with a column for each version.
fn measures(out: &mut Html, group: &Group, titles: &[String]) {
    /// Returns a number, its interval, and the number of decimals of both.
    type Cell = fn(&Numbers) -> (Option<f64>, Option<[f64; 2]>, usize);
    let rows: [(&str, Cell); 17] = [
        ("PCP3D at 0.5, %", |own| (own.pcp3d, own.pcp3d_interval, 2)),
        ("gain over the first version, points", |own| {
            (own.gain, own.gain_interval, 2)
        }),
        ("MPJPE, mm", |own| (own.mpjpe_mm, own.mpjpe_interval, 1)),
        ("MPJPE after alignment, mm", |own| {
            (own.aligned_mpjpe_mm, None, 1)
        }),
        ("left and right swapped, %", |own| {
            (own.exchanged, own.exchanged_interval, 1)
        }),
        ("joints within 150 mm, %", |own| (own.pck3d, None, 1)),
        ("joints not found, %", |own| (own.lost, None, 2)),
        ("images: PCP, %", |own| (own.pcp2d, None, 1)),
        ("images: PCK at 0.1, %", |own| {
            (own.pck2d.map(|pck2d| pck2d[0]), None, 1)
        }),
        ("images: PCK at 0.2, %", |own| {
            (own.pck2d.map(|pck2d| pck2d[1]), None, 1)
        }),
        ("iterations until convergence", |own| {
            (own.iterations, None, 2)
        }),
        ("not converged, %", |own| (own.unsettled, None, 2)),
        ("solutions per frame", |own| (own.solutions, None, 1)),
        ("terms switched off, %", |own| (own.off, None, 1)),
        ("joints in images improved, %", |own| {
            (Some(own.changes.improved), None, 1)
        }),
        ("deteriorated, %", |own| {
            (Some(own.changes.deteriorated), None, 1)
        }),
        ("deteriorated by more than 5 px, %", |own| {
            (Some(own.changes.deteriorated_5px), None, 2)
        }),
    ];
    put!(out, "<div class=\"scroll\"><table>\n<tr><th>");
    for title in titles {
        put!(out, "<th>{}", title);
    }
    put!(out, "</tr>\n");
    for (name, cell) in rows {
        put!(out, "<tr><td>{name}", [name]);
        for it in &group.versions {
            let (value, ends, digits) = cell(it);
            put!(
                out,
                "<td>{}{}",
                number(value, digits),
                interval(ends, digits)
            );
        }
        put!(out, "</tr>\n");
    }
    put!(out, "</table></div>\n");
}

/// Adds the quality of the expected errors.
fn predictions(out: &mut Html, summary: &Summary) {
    if summary.predictions.is_empty() {
        return;
    }
    put!(
        out,
        "<h2>Expected errors</h2>\n<p><small>Views: evaluated views. Above: fraction of the parts whose true error exceeds the \
         threshold. \
         Area: area under the ROC curve for predicting this from the expected error; 0.5 means no information. Correlation: Spearman's rank \
         correlation.</small></p>\n<div class=\"scroll\"><table>\n<tr><th>part<th>views<th>above, %<th>of \
         these switched off, %<th>of the others, %<th>area<th>correlation</tr>\n"
    );
    for it in &summary.predictions {
        put!(
            out,
            "<tr><td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}</tr>\n",
            it.part,
            it.n,
            number(it.above, 1),
            number(it.caught, 1),
            number(it.wasted, 1),
            number(it.auc, 3),
            number(it.rank_correlation, 3)
        );
    }
    put!(out, "</table></div>\n");
}

fn figures(out: &mut Html, group: &Group, titles: &[String]) {
    put!(
        out,
        "<h3>PCP3D of every part</h3>\n<div class=\"scroll\">{}</div>\n\
         <h3>PCP3D over the threshold</h3>\n{}\n",
        bars(group, titles),
        curves(group, titles)
    );
    for (title, it) in titles.iter().zip(&group.versions).skip(1) {
        put!(
            out,
            "<h3>Changes in images relative to {}: {}</h3>\n{}\n",
            titles[0],
            title,
            histogram(&it.changes)
        );
    }
}

#[cfg(test)]
mod tests;
