//! Collects the messages about a frame until its result is received.

use std::collections::{BTreeMap, BTreeSet};

use messages::{FrameHeader, MAX_VIEWS, Sightings, Skeletons, Status, ViewQuality};

use crate::missing::ViewHistory;
use crate::{Absent, FrameRecord, FusedRecord, Missing, Picture, ViewRecord};

/// Maximum number of frames that wait for their results. The oldest are discarded first.
const MAX_FRAMES: usize = 512;

/// Maximum number of consecutive frames without a result (hours of footage). A result further ahead has a wrong frame number.
const MAX_ABSENT: u64 = 1 << 20;

/// Maximum number of pairs of views in a frame.
const MAX_PAIRS: usize = MAX_VIEWS * (MAX_VIEWS - 1) / 2;

/// The messages about frames whose results have not been received yet.
#[derive(Debug)]
pub(crate) struct Gather {
    frames: BTreeMap<u64, Parts>,
    histories: Vec<ViewHistory>,
    /// Latest epoch of the process that sends results.
    epoch: u32,
    /// The first frame without a line in the output.
    next: u64,
    frame_step: u64,
    /// True if an earlier epoch of this process was killed, and no result has been received since.
    is_resumed: bool,
}

/// Frames that are complete because a result has been received.
#[derive(Debug)]
pub(crate) struct Settled {
    /// Earlier frames without a result, in order.
    pub(crate) absent: Vec<Absent>,
    /// Record of the result's frame.
    pub(crate) record: FrameRecord,
}

#[derive(Debug)]
struct Parts {
    views: Vec<ViewRecord>,
    fused: Vec<FusedRecord>,
}

impl Gather {
    /// Creates a collection without frames.
    ///
    /// * `next`: the first frame without a line in the output.
    /// * `is_resumed`: true if an earlier epoch of this process was killed.
    pub(crate) fn new(n_views: usize, next: u64, frame_step: u64, is_resumed: bool) -> Self {
        Self {
            frames: BTreeMap::new(),
            histories: vec![ViewHistory::default(); n_views],
            epoch: 0,
            next,
            frame_step: frame_step.max(1),
            is_resumed,
        }
    }

    /// Updates the connected ports of a view's capture and pose processes.
    pub(crate) fn note_ports(&mut self, view: usize, ports: [Vec<u128>; 2]) {
        if let Some(history) = self.histories.get_mut(view) {
            history.note_ports(ports);
        }
    }

    /// Adds a frame, with its pixels if a picture is to be drawn.
    pub(crate) fn frame(&mut self, view: usize, header: &FrameHeader, picture: Option<Picture>) {
        if let Some(history) = self.histories.get_mut(view) {
            history.note_frame(header);
        }
        if header.status == Status::END {
            return;
        }
        if let Some(record) = self.view(view, header.stamp.frame) {
            record.frame = Some(*header);
            record.picture = picture;
        }
    }

    pub(crate) fn pose(&mut self, view: usize, pose: &Sightings) {
        if let Some(history) = self.histories.get_mut(view) {
            history.note_pose(pose);
        }
        if pose.status == Status::END {
            return;
        }
        if let Some(record) = self.view(view, pose.stamp.frame) {
            record.pose = Some(*pose);
        }
    }

    pub(crate) fn quality(&mut self, view: usize, quality: &ViewQuality) {
        if let Some(record) = self.view(view, quality.stamp.frame) {
            record.quality = Some(*quality);
        }
    }

    pub(crate) fn fused(&mut self, frame: u64, message: FusedRecord) {
        let fused = &mut self.parts(frame).fused;
        if fused.len() < MAX_PAIRS {
            fused.push(message);
        }
    }

    /// Returns true if expected errors of a frame are still to arrive. Their sender serves one receiver after another, so fusion may have
    /// received and used them before this process does.
    pub(crate) fn awaits_quality(&self, frame: u64) -> bool {
        let Some(parts) = self.frames.get(&frame) else {
            return false;
        };
        let is_absent = |view: usize| {
            let record = parts.views.get(view);
            record.is_some_and(|record| record.quality.is_none())
        };
        // An age of 1 means that the errors were predicted in this frame.
        let mut used = parts.fused.iter().flat_map(|fused| fused.sigma_ages);
        used.any(|(view, age)| age == 1 && is_absent(view))
    }

    /// Returns the record of a frame whose result has been received. Earlier frames without a result will not get one. Returns `None` if
    /// the frame is already complete, because a restarted sender may send a result again.
    pub(crate) fn result(&mut self, skeletons: Box<Skeletons>) -> Option<Settled> {
        let frame = skeletons.stamp.frame;
        let n_before = frame.checked_sub(self.next)?;
        if n_before / self.frame_step > MAX_ABSENT {
            return None;
        }
        let is_first = skeletons.stamp.epoch > self.epoch;
        let absent = self.absent(frame, is_first);
        let later = self.frames.split_off(&(frame.saturating_add(1)));
        let mut past = std::mem::replace(&mut self.frames, later);
        let parts = past.remove(&frame);
        let Parts { mut views, fused } = parts.unwrap_or_else(|| self.empty());
        self.next = frame.saturating_add(self.frame_step);
        self.epoch = self.epoch.max(skeletons.stamp.epoch);
        for (view, (it, history)) in views.iter_mut().zip(&mut self.histories).enumerate() {
            let missing = history.note_result(frame, it.pose.as_ref(), is_first);
            it.missing = (skeletons.views_present >> view & 1 == 0).then_some(missing);
        }
        let record = FrameRecord {
            skeletons,
            views,
            fused,
        };
        Some(Settled { absent, record })
    }

    /// Returns the first frame after the last result.
    pub(crate) fn next(&self) -> u64 {
        self.next
    }

    /// Returns the frames after the last result when the stream has ended, up to the end of the longest footage.
    pub(crate) fn rest(&mut self) -> Vec<Absent> {
        let end = self.histories.iter().filter_map(ViewHistory::end).max();
        let most = self.next.saturating_add(MAX_ABSENT * self.frame_step);
        self.absent(end.unwrap_or(0).min(most), false)
    }

    /// Returns the frames before `end` without a result, with the reasons.
    ///
    /// * `is_lost`: true if the process that sends results has been restarted since the last result.
    fn absent(&mut self, end: u64, is_lost: bool) -> Vec<Absent> {
        let is_resumed = core::mem::take(&mut self.is_resumed);
        let mut absent = Vec::new();
        for frame in (self.next..end).step_by(self.frame_step as usize) {
            let parts = self.frames.remove(&frame);
            let pose =
                |view: usize| parts.as_ref().and_then(|parts| parts.views[view].pose.as_ref());
            let histories = self.histories.iter_mut().enumerate();
            let views: Vec<Missing> = histories
                .map(|(view, history)| history.note_result(frame, pose(view), is_lost))
                .collect();
            let reason = if is_resumed {
                "recorder lost".to_owned()
            } else if is_lost {
                Missing::Lost.reason().to_owned()
            } else {
                summary(&views)
            };
            absent.push(Absent {
                frame,
                reason,
                views,
            });
        }
        absent
    }

    fn view(&mut self, view: usize, frame: u64) -> Option<&mut ViewRecord> {
        self.parts(frame).views.get_mut(view)
    }

    fn parts(&mut self, frame: u64) -> &mut Parts {
        while self.frames.len() > MAX_FRAMES {
            self.frames.pop_first();
        }
        let empty = self.empty();
        self.frames.entry(frame).or_insert(empty)
    }

    fn empty(&self) -> Parts {
        Parts {
            views: vec![ViewRecord::default(); self.histories.len()],
            fused: Vec::new(),
        }
    }
}

/// Returns the reasons of all views, each once.
fn summary(views: &[Missing]) -> String {
    let reasons: BTreeSet<&str> = views.iter().map(|missing| missing.reason()).collect();
    reasons.into_iter().collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use messages::{PairPose, Stamp};

    use super::*;
    use crate::testing::skeletons;

    fn pose(frame: u64) -> Sightings {
        Sightings {
            stamp: Stamp {
                frame,
                ..Stamp::default()
            },
            ..Sightings::default()
        }
    }

    #[test]
    fn a_result_is_combined_with_the_messages_about_its_frame() {
        let mut gather = Gather::new(2, 0, 1, false);
        gather.pose(0, &pose(3));
        gather.pose(1, &pose(4));
        let got = gather.result(skeletons(3)).unwrap().record;
        assert_eq!(got.views[0].pose, Some(pose(3)));
        assert_eq!(got.views[1].pose, None);
        assert_eq!(got.views[0].missing, None, "it is present");
        assert_eq!(
            gather.result(skeletons(4)).unwrap().record.views[1].pose,
            Some(pose(4))
        );
    }

    #[test]
    fn only_expected_errors_that_fusion_used_are_awaited() {
        let mut gather = Gather::new(2, 0, 1, false);
        let stamp = pose(3).stamp;
        let pair = |sigma_age: [u16; 2]| {
            FusedRecord::from(&PairPose {
                stamp,
                views: [0, 1],
                sigma_age,
                ..PairPose::default()
            })
        };
        assert!(
            !gather.awaits_quality(3),
            "nothing is known about the frame"
        );
        gather.fused(3, pair([0, 4]));
        assert!(
            !gather.awaits_quality(3),
            "no expected errors were used, or those of an earlier frame"
        );
        gather.fused(3, pair([0, 1]));
        assert!(gather.awaits_quality(3));
        let quality = ViewQuality {
            stamp,
            ..ViewQuality::default()
        };
        gather.quality(0, &quality);
        assert!(
            gather.awaits_quality(3),
            "the expected errors of the other view are missing"
        );
        gather.quality(1, &quality);
        assert!(!gather.awaits_quality(3));
    }

    #[test]
    fn a_view_that_is_missing_from_a_result_has_a_reason() {
        let mut gather = Gather::new(2, 0, 1, false);
        gather.pose(0, &pose(3));
        gather.pose(1, &pose(4));
        let mut result = skeletons(3);
        result.views_present = 0b01;
        assert_eq!(
            gather.result(result).unwrap().record.views[1].missing,
            Some(Missing::Dropped)
        );
    }

    #[test]
    fn a_view_that_does_not_exist_is_ignored() {
        let mut gather = Gather::new(1, 0, 1, false);
        gather.pose(9, &pose(0));
        assert_eq!(gather.result(skeletons(0)).unwrap().record.views.len(), 1);
    }

    #[test]
    fn the_number_of_pairs_of_a_frame_is_bounded() {
        let mut gather = Gather::new(1, 0, 1, false);
        for _ in 0..1000 {
            gather.fused(0, FusedRecord::from(&PairPose::default()));
        }
        assert_eq!(gather.result(skeletons(0)).unwrap().record.fused.len(), 120);
    }

    #[test]
    fn frames_whose_results_are_never_received_are_discarded() {
        let mut gather = Gather::new(1, 0, 1, false);
        for frame in 0..10_000 {
            gather.pose(0, &pose(frame));
        }
        assert!(gather.frames.len() <= MAX_FRAMES + 1);
    }

    fn reasons(absent: &[Absent]) -> Vec<(u64, &str)> {
        absent.iter().map(|absent| (absent.frame, absent.reason.as_str())).collect()
    }

    #[test]
    fn every_frame_without_a_result_has_a_reason_and_is_reported_once() {
        let mut gather = Gather::new(2, 0, 2, false);
        for frame in [0, 4, 8] {
            gather.pose(0, &pose(frame));
        }
        gather.pose(1, &pose(8));
        // Both views dropped frame 2, and one view dropped frame 4.
        let got = gather.result(skeletons(6)).unwrap();
        let expected = [(0, "dropped, late"), (2, "dropped"), (4, "dropped, late")];
        assert_eq!(reasons(&got.absent), expected);
        assert_eq!(got.absent[2].views, [Missing::Late, Missing::Dropped]);
        assert!(gather.result(skeletons(6)).is_none(), "again");
        assert!(gather.result(skeletons(4)).is_none(), "earlier");
        let mut again = skeletons(6);
        again.stamp.epoch = 1;
        assert!(gather.result(again).is_none(), "again by the next epoch");
        let mut next = skeletons(12);
        next.stamp.epoch = 1;
        let got = gather.result(next).unwrap();
        let expected = [(8, "process lost"), (10, "process lost")];
        assert_eq!(reasons(&got.absent), expected);
        assert_eq!(got.record.frame(), 12);
    }

    #[test]
    fn frames_after_the_last_result_are_listed_up_to_the_end_of_footage() {
        let mut gather = Gather::new(2, 0, 1, false);
        gather.result(skeletons(0)).unwrap();
        // One view's pose of frame 1 came too late, and its pose of frame 2 is missing. The other view has no poses.
        gather.pose(0, &pose(1));
        for (view, end) in [(0, 3), (1, 2)] {
            let mut last = pose(end);
            last.status = Status::END;
            gather.pose(view, &last);
        }
        let expected = [(1, "dropped, late"), (2, "dropped, end of footage")];
        assert_eq!(reasons(&gather.rest()), expected);
    }

    #[test]
    fn a_restarted_process_lists_the_frames_it_missed_and_rejects_a_wrong_frame_number() {
        let mut gather = Gather::new(1, 38, 1, true);
        assert!(gather.result(skeletons(u64::MAX)).is_none());
        let got = gather.result(skeletons(40)).unwrap();
        let expected = [(38, "recorder lost"), (39, "recorder lost")];
        assert_eq!(reasons(&got.absent), expected);
        let got = gather.result(skeletons(42)).unwrap();
        assert_eq!(reasons(&got.absent), [(41, "late")]);
    }
}
