//! Collects what is published about a frame until its result comes.

use std::collections::BTreeMap;

use messages::{FrameHeader, MAX_VIEWS, PairPose, Pose3d, Status, ViewPose, ViewQuality};

use crate::missing::Voice;
use crate::{FrameRecord, Picture, ViewRecord};

/// Frames that are kept while their results are awaited; beyond it the oldest are forgotten.
const MOST_FRAMES: usize = 512;

/// Pairs of as many views as a rig may have.
const MOST_PAIRS: usize = MAX_VIEWS * (MAX_VIEWS - 1) / 2;

/// What was said about frames whose results have not come yet.
#[derive(Debug)]
pub(crate) struct Gather {
    frames: BTreeMap<u64, Parts>,
    voices: Vec<Voice>,
    /// The latest life of the process that sends results.
    epoch: u32,
}

#[derive(Debug)]
struct Parts {
    views: Vec<ViewRecord>,
    pairs: Vec<PairPose>,
}

impl Gather {
    pub(crate) fn new(n_views: usize) -> Self {
        Self {
            frames: BTreeMap::new(),
            voices: vec![Voice::default(); n_views],
            epoch: 0,
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

    /// The record of a frame whose result has come; earlier ones will get none any more.
    pub(crate) fn result(&mut self, pose3d: &Pose3d) -> FrameRecord {
        let later = self
            .frames
            .split_off(&(pose3d.stamp.frame.saturating_add(1)));
        let mut past = std::mem::replace(&mut self.frames, later);
        let parts = past.remove(&pose3d.stamp.frame);
        let Parts { mut views, pairs } = parts.unwrap_or_else(|| self.empty());
        let is_first = pose3d.stamp.epoch > self.epoch;
        self.epoch = self.epoch.max(pose3d.stamp.epoch);
        for (view, (it, voice)) in views.iter_mut().zip(&mut self.voices).enumerate() {
            let missing = voice.settle(pose3d.stamp.frame, it.pose.as_ref(), is_first);
            it.missing = (pose3d.views_present >> view & 1 == 0).then_some(missing);
        }
        FrameRecord {
            pose3d: *pose3d,
            views,
            pairs,
        }
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

#[cfg(test)]
mod tests {
    use messages::Stamp;

    use super::*;
    use crate::Missing;
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
        let mut gather = Gather::new(2);
        gather.pose(0, &pose(3));
        gather.pose(1, &pose(4));
        let got = gather.result(&pose3d(3));
        assert_eq!(got.views[0].pose, Some(pose(3)));
        assert_eq!(got.views[1].pose, None);
        assert_eq!(got.views[0].missing, None, "it is present");
        assert_eq!(gather.result(&pose3d(4)).views[1].pose, Some(pose(4)));
    }

    #[test]
    fn who_has_no_part_in_a_result_is_asked_why() {
        let mut gather = Gather::new(2);
        gather.pose(0, &pose(3));
        gather.pose(1, &pose(4));
        let mut result = pose3d(3);
        result.views_present = 0b01;
        assert_eq!(
            gather.result(&result).views[1].missing,
            Some(Missing::Dropped)
        );
    }

    #[test]
    fn a_view_that_does_not_exist_is_ignored() {
        let mut gather = Gather::new(1);
        gather.pose(9, &pose(0));
        assert_eq!(gather.result(&pose3d(0)).views.len(), 1);
    }

    #[test]
    fn who_repeats_an_answer_for_ever_fills_no_memory() {
        let mut gather = Gather::new(1);
        for _ in 0..1000 {
            gather.pair(&PairPose::default());
        }
        assert_eq!(gather.result(&pose3d(0)).pairs.len(), 120);
    }

    #[test]
    fn frames_whose_results_never_come_are_forgotten() {
        let mut gather = Gather::new(1);
        for frame in 0..10_000 {
            gather.pose(0, &pose(frame));
        }
        assert!(gather.frames.len() <= MOST_FRAMES + 1);
    }
}
