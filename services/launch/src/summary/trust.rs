//! Whether the results can be trusted, for people.

use core::fmt::Write as _;

use runfiles::{Doubt, Summary, Trust};

/// The reprojection error, the verdict in one line, and a line for every reason to doubt.
pub(super) fn text(summary: &Summary, doubts: &[Doubt]) -> String {
    let trust = &summary.trust;
    let misplaced = summary.calibration.values();
    let is_misplaced = misplaced
        .into_iter()
        .any(|fit| fit.suspected || fit.out_of_step);
    let is_doubtful = !doubts.is_empty()
        || is_misplaced
        || summary.exchanged.is_some()
        || summary.contradicted.is_some();
    let verdict = match (trust.frames < Trust::MIN_FRAMES, is_doubtful) {
        (_, true) => "the results may be wrong",
        (true, false) => "too few frames to judge",
        (false, false) => "nothing speaks against the results",
    };
    let mut text = summary.reprojection_px.map_or_else(String::new, |px| {
        format!("  reprojection  {px:.2} px (rms over all joints)\n")
    });
    // Writing to a string cannot fail.
    let _infallible = writeln!(text, "  trust         {verdict}: {}", trust.text());
    for doubt in doubts {
        let _infallible = writeln!(text, "    {doubt}");
    }
    text
}
