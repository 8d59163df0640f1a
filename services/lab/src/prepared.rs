//! Files of prepared examples: training examples of a network, and held-out examples.

use std::io::{BufReader, Read as _, Write as _};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use failure::{Console, ExitKind, Failure};
use serde::{Serialize, de::DeserializeOwned};

/// One in this many blocks of photographs is held out, and one in this many subjects of the scenes.
const KEPT: usize = 12;
/// Number of consecutive photographs that are held out together, because neighbouring photographs often show the same event or person.
const BLOCK: usize = 20;

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
    /// Divides examples into training examples and held-out examples, and shows their numbers.
    ///
    /// * `photographs`: with their positions in their data set.
    /// * `scenes`: with the numbers of the subjects.
    /// * `name`: name of the examples, such as `people`.
    pub(crate) fn divided(
        photographs: impl IntoIterator<Item = (usize, T)>,
        scenes: Vec<(u64, T)>,
        (name, console): (&str, &dyn Console),
    ) -> Self {
        let mut all = Self::default();
        let photographs = photographs.into_iter();
        let photographs =
            photographs.map(|(nth, example)| (nth / BLOCK % KEPT == KEPT - 1, example));
        let scenes = scenes.into_iter();
        let scenes =
            scenes.map(|(subject, example)| (subject.is_multiple_of(KEPT as u64), example));
        for (is_kept, example) in photographs.chain(scenes) {
            let to = if is_kept {
                &mut all.kept
            } else {
                &mut all.learnt
            };
            to.push(example);
        }
        let [learnt, kept] = [all.learnt.len(), all.kept.len()];
        console.message(&format!(
            "{learnt} {name} are used for training, and {kept} are held out"
        ));
        all
    }

    /// Adds all examples of another list.
    pub fn append(&mut self, mut others: Self) {
        self.learnt.append(&mut others.learnt);
        self.kept.append(&mut others.kept);
    }
}

/// Calls a function on all items, on one thread for each teacher. Without teachers, it starts as many threads as rayon has. Returns the
/// results in the order of the items.
///
/// The function starts its own threads. Networks run on rayon's threads too. While a rayon thread waits for a network, it would start to
/// process another item, and so on, until its stack overflows.
///
/// * `task`: the task of the threads, for the message if one panics.
pub(crate) fn on_threads<I: Sync, T: Sync, R: Send>(
    items: &[I],
    teachers: &[T],
    task: &str,
    make: impl Fn(&I, Option<&T>) -> Result<R, Failure> + Sync,
) -> Result<Vec<R>, Failure> {
    let n_threads = match teachers.len() {
        0 => rayon::current_num_threads(),
        n => n,
    };
    let next = AtomicUsize::new(0);
    let of_thread = |teacher: Option<&T>| {
        let mut made = Vec::new();
        loop {
            let nth = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(nth) else {
                return Ok::<_, Failure>(made);
            };
            made.push((nth, make(item, teacher)?));
        }
    };
    let of_thread = &of_thread;
    let made: Result<Vec<_>, Failure> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..n_threads)
            .map(|nth| scope.spawn(move || of_thread(teachers.get(nth))))
            .collect();
        let died = |_| Failure::new(ExitKind::Run, format!("a thread that {task} has panicked"));
        threads.into_iter().map(|thread| thread.join().map_err(died)?).collect()
    });
    let mut made: Vec<(usize, R)> = made?.into_iter().flatten().collect();
    made.sort_by_key(|(nth, _)| *nth);
    Ok(made.into_iter().map(|(_, result)| result).collect())
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
