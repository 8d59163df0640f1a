//! Tests of the content of the page, and that it sends no request.

#![expect(clippy::print_stderr, reason = "a test that cannot run says so")]

use serde_json::Value;

use super::*;

fn page() -> Page {
    let moment = |frame: u64, gone: Option<&str>| Moment {
        frame,
        seconds: frame as f64 / 5.0,
        found: vec![Some([0.0, 0.0, 1.7]), None],
        truth: vec![[0.001, 0.0, 1.75], [0.0, 0.0, 0.9]],
        views: vec![None, gone.map(str::to_owned)],
    };
    let eye = |name: &str| Eye {
        name: name.to_owned(),
        at: [4.0, 0.0, 1.5],
        axis: [-1.0, 0.0, 0.0],
    };
    let limit = |what: &str, held| Limit {
        what: what.to_owned(),
        asked: "at least 1".to_owned(),
        got: "2".to_owned(),
        held,
    };
    Page {
        title: "A <run>".to_owned(),
        lead: "Nobody & nothing".to_owned(),
        verdict: None,
        limits: vec![limit("results", true), limit("pause", false)],
        space: Space {
            joints: vec!["head".to_owned(), "left hip".to_owned()],
            limbs: vec![(0, 1)],
            eyes: vec![eye("c1"), eye("</script>")],
            up: [0.0, 0.0, 1.0],
            moments: vec![moment(0, None), moment(4, Some("process lost"))],
        },
        marks: vec![Mark {
            seconds: 0.4,
            what: "killed".to_owned(),
        }],
        tables: vec![Table {
            heading: "Latency".to_owned(),
            note: String::new(),
            columns: vec!["stage".to_owned(), "p50".to_owned()],
            rows: vec![vec!["pose".to_owned(), "12.0".to_owned()]],
        }],
        legend: "Skeletons".to_owned(),
        strips: vec![Strip {
            caption: "frame 4".to_owned(),
            pictures: vec![
                Picture {
                    caption: "c1".to_owned(),
                    jpeg: Ok(vec![255, 216]),
                },
                Picture {
                    caption: "c2".to_owned(),
                    jpeg: Err("process lost".to_owned()),
                },
            ],
        }],
    }
}

#[test]
fn the_page_loads_nothing_external() {
    let html = html(&page());
    for outside in ["http:", "https:", "url(", "@import", "<link", "<iframe"] {
        assert!(!html.contains(outside), "{outside}");
    }
    let sources = html
        .match_indices("src=\"")
        .map(|match_index| &html[match_index.0 + 5..match_index.0 + 10]);
    assert_eq!(sources.collect::<Vec<_>>(), ["data:"]);
    assert!(html.contains("default-src 'none'"));
    testkit::chromium::check_in_browser(&html);
}

#[test]
fn the_data_of_the_script_are_the_joints_in_millimetres() {
    let html = html(&page());
    let begin = html.find("id=\"data\">").unwrap() + 10;
    let end = begin + html[begin..].find("</script>").unwrap();
    let data: Value = serde_json::from_str(&html[begin..end]).unwrap();
    assert_eq!(
        data["moments"][1]["truth"][0],
        serde_json::json!([1, 0, 1750])
    );
    assert_eq!(data["moments"][1]["found"][1], Value::Null);
    assert_eq!(data["moments"][1]["views"][1], "process lost");
    assert_eq!(data["eyes"][1]["name"], "</script>");
    let scripts = html.matches("</script>").count();
    assert_eq!(scripts, 2, "a name has ended the script");
}

#[test]
fn a_missed_limit_is_shown_at_the_top_and_in_its_row() {
    let missed = html(&page());
    assert!(missed.contains("1 of 2 limits missed"));
    assert_eq!(missed.matches("<td class=\"missed\">").count(), 1);
    let mut good = page();
    good.limits[1].held = true;
    assert!(html(&good).contains("All 2 limits held"));
}

#[test]
fn an_absent_view_is_shown_in_the_timeline_and_among_the_pictures() {
    let html = html(&page());
    assert_eq!(html.matches("class=\"there\"").count(), 3);
    assert_eq!(html.matches("class=\"gone\"").count(), 1);
    assert!(html.contains("<div class=\"none\">c2: process lost</div>"));
    assert!(html.contains("A &lt;run&gt;"));
}

#[test]
fn every_element_that_the_script_uses_exists() {
    let html = html(&page());
    let asked = SCRIPT.split("element(\"").skip(1);
    let names = asked.map(|rest| rest.split('"').next().unwrap());
    for name in names {
        assert!(html.contains(&format!("id=\"{name}\"")), "{name}");
    }
}

#[test]
fn events_are_shown_before_settings_and_no_row_is_empty() {
    let html = html(&page());
    let at = |what: &str| html.find(what).unwrap();
    assert!(at("class=\"verdict") < at("<canvas") && at("<canvas") < at("<h2>Limits"));
    assert!(at("class=\"time\"") < at("<h2>Limits"));
    let mut bare = page();
    bare.tables[0].columns = vec![String::new(); 2];
    let bare = super::html(&bare);
    let table = &bare[bare.find("<h2>Latency").unwrap()..];
    assert!(!table.contains("<th>"), "a row without a word");
}

#[test]
fn the_page_follows_the_dark_mode_of_the_browser_and_wide_parts_scroll() {
    let dark = STYLE.split("prefers-color-scheme: dark").nth(1).unwrap();
    let dark = &dark[..dark.find("}\n}").unwrap()];
    for colour in STYLE[..STYLE.find('}').unwrap()].split("--").skip(1) {
        let name = colour.split(':').next().unwrap();
        assert!(
            dark.contains(&format!("--{name}:")),
            "{name} has no dark tone"
        );
    }
    // No colour of the page is fixed except that of the stage, which is dark in both styles.
    let rules = STYLE.split("}\n}\n").nth(1).unwrap();
    assert_eq!(
        rules.matches('#').count(),
        rules.matches("#space").count() + rules.matches("#said").count() + 1
    );
    let html = html(&page());
    for table in html.match_indices("<table>") {
        assert!(
            html[..table.0].ends_with("<div class=\"scroll\">"),
            "a table that cannot be scrolled"
        );
    }
    assert!(html.contains("width=device-width"));
}

#[test]
fn no_element_is_wider_than_a_telephone_screen() {
    let folder = tempfile::tempdir().unwrap();
    let mut page = page();
    page.lead = "capture-0, ".repeat(40) + &"x".repeat(200);
    page.tables[0].columns = vec!["a column of some width".to_owned(); 9];
    page.strips[0].pictures.extend(vec![
        Picture {
            caption: "c3".to_owned(),
            jpeg: Err("process lost".to_owned()),
        };
        3
    ]);
    for width in [320, 420] {
        match testkit::browser::too_wide(&html(&page), folder.path(), width).unwrap() {
            Some(wide) => assert_eq!(wide, Vec::<String>::new(), "beyond {width} pixels"),
            None => eprintln!("skipped: no browser is installed"),
        }
    }
}

#[test]
fn no_text_of_the_page_becomes_markup() {
    let evil = || "<script>'\"&".to_owned();
    let mut page = page();
    page.title = evil();
    page.lead = evil();
    page.legend = evil();
    for limit in &mut page.limits {
        (limit.what, limit.asked, limit.got) = (evil(), evil(), evil());
    }
    page.space.joints = vec![evil(); 2];
    for eye in &mut page.space.eyes {
        eye.name = evil();
    }
    page.space.moments[0].views[0] = Some(evil());
    page.marks[0].what = evil();
    let table = &mut page.tables[0];
    (table.heading, table.note) = (evil(), evil());
    table.columns = vec![evil(); 2];
    table.rows = vec![vec![evil(); 2]];
    page.strips[0].caption = evil();
    for picture in &mut page.strips[0].pictures {
        picture.caption = evil();
        if picture.jpeg.is_err() {
            picture.jpeg = Err(evil());
        }
    }
    let html = html(&page);
    // The two scripts are the data and the script of the page itself.
    assert_eq!(html.matches("<script").count(), 2);
    // The expected count consists of: the title twice, lead, legend, 2 limits of 3, 2 cameras, a view's absence, a mark, 6 of the table,
    // the strip, and its pictures: one with a name, and one with a name and the reason for its absence.
    let escaped = html.matches("&lt;script&gt;&#39;&quot;&amp;").count();
    assert_eq!(escaped, 2 + 2 + 6 + 2 + 1 + 1 + 6 + 1 + 3);
}
