//! A model shown and explained on one HTML page: its filters, tree, springs, biases and numbers.
//!
//! The page has no script. It is also well-formed XML, so the tests read it as XML.

mod biases;
mod colours;
mod figure;
mod glyph;
mod springs;

use fmp::{Model, files::describe};

use exports::report::html::{Html, STYLE};
use exports::report::{html, put};
use figure::Figure;

/// Draws a model. The page shows:
///
/// * Every filter as a glyph: for each cell, the positive weights of its nine orientations, as strokes along the edges that they respond
///   to.
/// * The whole body in an ordinary posture, drawn twice: as filters, and as a tree with springs. A spring is drawn as the ellipse on which
///   the score is [`SPRING_COST`] below the best score.
/// * For each part, the springs of all types and the biases of all pairs of types.
///
/// Parts and types are counted from 1, as in everything that users see.
pub fn html(model: &Model) -> String {
    let title = &model.spec().name;
    let figure = Figure::new(model);
    let mut page = html!("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n");
    put!(page, "<meta charset=\"utf-8\"/>\n");
    put!(
        page,
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
    );
    put!(
        page,
        "<title>{title}</title>\n<style>{}{}</style>\n",
        [title],
        Html::constant(STYLE),
        Html::constant(MORE_STYLE)
    );
    put!(page, "</head>\n<body>\n<h1>{title}</h1>\n", [title]);
    put!(page, "{}", numbers(model));
    put!(page, "{}", glyph::symbols(model));
    put!(page, "<h2>The body</h2>\n<div class=\"row\">\n");
    put!(page, "{}", figure.filters(model));
    put!(page, "{}", figure.tree(model));
    put!(page, "</div>\n");
    put!(page, "{}", Html::constant(LEGEND));
    put!(page, "<h2>The parts</h2>\n");
    for part in 0..model.n_parts() {
        put!(page, "{}", card(model, part));
    }
    put!(page, "</body>\n</html>\n");
    page.into_page()
}

/// Loss of score at the ellipse that is drawn for a spring.
pub const SPRING_COST: f64 = 0.05;

/// Styles of this page, in addition to the common styles.
const MORE_STYLE: &str = "
body { max-width: 84em; }
h3 { margin: 0 0 .5em; }
h3 small { font-weight: normal; margin-left: .6em; }
.numbers { display: flex; flex-wrap: wrap; gap: .6em; margin: 0; padding: 0; list-style: none; }
.numbers li { background: var(--card); border: 1px solid var(--line); border-radius: 6px; padding: .35em .8em; }
.numbers b { display: block; font-size: 1.15em; }
.numbers span, figcaption, .legend { color: var(--quiet); font-size: .86em; }
.legend { max-width: 62em; }
.row { display: flex; flex-wrap: wrap; gap: 1.2em; align-items: flex-start; }
.card { background: var(--card); border: 1px solid var(--line); border-radius: 8px; padding: .9em 1.1em; margin: 0 0 .9em; break-inside: avoid; }
figure { margin: 0; max-width: 100%; overflow-x: auto; }
figcaption { margin-top: .25em; text-align: center; }
svg { display: block; }
.hidden { position: absolute; width: 0; height: 0; }
.dark { background: #0d1117; border-radius: 5px; }
.light { background: #fff; border: 1px solid #e6e9ee; border-radius: 5px; }
.key { display: inline-block; width: .75em; height: .75em; border-radius: 50%; margin-right: .3em; }
table.biases td { min-width: 2.7em; height: 1.75em; padding: 0 .2em; text-align: center; font-size: .72em; border: 1px solid var(--card); }
table.biases th { font-size: .72em; font-weight: normal; color: var(--quiet); padding: 0 .35em; border: 0; }
";

const LEGEND: &str = "<p class=\"legend\">Glyphs: a stroke is an edge that the filter responds to; brighter strokes have larger weights \
(the sum of the positive weights with both contrasts and without contrast, relative to the filter's largest). Left: the filters in an ordinary posture, \
each part at the rest position of its spring. Each part has the type whose rest position is nearest to the mean of all its types. Right: the same tree. \
On the ellipse of a part, its spring costs 0.05; dots are the rest positions of other types. The axes of the springs show the distance from the parent (the cross), in cells.</p>\n";

fn numbers(model: &Model) -> Html {
    let summary = describe(model);
    let [rows, cols] = model.max_filter();
    let [low, high] = summary.bias_range.unwrap_or([0.0; 2]);
    let kind = if summary.springs_per_pair {
        "pair of types"
    } else {
        "type of the child"
    };
    let mirror = if summary.has_mirror {
        "known"
    } else {
        "unknown"
    };
    let items = [
        ("parts", model.n_parts().to_string()),
        ("filters", summary.n_filters.to_string()),
        ("largest filter, cells", format!("{rows} \u{d7} {cols}")),
        ("cell, px", summary.cell_px.to_string()),
        ("levels per octave", summary.interval.to_string()),
        ("root bias", format!("{:.4}", summary.root_bias)),
        ("trained threshold", format!("{:.4}", summary.threshold)),
        (
            "detection threshold",
            format!("{:.4}", summary.detection_threshold),
        ),
        ("biases", format!("{low:.3} to {high:.3}")),
        ("one spring per", kind.to_owned()),
        ("mirror", mirror.to_owned()),
    ];
    let mut out = html!("<ul class=\"numbers\">\n");
    for (name, value) in items {
        put!(
            out,
            "<li><b>{value}</b><span>{name}</span></li>\n",
            [value, name]
        );
    }
    put!(out, "</ul>\n");
    out
}

/// Draws the card of one part.
fn card(model: &Model, part: usize) -> Html {
    let spec = &model.spec().parts[part];
    let n_types = model.n_types(part);
    let parent = spec.edge.as_ref().map_or("the root".to_owned(), |edge| {
        let name = &model.spec().parts[edge.parent].name;
        format!("child of {} {name}", edge.parent + 1)
    });
    let s = if n_types == 1 { "" } else { "s" };
    let mut out = html!(
        "<section class=\"card\">\n<h3>{} {}<small>{parent}, {n_types} type{s}</small></h3>\n<div class=\"row\">\n",
        [parent, n_types, s],
        part + 1,
        spec.name
    );
    for mixture in 0..n_types {
        put!(out, "<div>\n");
        put!(out, "{}", glyph::of_type(model, part, mixture));
        put!(out, "</div>\n");
    }
    if let Some(edge) = &spec.edge {
        put!(out, "{}", springs::panel(edge));
        put!(out, "{}", biases::table(edge));
    }
    put!(out, "</div>\n</section>\n");
    out
}

#[cfg(test)]
mod tests;
