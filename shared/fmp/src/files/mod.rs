//! Model files: the two released formats and Parallax's own.

pub mod mat;
pub mod text;

mod mat5;
#[cfg(test)]
pub(crate) mod planted;
mod released;
mod tokens;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

pub use mat5::ContainerError;
pub use tokens::Place;

use crate::{Model, ModelError, ModelSpec};

/// Why no model came out of a file.
#[derive(Debug, thiserror::Error)]
pub enum ModelFileError {
    /// There is no such file.
    #[error(
        "there is no model file {}: Parallax ships none yet; `parallax model import` makes one from \
         Yang & Ramanan's released .mat models or from the paper authors' .txt models",
        path.display()
    )]
    Absent {
        /// The file.
        path: PathBuf,
    },
    /// The operating system refused.
    #[error("cannot {doing} the model file {}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// `read` or `write`.
        doing: &'static str,
        /// What the operating system says.
        source: io::Error,
    },
    /// The file begins like none of the formats.
    #[error(
        "{} is not a model: it begins with {beginning:?}, expected `PLXMODEL` (Parallax), `MATLAB 5.0` \
         (Yang & Ramanan) or `partsNbr` (the authors' text)",
        path.display()
    )]
    NotAModel {
        /// The file.
        path: PathBuf,
        /// Its first characters.
        beginning: String,
    },
    /// The authors' text format, but wrong.
    #[error("the model file {} cannot be read", path.display())]
    Text {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: text::TextError,
    },
    /// A MATLAB file, but not a model.
    #[error("the model file {} cannot be read", path.display())]
    Mat {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: mat::MatError,
    },
    /// The file can be read, but its model makes no sense.
    #[error("the model in {} was refused", path.display())]
    Model {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: ModelError,
    },
}

/// Reads a model file of any of the formats, told by its first bytes.
///
/// # Errors
///
/// [`ModelFileError`]; every one names the file.
pub fn read(path: &Path) -> Result<Model, ModelFileError> {
    let bytes = fs::read(path).map_err(|source| match source.kind() {
        io::ErrorKind::NotFound => ModelFileError::Absent {
            path: path.to_owned(),
        },
        _ => ModelFileError::Io {
            path: path.to_owned(),
            doing: "read",
            source,
        },
    })?;
    let spec = parse(path, &bytes)?;
    Model::new(spec).map_err(|source| ModelFileError::Model {
        path: path.to_owned(),
        source,
    })
}

fn parse(path: &Path, bytes: &[u8]) -> Result<ModelSpec, ModelFileError> {
    let path = path.to_owned();
    let stem = path.file_stem().map(|it| it.to_string_lossy().into_owned());
    let mut spec = if bytes.starts_with(b"MATLAB ") {
        mat::parse(bytes).map_err(|source| ModelFileError::Mat { path, source })?
    } else if bytes.trim_ascii_start().starts_with(b"partsNbr") {
        let text = String::from_utf8_lossy(bytes);
        text::parse(&text).map_err(|source| ModelFileError::Text { path, source })?
    } else {
        let beginning = String::from_utf8_lossy(&bytes[..bytes.len().min(16)]).into_owned();
        return Err(ModelFileError::NotAModel { path, beginning });
    };
    spec.name = stem.unwrap_or_default();
    Ok(spec)
}
