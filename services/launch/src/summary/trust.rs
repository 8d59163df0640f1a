//! Whether the results can be trusted, for people.

use core::fmt::Write as _;

use runfiles::{Doubt, Summary, Trust};

/// The reprojection error, the verdict in one line, and a line for every reason to doubt.
pub(super) fn text(summary: &Summary, doubts: &[Doubt]) -> String {
    let trust = &summary.trust;
    let verdict = match (trust.frames < Trust::MIN_FRAMES, doubts.is_empty()) {
        (true, true) => "too few frames to judge",
        (false, true) => "nothing speaks against the results",
        (_, false) => "the results may be wrong",
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
