//! The reason why a run has no results.

use runfiles::Summary;

use crate::views::ViewReport;

/// Returns the reason why a run has no 3D joints. Returns `None` if it has some, or if its only view shows a person.
///
/// * `summary`: the summary that the process `results` wrote.
/// * `views`: the reports of all views.
pub fn reason(summary: &Summary, views: &[ViewReport]) -> Option<String> {
    if views.iter().all(|view| view.frames == 0) {
        return Some("the footage has no frame".to_owned());
    }
    if summary.frames == 0 {
        let views: Vec<String> = views.iter().map(ToString::to_string).collect();
        return Some(format!(
            "no frame has a result ({}); this machine may be too slow for so many views: use fewer or smaller \
             pictures, a lower capture.frame_rate_hz, or capture.mode = \"lossless\"",
            views.join("; ")
        ));
    }
    if summary.frames_with_pose > 0 {
        return None;
    }
    if views.iter().all(|view| view.used == 0) {
        return Some(format!(
            "nobody was found in any of {} frames of any view: is there a person, upright and large enough? `parallax detect` shows what is \
             found in a picture",
            summary.frames
        ));
    }
    if views.len() > 1 {
        return Some(format!(
            "views show a person, but none of {} results has a plausible 3D joint: maybe there was nobody. \
             Otherwise run `calib check`, and check that the unit of the calibration is right (`unit`: m, mm, ft, or 30mm for squares of \
             the board), that all footage was recorded at the same time, and that people are large enough",
            summary.frames
        ));
    }
    None
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    fn view(frames: u64, used: u64) -> ViewReport {
        ViewReport {
            name: "a".to_owned(),
            frames,
            used,
            empty: 0,
            late: 0,
            dropped: frames - used,
            lost: 0,
            unanswered: 0,
            faults: BTreeMap::new(),
            missing: Vec::new(),
        }
    }

    fn reason_of(frames: u64, with_pose: u64, views: &[ViewReport]) -> String {
        let summary = Summary {
            frames,
            frames_with_pose: with_pose,
            ..Summary::default()
        };
        reason(&summary, views).unwrap_or_default()
    }

    #[test]
    fn a_run_without_any_result_reports_the_reason() {
        let dropped = reason_of(0, 0, &[view(30, 0), view(30, 0)]);
        assert!(dropped.contains("no frame has a result"), "{dropped}");
        assert!(dropped.contains("a: 0 of 30 frames"), "{dropped}");
        let none = reason_of(0, 0, &[view(0, 0)]);
        assert!(none.contains("no frame"), "{none}");
        let flat = reason_of(3, 0, &[view(3, 3), view(3, 3)]);
        assert!(flat.contains("none of 3 results"), "{flat}");
    }

    #[test]
    fn a_room_without_people_is_reported_as_the_reason_and_a_single_view_is_not() {
        let nobody = reason_of(3, 0, &[view(3, 0), view(3, 0)]);
        assert!(nobody.contains("nobody was found"), "{nobody}");
        assert_eq!(reason_of(3, 0, &[view(3, 3)]), "");
        assert_eq!(reason_of(3, 1, &[view(3, 3), view(3, 3)]), "");
    }
}
