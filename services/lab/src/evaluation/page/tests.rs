//! Tests of the report page with invented numbers.

#![expect(clippy::print_stderr, reason = "a test reports that it is skipped")]

use crate::evaluation::testing::made_up;
use crate::evaluation::{Judgement, Pictures};
use statistics::score::{Bootstrap, SEGMENT_NAMES};

use super::figure::{tick, top};
use super::*;
use exports::report::html::STYLE;

#[test]
fn the_page_is_self_contained_and_has_every_table_and_figure() {
    let (summary, versions) = made_up();
    let about = [("model".to_owned(), "a <b> & c".to_owned())];
    let page = html(&Page {
        summary: &summary,
        versions: &versions,
        about: &about,
    });
    for part in SEGMENT_NAMES {
        assert!(page.contains(part), "{part}");
    }
    for text in [
        "paper 77.34",
        "paper 69.45",
        "a &lt;b&gt; &amp; c",
        "Geom., all views",
        "iterations until convergence",
        "<polyline",
    ] {
        assert!(page.contains(text), "{text}");
    }
    // The page has bars, curves, and a histogram for each version except the first.
    assert_eq!(page.matches("<svg").count(), page.matches("</svg>").count());
    assert_eq!(page.matches("<svg").count(), 2 + 2);
    for outside in ["http:", "https:", "src=", "@import", "NaN", "inf"] {
        assert!(!page.contains(outside), "{outside}");
    }
    testkit::chromium::check_in_browser(&page);
}

#[test]
fn no_name_of_a_sequence_or_a_part_becomes_markup() {
    let (mut summary, versions) = made_up();
    let evil = || "<script>'\"&".to_owned();
    for group in &mut summary.groups {
        (group.dataset, group.subject, group.action) = (evil(), evil(), evil());
    }
    summary.predictions = vec![Judgement {
        part: evil(),
        n: 1,
        above: None,
        caught: None,
        wasted: None,
        auc: None,
        rank_correlation: None,
    }];
    let page = html(&Page {
        summary: &summary,
        versions: &versions,
        about: &[(evil(), evil())],
    });
    assert!(!page.contains("<script"));
    // The text occurs in the description of the run, in the part, in every group of the table, and in the heading of one group.
    let escaped = page.matches("&lt;script&gt;&#39;&quot;&amp;").count();
    assert_eq!(escaped, 2 + 1 + 3 * summary.groups.len() + 3);
}

#[test]
fn axis_labels_show_their_values() {
    for (value, text) in [
        (0.75, "0.75"),
        (2.25, "2.25"),
        (-12.5, "-12.5"),
        (-0.0, "0"),
        (100.0, "100"),
        (0.3, "0.3"),
    ] {
        assert_eq!(tick(value), text);
    }
    for most in 20..2000 {
        let top = top(0.05 * f64::from(most));
        assert!(
            top >= 0.05 * f64::from(most) - 1e-9 && top <= 0.1 * f64::from(most) + 1e-9,
            "{most}: {top}"
        );
        for nth in 0..=4 {
            let value = top * f64::from(nth) / 4.0;
            let label: f64 = tick(value).parse().unwrap();
            assert!((label - value).abs() < 1e-9, "{value} is labelled {label}");
        }
    }
}

#[test]
fn the_page_uses_the_style_of_run_reports_and_fits_a_telephone_screen() {
    let (summary, versions) = made_up();
    let about = [(
        "sequences".to_owned(),
        "/a/folder/with/a/name/that/is/long".repeat(9),
    )];
    let page = html(&Page {
        summary: &summary,
        versions: &versions,
        about: &about,
    });
    assert!(page.contains(STYLE));
    let folder = tempfile::tempdir().unwrap();
    match testkit::browser::too_wide(&page, folder.path(), 420).unwrap() {
        Some(wide) => assert_eq!(wide, Vec::<String>::new()),
        None => eprintln!("skipped: no browser is installed"),
    }
}

#[test]
fn the_page_for_single_pictures_shows_every_number_and_escapes_names() {
    let person =
        |x: f64| core::array::from_fn(|i| [x + 10.0 * (i % 4) as f64, 25.0 * (i / 4) as f64]);
    let (here, there) = (Some(person(0.0)), Some(person(500.0)));
    // The person is found in two of three pictures, but in one of these two, the best detection of the picture is not on the person.
    let set = Pictures {
        name: "parse & co".to_owned(),
        n_left_out: 1,
        truths: vec![person(0.0); 3],
        found: vec![[here, here], [there, here], [None, None]],
    };
    let about = [("model".to_owned(), "<m>".to_owned())];
    let page = pictures_html(&[set], &about, &Bootstrap::default());
    for text in [
        "parse &amp; co",
        "&lt;m&gt;",
        "33.3",
        "66.7",
        "within 0.2 of size",
    ] {
        assert!(page.contains(text), "{text}");
    }
}
