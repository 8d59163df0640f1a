//! Files of prepared examples: training examples of a network, and held-out examples.

use std::io::{BufReader, Read as _, Write as _};
use std::path::Path;

use failure::{ExitKind, Failure};
use serde::{Serialize, de::DeserializeOwned};

/// Training examples and held-out examples.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub struct Prepared<T> {
    /// Training examples.
    pub learnt: Vec<T>,
    /// Held-out examples, to monitor the training.
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

    /// Adds all examples of another list.
    pub fn append(&mut self, mut others: Self) {
        self.learnt.append(&mut others.learnt);
        self.kept.append(&mut others.kept);
    }
}

/// A kind of example with its own file format.
pub trait Example: Serialize + DeserializeOwned {
    /// First bytes of a file of this kind.
    const KIND: &[u8; 8];
    /// The command that writes these files.
    const MADE_BY: &str;

    /// Returns true if the example has the right number of pixels.
    fn is_whole(&self) -> bool;
}

/// Last bytes of a file; a truncated file does not have them.
const END: &[u8; 8] = b"EVERYONE";

/// Writes prepared examples. The file appears only when it is complete.
///
/// # Errors
///
/// Fails if the file cannot be written.
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

/// Returns true if a file contains prepared examples of a kind.
pub fn is_file<T: Example>(path: &Path) -> bool {
    let mut mark = [0; 8];
    let read = files::open(path).and_then(|mut file| file.read_exact(&mut mark));
    read.is_ok() && &mark == T::KIND
}

/// Reads a file that [`write()`] wrote.
///
/// # Errors
///
/// Fails if the file cannot be read or contains something else.
pub fn read<T: Example>(path: &Path) -> Result<Prepared<T>, Failure> {
    let fail = |error: std::io::Error| failure::in_file(path, &error);
    let is_other = || {
        let message = format!(
            "{}: this is not a file of `parallax-lab train {}`",
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
