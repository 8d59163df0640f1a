//! When a fault comes, and how one knows whom it struck.

use launch::Planned;

use crate::trial::cost::Trace;

/// The fault comes after this share of the frames.
pub(super) const STRIKE_AFTER: f64 = 0.4;

/// The frame after a share of all of them.
pub(super) fn frame_at(planned: &Planned, share: f64) -> f64 {
    let capture = &planned.resolved().deployment.capture;
    let nth = share * planned.resolved().n_frames() as f64;
    capture.start_frame as f64 + nth.floor() * capture.frame_step as f64
}

/// Where the results name the lives of a process.
pub(super) fn trace_of(process: &str) -> Trace {
    let view = |it: &str| process.strip_prefix(it)?.parse().ok();
    match (view("capture-"), view("pose-"), process) {
        (Some(view), _, _) => Trace::Camera(view),
        (_, Some(view), _) => Trace::Pose(view),
        (_, _, "triangulate") => Trace::Result,
        _ => Trace::Nowhere,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_name_the_lives_of_those_they_are_made_of() {
        assert_eq!(trace_of("capture-2"), Trace::Camera(2));
        assert_eq!(trace_of("pose-11"), Trace::Pose(11));
        assert_eq!(trace_of("triangulate"), Trace::Result);
        for process in ["fuse-0", "quality-1", "results"] {
            assert_eq!(trace_of(process), Trace::Nowhere, "{process}");
        }
    }
}
