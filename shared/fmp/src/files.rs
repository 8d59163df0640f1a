//! Model files: the two released formats and Parallax's own.

pub mod mat;
pub mod own;
pub mod text;

mod payload;
#[cfg(test)]
pub(crate) mod planted;
mod released;
mod summary;

use std::io;
use std::path::{Path, PathBuf};

pub use summary::{ModelSummary, PartSummary, SpringRanges, describe};

use crate::{Model, ModelError, ModelSpec};

/// Reason why a model file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ModelFileError {
    /// The file does not exist.
    #[error(
        "there is no model file {}: leave the model out to use the one that ships with Parallax; `parallax-lab model \
         import` makes one from Yang & Ramanan's released .mat models or from the paper authors' .txt models",
        path.display()
    )]
    Absent {
        /// Path of the file.
        path: PathBuf,
    },
    /// The operating system reported an error.
    #[error("cannot {doing} the model file {}", path.display())]
    Io {
        /// Path of the file.
        path: PathBuf,
        /// The action, `read` or `write`.
        doing: &'static str,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The file is empty.
    #[error("the model file {} is empty (0 bytes)", path.display())]
    Empty {
        /// Path of the file.
        path: PathBuf,
    },
    /// The beginning of the file matches no known format.
    #[error(
        "{} is not a model: the file begins with \"{beginning}\", expected `PLXMODEL` (Parallax), `MATLAB 5.0` \
         (Yang & Ramanan) or `partsNbr` (the authors' text)",
        path.display()
    )]
    NotAModel {
        /// Path of the file.
        path: PathBuf,
        /// First characters of the file.
        beginning: String,
    },
    /// A file in the authors' text format contains an error.
    #[error("the model file {} cannot be read", path.display())]
    Text {
        /// Path of the file.
        path: PathBuf,
        /// The error in the text.
        source: text::TextError,
    },
    /// A MATLAB file that is not a valid model.
    #[error("the model file {} cannot be read", path.display())]
    Mat {
        /// Path of the file.
        path: PathBuf,
        /// The error in the MATLAB file.
        source: mat::MatError,
    },
    /// A Parallax file is damaged, or a model could not be encoded.
    #[error("{} is not a valid model file", path.display())]
    Own {
        /// Path of the file.
        path: PathBuf,
        /// The error in the Parallax file.
        source: own::OwnError,
    },
    /// The file can be read, but its model is invalid.
    #[error("the model in {} was refused", path.display())]
    Model {
        /// Path of the file.
        path: PathBuf,
        /// The error in the model.
        source: ModelError,
    },
}

/// Reads a model file of any supported format; the format is recognised by the first bytes.
///
/// A released model gets the name of the file, without the extension.
///
/// # Errors
///
/// [`ModelFileError`]; every variant names the file.
pub fn read(path: &Path) -> Result<Model, ModelFileError> {
    let bytes = ::files::read(path, ::files::MODEL).map_err(|source| match source.kind() {
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

/// Writes a model as Parallax's own file.
///
/// The write is atomic: a temporary file is written beside the target, flushed to the disk, and then
/// renamed.
///
/// # Errors
///
/// [`ModelFileError::Io`] and [`ModelFileError::Own`].
pub fn write(path: &Path, model: &Model) -> Result<(), ModelFileError> {
    let bytes = own::encode(model).map_err(|source| ModelFileError::Own {
        path: path.to_owned(),
        source,
    })?;
    files::replace(path, &bytes).map_err(|source| ModelFileError::Io {
        path: path.to_owned(),
        doing: "write",
        source,
    })
}

fn parse(path: &Path, bytes: &[u8]) -> Result<ModelSpec, ModelFileError> {
    let path = path.to_owned();
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    if bytes.starts_with(&own::MAGIC) {
        return own::decode(bytes).map_err(|source| ModelFileError::Own { path, source });
    }
    let mut spec = if bytes.starts_with(b"MATLAB ") {
        mat::parse(bytes).map_err(|source| ModelFileError::Mat { path, source })?
    } else if bytes.trim_ascii_start().starts_with(b"partsNbr") {
        let text = String::from_utf8_lossy(bytes);
        text::parse(&text).map_err(|source| ModelFileError::Text { path, source })?
    } else {
        if bytes.is_empty() {
            return Err(ModelFileError::Empty { path });
        }
        let beginning = beginning(bytes);
        return Err(ModelFileError::NotAModel { path, beginning });
    };
    spec.name = stem.unwrap_or_default();
    Ok(spec)
}

/// Returns the first characters of a file; unprintable characters become dots.
fn beginning(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(16)]);
    let shown = |letter: char| {
        let is_odd = letter.is_control() || letter == char::REPLACEMENT_CHARACTER;
        if is_odd { '.' } else { letter }
    };
    text.chars().map(shown).collect()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn outcome(name: &str, bytes: &[u8]) -> String {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(name);
        fs::write(&path, bytes).unwrap();
        match read(&path) {
            Ok(model) => format!("fine: {}", model.spec().name),
            Err(error) => error.to_string().replace(&dir.path().display().to_string(), "dir"),
        }
    }

    #[test]
    fn every_format_is_recognised_by_its_first_bytes() {
        let spec = planted::three_parts();
        let text = planted::as_text(&spec);
        assert_eq!(outcome("he.dat", text.as_bytes()), "fine: he");
        let mat = testkit::mat::file("model", &planted::mat::model(&spec), true);
        assert_eq!(outcome("parse.final.txt", &mat), "fine: parse.final");
        let own = own::encode(&Model::new(spec).unwrap()).unwrap();
        assert_eq!(outcome("other.mat", &own), "fine: unnamed");
    }

    #[test]
    fn other_files_are_rejected_with_the_file_name() {
        let expected = "dir/m is not a model: the file begins with \".PNG.\", expected `PLXMODEL` (Parallax), \
                        `MATLAB 5.0` (Yang & Ramanan) or `partsNbr` (the authors' text)";
        assert_eq!(outcome("m", b"\x89PNG\n"), expected);
        assert_eq!(outcome("m", b""), "the model file dir/m is empty (0 bytes)");
    }

    #[test]
    fn the_error_for_a_missing_model_explains_where_models_come_from() {
        let error = read(Path::new("no/such.plx")).unwrap_err();
        assert!(matches!(error, ModelFileError::Absent { .. }));
        assert!(error.to_string().starts_with("there is no model file no/such.plx: "));
        assert!(error.to_string().contains("parallax-lab model import"));
        assert!(error.to_string().contains("the one that ships with Parallax"));
    }

    #[test]
    fn a_folder_is_rejected() {
        let dir = tempfile::tempdir().unwrap();
        let error = read(dir.path()).unwrap_err();
        assert!(matches!(error, ModelFileError::Io { doing: "read", .. }));
    }

    #[test]
    fn an_invalid_model_is_rejected() {
        let mut spec = planted::three_parts();
        spec.interval = 65;
        let expected = "the model in dir/m was refused";
        assert_eq!(outcome("m", planted::as_text(&spec).as_bytes()), expected);
    }

    #[test]
    fn damage_is_reported_with_the_name_of_the_file() {
        let expected = "the model file dir/m cannot be read";
        assert_eq!(outcome("m", b"partsNbr 1 typ"), expected);
        assert_eq!(outcome("m", b"MATLAB 5.0"), expected);
        assert_eq!(outcome("m", b"PLXMODEL"), "dir/m is not a valid model file");
    }

    #[test]
    fn writing_replaces_the_file_and_leaves_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("m.plx");
        for spec in [planted::three_parts(), planted::per_pair()] {
            let model = Model::new(spec).unwrap();
            write(&path, &model).unwrap();
            assert_eq!(read(&path).unwrap(), model);
        }
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_failed_write_leaves_no_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("m.plx");
        fs::create_dir(&path).unwrap();
        let model = Model::new(planted::three_parts()).unwrap();
        let error = write(&path, &model).unwrap_err();
        assert!(matches!(error, ModelFileError::Io { doing: "write", .. }));
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }
}
