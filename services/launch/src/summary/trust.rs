//! Texts for the user about how far the results can be trusted.

use core::fmt::Write as _;

use runfiles::{Doubt, Summary, Trust};

/// Returns true if cameras contradict each other or the calibration.
pub(super) fn are_cameras_doubtful(summary: &Summary) -> bool {
    let mut fits = summary.calibration.values();
    summary.exchanged.is_some()
        || summary.contradicted.is_some()
        || fits.any(|fit| fit.suspected || fit.out_of_step)
}

/// Returns the verdict on the results.
pub(super) fn verdict(summary: &Summary, doubts: &[Doubt]) -> &'static str {
    if !doubts.is_empty() || are_cameras_doubtful(summary) {
        "the results may be wrong"
    } else if summary.trust.frames < Trust::MIN_FRAMES {
        "too few frames to judge"
    } else {
        "no reason to doubt the results"
    }
}

/// Returns the reprojection error, the verdict in one line, and a line for every reason to doubt the results.
pub(super) fn text(summary: &Summary, doubts: &[Doubt]) -> String {
    let trust = &summary.trust;
    let verdict = verdict(summary, doubts);
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
