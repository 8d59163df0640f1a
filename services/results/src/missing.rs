//! Reasons why a view does not contribute to a result.

use messages::{FrameHeader, Sightings, Status};

/// Reason why a view does not contribute to a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Missing {
    /// The view sent a message without a pose: no person was found, or there was no frame.
    Empty(Status),
    /// The view's message was received too late, or had not been received yet.
    Late,
    /// The view skipped the frame: a later pose or the end of its poses was received.
    Dropped,
    /// The view's process, or the process that fuses the views, had died.
    Lost,
    /// The view's footage has fewer frames.
    Ended,
}

impl Missing {
    /// Returns the reason as written to the files of a run.
    pub fn reason(self) -> &'static str {
        match self {
            Self::Empty(status) => status.reason(),
            Self::Late => runfiles::Missing::LATE,
            Self::Dropped => runfiles::Missing::DROPPED,
            Self::Lost => runfiles::Missing::PROCESS_LOST,
            Self::Ended => runfiles::Missing::END_OF_FOOTAGE,
        }
    }
}

/// State of one view's processes, derived from the received messages.
#[derive(Debug, Clone, Default)]
pub(crate) struct ViewHistory {
    /// Connected ports of the capture and pose processes.
    ports: [Vec<u128>; 2],
    /// Latest epoch of the pose process from which a message was received.
    epoch: u32,
    /// Latest epoch of the pose process that a result used.
    used_epoch: u32,
    /// True if a port has disappeared, and no pose has been received since.
    lost_process: bool,
    last_frame: Option<u64>,
    /// True if the pose process has sent the end of its stream, so that no more poses are expected.
    has_sent_all: bool,
    /// Latest epoch of the capture process, and the last frame of that epoch.
    captured: Option<(u32, u64)>,
    /// True if the port of the capture process has disappeared, and no frame of the next epoch has been received.
    lost_capture: bool,
    /// Last frame before the capture process was restarted, and first frame after it.
    gap: Option<[u64; 2]>,
    /// First frame beyond the end of the footage.
    end: Option<u64>,
}

impl ViewHistory {
    /// Processes a frame, or the end of the stream.
    pub(crate) fn note_frame(&mut self, header: &FrameHeader) {
        let (epoch, frame) = (header.stamp.epoch, header.stamp.frame);
        if let Some((before, last)) = self.captured
            && epoch > before
        {
            self.gap = Some([last, frame]);
            self.lost_capture = false;
        }
        self.captured = self.captured.max(Some((epoch, frame)));
        if header.status == Status::END {
            self.end = Some(frame);
        }
    }

    /// Returns the first frame beyond the end of the footage, once it is known.
    pub(crate) fn end(&self) -> Option<u64> {
        self.end
    }

    /// Processes a pose, or the end of the stream.
    pub(crate) fn note_pose(&mut self, pose: &Sightings) {
        self.lost_process = false;
        if pose.status == Status::END {
            self.end = Some(pose.stamp.frame);
            self.has_sent_all = true;
            return;
        }
        self.epoch = self.epoch.max(pose.stamp.epoch);
        self.last_frame = self.last_frame.max(Some(pose.stamp.frame));
    }

    /// Updates the connected ports. A process that was restarted quickly still counts as lost.
    pub(crate) fn note_ports(&mut self, ports: [Vec<u128>; 2]) {
        let is_gone = |port: &u128| !ports.iter().flatten().any(|other| other == port);
        let is_lost = self.ports.iter().flatten().any(is_gone);
        self.lost_process |= is_lost && self.last_frame.is_some();
        // A pose may belong to a frame that capture sent before its death, so a pose does not show that capture has been restarted.
        self.lost_capture |= self.ports[0].iter().any(is_gone) && self.captured.is_some();
        self.ports = ports;
    }

    /// Processes a result, and returns the reason why the view could not contribute to it.
    ///
    /// * `pose`: the view's message about that frame.
    /// * `is_first`: true if this is the first result of a restarted process.
    pub(crate) fn note_result(
        &mut self,
        frame: u64,
        pose: Option<&Sightings>,
        is_first: bool,
    ) -> Missing {
        let is_new = self.epoch != self.used_epoch;
        if let Some(pose) = pose {
            self.used_epoch = self.used_epoch.max(pose.stamp.epoch);
        }
        let was_lost = is_first
            || (pose.is_none() && (self.lost_process || is_new || self.was_not_captured(frame)));
        match pose {
            Some(pose) if pose.status != Status::OK => Missing::Empty(pose.status),
            None if self.end.is_some_and(|end| end <= frame) => Missing::Ended,
            _ if was_lost => Missing::Lost,
            None if self.last_frame > Some(frame) || self.has_sent_all => Missing::Dropped,
            _ => Missing::Late,
        }
    }

    /// Returns true if the capture process was not running when the frame was due.
    fn was_not_captured(&self, frame: u64) -> bool {
        let is_later = self.captured.is_some_and(|(_, last)| last < frame);
        let is_between = self.gap.is_some_and(|[last, first]| last < frame && frame < first);
        self.lost_capture && is_later || is_between
    }
}

#[cfg(test)]
mod tests {
    use messages::Stamp;

    use super::*;

    fn pose(frame: u64, epoch: u32, status: Status) -> Sightings {
        Sightings {
            stamp: Stamp {
                frame,
                epoch,
                ..Stamp::default()
            },
            status,
            ..Sightings::default()
        }
    }

    /// Returns the ports of a capture process, and of the `n`-th start of a pose process.
    fn ports(n: u128) -> [Vec<u128>; 2] {
        [vec![7], vec![n]]
    }

    /// Returns a view that has sent poses of frames 0 and 1, both used in results.
    fn history() -> ViewHistory {
        let mut history = ViewHistory::default();
        history.note_ports(ports(1));
        for frame in 0..2 {
            let sent = pose(frame, 0, Status::OK);
            history.note_pose(&sent);
            history.note_result(frame, Some(&sent), false);
        }
        history
    }

    #[test]
    fn a_message_without_a_pose_gives_the_reason() {
        for status in [Status::NO_DETECTION, Status::NO_FRAME, Status::BAD_INPUT] {
            let got = history().note_result(2, Some(&pose(2, 0, status)), false);
            assert_eq!(got.reason(), status.reason());
        }
    }

    #[test]
    fn a_pose_that_the_result_did_not_use_counts_as_late() {
        let mut history = history();
        let sent = pose(2, 0, Status::OK);
        assert_eq!(history.note_result(2, Some(&sent), false), Missing::Late);
        assert_eq!(history.note_result(3, None, false), Missing::Late);
    }

    #[test]
    fn a_frame_without_a_pose_before_a_later_pose_counts_as_dropped() {
        let mut history = history();
        history.note_pose(&pose(4, 0, Status::OK));
        assert_eq!(history.note_result(3, None, false), Missing::Dropped);
    }

    #[test]
    fn frames_between_two_epochs_are_lost() {
        let mut history = history();
        history.note_ports([vec![7], Vec::new()]);
        assert_eq!(history.note_result(2, None, false), Missing::Lost);
        history.note_ports(ports(2));
        assert_eq!(history.note_result(3, None, false), Missing::Lost);
        let back = pose(5, 1, Status::OK);
        history.note_pose(&back);
        assert_eq!(history.note_result(4, None, false), Missing::Lost);
        history.note_result(5, Some(&back), false);
        assert_eq!(history.note_result(6, None, false), Missing::Late);
    }

    /// Returns a frame from an epoch of the capture process.
    fn captured(frame: u64, epoch: u32) -> FrameHeader {
        FrameHeader {
            stamp: Stamp {
                frame,
                epoch,
                ..Stamp::default()
            },
            ..FrameHeader::default()
        }
    }

    #[test]
    fn frames_of_a_killed_capture_process_are_lost_even_if_a_pose_arrives_later() {
        let mut history = history();
        history.note_frame(&captured(2, 0));
        history.note_ports([Vec::new(), vec![1]]);
        let sent = pose(2, 0, Status::OK);
        history.note_pose(&sent);
        assert_eq!(history.note_result(2, Some(&sent), false), Missing::Late);
        assert_eq!(history.note_result(3, None, false), Missing::Lost);
        history.note_ports([vec![8], vec![1]]);
        assert_eq!(history.note_result(4, None, false), Missing::Lost);
        history.note_frame(&captured(7, 1));
        assert_eq!(history.note_result(5, None, false), Missing::Lost);
        history.note_pose(&pose(7, 0, Status::OK));
        assert_eq!(history.note_result(6, None, false), Missing::Lost);
        history.note_frame(&captured(8, 1));
        assert_eq!(history.note_result(8, None, false), Missing::Late);
    }

    #[test]
    fn a_frame_that_capture_sent_before_its_death_counts_as_late() {
        let mut history = history();
        history.note_frame(&captured(2, 0));
        history.note_frame(&captured(3, 0));
        history.note_ports([Vec::new(), vec![1]]);
        history.note_pose(&pose(2, 0, Status::OK));
        assert_eq!(history.note_result(3, None, false), Missing::Late);
        assert_eq!(history.note_result(4, None, false), Missing::Lost);
    }

    #[test]
    fn frames_of_a_process_restarted_between_two_checks_are_lost() {
        let mut history = history();
        history.note_ports(ports(1));
        assert_eq!(history.note_result(2, None, false), Missing::Late);
        history.note_ports(ports(2));
        history.note_ports(ports(2));
        assert_eq!(history.note_result(3, None, false), Missing::Lost);
    }

    #[test]
    fn frames_of_a_process_that_never_connected_count_as_late() {
        let mut history = ViewHistory::default();
        history.note_ports([Vec::new(), Vec::new()]);
        assert_eq!(history.note_result(0, None, false), Missing::Late);
    }

    #[test]
    fn the_frames_of_a_killed_triangulation_are_lost() {
        let mut history = history();
        let sent = pose(2, 0, Status::OK);
        assert_eq!(history.note_result(2, Some(&sent), true), Missing::Lost);
    }

    #[test]
    fn the_last_frame_counts_as_dropped_if_the_poses_ended_without_it() {
        let mut history = history();
        let mut end = captured(3, 0);
        end.status = Status::END;
        history.note_frame(&end);
        let sent = pose(2, 0, Status::OK);
        assert_eq!(history.clone().note_result(2, None, false), Missing::Late);
        history.note_pose(&pose(3, 0, Status::END));
        assert_eq!(history.note_result(2, None, false), Missing::Dropped);
        assert_eq!(history.note_result(2, Some(&sent), false), Missing::Late);
    }

    #[test]
    fn frames_after_the_end_of_the_footage_do_not_count_as_lost() {
        let mut history = history();
        history.note_pose(&pose(3, 0, Status::END));
        assert_eq!(history.note_result(2, None, false), Missing::Dropped);
        assert_eq!(history.note_result(3, None, false), Missing::Ended);
    }
}
