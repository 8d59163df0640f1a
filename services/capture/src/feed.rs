//! The source of pictures: footage, or a scene that is rendered during the run.

use std::sync::Arc;

use footage::{Complaints, FootageError, FrameView, Size, Source, SourceKind, SourceSpec};
use scene::{Address, AddressError, Scene, SceneError, View};

use crate::blank::{Blank, BlankError, BlankFeed};
use crate::info::FeedInfo;
use crate::recorded::{Recorded, RecordedError, RecordedFeed};

/// Error if there are no pictures.
#[derive(Debug, thiserror::Error)]
pub enum FeedError {
    /// The footage cannot be used.
    #[error(transparent)]
    Footage(#[from] FootageError),
    /// The address of a scene is invalid.
    #[error("{address}")]
    Address {
        /// Address as the user wrote it.
        address: String,
        /// Mistake in the address.
        source: AddressError,
    },
    /// The `blank://` URL of grey frames is invalid.
    #[error("{address}: {source}")]
    Blank {
        /// Address as the user wrote it.
        address: String,
        /// Mistake in the address.
        source: BlankError,
    },
    /// The pictures of a recording cannot be used.
    #[error("{address}")]
    Recorded {
        /// Address as the user wrote it.
        address: String,
        /// Cause of the error.
        source: RecordedError,
    },
    /// The scene of an address cannot be created.
    #[error("{address}")]
    Scene {
        /// Address as the user wrote it.
        address: String,
        /// Cause of the error.
        source: SceneError,
    },
}

/// The pictures of a camera, in order. The source is footage, `synth://` (see [`Address`]), `blank://` (see [`Blank`]), or `run.mcap#left`
/// (see [`Recorded`]).
#[derive(Debug)]
pub enum Feed {
    /// Footage in files.
    Footage(Box<Source>),
    /// A rendered scene.
    Scene(Box<Stage>),
    /// Grey frames, for a camera whose pictures are not used.
    Blank(Box<BlankFeed>),
    /// Original pictures of a live camera, read from a recording.
    Recorded(Box<RecordedFeed>),
}

/// A camera of a scene.
#[derive(Debug)]
pub struct Stage {
    info: FeedInfo,
    view: View,
    rate_hz: f64,
    /// Index of the next frame, and number of frames left.
    index: u64,
    step: u64,
    n_left: u64,
    rgb: Vec<u8>,
}

impl Feed {
    /// Returns the properties of a camera's pictures, without creating a scene.
    ///
    /// # Errors
    ///
    /// Fails with [`FeedError`] if the source cannot be used.
    pub fn look(spec: &SourceSpec) -> Result<FeedInfo, FeedError> {
        if let Some(blank) = blank(spec)? {
            return Ok(BlankFeed::look(&blank, spec)?);
        }
        if Recorded::is_recorded(&spec.path) {
            let info =
                Recorded::parse(&spec.path).and_then(|value| RecordedFeed::look(&value, spec));
            return info.map_err(|source| not_recorded(spec, source));
        }
        if !Address::is_address(&spec.path) {
            return Ok(Self::Footage(Box::new(Source::open(spec)?)).info());
        }
        let address = address(spec)?;
        let in_scene = |source: SceneError| failed(spec, source);
        let rig = address.settings.rig.rig().map_err(|error| in_scene(error.into()))?;
        let camera = scene::camera_of(&rig, &address.camera).map_err(in_scene)?;
        let [width, height] = rig.cameras()[camera].intrinsics.size.map(|side| side as usize);
        info(spec, &address, Size::new(width, height))
    }

    /// Opens the source. Creating a scene takes about a second.
    ///
    /// # Errors
    ///
    /// Fails with [`FeedError`] if the source cannot be used.
    pub fn open(spec: &SourceSpec) -> Result<Self, FeedError> {
        if let Some(blank) = blank(spec)? {
            return Ok(Self::Blank(Box::new(BlankFeed::open(&blank, spec)?)));
        }
        if Recorded::is_recorded(&spec.path) {
            let feed =
                Recorded::parse(&spec.path).and_then(|value| RecordedFeed::open(&value, spec));
            let feed = feed.map_err(|source| not_recorded(spec, source))?;
            return Ok(Self::Recorded(Box::new(feed)));
        }
        if !Address::is_address(&spec.path) {
            return Ok(Self::Footage(Box::new(Source::open(spec)?)));
        }
        let address = address(spec)?;
        let in_scene = |source: SceneError| failed(spec, source);
        let scene = Arc::new(Scene::new(&address.settings).map_err(in_scene)?);
        let camera = scene.camera(&address.camera).map_err(in_scene)?;
        let view = View::new(&scene, camera).map_err(in_scene)?;
        let info = info(spec, &address, view.size())?;
        Ok(Self::Scene(Box::new(Stage {
            info,
            rgb: vec![0; view.size().rgb_bytes()],
            view,
            rate_hz: address.settings.rate_hz,
            index: spec.start,
            step: spec.step,
            n_left: info.n_frames,
        })))
    }

    /// Returns the properties of the pictures.
    pub fn info(&self) -> FeedInfo {
        match self {
            Self::Footage(source) => FeedInfo {
                size: source.info().size,
                shrink: source.info().shrink,
                n_frames: source.info().n_frames,
                frame_rate_hz: source.info().frame_rate_hz,
                tag: source.info().tag,
                depth: source.info().depth,
                is_interlaced: source.info().is_interlaced,
                uneven_s: source.info().uneven_s,
            },
            Self::Scene(stage) => stage.info,
            Self::Blank(feed) => feed.info,
            Self::Recorded(feed) => feed.info,
        }
    }

    /// Returns the next frame, in a buffer of the feed; `None` at the end.
    ///
    /// # Errors
    ///
    /// Fails with [`FootageError`] if the frame cannot be read. A scene does not fail.
    pub fn next_frame(&mut self) -> Result<Option<FrameView<'_>>, FootageError> {
        match self {
            Self::Footage(source) => source.next_frame(),
            Self::Scene(stage) => Ok(stage.next_frame()),
            Self::Blank(feed) => Ok(feed.next_frame()),
            Self::Recorded(feed) => feed.next_frame(),
        }
    }

    /// Returns the pixels of the last frame; see [`Source::pixels`].
    pub fn pixels(&self) -> &[u8] {
        match self {
            Self::Footage(source) => source.pixels(),
            Self::Scene(stage) => &stage.rgb,
            Self::Blank(feed) => &feed.rgb,
            Self::Recorded(feed) => &feed.rgb,
        }
    }

    /// Returns true if all pictures are the same by design: a single image, or grey frames. Such pictures do not count as frozen.
    pub fn is_still(&self) -> bool {
        match self {
            Self::Footage(source) => source.info().kind == SourceKind::Still,
            Self::Scene(_) | Self::Recorded(_) => false,
            Self::Blank(_) => true,
        }
    }

    /// Returns true if the source is a video. The decoder of a video leaves out frames that it cannot decode.
    pub fn is_video(&self) -> bool {
        match self {
            Self::Footage(source) => source.info().kind == SourceKind::Video,
            Self::Scene(_) | Self::Blank(_) | Self::Recorded(_) => false,
        }
    }

    /// Returns the error messages of a video's decoder so far.
    pub fn complaints(&self) -> Complaints {
        match self {
            Self::Footage(source) => source.complaints(),
            Self::Scene(_) | Self::Blank(_) | Self::Recorded(_) => Complaints::default(),
        }
    }

    /// Skips the next `n` frames, or fewer at the end. Returns the number of skipped frames.
    ///
    /// # Errors
    ///
    /// Fails with [`FootageError`] if the footage cannot be read. A scene does not fail.
    pub fn skip(&mut self, n: u64) -> Result<u64, FootageError> {
        match self {
            Self::Footage(source) => source.skip(n),
            Self::Scene(stage) => {
                let n = n.min(stage.n_left);
                stage.skip(n);
                Ok(n)
            }
            Self::Blank(feed) => Ok(feed.skip(n)),
            Self::Recorded(feed) => Ok(feed.skip(n)),
        }
    }
}

impl Stage {
    fn skip(&mut self, n: u64) {
        self.n_left -= n;
        self.index = self.index.saturating_add(n.saturating_mul(self.step));
    }

    fn next_frame(&mut self) -> Option<FrameView<'_>> {
        if self.n_left == 0 {
            return None;
        }
        let index = self.index;
        let picture = self.view.picture(index, &mut self.rgb);
        tracing::trace!(
            index,
            seconds = picture.seconds,
            repeated = picture.repeated,
            "rendered a picture"
        );
        self.skip(1);
        Some(FrameView {
            index,
            time_s: Some(index as f64 / self.rate_hz),
            rgb: &self.rgb,
        })
    }
}

/// Parses a `blank://` URL. Returns `None` if the source is something else.
fn blank(spec: &SourceSpec) -> Result<Option<Blank>, FeedError> {
    if !Blank::is_blank(&spec.path) {
        return Ok(None);
    }
    let blank = Blank::parse(&spec.path).map_err(|source| FeedError::Blank {
        address: spec.path.clone(),
        source,
    })?;
    Ok(Some(blank))
}

fn not_recorded(spec: &SourceSpec, source: RecordedError) -> FeedError {
    match source {
        RecordedError::Choice(error) => FeedError::Footage(error),
        source => FeedError::Recorded {
            address: spec.path.clone(),
            source,
        },
    }
}

fn address(spec: &SourceSpec) -> Result<Address, FeedError> {
    Address::parse(&spec.path).map_err(|source| FeedError::Address {
        address: spec.path.clone(),
        source,
    })
}

fn failed(spec: &SourceSpec, source: SceneError) -> FeedError {
    FeedError::Scene {
        address: spec.path.clone(),
        source,
    }
}

fn info(spec: &SourceSpec, address: &Address, size: Size) -> Result<FeedInfo, FeedError> {
    let n_frames = spec.n_delivered(address.n_frames)?;
    let rate_hz = address.settings.rate_hz / spec.step as f64;
    Ok(FeedInfo::plain(size, n_frames, rate_hz))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATH: &str = "synth://ring:2?camera=1&rate=20&frames=10";

    fn frames(spec: &SourceSpec, skip: u64) -> Vec<(u64, Vec<u8>)> {
        let mut feed = Feed::open(spec).unwrap();
        assert_eq!(feed.info(), Feed::look(spec).unwrap());
        assert_eq!(feed.skip(skip).unwrap(), skip.min(feed.info().n_frames));
        let mut all = Vec::new();
        while let Some(frame) = feed.next_frame().unwrap() {
            assert_eq!(frame.time_s, Some(frame.index as f64 / 20.0));
            all.push((frame.index, frame.rgb.to_vec()));
        }
        assert_eq!(feed.next_frame().unwrap(), None);
        assert_eq!(feed.skip(3).unwrap(), 0);
        all
    }

    #[test]
    fn frames_of_a_scene_are_selected_like_frames_of_footage() {
        let whole = frames(&SourceSpec::new(PATH), 0);
        assert_eq!(whole.len(), 10);
        let part = SourceSpec {
            start: 1,
            step: 3,
            count: Some(9),
            ..SourceSpec::new(PATH)
        };
        let info = Feed::look(&part).unwrap();
        assert_eq!((info.n_frames, info.frame_rate_hz), (3, Some(20.0 / 3.0)));
        assert_eq!(info.size, Size::new(640, 480));
        let picked: Vec<_> = [1, 4, 7].map(|index| whole[index].clone()).into();
        assert_eq!(frames(&part, 0), picked);
        assert_eq!(frames(&part, 2), picked[2..]);
        assert_eq!(frames(&part, 9), []);
    }

    #[test]
    fn grey_frames_are_selected_like_frames_of_footage_and_never_count_as_frozen() {
        const GREY: &str = "blank://32x16?rate=20&frames=10";
        let whole = frames(&SourceSpec::new(GREY), 0);
        assert_eq!(whole.len(), 10);
        assert!(whole.iter().all(|frame| frame.1 == [128; 32 * 16 * 3]));
        let part = SourceSpec {
            start: 1,
            step: 3,
            count: Some(9),
            ..SourceSpec::new(GREY)
        };
        let info = Feed::look(&part).unwrap();
        assert_eq!((info.n_frames, info.frame_rate_hz), (3, Some(20.0 / 3.0)));
        assert_eq!(info.size, Size::new(32, 16));
        let of = |skip| frames(&part, skip).into_iter().map(|frame| frame.0);
        assert_eq!(of(0).collect::<Vec<u64>>(), [1, 4, 7]);
        assert_eq!(of(2).collect::<Vec<u64>>(), [7]);
        assert_eq!(of(9).count(), 0);
        let feed = Feed::open(&part).unwrap();
        assert!(feed.is_still() && !feed.is_video());
    }

    #[test]
    fn a_source_that_cannot_be_opened_is_an_error_with_the_cause() {
        let refused =
            |spec: &SourceSpec| failure::wording::in_one_line(&Feed::look(spec).unwrap_err());
        let path = |path: &str| SourceSpec::new(path);
        assert!(refused(&path("synth://ring:2?camera=7")).contains("only c1, c2"));
        assert!(refused(&path("synth://ring:2")).contains("names no camera"));
        assert!(refused(&path("synth://nobody.toml?camera=0")).contains("rig"));
        assert!(refused(&path("blank://32x16?rate=20")).contains("`frames` is missing"));
        assert!(refused(&path("nothing/here.mp4")).contains("no such footage"));
        let beyond = SourceSpec {
            start: 10,
            ..path(PATH)
        };
        assert!(refused(&beyond).contains("is beyond"));
        assert!(
            refused(&SourceSpec {
                step: 0,
                ..path(PATH)
            })
            .contains("step")
        );
    }
}
