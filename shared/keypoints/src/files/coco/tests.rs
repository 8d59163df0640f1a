//! Tests of the layout of COCO.

use super::*;
use crate::decode::Keypoint;

/// Returns 17 keypoints whose third numbers are all the same.
fn list(x: f64, third: f64) -> String {
    let three = format!("{x},{},{third}", x + 1.0);
    format!("[{}]", vec![three; 17].join(","))
}

fn refused(text: &str) -> String {
    parse(text.as_bytes(), None).unwrap_err().to_string()
}

fn set(annotations: &str, categories: &str) -> String {
    format!(
        "{{\"info\":{{}},\"images\":[{{\"id\":30,\"file_name\":\"c\"}},{{\"id\":7}},{{\"id\":12}}],\
         \"annotations\":[{annotations}],\"categories\":[{categories}]}}"
    )
}

fn annotation(image: &str, category: u64, keypoints: &str) -> String {
    format!(
        "{{\"id\":1,\"image_id\":{image},\"category_id\":{category},\"bbox\":[0,0,1,1],\"keypoints\":{keypoints}}}"
    )
}

#[test]
fn frames_of_a_data_set_are_images_sorted_by_id_and_visibility_0_means_not_labelled() {
    let keypoints = list(5.0, 2.0).replacen("5,6,2", "0,0,0", 1);
    let all = [
        annotation("30", 1, &keypoints),
        annotation("7", 1, &list(8.0, 1.0)),
        annotation("30", 1, &list(9.0, 0.25)),
    ];
    let film = parse(set(&all.join(","), "").as_bytes(), None).unwrap();
    assert_eq!(
        (film.n_frames, &film.names),
        (3, &NameSet::of_number(17).unwrap())
    );
    let of: Vec<usize> = film.frames.values().map(Vec::len).collect();
    assert_eq!(of, [1, 0, 2]);
    let [first, second] = &film.frames[&2][..] else {
        panic!("two people")
    };
    assert_eq!(first.keypoints[0], None);
    let at = |at, score| Some(Keypoint { at, score });
    assert_eq!(first.keypoints[1], at([5.0, 6.0], 1.0));
    assert_eq!(second.keypoints[0], at([9.0, 10.0], 0.25));
}

#[test]
fn the_category_person_gives_the_names_and_other_categories_are_ignored() {
    let categories = "{\"id\":1,\"name\":\"person\",\"keypoints\":[\"left_hip\",\"nose\"]},{\"id\":2,\"name\":\"dog\",\
         \"keypoints\":[\"tail\"]},{\"id\":3,\"name\":\"ball\"}";
    let all = [
        annotation("7", 1, "[1,2,2,3,4,2]"),
        annotation("7", 2, "[1,2,2]"),
        annotation("7", 3, "[]"),
    ];
    let text = set(&all.join(","), categories);
    let film = parse(text.as_bytes(), None).unwrap();
    assert_eq!(film.names.names(), ["left hip", "nose"]);
    assert_eq!(film.frames[&0].len(), 1);
    let nobody = text.replace("\"person\"", "\"cat\"");
    assert!(refused(&nobody).contains("2 with keypoints"));
    let strange = text.replace("left_hip", "k0");
    assert!(refused(&strange).contains("category 1"));
    let given = NameSet::of_set("coco-17").unwrap();
    let told = parse(text.as_bytes(), Some(&given)).unwrap_err().to_string();
    assert!(
        told.contains("annotations[0].keypoints") && told.contains("6 numbers, expected 51"),
        "{told}"
    );
}

#[test]
fn frames_of_results_are_their_image_ids_as_numbers_or_texts() {
    let ids = ["4", "\"000001\"", "\"cam01_0004.jpg\"", "\"cam1.0002\""];
    let all = ids.map(|id| annotation(id, 1, &list(5.0, 0.5)));
    let text = format!(" [{}]", all.join(","));
    let film = parse(text.as_bytes(), None).unwrap();
    assert_eq!(film.n_frames, 5);
    let of: Vec<(u64, usize)> = film.frames.iter().map(|frame| (*frame.0, frame.1.len())).collect();
    assert_eq!(of, [(1, 1), (2, 1), (4, 2)]);
    assert_eq!(film.frames[&4][0].keypoints[3].unwrap().score, 0.5);
}

#[test]
fn impossible_coco_values_are_refused_with_their_place() {
    let one = |image: &str| format!("[{}]", annotation(image, 1, &list(5.0, 0.5)));
    assert!(refused(&one("\"picture\"")).contains("[0].image_id"));
    assert!(refused(&one("99999999999")).contains("a frame number below 10000000"));
    assert!(refused(&one("-1")).contains("image_id"));
    assert!(refused("[]").contains("without any person"));
    let unknown = refused(&set(&annotation("8", 1, &list(5.0, 0.5)), ""));
    assert!(
        unknown.contains("annotations[0].image_id") && unknown.contains("is 8"),
        "{unknown}"
    );
    let twice = set(&annotation("7", 1, &list(5.0, 2.0)), "").replace("12", "30");
    assert!(refused(&twice).contains("twice 30"));
    assert!(refused("{\"people\":[]}").contains("images"));
    assert!(refused("nothing").contains("begins with \"nothing\""));
    let many = vec![annotation("3", 1, &list(5.0, 0.5)); MAX_PEOPLE + 1];
    let many = refused(&format!("[{}]", many.join(",")));
    assert!(many.contains("1001 people in a frame"), "{many}");
    let short = refused(&format!("[{}]", annotation("3", 1, "[1,2,3]")));
    assert!(short.contains("1 keypoints"), "{short}");
}

#[test]
fn a_data_set_without_people_needs_names() {
    assert!(refused(&set("", "")).contains("without any person"));
    let names = NameSet::of_set("coco-17").unwrap();
    let film = parse(set("", "").as_bytes(), Some(&names)).unwrap();
    assert_eq!((film.n_frames, film.frames.len()), (3, 3));
}

#[test]
fn unsupported_files_of_other_programs_are_refused_with_an_explanation() {
    let table = refused("scorer,DLC,DLC,DLC\nbodyparts,nose,nose,nose\n");
    assert!(table.contains("begins with \"scorer,DLC"), "{table}");
    // Ultralytics writes a list of people for each frame.
    let frames = refused("[[{\"name\":\"person\",\"keypoints\":{\"x\":[1],\"y\":[2]}}]]");
    assert!(frames.contains("expected an `image_id`"), "{frames}");
}
