//! The time at which a fault is injected, and the part of a result that contains the epoch of a process.

use launch::Planned;

use crate::trial::cost::EpochSource;

/// Fraction of the frames after which the fault is injected.
pub(super) const INJECT_AFTER: f64 = 0.4;

/// Returns the number of the frame at a given fraction of all frames.
pub(super) fn frame_at(planned: &Planned, share: f64) -> f64 {
    let capture = &planned.resolved().deployment.capture;
    let nth = share * planned.resolved().n_frames() as f64;
    capture.start_frame as f64 + nth.floor() * capture.frame_step as f64
}

/// Returns the part of a result that contains the epoch of a process.
pub(super) fn epoch_source_of(process: &str) -> EpochSource {
    let view = |text: &str| process.strip_prefix(text)?.parse().ok();
    match (view("capture-"), view("pose-"), process) {
        (Some(view), _, _) => EpochSource::Camera(view),
        (_, Some(view), _) => EpochSource::Pose(view),
        (_, _, "triangulate") => EpochSource::Result,
        _ => EpochSource::Unrecorded,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_contain_the_epochs_of_capture_pose_and_triangulate() {
        assert_eq!(epoch_source_of("capture-2"), EpochSource::Camera(2));
        assert_eq!(epoch_source_of("pose-11"), EpochSource::Pose(11));
        assert_eq!(epoch_source_of("triangulate"), EpochSource::Result);
        for process in ["fuse-0", "quality-1", "results"] {
            assert_eq!(
                epoch_source_of(process),
                EpochSource::Unrecorded,
                "{process}"
            );
        }
    }
}
