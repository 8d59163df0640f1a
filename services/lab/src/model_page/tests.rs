//! Tests of the page: it is complete, escaped, and needs no other file.

use fmp::{Edge, Filter, ModelSpec, N_CHANNELS, PartSpec, Spring, Springs};
use proptest::prelude::*;
use roxmltree::{Document, ParsingOptions};

use super::*;
use crate::model_page::springs::Ellipse;

const SPRING: Spring = Spring {
    w: [0.0125, 0.025, 0.05, -0.2],
    anchor: [2, 3],
};

/// Returns a model with a root and two children of two types each, with filters of 2x3 cells.
pub(crate) fn planted(name: &str) -> ModelSpec {
    let part = |part: usize| PartSpec {
        name: format!("{name} {part}"),
        filter_of_type: vec![2 * part, 2 * part + 1],
        edge: (part > 0).then(|| Edge {
            parent: 0,
            bias: vec![vec![0.5, -0.25], vec![0.0, f64::NEG_INFINITY]],
            springs: Springs::PerChildType(vec![SPRING; 2]),
        }),
    };
    let filter = |seed: usize| Filter {
        rows: 2,
        cols: 3,
        weights: (0..6 * N_CHANNELS).map(|i| ((i + 1000 * seed) as f64).sin()).collect(),
    };
    ModelSpec {
        name: name.to_owned(),
        parts: (0..3).map(part).collect(),
        filters: (0..6).map(filter).collect(),
        root_bias: -0.125,
        interval: 10,
        cell_px: 4,
        threshold: 0.1,
        mirror: None,
    }
}

fn page(spec: ModelSpec) -> String {
    html(&Model::new(spec).unwrap())
}

/// Reads the page as XML and counts the elements of a name.
fn count(page: &str, name: &str) -> usize {
    let options = ParsingOptions {
        allow_dtd: true,
        ..ParsingOptions::default()
    };
    let document = Document::parse_with_options(page, options).unwrap();
    document
        .descendants()
        .filter(|descendant| descendant.has_tag_name(name))
        .count()
}

#[test]
fn every_filter_part_and_pair_of_types_is_drawn() {
    let page = page(planted("person"));
    for filter in 0..6 {
        assert!(page.contains(&format!("id=\"f{filter}\"")));
        assert!(page.contains(&format!("<use href=\"#f{filter}\"/>")));
    }
    assert_eq!(count(&page, "section"), 3);
    assert_eq!(count(&page, "td"), 8);
    assert_eq!(page.matches(">never<").count(), 2);
    testkit::chromium::check_in_browser(&page);
}

#[test]
fn no_name_of_a_model_or_a_part_becomes_markup() {
    let page = page(planted("<script>'\"&"));
    assert!(!page.contains("<script"));
    // The text occurs twice in the title. The name of every part is in the figure and on the card of the part. The name of the parent is
    // also on the cards of its two children.
    let escaped = page.matches("&lt;script&gt;&#39;&quot;&amp;").count();
    assert_eq!(escaped, 2 + 3 + 3 + 2);
}

#[test]
fn the_page_loads_nothing_from_elsewhere() {
    let page = page(planted("person"));
    for word in ["<script", "http", "@import", "url(", "src="] {
        assert!(!page.contains(word), "{word}");
    }
}

#[test]
fn the_same_model_gives_the_same_page() {
    assert_eq!(page(planted("a")), page(planted("a")));
}

#[test]
fn the_ellipse_is_drawn_at_the_stated_spring_cost() {
    let ellipse = Ellipse::of(&SPRING);
    assert_eq!(ellipse.centre, [3.0, 1.0]);
    let cost = |at: [f64; 2]| {
        let [dx, dy] = [0, 1].map(|i| f64::from(SPRING.anchor[i]) - at[i]);
        let [a, b, c, d] = SPRING.w;
        a * dx * dx + b * dx + c * dy * dy + d * dy
    };
    let [x, y] = ellipse.centre;
    let least = cost([x, y]);
    for at in [[x + ellipse.radius[0], y], [x, y - ellipse.radius[1]]] {
        assert!((cost(at) - least - SPRING_COST).abs() < 1e-12);
    }
}

#[test]
fn a_filter_for_vertical_edges_is_drawn_with_vertical_strokes() {
    let mut spec = planted("person");
    for filter in &mut spec.filters {
        filter.weights.fill(-1.0);
        // A gradient along x.
        filter.weights[0] = 1.0;
    }
    assert!(page(spec).contains("d=\"M5.0 0.2L5.0 9.8\""));
}

#[test]
fn a_filter_without_positive_weights_is_an_empty_glyph() {
    let mut spec = planted("person");
    spec.filters[0].weights.fill(-1.0);
    assert!(page(spec).contains("<g id=\"f0\" stroke-linecap=\"round\"></g>"));
}

proptest! {
    #[test]
    fn no_name_breaks_the_page(name: String) {
        let page = page(planted(&name));
        prop_assert_eq!(count(&page, "section"), 3);
        prop_assert_eq!(count(&page, "h1"), 1);
    }
}
