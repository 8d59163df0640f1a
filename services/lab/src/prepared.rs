//! Files of prepared examples: what a network learns from, and what is kept apart.

use std::io::{BufReader, Read as _, Write as _};
use std::path::Path;

use failure::{ExitKind, Failure};
use serde::{Serialize, de::DeserializeOwned};

/// The examples to learn from, and those that are kept apart.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub struct Prepared<T> {
    /// To learn from.
    pub learnt: Vec<T>,
    /// Kept apart: the training is watched on them.
    pub kept: Vec<T>,
}

impl<T> Default for Prepared<T> {
    fn default() -> Self {
        Self {
            learnt: Vec::new(),
            kept: Vec::new(),
        }
    }
}

impl<T> Prepared<T> {
    /// Adds an example.
    pub(crate) fn add(&mut self, example: T, is_kept: bool) {
        let to = if is_kept {
            &mut self.kept
        } else {
            &mut self.learnt
        };
        to.push(example);
    }
}

/// An example of a kind that has files of its own.
pub trait Example: Serialize + DeserializeOwned {
    /// How such a file begins.
    const KIND: &[u8; 8];
    /// The command that writes it.
    const MADE_BY: &str;

    /// Returns whether it has as many pixels as it should.
    fn is_whole(&self) -> bool;
}

/// How a file ends: one that was cut short lacks it.
const END: &[u8; 8] = b"EVERYONE";

/// Writes prepared examples; the file appears when it is whole.
///
/// # Errors
///
/// The file cannot be written.
pub fn write<T: Example>(path: &Path, examples: &Prepared<T>) -> Result<(), Failure> {
    let written = files::replace_by(path, |file| {
        file.write_all(T::KIND)?;
        let config = bincode::config::standard();
        bincode::serde::encode_into_std_write(examples, file, config)
            .map_err(std::io::Error::other)?;
        file.write_all(END)
    });
    written.map_err(|error| failure::in_file(path, &error))
}

/// Returns whether a file holds prepared examples of a kind.
pub fn is_file<T: Example>(path: &Path) -> bool {
    let mut mark = [0; 8];
    let read = files::open(path).and_then(|mut file| file.read_exact(&mut mark));
    read.is_ok() && &mark == T::KIND
}

/// Reads what [`write()`] wrote.
///
/// # Errors
///
/// The file cannot be read, or holds something else.
pub fn read<T: Example>(path: &Path) -> Result<Prepared<T>, Failure> {
    let fail = |error: std::io::Error| failure::in_file(path, &error);
    let is_other = || {
        let message = format!(
            "{}: not a file of `parallax-lab train {}`",
            path.display(),
            T::MADE_BY
        );
        Failure::new(ExitKind::Input, message)
    };
    let mut file = BufReader::with_capacity(1 << 20, files::open(path).map_err(fail)?);
    let mut mark = [0; 8];
    let n = file.read(&mut mark).map_err(fail)?;
    if n < mark.len() || &mark != T::KIND {
        return Err(is_other());
    }
    let config = bincode::config::standard();
    let examples: Prepared<T> = bincode::serde::decode_from_std_read(&mut file, config)
        .map_err(|error| failure::in_file(path, &error))?;
    file.read_exact(&mut mark).map_err(fail)?;
    let mut all = examples.learnt.iter().chain(&examples.kept);
    if &mark != END || !all.all(T::is_whole) {
        return Err(is_other());
    }
    Ok(examples)
}
