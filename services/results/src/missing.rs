//! Why a view has no part in a result.

use messages::{FrameHeader, Status, ViewPose};

/// Why a view has no part in a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Missing {
    /// It answered, but with nothing: nobody was found, or there was no frame.
    Empty(Status),
    /// It answered too late, or had not answered yet.
    Late,
    /// It passed the frame over and went on.
    Dropped,
    /// Its process, or the one that puts the views together, had died.
    Lost,
    /// Its footage has fewer frames.
    Ended,
}

impl Missing {
    /// In words.
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

/// What is known of one view's processes.
#[derive(Debug, Clone, Default)]
pub(crate) struct Voice {
    /// Those of its processes, as they were last seen.
    ports: [Vec<u128>; 2],
    /// The latest life of its pose process that was heard.
    epoch: u32,
    /// The latest whose answer has a result.
    settled: u32,
    /// Somebody who was there to answer is gone, and there has been no answer since.
    is_absent: bool,
    last_frame: Option<u64>,
    /// The life of its camera's process that was heard last, and the last frame of it.
    shot: Option<(u32, u64)>,
    /// That process is gone, and nothing has been heard of the next.
    is_blind: bool,
    /// The last frame before that process was replaced, and the first after it.
    gap: Option<[u64; 2]>,
    /// Its first frame that does not exist.
    end: Option<u64>,
}

impl Voice {
    /// Hears of a frame, or that there are no more.
    pub(crate) fn frame(&mut self, header: &FrameHeader) {
        let (life, frame) = (header.stamp.epoch, header.stamp.frame);
        if let Some((before, last)) = self.shot
            && life > before
        {
            self.gap = Some([last, frame]);
            self.is_blind = false;
        }
        self.shot = self.shot.max(Some((life, frame)));
        if header.status == Status::END {
            self.end = Some(frame);
        }
    }

    /// Its first frame that does not exist, once that is known.
    pub(crate) fn end(&self) -> Option<u64> {
        self.end
    }

    /// Hears an answer, or that there are no more.
    pub(crate) fn pose(&mut self, pose: &ViewPose) {
        self.is_absent = false;
        if pose.status == Status::END {
            self.end = Some(pose.stamp.frame);
            return;
        }
        self.epoch = self.epoch.max(pose.stamp.epoch);
        self.last_frame = self.last_frame.max(Some(pose.stamp.frame));
    }

    /// Notes who is there to answer. Who is replaced at once was gone all the same.
    pub(crate) fn answerers(&mut self, ports: [Vec<u128>; 2]) {
        let is_gone = |it: &u128| !ports.iter().flatten().any(|other| other == it);
        let is_absent = self.ports.iter().flatten().any(is_gone);
        self.is_absent |= is_absent && self.last_frame.is_some();
        // An answer to what the camera sent before its death says nothing of the camera.
        self.is_blind |= self.ports[0].iter().any(is_gone) && self.shot.is_some();
        self.ports = ports;
    }

    /// Takes note of a result, and says why the view would have no part in it.
    ///
    /// * `pose`: what it said about that frame.
    /// * `is_first`: whether this is the first result of a restarted process.
    pub(crate) fn settle(
        &mut self,
        frame: u64,
        pose: Option<&ViewPose>,
        is_first: bool,
    ) -> Missing {
        let is_new = self.epoch != self.settled;
        if let Some(pose) = pose {
            self.settled = self.settled.max(pose.stamp.epoch);
        }
        let was_lost = is_first
            || (pose.is_none() && (self.is_absent || is_new || self.has_no_shot_of(frame)));
        match pose {
            Some(pose) if pose.status != Status::OK => Missing::Empty(pose.status),
            None if self.end.is_some_and(|end| end <= frame) => Missing::Ended,
            _ if was_lost => Missing::Lost,
            None if self.last_frame > Some(frame) => Missing::Dropped,
            _ => Missing::Late,
        }
    }

    /// Whether the process of its camera was not there to send a frame.
    fn has_no_shot_of(&self, frame: u64) -> bool {
        let is_later = self.shot.is_some_and(|(_, last)| last < frame);
        let is_between = self
            .gap
            .is_some_and(|[last, first]| last < frame && frame < first);
        self.is_blind && is_later || is_between
    }
}

#[cfg(test)]
mod tests {
    use messages::Stamp;

    use super::*;

    fn pose(frame: u64, epoch: u32, status: Status) -> ViewPose {
        ViewPose {
            stamp: Stamp {
                frame,
                epoch,
                ..Stamp::default()
            },
            status,
            ..ViewPose::default()
        }
    }

    /// Of a capture, and of the pose process that is started as the `n`-th.
    fn ports(n: u128) -> [Vec<u128>; 2] {
        [vec![7], vec![n]]
    }

    /// A view that has answered frames 0 and 1, of which there are results.
    fn voice() -> Voice {
        let mut voice = Voice::default();
        voice.answerers(ports(1));
        for frame in 0..2 {
            let said = pose(frame, 0, Status::OK);
            voice.pose(&said);
            voice.settle(frame, Some(&said), false);
        }
        voice
    }

    #[test]
    fn an_answer_without_a_pose_says_why() {
        for status in [Status::NO_DETECTION, Status::NO_FRAME, Status::BAD_INPUT] {
            let got = voice().settle(2, Some(&pose(2, 0, status)), false);
            assert_eq!(got.reason(), status.reason());
        }
    }

    #[test]
    fn an_answer_that_has_no_part_was_late() {
        let mut voice = voice();
        let said = pose(2, 0, Status::OK);
        assert_eq!(voice.settle(2, Some(&said), false), Missing::Late);
        assert_eq!(voice.settle(3, None, false), Missing::Late);
    }

    #[test]
    fn who_went_on_has_dropped_the_frame() {
        let mut voice = voice();
        voice.pose(&pose(4, 0, Status::OK));
        assert_eq!(voice.settle(3, None, false), Missing::Dropped);
    }

    #[test]
    fn frames_between_two_lives_are_lost() {
        let mut voice = voice();
        voice.answerers([vec![7], Vec::new()]);
        assert_eq!(voice.settle(2, None, false), Missing::Lost);
        voice.answerers(ports(2));
        assert_eq!(voice.settle(3, None, false), Missing::Lost);
        let back = pose(5, 1, Status::OK);
        voice.pose(&back);
        assert_eq!(voice.settle(4, None, false), Missing::Lost);
        voice.settle(5, Some(&back), false);
        assert_eq!(voice.settle(6, None, false), Missing::Late);
    }

    /// A frame of a life of the camera's process.
    fn shot(frame: u64, epoch: u32) -> FrameHeader {
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
    fn frames_of_a_killed_camera_are_lost_though_its_last_one_is_answered_after_its_death() {
        let mut voice = voice();
        voice.frame(&shot(2, 0));
        voice.answerers([Vec::new(), vec![1]]);
        let said = pose(2, 0, Status::OK);
        voice.pose(&said);
        assert_eq!(voice.settle(2, Some(&said), false), Missing::Late);
        assert_eq!(voice.settle(3, None, false), Missing::Lost);
        voice.answerers([vec![8], vec![1]]);
        assert_eq!(voice.settle(4, None, false), Missing::Lost);
        voice.frame(&shot(7, 1));
        assert_eq!(voice.settle(5, None, false), Missing::Lost);
        voice.pose(&pose(7, 0, Status::OK));
        assert_eq!(voice.settle(6, None, false), Missing::Lost);
        voice.frame(&shot(8, 1));
        assert_eq!(voice.settle(8, None, false), Missing::Late);
    }

    #[test]
    fn a_frame_that_the_camera_sent_before_its_death_was_late() {
        let mut voice = voice();
        voice.frame(&shot(2, 0));
        voice.frame(&shot(3, 0));
        voice.answerers([Vec::new(), vec![1]]);
        voice.pose(&pose(2, 0, Status::OK));
        assert_eq!(voice.settle(3, None, false), Missing::Late);
        assert_eq!(voice.settle(4, None, false), Missing::Lost);
    }

    #[test]
    fn who_is_replaced_before_anybody_looks_is_lost() {
        let mut voice = voice();
        voice.answerers(ports(1));
        assert_eq!(voice.settle(2, None, false), Missing::Late);
        voice.answerers(ports(2));
        voice.answerers(ports(2));
        assert_eq!(voice.settle(3, None, false), Missing::Lost);
    }

    #[test]
    fn who_has_never_been_there_is_late() {
        let mut voice = Voice::default();
        voice.answerers([Vec::new(), Vec::new()]);
        assert_eq!(voice.settle(0, None, false), Missing::Late);
    }

    #[test]
    fn what_a_killed_triangulation_held_is_lost() {
        let mut voice = voice();
        let said = pose(2, 0, Status::OK);
        assert_eq!(voice.settle(2, Some(&said), true), Missing::Lost);
    }

    #[test]
    fn beyond_the_end_there_is_nothing_to_miss() {
        let mut voice = voice();
        voice.pose(&pose(3, 0, Status::END));
        assert_eq!(voice.settle(2, None, false), Missing::Late);
        assert_eq!(voice.settle(3, None, false), Missing::Ended);
    }
}
