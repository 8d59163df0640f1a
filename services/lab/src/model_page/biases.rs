//! Biases of pairs of types as a small heat map.

use fmp::Edge;

use super::colours::type_colour;
use exports::report::html::Html;
use exports::report::{html, put};

/// Draws the table. Rows are the parent's types, and columns the part's types. The colours span the largest bias in the table.
pub(super) fn table(edge: &Edge) -> Html {
    let all = || edge.bias.iter().flatten().filter(|bias| bias.is_finite());
    let largest = all().fold(0.0_f64, |largest, it| largest.max(it.abs()));
    let n_own = edge.bias.first().map_or(0, Vec::len);
    let mut out = html!("<figure><table class=\"biases\"><tr><th></th>");
    for own in 0..n_own {
        put!(
            out,
            "<th><span class=\"key\" style=\"background:{}\"></span>{}</th>",
            type_colour(own),
            own + 1
        );
    }
    put!(out, "</tr>\n");
    for (parent, row) in edge.bias.iter().enumerate() {
        put!(out, "<tr><th>{}</th>", parent + 1);
        for &bias in row {
            put!(out, "{}", cell(bias, largest));
        }
        put!(out, "</tr>\n");
    }
    put!(
        out,
        "</table><figcaption>biases: parent's type in rows, own type in columns</figcaption></figure>\n"
    );
    out
}

fn cell(bias: f64, largest: f64) -> Html {
    if !bias.is_finite() {
        return html!("<td style=\"background:#eef0f3;color:#a0a6b0\">never</td>");
    }
    let share = if largest > 0.0 { bias / largest } else { 0.0 };
    let fade = |full: f64| (255.0 + (full - 255.0) * share.abs()).round() as u8;
    let full = if share > 0.0 {
        [209.0, 73.0, 91.0]
    } else {
        [66.0, 105.0, 208.0]
    };
    let [r, g, b] = full.map(fade);
    let ink = if share.abs() > 0.6 { "#fff" } else { "#1d2430" };
    html!(
        "<td style=\"background:rgb({r},{g},{b});color:{ink}\">{bias:.3}</td>",
        [r, g, b, ink, bias]
    )
}
