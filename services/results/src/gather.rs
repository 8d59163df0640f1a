//! Collects what is published about a frame until its result comes.

use std::collections::{BTreeMap, BTreeSet};

use messages::{FrameHeader, MAX_VIEWS, PairPose, Pose3d, Status, ViewPose, ViewQuality};

use crate::missing::Voice;
use crate::{Absent, FrameRecord, Missing, Picture, ViewRecord};

/// Frames that are kept while their results are awaited; beyond it the oldest are forgotten.
const MOST_FRAMES: usize = 512;

/// So many frames in a row may have no result, hours of them; a result beyond is of a sender that counts wrong.
const MOST_ABSENT: u64 = 1 << 20;

/// Pairs of as many views as a rig may have.
const MOST_PAIRS: usize = MAX_VIEWS * (MAX_VIEWS - 1) / 2;

/// What was said about frames whose results have not come yet.
#[derive(Debug)]
pub(crate) struct Gather {
    frames: BTreeMap<u64, Parts>,
    voices: Vec<Voice>,
    /// The latest life of the process that sends results.
    epoch: u32,
    /// The first frame that has no line yet.
    next: u64,
    frame_step: u64,
    /// Whether an earlier recorder was killed, and this one has heard no result yet.
    is_resumed: bool,
}

/// What a result settles.
#[derive(Debug)]
pub(crate) struct Settled {
    /// Frames before it that have none, in their order.
    pub(crate) absent: Vec<Absent>,
    /// Its own.
    pub(crate) record: FrameRecord,
}

#[derive(Debug)]
struct Parts {
    views: Vec<ViewRecord>,
    pairs: Vec<PairPose>,
}

impl Gather {
    /// * `next`: the first frame that has no line yet.
    /// * `is_resumed`: whether an earlier recorder was killed.
    pub(crate) fn new(n_views: usize, next: u64, frame_step: u64, is_resumed: bool) -> Self {
        Self {
            frames: BTreeMap::new(),
            voices: vec![Voice::default(); n_views],
            epoch: 0,
            next,
            frame_step: frame_step.max(1),
            is_resumed,
        }
    }

    /// Notes who is there to answer for a view: the ports of its capture and of its pose process.
    pub(crate) fn answerers(&mut self, view: usize, ports: [Vec<u128>; 2]) {
        if let Some(voice) = self.voices.get_mut(view) {
            voice.answerers(ports);
        }
    }

    /// Notes a frame, with its pixels if they are to be drawn on.
    pub(crate) fn frame(&mut self, view: usize, header: &FrameHeader, picture: Option<Picture>) {
        if let Some(voice) = self.voices.get_mut(view) {
            voice.frame(header);
        }
        if header.status == Status::END {
            return;
        }
        if let Some(it) = self.view(view, header.stamp.frame) {
            it.frame = Some(*header);
            it.picture = picture;
        }
    }

    pub(crate) fn pose(&mut self, view: usize, pose: &ViewPose) {
        if let Some(voice) = self.voices.get_mut(view) {
            voice.pose(pose);
        }
        if pose.status == Status::END {
            return;
        }
        if let Some(it) = self.view(view, pose.stamp.frame) {
            it.pose = Some(*pose);
        }
    }

    pub(crate) fn quality(&mut self, view: usize, quality: &ViewQuality) {
        if let Some(it) = self.view(view, quality.stamp.frame) {
            it.quality = Some(*quality);
        }
    }

    pub(crate) fn pair(&mut self, pair: &PairPose) {
        let pairs = &mut self.parts(pair.stamp.frame).pairs;
        if pairs.len() < MOST_PAIRS {
            pairs.push(*pair);
        }
    }

    /// The record of a frame whose result has come; earlier ones will get none any more. None if the frame has been
    /// settled already: who sends results was killed and says once more what it had said.
    pub(crate) fn result(&mut self, pose3d: &Pose3d) -> Option<Settled> {
        let frame = pose3d.stamp.frame;
        let n_before = frame.checked_sub(self.next)?;
        if n_before / self.frame_step > MOST_ABSENT {
            return None;
        }
        let is_first = pose3d.stamp.epoch > self.epoch;
        let absent = self.absent(frame, is_first);
        let later = self.frames.split_off(&(frame.saturating_add(1)));
        let mut past = std::mem::replace(&mut self.frames, later);
        let parts = past.remove(&frame);
        let Parts { mut views, pairs } = parts.unwrap_or_else(|| self.empty());
        self.next = frame.saturating_add(self.frame_step);
        self.epoch = self.epoch.max(pose3d.stamp.epoch);
        for (view, (it, voice)) in views.iter_mut().zip(&mut self.voices).enumerate() {
            let missing = voice.settle(frame, it.pose.as_ref(), is_first);
            it.missing = (pose3d.views_present >> view & 1 == 0).then_some(missing);
        }
        let record = FrameRecord {
            pose3d: *pose3d,
            views,
            pairs,
        };
        Some(Settled { absent, record })
    }

    /// The frames behind the last result, once no more will come: as far as the footage of any view goes.
    pub(crate) fn rest(&mut self) -> Vec<Absent> {
        let end = self.voices.iter().filter_map(Voice::end).max();
        let most = self.next.saturating_add(MOST_ABSENT * self.frame_step);
        self.absent(end.unwrap_or(0).min(most), false)
    }

    /// Frames up to another that have no result, and why.
    ///
    /// * `is_lost`: who sends results has been restarted since the last one.
    fn absent(&mut self, end: u64, is_lost: bool) -> Vec<Absent> {
        let is_resumed = core::mem::take(&mut self.is_resumed);
        let mut absent = Vec::new();
        for frame in (self.next..end).step_by(self.frame_step as usize) {
            let parts = self.frames.remove(&frame);
            let said = |view: usize| parts.as_ref().and_then(|it| it.views[view].pose.as_ref());
            let voices = self.voices.iter_mut().enumerate();
            let views: Vec<Missing> = voices
                .map(|(view, it)| it.settle(frame, said(view), is_lost))
                .collect();
            let reason = if is_resumed {
                "recorder lost".to_owned()
            } else if is_lost {
                Missing::Lost.reason().to_owned()
            } else {
                in_short(&views)
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
        while self.frames.len() > MOST_FRAMES {
            self.frames.pop_first();
        }
        let empty = self.empty();
        self.frames.entry(frame).or_insert(empty)
    }

    fn empty(&self) -> Parts {
        Parts {
            views: vec![ViewRecord::default(); self.voices.len()],
            pairs: Vec::new(),
        }
    }
}

/// The reasons of all views, each once.
fn in_short(views: &[Missing]) -> String {
    let reasons: BTreeSet<&str> = views.iter().map(|it| it.reason()).collect();
    reasons.into_iter().collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use messages::Stamp;

    use super::*;
    use crate::testing::pose3d;

    fn pose(frame: u64) -> ViewPose {
        ViewPose {
            stamp: Stamp {
                frame,
                ..Stamp::default()
            },
            ..ViewPose::default()
        }
    }

    #[test]
    fn a_result_takes_what_was_said_about_its_frame() {
        let mut gather = Gather::new(2, 0, 1, false);
        gather.pose(0, &pose(3));
        gather.pose(1, &pose(4));
        let got = gather.result(&pose3d(3)).unwrap().record;
        assert_eq!(got.views[0].pose, Some(pose(3)));
        assert_eq!(got.views[1].pose, None);
        assert_eq!(got.views[0].missing, None, "it is present");
        assert_eq!(
            gather.result(&pose3d(4)).unwrap().record.views[1].pose,
            Some(pose(4))
        );
    }

    #[test]
    fn who_has_no_part_in_a_result_is_asked_why() {
        let mut gather = Gather::new(2, 0, 1, false);
        gather.pose(0, &pose(3));
        gather.pose(1, &pose(4));
        let mut result = pose3d(3);
        result.views_present = 0b01;
        assert_eq!(
            gather.result(&result).unwrap().record.views[1].missing,
            Some(Missing::Dropped)
        );
    }

    #[test]
    fn a_view_that_does_not_exist_is_ignored() {
        let mut gather = Gather::new(1, 0, 1, false);
        gather.pose(9, &pose(0));
        assert_eq!(gather.result(&pose3d(0)).unwrap().record.views.len(), 1);
    }

    #[test]
    fn who_repeats_an_answer_for_ever_fills_no_memory() {
        let mut gather = Gather::new(1, 0, 1, false);
        for _ in 0..1000 {
            gather.pair(&PairPose::default());
        }
        assert_eq!(gather.result(&pose3d(0)).unwrap().record.pairs.len(), 120);
    }

    #[test]
    fn frames_whose_results_never_come_are_forgotten() {
        let mut gather = Gather::new(1, 0, 1, false);
        for frame in 0..10_000 {
            gather.pose(0, &pose(frame));
        }
        assert!(gather.frames.len() <= MOST_FRAMES + 1);
    }

    fn reasons(absent: &[Absent]) -> Vec<(u64, &str)> {
        absent
            .iter()
            .map(|it| (it.frame, it.reason.as_str()))
            .collect()
    }

    #[test]
    fn every_frame_without_a_result_says_why_and_none_is_settled_twice() {
        let mut gather = Gather::new(2, 0, 2, false);
        for frame in [0, 4, 8] {
            gather.pose(0, &pose(frame));
        }
        gather.pose(1, &pose(8));
        // Frame 2 was passed over by both, frame 4 answered by one and passed over by the other.
        let got = gather.result(&pose3d(6)).unwrap();
        let expected = [(0, "dropped, late"), (2, "dropped"), (4, "dropped, late")];
        assert_eq!(reasons(&got.absent), expected);
        assert_eq!(got.absent[2].views, [Missing::Late, Missing::Dropped]);
        assert!(gather.result(&pose3d(6)).is_none(), "once more");
        assert!(gather.result(&pose3d(4)).is_none(), "earlier");
        let mut again = pose3d(6);
        again.stamp.epoch = 1;
        assert!(gather.result(&again).is_none(), "by the next life");
        let mut next = pose3d(12);
        next.stamp.epoch = 1;
        let got = gather.result(&next).unwrap();
        let expected = [(8, "process lost"), (10, "process lost")];
        assert_eq!(reasons(&got.absent), expected);
        assert_eq!(got.record.frame(), 12);
    }

    #[test]
    fn frames_behind_the_last_result_are_told_as_far_as_footage_goes() {
        let mut gather = Gather::new(2, 0, 1, false);
        gather.result(&pose3d(0)).unwrap();
        for (view, end) in [(0, 3), (1, 2)] {
            let mut last = pose(end);
            last.status = Status::END;
            gather.pose(view, &last);
        }
        let expected = [(1, "late"), (2, "end of footage, late")];
        assert_eq!(reasons(&gather.rest()), expected);
    }

    #[test]
    fn a_restarted_recorder_says_what_it_missed_and_no_frame_number_is_believed() {
        let mut gather = Gather::new(1, 38, 1, true);
        assert!(gather.result(&pose3d(u64::MAX)).is_none());
        let got = gather.result(&pose3d(40)).unwrap();
        let expected = [(38, "recorder lost"), (39, "recorder lost")];
        assert_eq!(reasons(&got.absent), expected);
        let got = gather.result(&pose3d(42)).unwrap();
        assert_eq!(reasons(&got.absent), [(41, "late")]);
    }
}
