//! Tests of whole runs that use facts from the files of cameras, such as frame numbers with gaps and orientation tags.

use std::fs;

use crate::common::{Case, PLAIN};

#[test]
fn a_gap_in_the_numbers_is_a_missing_picture_of_that_camera() {
    let whole = Case::new("gap-none", &[6; 3], PLAIN);
    whole.run().ends(0);
    for pattern in ["", "/%04d.png", "/*.png"] {
        let case = Case::new("gap", &[6; 3], PLAIN);
        case.edit(
            "deployment.toml",
            "source = \"b\"",
            &format!("source = \"b{pattern}\""),
        );
        for frame in [2, 3] {
            fs::remove_file(case.path(&format!("b/{frame:04}.png"))).unwrap();
        }
        let ended = case.run();
        let said =
            "camera \"b\" has no picture for 2 of 6 frames: no file name has the numbers 2 to 3";
        ended.says(said);
        let (lines, due) = (case.lines("pose3d.jsonl"), whole.lines("pose3d.jsonl"));
        assert_eq!(lines.len(), 6);
        for frame in [0, 1, 4, 5] {
            assert_eq!(
                lines[frame]["people"][0]["joints"], due[frame]["people"][0]["joints"],
                "frame {frame}"
            );
        }
        for frame in [2, 3] {
            let missing = &lines[frame]["views_missing"]["b"];
            assert_eq!(missing, "left out by the camera", "frame {frame}");
        }
    }
}

#[test]
fn cameras_that_start_with_different_numbers_are_reported() {
    let case = Case::new("late", &[6; 2], PLAIN);
    fs::remove_file(case.path("b/0000.png")).unwrap();
    let ended = case.start(&["run", "deployment.toml", "--dry-run"]).wait();
    let said = "cameras do not begin with the same picture (a 0 to 5, b 1 to 5)";
    ended.says(said);
    for nth in (1..6).rev() {
        let [from, to] = [nth, nth + 1000].map(|i| case.path(&format!("b/{i:04}.png")));
        fs::rename(from, to).unwrap();
    }
    let ended = case.start(&["run", "deployment.toml", "--dry-run"]).wait();
    ended.says("are numbered separately");
}
