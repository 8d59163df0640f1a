//! Pictures of a file, and the size at which a picture is searched.

use std::path::{Path, PathBuf};

use failure::{ExitKind, Failure, OrFail as _, in_file};
use fmp::{Layout, Search};
use footage::{Fill, Rotation, Size, Source, SourceSpec, Turn, Warp, resize_map};
use kernels::Rgb8View;

use crate::images::has_image_name;
use crate::memory::check_memory;

/// Selection of the frames of a video.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frames {
    /// Step between frames; the first frame and every n-th frame after it are used.
    pub every: u64,
    /// Maximum number of frames; `None` for all.
    pub most: Option<u64>,
}

/// A picture in its upright orientation.
#[derive(Debug)]
pub struct Picture {
    /// Path of the file.
    pub path: PathBuf,
    /// Number of the frame, if the file is a video.
    pub frame: Option<u64>,
    /// Rotation that was applied to the picture.
    pub turn: Turn,
    /// Size of the picture, in pixels.
    pub size: Size,
    /// Pixels of the picture, row by row.
    pub rgb: Vec<u8>,
}

impl Picture {
    /// Returns a readable title: the name of the file, and the frame.
    pub fn title(&self) -> String {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let frame = self.frame.map(|frame| format!(" {frame}"));
        format!("{name}{}", frame.unwrap_or_default())
    }

    /// Returns a stem for names of output files: the name of the file without its ending, and the frame.
    pub fn stem(&self) -> String {
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
        let frame = self.frame.map(|frame| format!("-{frame:06}"));
        format!("{stem}{}", frame.unwrap_or_default())
    }
}

/// The pictures of a file, one after another.
#[derive(Debug)]
pub enum Pictures {
    /// An image; `None` after it was returned.
    Image(Option<PathBuf>),
    /// A video.
    Video(PathBuf, Box<Source>),
}

impl Pictures {
    /// Opens a file.
    ///
    /// # Errors
    ///
    /// Fails if the file cannot be read, or is neither an image nor a video.
    pub fn open(path: &Path, frames: Frames) -> Result<Self, Failure> {
        if path.is_file() && footage::is_image(path).or_fail(ExitKind::Input)? {
            return Ok(Self::Image(Some(path.to_path_buf())));
        }
        let source = Source::open(&spec(path, frames)).or_fail(ExitKind::Input)?;
        Ok(Self::Video(path.to_path_buf(), Box::new(source)))
    }

    /// Returns the next picture; `None` at the end.
    ///
    /// # Errors
    ///
    /// Fails if the picture cannot be decoded.
    pub fn next_picture(&mut self) -> Result<Option<Picture>, Failure> {
        match self {
            Self::Image(path) => path.take().map(image).transpose(),
            Self::Video(path, source) => {
                let (size, turn) = (source.info().size, source.info().tag);
                let frame = source.next_frame().or_fail(ExitKind::Input)?;
                Ok(frame.map(|frame| Picture {
                    path: path.clone(),
                    frame: Some(frame.index),
                    turn,
                    size,
                    rgb: frame.rgb.to_vec(),
                }))
            }
        }
    }
}

fn image(path: PathBuf) -> Result<Picture, Failure> {
    let (size, rgb, turn) = footage::read_upright(&path).or_fail(ExitKind::Input)?;
    Ok(Picture {
        path,
        frame: None,
        turn,
        size,
        rgb,
    })
}

fn spec(path: &Path, frames: Frames) -> SourceSpec {
    SourceSpec {
        step: frames.every,
        count: frames.most,
        rotation: Rotation::Tag,
        ..SourceSpec::new(path.to_string_lossy())
    }
}

/// Returns the number of pictures that a file declares; 1 if it declares none.
pub fn count(path: &Path, frames: Frames) -> usize {
    if has_image_name(path) {
        return 1;
    }
    let source = Source::open(&spec(path, frames));
    source.map_or(1, |source| source.info().n_frames as usize)
}

/// A picture prepared for the search, possibly reduced in size.
#[derive(Debug)]
pub struct Searched {
    /// Pyramid of the searched image.
    layout: Layout,
    /// Number of pixels of the picture per searched pixel.
    per_pixel: [f64; 2],
    /// Pixels of the searched image; `None` if the picture itself is searched.
    smaller: Option<Vec<u8>>,
}

impl Searched {
    /// Prepares a picture for the search.
    ///
    /// * `longest`: maximum length of the longer side to search, in pixels; `None` for the full size.
    ///
    /// # Errors
    ///
    /// Fails if the picture is too small for the model, or if there is not enough memory for the search.
    pub fn new(
        picture: &Picture,
        longest: Option<usize>,
        search: &Search,
    ) -> Result<Self, Failure> {
        let size = bounded(picture.size, longest);
        let layout = Layout::new(&search.model, size.width, size.height);
        let layout = layout.map_err(|error| in_file(&picture.path, &error))?;
        check_memory(&layout).map_err(|needed| {
            let message = format!("{}: {needed}", picture.path.display());
            let hint = "leave out --full, or choose a smaller --size";
            Failure::new(ExitKind::Input, message).with_hint(hint)
        })?;
        let smaller = if size == picture.size {
            None
        } else {
            let map = resize_map(picture.size, size);
            let mut pixels = vec![0; size.rgb_bytes()];
            let warp = Warp::new(picture.size, size, &map, Fill::Replicate);
            warp.or_fail(ExitKind::Input)?.apply(&picture.rgb, &mut pixels);
            Some(pixels)
        };
        let share = |of: usize, to: usize| of as f64 / to as f64;
        Ok(Self {
            layout,
            per_pixel: [
                share(picture.size.width, size.width),
                share(picture.size.height, size.height),
            ],
            smaller,
        })
    }

    /// Returns the pyramid of the searched image.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Returns the number of pixels of the picture per searched pixel, `[x, y]`.
    pub fn per_pixel(&self) -> [f64; 2] {
        self.per_pixel
    }

    /// Returns the pixels to search.
    ///
    /// # Errors
    ///
    /// Fails if the size and the pixels of the picture disagree.
    pub fn image<'a>(&'a self, picture: &'a Picture) -> Result<Rgb8View<'a>, Failure> {
        let [width, height] = self.layout.image_size;
        let rgb = self.smaller.as_deref().unwrap_or(&picture.rgb);
        let image = Rgb8View::new(width, height, rgb);
        image.map_err(|error| in_file(&picture.path, &error))
    }

    /// Returns the position in the picture of a point of the searched image.
    pub fn in_picture(&self, point: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| (point[axis] + 0.5) * self.per_pixel[axis] - 0.5)
    }
}

/// Returns the largest size with the same shape whose longer side is allowed.
fn bounded(size: Size, longest: Option<usize>) -> Size {
    let side = size.width.max(size.height);
    let Some(longest) = longest.filter(|longest| *longest < side) else {
        return size;
    };
    let scale = longest as f64 / side as f64;
    let smaller = |value: usize| ((value as f64 * scale).round() as usize).max(1);
    Size::new(smaller(size.width), smaller(size.height))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_searched_picture_keeps_its_aspect_ratio_and_is_never_enlarged() {
        let bounded = |width, height, longest| bounded(Size::new(width, height), longest);
        assert_eq!(bounded(4000, 3000, Some(1280)), Size::new(1280, 960));
        assert_eq!(bounded(3000, 4000, Some(1280)), Size::new(960, 1280));
        assert_eq!(bounded(640, 480, Some(1280)), Size::new(640, 480));
        assert_eq!(bounded(4000, 3000, None), Size::new(4000, 3000));
    }
}
