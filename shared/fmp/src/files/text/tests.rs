//! Properties and edge cases of the reader of the text format.

use proptest::prelude::*;

use super::*;
use crate::files::planted;

fn text() -> String {
    planted::as_text(&planted::three_parts())
}

fn outcome(text: &str) -> String {
    match parse(text) {
        Ok(_) => "fine".to_owned(),
        Err(TextError::Index(error)) => error.to_string(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn reads_the_planted_model() {
    assert_eq!(parse(&text()).unwrap(), planted::three_parts());
}

#[test]
fn the_published_tree_gets_its_names_and_its_mirror() {
    let text = planted::as_text(&planted::published_tree());
    let spec = parse(&text).unwrap();
    assert_eq!(spec.mirror.as_deref(), Some(&skeleton::MIRROR[..]));
    assert_eq!(spec.parts[25].name, "left ankle");
    Model::new(spec).unwrap();
    let other = text.replace(" 15 20 21 22 23 24 25 ", " 16 20 21 22 23 24 25 ");
    let spec = parse(&other).unwrap();
    assert_eq!((spec.mirror, &spec.parts[25].name[..]), (None, "part 26"));
}

#[test]
fn the_length_and_the_objective_may_be_absent() {
    let text = text();
    let [start, end] = ["len ", "thresh "].map(|name| text.find(name).unwrap());
    let without = text[..start].to_owned() + &text[end..];
    assert_eq!(outcome(&without), "fine");
    assert_eq!(outcome(&text[..text.find("obj").unwrap()]), "fine");
}

#[test]
fn a_header_that_disagrees_with_its_arrays_is_refused() {
    let cases = [
        (
            "biasSz 9",
            "biasSz 8",
            "line 4 (token 8): `bias_w` says rows = 9, expected 8",
        ),
        (
            "filtersSz 6",
            "filtersSz 7",
            "line 8 (token 822): `filters_w` says number of filters = 6, expected 7",
        ),
        (
            "filters_w 2 2 32",
            "filters_w 2 2 31",
            "line 7 (token 36): `filters_w` says planes = 31, expected 32",
        ),
        (
            "typesNbr 2",
            "typesNbr 3",
            "line 15 (token 883): `components_biasid` says rows = 2, expected 3",
        ),
        (
            "componentSz 3",
            "componentSz 4",
            "line 14 (token 880): `componentSz` says parts = 4, expected 3",
        ),
        (
            "pa 1 3 1 0 1 1",
            "pa 1 3 1 0 1 2",
            "line 19 (token 925): `pa` says a parent = 2, expected 1",
        ),
        (
            "maxsize 1 2 1 2 2",
            "maxsize 1 2 1 2 3",
            "line 20 (token 932): `maxsize` says cols = 3, expected 2",
        ),
        (
            "len 793",
            "len 792",
            "line 23 (token 942): `len` says len = 792, expected 793",
        ),
    ];
    for (from, to, expected) in cases {
        let text = text();
        assert!(text.contains(from), "{from}");
        assert_eq!(outcome(&text.replace(from, to)), expected);
    }
}

#[test]
fn errors_name_the_line_and_the_field() {
    let cases = [
        (
            "typesNbr",
            "typeNbr",
            "line 2 (token 3): expected `typesNbr`, got `typeNbr`",
        ),
        (
            "typesNbr 2",
            "typesNbr two",
            "line 2 (token 4): `typesNbr` expects a whole number of at least 0, got `two`",
        ),
        (
            "typesNbr 2",
            "typesNbr -2",
            "line 2 (token 4): `typesNbr` expects a whole number of at least 0, got `-2`",
        ),
        (
            "typesNbr 2",
            "typesNbr 33",
            "line 2 (token 4): `typesNbr` is 33, expected 1 to 32",
        ),
        (
            "partsNbr 3",
            "partsNbr 99999999999",
            "line 1 (token 2): `partsNbr` is 99999999999, expected 1 to 64",
        ),
        (
            "bias_w 9 1 1 -0.125",
            "bias_w 9 1 1 1,25",
            "line 4 (token 11): `bias_w` expects a number, got `1,25`",
        ),
        (
            "filters_w 2 2 32",
            "filters_w 2 17 32",
            "line 7 (token 36): `filters_w` is 17, expected 1 to 16",
        ),
        (
            "componentsNbr 1",
            "componentsNbr 2",
            "line 13 (token 879): `componentsNbr` is 2, expected 1 to 1",
        ),
        (
            "e+308",
            "e+308 more",
            "line 25 (token 948): expected the end of the file, got `more`",
        ),
    ];
    for (from, to, expected) in cases {
        let text = text();
        assert!(text.contains(from), "{from}");
        assert_eq!(outcome(&text.replace(from, to)), expected);
    }
    assert_eq!(
        outcome(""),
        "line 1 (token 1): the file ends within `partsNbr`"
    );
    let text = text();
    let half = text.find("bias_i 9 1 1 1 2").unwrap() + 16;
    let expected = "line 5 (token 26): the file ends within `bias_i`";
    assert_eq!(outcome(&text[..half]), expected);
}

#[test]
fn refuses_parts_at_another_level_than_their_parent() {
    let text = text();
    let start = text.find("defs_anchor").unwrap();
    let line = text[start..].lines().next().unwrap();
    let octave = line.trim_end().strip_suffix("0 0").unwrap().to_owned() + "1 0 ";
    let expected =
        "line 12 (token 863): `defs_anchor` puts spring 3 at 1 octaves from its parent, expected 0";
    assert_eq!(outcome(&text.replace(line, &octave)), expected);
}

#[test]
fn indices_out_of_range_are_rejected() {
    let cases = [
        (
            "components_filterid 3 2 1 1 3 5",
            "components_filterid 3 2 1 1 3 7",
            "part 3 names filter 7, but the model has only 6",
        ),
        (
            "components_biasid 2 2 3 1",
            "components_biasid 2 2 3 0",
            "part 1 names bias 0, but the model has only 9",
        ),
        (
            "components_defid 3 2 1 0 1",
            "components_defid 3 2 1 0 0",
            "part 2 names spring 0, but the model has only 4",
        ),
    ];
    for (from, to, expected) in cases {
        let text = text();
        assert!(text.contains(from), "{from}");
        assert_eq!(outcome(&text.replace(from, to)), expected);
    }
}

proptest! {
    #[test]
    fn a_truncated_text_is_refused(part in 0.0..1.0) {
        let text = text();
        let before_obj = text.find("thresh").unwrap();
        let kept = (before_obj as f64 * part) as usize;
        prop_assert!(parse(&text[..kept]).is_err());
    }

    #[test]
    fn a_changed_text_never_panics(part in 0.0..1.0, to in "[0-9a-z .\n-]{0,12}") {
        let mut text = text();
        let at = (text.len() as f64 * part) as usize;
        text.replace_range(at..(at + 6).min(text.len()), &to);
        if let Ok(spec) = parse(&text) {
            let _model = Model::new(spec);
        }
    }
}
