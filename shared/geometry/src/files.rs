//! Calibration files: reading and writing of rigs in the formats of other programs and in Parallax's own format.
//!
//! Every format has a module with `parse`, which works on text, so that tests need no file. The functions of this module read and write
//! the files. The internal form always has metres, world-to-camera poses, and pixels counted from the centre of the top-left pixel.

use std::path::{Path, PathBuf};

use nalgebra::UnitVector3;

use crate::Rig;

mod detect;
mod entry;
mod error;
mod numbers;
mod toml_fields;

pub mod humaneva;
pub mod opencv;
pub mod own;
pub mod panoptic;
pub mod pose2sim;
pub mod qualisys;
pub mod umpm;

mod check;

pub use check::{CameraError, EpipolarReport, Finding, PairError, Severity, check, epipolar_check};
pub use detect::detect;
pub use error::{ParseError, RigFileError, UnwritableRig};

#[cfg(test)]
mod tests;

/// Maximum size of a calibration file, in bytes.
const LARGEST_FILE: u64 = 16 << 20;

/// Format of a calibration file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Parallax's own TOML: [`own`].
    Own,
    /// TOML of Pose2Sim, anipose, Caliscope and `FreeMoCap`: [`pose2sim`].
    Pose2Sim,
    /// The same TOML in millimetres, as written for anipose and `FreeMoCap`; reading treats it as [`Pose2Sim`](Self::Pose2Sim).
    Anipose,
    /// XML of Qualisys: [`qualisys`].
    Qualisys,
    /// YAML of `OpenCV` and `EasyMocap`: [`opencv`].
    OpenCv,
    /// `.cal` of `HumanEva`: [`humaneva`].
    HumanEva,
    /// `.ini` of UMPM: [`umpm`].
    Umpm,
    /// JSON of CMU Panoptic: [`panoptic`].
    Panoptic,
}

impl Format {
    /// Returns the name of the format for messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Own => "Parallax rig",
            Self::Pose2Sim => "Pose2Sim calibration",
            Self::Anipose => "anipose calibration",
            Self::Qualisys => "Qualisys calibration",
            Self::OpenCv => "OpenCV storage",
            Self::HumanEva => "HumanEva .cal",
            Self::Umpm => "UMPM .ini",
            Self::Panoptic => "Panoptic calibration",
        }
    }
}

/// Unit of lengths in a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unit {
    /// Metres.
    Metres,
    /// Centimetres.
    Centimetres,
    /// Millimetres.
    Millimetres,
    /// Feet.
    Feet,
    /// Inches.
    Inches,
    /// The given number of metres, such as the side of a square of the calibration board.
    Length(f64),
}

/// Error for a text that is not a unit of length.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{text:?} is not a unit: expected m, cm, mm, ft, in, or a length such as 30mm (the side of a square of the board)"
)]
pub struct UnitError {
    /// The text that was given.
    pub text: String,
}

impl core::str::FromStr for Unit {
    type Err = UnitError;

    fn from_str(text: &str) -> Result<Self, UnitError> {
        let named = |name: &str| match name {
            "m" => Some(Self::Metres),
            "cm" => Some(Self::Centimetres),
            "mm" => Some(Self::Millimetres),
            "ft" => Some(Self::Feet),
            "in" => Some(Self::Inches),
            _ => None,
        };
        let name = text.trim_start_matches(|letter: char| letter.is_ascii_digit() || letter == '.');
        let number = &text[..text.len() - name.len()];
        let unit = named(name.trim());
        let found = match (number, unit) {
            ("", unit) => unit,
            (number, Some(unit)) => {
                let metres = number.parse().ok().map(|value: f64| value / unit.per_metre());
                metres.filter(|metres| (1e-6..=1e3).contains(metres)).map(Self::Length)
            }
            (_, None) => None,
        };
        found.ok_or_else(|| UnitError {
            text: text.chars().take(32).collect(),
        })
    }
}

impl Unit {
    /// Returns the number of units in a metre.
    pub fn per_metre(self) -> f64 {
        match self {
            Self::Metres => 1.0,
            Self::Centimetres => 100.0,
            Self::Millimetres => 1000.0,
            Self::Feet => 1.0 / 0.3048,
            Self::Inches => 1.0 / 0.0254,
            Self::Length(metres) => 1.0 / metres,
        }
    }
}

/// Values to use if a calibration file does not contain them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ReadOptions {
    /// Unit of lengths, if it differs from the usual unit of the format.
    pub unit: Option<Unit>,
    /// Up direction (opposite to gravity), if the file does not state it.
    pub up: Option<UnitVector3<f64>>,
    /// Image size, if the file does not state it.
    pub size: Option<[u32; 2]>,
    /// True to include cameras for which the file has a lens but no pose; they are placed at the origin.
    pub lenses_suffice: bool,
}

/// Reads a calibration file of any known format.
///
/// # Errors
///
/// Fails with a [`RigFileError`], which names the file; its source names the field.
pub fn read(path: &Path, options: &ReadOptions) -> Result<Rig, RigFileError> {
    read_many(&[path], options)
}

/// Reads several files as one rig: one file for each camera, or the pair of files of `EasyMocap`.
///
/// The cameras have the order of the files. If a file with one camera does not name it, the camera is named after the file's
/// stem: `C1.cal` is camera `C1`.
///
/// # Errors
///
/// Fails like [`read`], and also if the formats differ or two cameras have the same name.
pub fn read_many(paths: &[&Path], options: &ReadOptions) -> Result<Rig, RigFileError> {
    let mut documents = Vec::new();
    for path in paths {
        let text = read_text(path)?;
        let format = detect(path, &text);
        let format = format.ok_or_else(|| RigFileError::UnknownFormat {
            path: path.to_path_buf(),
        })?;
        documents.push(Document {
            path: path.to_path_buf(),
            format,
            text,
        });
    }
    let Some(first) = documents.first() else {
        return Err(RigFileError::NoFiles);
    };
    if let Some(other) = documents.iter().find(|other| other.format != first.format) {
        return Err(RigFileError::Mixed {
            path: other.path.clone(),
            format: other.format.name(),
            first: first.format.name(),
        });
    }
    combine(&documents, first, options)
}

/// Writes a rig.
///
/// A `HumanEva` or UMPM file has one camera. For these formats, `path` is an existing folder, and the files are named after the cameras.
/// The formats of Qualisys and Panoptic can only be read.
///
/// # Errors
///
/// Fails with [`RigFileError::Unwritable`] if the format cannot describe the rig, and with [`RigFileError::Write`] if the file cannot be
/// written.
pub fn write(path: &Path, format: Format, rig: &Rig) -> Result<(), RigFileError> {
    let unwritable = |source| RigFileError::Unwritable {
        path: path.to_path_buf(),
        source,
    };
    let single = |text: Result<String, UnwritableRig>| Ok(vec![(path.to_path_buf(), text?)]);
    let each = |extension: &str, text: fn(&crate::Camera) -> Result<String, UnwritableRig>| {
        let file = |camera: &crate::Camera| {
            error::check_file_name(camera)?;
            Ok((
                path.join(format!("{}.{extension}", camera.name)),
                text(camera)?,
            ))
        };
        rig.cameras().iter().map(file).collect()
    };
    let files: Result<Vec<(PathBuf, String)>, UnwritableRig> = match format {
        Format::Own => single(Ok(own::write(rig))),
        Format::Pose2Sim => single(pose2sim::write(rig)),
        Format::Anipose => single(pose2sim::write_anipose(rig)),
        Format::OpenCv => single(opencv::write(rig)),
        Format::HumanEva => each("cal", humaneva::write),
        Format::Umpm => each("ini", umpm::write),
        Format::Qualisys | Format::Panoptic => Err(UnwritableRig::ReadOnly {
            format: format.name(),
        }),
    };
    for (path, text) in files.map_err(unwritable)? {
        ::files::replace(&path, text.as_bytes())
            .map_err(|source| RigFileError::Write { path, source })?;
    }
    Ok(())
}

struct Document {
    path: PathBuf,
    format: Format,
    text: String,
}

impl Document {
    fn stem(&self) -> String {
        self.path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
    }

    fn parse(&self, options: &ReadOptions) -> Result<Rig, RigFileError> {
        let rig = match self.format {
            Format::Own => own::parse(&self.text, options),
            Format::Pose2Sim | Format::Anipose => pose2sim::parse(&self.text, options),
            Format::Qualisys => qualisys::parse(&self.text, options),
            Format::OpenCv => opencv::parse(&[(&self.stem(), &self.text)], options),
            Format::HumanEva => humaneva::parse(&self.stem(), &self.text, options),
            Format::Umpm => umpm::parse(&self.stem(), &self.text, options),
            Format::Panoptic => panoptic::parse(&self.text, options),
        };
        rig.map_err(|source| self.error(source))
    }

    fn error(&self, source: ParseError) -> RigFileError {
        RigFileError::Parse {
            path: self.path.clone(),
            source,
        }
    }
}

fn read_text(path: &Path) -> Result<String, RigFileError> {
    let failed = |source| RigFileError::Read {
        path: path.to_path_buf(),
        source,
    };
    let bytes = std::fs::metadata(path).map_err(failed)?.len();
    if bytes > LARGEST_FILE {
        return Err(RigFileError::TooLarge {
            path: path.to_path_buf(),
            bytes,
            limit: LARGEST_FILE,
        });
    }
    ::files::read_text(path, LARGEST_FILE).map_err(failed)
}

fn combine(
    documents: &[Document],
    first: &Document,
    options: &ReadOptions,
) -> Result<Rig, RigFileError> {
    let source = documents
        .iter()
        .map(|document| document.path.file_name().unwrap_or_default().to_string_lossy())
        .collect::<Vec<_>>()
        .join(", ");
    if first.format == Format::OpenCv {
        // The data of one camera may be in several of these files.
        let stems: Vec<String> = documents.iter().map(Document::stem).collect();
        let texts = documents.iter().zip(&stems).map(|(d, stem)| (stem.as_str(), d.text.as_str()));
        let rig = opencv::parse(&texts.collect::<Vec<_>>(), options);
        let rig = rig.map_err(|source| first.error(source))?;
        let left_out = rig.left_out().to_vec();
        let rig = rebuild(rig.cameras().to_vec(), rig.up_in_world(), &source, first)?;
        return Ok(rig.with_left_out(left_out));
    }
    let (mut cameras, mut left_out) = (Vec::new(), Vec::new());
    let mut up = None;
    let mut written = None;
    for document in documents {
        let rig = document.parse(options)?;
        up = up.or(rig.up_in_world());
        written = Some(rig.source().to_owned()).filter(|source| !source.is_empty());
        cameras.extend_from_slice(rig.cameras());
        left_out.extend_from_slice(rig.left_out());
    }
    let source = written.filter(|_| documents.len() == 1).unwrap_or(source);
    Ok(rebuild(cameras, up, &source, first)?.with_left_out(left_out))
}

fn rebuild(
    cameras: Vec<crate::Camera>,
    up: Option<UnitVector3<f64>>,
    source: &str,
    first: &Document,
) -> Result<Rig, RigFileError> {
    Rig::new(cameras, up, source).map_err(|error| first.error(ParseError::Rig(error)))
}
