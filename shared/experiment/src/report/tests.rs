//! The report of made-up numbers.

#![expect(clippy::print_stderr, reason = "a test that cannot run says so")]

use evaluation::{Bootstrap, SEGMENT_NAMES};

use super::figure::{tick, top};
use super::{Page, escape, html, latex};
use crate::{FrameScore, Measured, Summary, Version, summarise};

fn made_up() -> (Summary, Vec<Version>) {
    let versions: Vec<Version> = ["fmp", "geometry", "geometry+all-views"]
        .map(|it| it.parse().unwrap())
        .to_vec();
    let score = |error: f64| FrameScore {
        segments: vec![Some(error); 12],
        joints_m: vec![Some(0.1 * error); 14],
        views: vec![Some((Some([[10.0 * error, 0.0]; 14]), [[0.0; 2]; 14]))],
        iterations: vec![4],
        ..FrameScore::default()
    };
    let measured = |subject: &str| Measured {
        dataset: "HumanEva".to_owned(),
        subject: subject.to_owned(),
        action: "Box".to_owned(),
        scores: vec![[0.7, 0.45, 0.3].map(score).to_vec(); 5],
    };
    let names: Vec<String> = versions.iter().map(ToString::to_string).collect();
    let summary = summarise(
        &[measured("S1"), measured("S2")],
        &names,
        &Bootstrap::default(),
    );
    (summary, versions)
}

#[test]
fn the_page_holds_every_table_and_figure_and_needs_nothing_else() {
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
        "iterations until settled",
        "<polyline",
    ] {
        assert!(page.contains(text), "{text}");
    }
    // Bars, curves, and a histogram for each version but the first.
    assert_eq!(page.matches("<svg").count(), page.matches("</svg>").count());
    assert_eq!(page.matches("<svg").count(), 2 + 2);
    for outside in ["http:", "https:", "src=", "@import", "NaN", "inf"] {
        assert!(!page.contains(outside), "{outside}");
    }
}

#[test]
fn the_tables_have_our_numbers_and_the_papers() {
    let (summary, versions) = made_up();
    let text = latex(&summary, &versions);
    assert!(
        text.contains("HumanEva & S1 & Box & 0.00 (77.34) & 100.00 (82.70) & 100.00 \\\\"),
        "{text}"
    );
    assert!(text.contains("HumanEva & All & Box & 0.00 (67.14)"));
    assert_eq!(text.matches("\\begin{table}").count(), 2);
}

#[test]
fn text_means_itself() {
    assert_eq!(
        escape("<a href=\"x\">&"),
        "&lt;a href=&quot;x&quot;&gt;&amp;"
    );
}

#[test]
fn what_stands_beside_an_axis_is_what_it_means() {
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
            let said: f64 = tick(value).parse().unwrap();
            assert!((said - value).abs() < 1e-9, "{value} is called {said}");
        }
    }
}

#[test]
fn the_page_looks_like_that_of_a_run_and_is_no_wider_than_a_telephone() {
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
    assert!(page.contains(runpage::STYLE));
    let folder = tempfile::tempdir().unwrap();
    match testkit::browser::too_wide(&page, folder.path(), 420).unwrap() {
        Some(wide) => assert_eq!(wide, Vec::<String>::new()),
        None => eprintln!("skipped: no browser is installed"),
    }
}
