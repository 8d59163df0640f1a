//! Footage resampled at the frame times that all cameras share: each frame of the run gets the nearest picture.

use deployment::Timeline;
use footage::{Complaints, FootageError, FrameView, SourceSpec};

use crate::feed::{Feed, FeedError};
use crate::info::FeedInfo;

/// The frames of a camera: resampled at the common frame times if the camera has a timeline, otherwise as in the footage.
#[derive(Debug)]
pub struct Retimed {
    feed: Feed,
    times: Option<Times>,
}

/// The common frame times to use, and the position in the footage.
#[derive(Debug)]
struct Times {
    timeline: Timeline,
    start: u64,
    step: u64,
    n_instants: u64,
    /// Index of the next frame time among those that are used.
    at: u64,
    /// Index of the next frame that the footage delivers. `shown` is the index of the last delivered frame.
    next: u64,
    shown: Option<u64>,
}

/// Returns a specification of the whole footage, starting at a frame.
fn whole(spec: &SourceSpec, from: u64) -> SourceSpec {
    SourceSpec {
        start: from,
        step: 1,
        count: None,
        ..spec.clone()
    }
}

impl Retimed {
    /// Returns the properties of the pictures.
    ///
    /// * `spec`: counts common frame times if there is a timeline, and frames of the footage otherwise.
    ///
    /// # Errors
    ///
    /// Fails like [`Feed::look`].
    pub fn look(spec: &SourceSpec, timeline: Option<&Timeline>) -> Result<FeedInfo, FeedError> {
        let Some(timeline) = timeline else {
            return Feed::look(spec);
        };
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
    /// * `spec`: counts common frame times if there is a timeline, and frames of the footage otherwise.
    ///
    /// # Errors
    ///
    /// Fails like [`Feed::open`].
    pub fn open(spec: &SourceSpec, timeline: Option<&Timeline>) -> Result<Self, FeedError> {
        let Some(timeline) = timeline else {
            let feed = Feed::open(spec)?;
            return Ok(Self { feed, times: None });
        };
        let n_instants = Self::look(spec, Some(timeline))?.n_frames;
        let first = timeline.frame(spec.start);
        Ok(Self {
            feed: Feed::open(&whole(spec, first))?,
            times: Some(Times {
                timeline: *timeline,
                start: spec.start,
                step: spec.step,
                n_instants,
                at: 0,
                next: first,
                shown: None,
            }),
        })
    }

    /// Returns the properties of the pictures.
    pub fn info(&self) -> FeedInfo {
        let info = self.feed.info();
        self.times.as_ref().map_or(info, |times| FeedInfo {
            n_frames: times.n_instants,
            frame_rate_hz: Some(times.timeline.instants_hz() / times.step as f64),
            ..info
        })
    }

    /// Returns the pixels of the last frame; see [`Feed::pixels`].
    pub fn pixels(&self) -> &[u8] {
        self.feed.pixels()
    }

    /// Returns the same as [`Feed::is_still`].
    pub fn is_still(&self) -> bool {
        self.feed.is_still()
    }

    /// Returns the same as [`Feed::is_video`].
    pub fn is_video(&self) -> bool {
        self.feed.is_video()
    }

    /// Returns the same as [`Feed::complaints`].
    pub fn complaints(&self) -> Complaints {
        self.feed.complaints()
    }

    /// Skips frames (or common frame times, if there is a timeline). Returns the number that were skipped.
    ///
    /// # Errors
    ///
    /// Fails like [`Feed::skip`].
    pub fn skip(&mut self, n: u64) -> Result<u64, FootageError> {
        let Some(times) = &mut self.times else {
            return self.feed.skip(n);
        };
        let n = n.min(times.n_instants - times.at);
        times.at += n;
        Ok(n)
    }

    /// Returns the next picture. If frames are missing in the footage, this picture may belong to a later frame time. Returns `None` at the
    /// end.
    ///
    /// # Errors
    ///
    /// Fails like [`Feed::next_frame`].
    pub fn next_frame(&mut self) -> Result<Option<FrameView<'_>>, FootageError> {
        let Some(times) = &mut self.times else {
            return self.feed.next_frame();
        };
        if times.at >= times.n_instants {
            return Ok(None);
        }
        let wanted = times.wanted();
        while times.shown.is_none_or(|shown| shown < wanted) {
            if wanted > times.next {
                self.feed.skip(wanted - times.next)?;
                times.next = wanted;
            }
            let Some(frame) = self.feed.next_frame()? else {
                return Ok(None);
            };
            times.shown = Some(frame.index);
            times.next = frame.index + 1;
        }
        let shown = times.shown.unwrap_or(wanted);
        while times.wanted() < shown {
            times.at += 1;
            if times.at >= times.n_instants {
                return Ok(None);
            }
        }
        let index = times.instant();
        times.at += 1;
        Ok(Some(FrameView {
            index,
            time_s: Some(index as f64 / times.timeline.instants_hz()),
            rgb: self.feed.pixels(),
        }))
    }
}

impl Times {
    /// Returns the next common frame time.
    fn instant(&self) -> u64 {
        self.start.saturating_add(self.at.saturating_mul(self.step))
    }

    /// Returns the frame of the footage that is nearest to the next common frame time.
    fn wanted(&self) -> u64 {
        self.timeline.frame(self.instant())
    }
}

#[cfg(test)]
mod tests {
    use deployment::OwnClock;

    use super::*;

    const PATH: &str = "synth://ring:2?camera=1&rate=20&frames=20";

    fn pictures(spec: &SourceSpec, timeline: Option<&Timeline>, skip: u64) -> Vec<(u64, Vec<u8>)> {
        let mut feed = Retimed::open(spec, timeline).unwrap();
        assert_eq!(feed.info(), Retimed::look(spec, timeline).unwrap());
        feed.skip(skip).unwrap();
        let mut all = Vec::new();
        while let Some(frame) = feed.next_frame().unwrap() {
            all.push((frame.index, frame.rgb.to_vec()));
        }
        all
    }

    #[test]
    fn every_instant_gets_the_nearest_picture() {
        let clock = |rate_hz: f64, offset_s: f64| OwnClock {
            rate_hz,
            offset_s,
            drift: 0.0,
        };
        // The other camera begins 4.2 frames later, at half the rate.
        let timelines = Timeline::all(&[clock(20.0, 0.0), clock(10.0, 0.21)]);
        let plain = pictures(&SourceSpec::new(PATH), None, 0);
        let found = pictures(&SourceSpec::new(PATH), Some(&timelines[0]), 0);
        let frames: Vec<u64> = (0..found.len() as u64).map(|i| 4 + 2 * i).collect();
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
        assert_eq!(
            part.iter().map(|part| part.0).collect::<Vec<_>>(),
            [3, 5, 7]
        );
        assert!(part[0].1 == plain[10].1);
    }
}
