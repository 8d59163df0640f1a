//! Frames of a sequence, read for all views together and prepared as in the pipeline.

use footage::{Fill, FootageError, Size, Source, SourceSpec, Warp, WarpError};
use geometry::{Camera, Framing, FramingError, OutSize, upright_roll};
use kernels::Rgb8View;
use training::datasets::sequences::Sequence;

/// Settings for deriving frames from footage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmSettings {
    /// Width and height of the frames; if `None`, the footage's size times `scale`.
    pub size: Option<[u32; 2]>,
    /// Pixels of a frame per pixel of the footage.
    pub scale: f64,
    /// True to rotate frames upright, if the rig gives the vertical.
    pub upright: bool,
}

/// Reason why frames cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    /// Footage cannot be read.
    #[error("camera {camera:?}")]
    Footage {
        /// Name of the camera.
        camera: String,
        /// Cause of the error.
        source: FootageError,
    },
    /// Footage does not match the calibration.
    #[error("camera {camera:?}")]
    Framing {
        /// Name of the camera.
        camera: String,
        /// Cause of the error.
        source: FramingError,
    },
    /// Frames cannot be derived.
    #[error("camera {camera:?}")]
    Warp {
        /// Name of the camera.
        camera: String,
        /// Cause of the error.
        source: WarpError,
    },
}

/// The footage of all views.
#[derive(Debug)]
pub struct Film {
    reels: Vec<Reel>,
}

#[derive(Debug)]
struct Reel {
    camera: String,
    source: Source,
    warp: Warp,
    framing: Framing,
    /// Index of the next frame to read.
    next: u64,
    decoded: Vec<u8>,
    frame: Vec<u8>,
    is_there: bool,
}

impl Film {
    /// Opens the footage of every view.
    ///
    /// # Errors
    ///
    /// Fails with [`FilmError`], which names the camera.
    pub fn open(sequence: &Sequence, settings: &FilmSettings) -> Result<Self, FilmError> {
        let views = sequence.views.iter().zip(sequence.rig.cameras());
        let reel = |(view, camera): (&training::datasets::sequences::View, &Camera)| {
            let name = || camera.name.clone();
            let spec = SourceSpec {
                start: view.first,
                ..SourceSpec::new(view.source.clone())
            };
            let unread = |source| FilmError::Footage {
                camera: name(),
                source,
            };
            let source = Source::open(&spec).map_err(unread)?;
            let size = source.info().size;
            let out_size = settings.size.map_or(OutSize::Scale(settings.scale), OutSize::Exact);
            let roll = if settings.upright {
                upright_roll(camera, &sequence.rig).unwrap_or(0.0)
            } else {
                0.0
            };
            let of_footage = [size.width as u32, size.height as u32];
            let framing = Framing::new(camera, of_footage, view.source_offset_px, out_size, roll)
                .map_err(|source| FilmError::Framing {
                camera: name(),
                source,
            })?;
            let [width, height] = framing.out_size().map(|out_size| out_size as usize);
            let out = Size::new(width, height);
            let warp = Warp::new(size, out, &framing.source_from_output(), Fill::Black).map_err(
                |source| FilmError::Warp {
                    camera: name(),
                    source,
                },
            )?;
            Ok(Reel {
                camera: name(),
                decoded: vec![0; size.rgb_bytes()],
                frame: vec![0; out.rgb_bytes()],
                source,
                warp,
                framing,
                next: 0,
                is_there: false,
            })
        };
        Ok(Self {
            reels: views.map(reel).collect::<Result<_, _>>()?,
        })
    }

    /// Returns the cameras of the frames.
    pub fn cameras(&self) -> Vec<Camera> {
        self.reels.iter().map(|reel| reel.framing.camera().clone()).collect()
    }

    /// Returns the map from pixels of the frames to pixels of the footage, for every view.
    pub fn footage_from_frame(&self) -> Vec<[[f64; 3]; 2]> {
        self.reels.iter().map(|reel| reel.framing.source_from_output()).collect()
    }

    /// Returns the images of all views at a frame of the sequence; `None` for a view whose footage has ended.
    ///
    /// * `index`: must increase from call to call; skipped frames cannot be read later.
    ///
    /// # Errors
    ///
    /// Fails with [`FilmError::Footage`].
    pub fn at(&mut self, index: u64) -> Result<Vec<Option<Rgb8View<'_>>>, FilmError> {
        for reel in &mut self.reels {
            reel.seek(index).map_err(|source| FilmError::Footage {
                camera: reel.camera.clone(),
                source,
            })?;
        }
        let image = |reel: &'_ Reel| reel.is_there.then_some(reel.framing.out_size());
        let images = self.reels.iter().map(|reel| {
            let [width, height] = image(reel)?.map(|value| value as usize);
            Rgb8View::new(width, height, &reel.frame).ok()
        });
        Ok(images.collect())
    }
}

impl Reel {
    fn seek(&mut self, index: u64) -> Result<(), FootageError> {
        self.is_there = false;
        let Some(n) = index.checked_sub(self.next) else {
            return Ok(());
        };
        self.next += self.source.skip(n)?;
        if self.next == index && self.source.next_into(&mut self.decoded)?.is_some() {
            self.next += 1;
            self.warp.apply(&self.decoded, &mut self.frame);
            self.is_there = true;
        }
        Ok(())
    }
}
