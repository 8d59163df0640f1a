//! Footage brought to common instants: of every instant the frame that is nearest to it.

use deployment::Timeline;
use footage::{FootageError, FrameView, SourceSpec};

use crate::feed::{Feed, FeedError};
use crate::info::FeedInfo;

/// The frames of a camera at common instants.
#[derive(Debug)]
pub struct Retimed {
    feed: Feed,
    timeline: Timeline,
    /// Which instants are used.
    start: u64,
    step: u64,
    n_instants: u64,
    /// Position of the next instant among those that are used.
    at: u64,
    /// The next frame that the footage gives, and the last that it gave.
    next: u64,
    shown: Option<u64>,
}

/// The footage with all its frames, from one on.
fn whole(spec: &SourceSpec, from: u64) -> SourceSpec {
    SourceSpec {
        start: from,
        step: 1,
        count: None,
        ..spec.clone()
    }
}

impl Retimed {
    /// The properties of the pictures.
    ///
    /// * `spec`: which instants are used.
    ///
    /// # Errors
    ///
    /// As for [`Feed::look`].
    pub fn look(spec: &SourceSpec, timeline: &Timeline) -> Result<FeedInfo, FeedError> {
        let found = Feed::look(&whole(spec, 0))?;
        let n_instants = spec.n_delivered(timeline.n_instants(found.n_frames))?;
        Ok(FeedInfo {
            n_frames: n_instants,
            frame_rate_hz: Some(timeline.instants_hz() / spec.step as f64),
            ..found
        })
    }

    /// Opens the footage.
    ///
    /// # Errors
    ///
    /// As for [`Feed::open`].
    pub fn open(spec: &SourceSpec, timeline: &Timeline) -> Result<Self, FeedError> {
        let n_instants = Self::look(spec, timeline)?.n_frames;
        let first = timeline.frame(spec.start);
        Ok(Self {
            feed: Feed::open(&whole(spec, first))?,
            timeline: *timeline,
            start: spec.start,
            step: spec.step,
            n_instants,
            at: 0,
            next: first,
            shown: None,
        })
    }

    /// The properties of the pictures.
    pub fn info(&self) -> FeedInfo {
        FeedInfo {
            n_frames: self.n_instants,
            frame_rate_hz: Some(self.timeline.instants_hz() / self.step as f64),
            ..self.feed.info()
        }
    }

    /// The footage itself.
    pub(crate) fn feed(&self) -> &Feed {
        &self.feed
    }

    /// Skips instants; returns how many there were.
    pub(crate) fn skip(&mut self, n: u64) -> u64 {
        let n = n.min(self.n_instants - self.at);
        self.at += n;
        n
    }

    fn instant(&self, at: u64) -> u64 {
        self.start.saturating_add(at.saturating_mul(self.step))
    }

    /// The picture of the next instant; of a later one where the footage lacks frames. `None` at the end.
    pub(crate) fn next_frame(&mut self) -> Result<Option<FrameView<'_>>, FootageError> {
        if self.at >= self.n_instants {
            return Ok(None);
        }
        let wanted = self.timeline.frame(self.instant(self.at));
        while self.shown.is_none_or(|it| it < wanted) {
            if wanted > self.next {
                self.feed.skip(wanted - self.next)?;
                self.next = wanted;
            }
            let Some(frame) = self.feed.next_frame()? else {
                return Ok(None);
            };
            self.shown = Some(frame.index);
            self.next = frame.index + 1;
        }
        let shown = self.shown.unwrap_or(wanted);
        while self.timeline.frame(self.instant(self.at)) < shown {
            self.at += 1;
            if self.at >= self.n_instants {
                return Ok(None);
            }
        }
        let index = self.instant(self.at);
        self.at += 1;
        Ok(Some(FrameView {
            index,
            time_s: Some(index as f64 / self.timeline.instants_hz()),
            rgb: self.feed.pixels(),
        }))
    }
}

#[cfg(test)]
mod tests {
    use deployment::OwnClock;

    use super::*;

    const PATH: &str = "synth://ring:2?camera=1&rate=20&frames=20";

    fn pictures(spec: &SourceSpec, timeline: Option<&Timeline>, skip: u64) -> Vec<(u64, Vec<u8>)> {
        let mut feed = Feed::open_on(spec, timeline).unwrap();
        assert_eq!(feed.info(), Feed::look_on(spec, timeline).unwrap());
        feed.skip(skip).unwrap();
        let mut all = Vec::new();
        while let Some(frame) = feed.next_frame().unwrap() {
            all.push((frame.index, frame.rgb.to_vec()));
        }
        all
    }

    #[test]
    fn every_instant_has_the_nearest_picture() {
        let clock = |rate_hz: f64, offset_s: f64| OwnClock {
            rate_hz,
            offset_s,
            drift: 0.0,
        };
        // The other camera begins 4.2 frames later, at half the rate.
        let timelines = Timeline::all(&[clock(20.0, 0.0), clock(10.0, 0.21)]);
        let plain = pictures(&SourceSpec::new(PATH), None, 0);
        let found = pictures(&SourceSpec::new(PATH), Some(&timelines[0]), 0);
        let frames: Vec<u64> = (0..found.len() as u64).map(|it| 4 + 2 * it).collect();
        assert_eq!(frames, [4, 6, 8, 10, 12, 14, 16, 18]);
        for ((nth, it), frame) in found.iter().enumerate().zip(frames) {
            assert_eq!(it.0, nth as u64);
            assert!(it.1 == plain[frame as usize].1, "instant {nth}");
        }
        let part = SourceSpec {
            start: 1,
            step: 2,
            ..SourceSpec::new(PATH)
        };
        let part = pictures(&part, Some(&timelines[0]), 1);
        assert_eq!(part.iter().map(|it| it.0).collect::<Vec<_>>(), [3, 5, 7]);
        assert!(part[0].1 == plain[10].1);
    }
}
