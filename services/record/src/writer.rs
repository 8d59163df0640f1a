//! The thread that writes the file.

use core::time::Duration;
use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use recording::{About, Kind, WriteError, Writer};

use crate::foxglove::Foxglove;
use crate::queue::Outlet;

/// Longest time from the arrival of a message until it is in the file.
const FLUSH_PERIOD: Duration = Duration::from_secs(1);

/// Returns the path of the file that the process writes in an epoch. After a restart, it writes another file in the same folder.
pub fn file_of_life(file: &Path, epoch: u32) -> PathBuf {
    if epoch == 0 {
        return file.to_owned();
    }
    let ending = file.extension().unwrap_or_default().to_string_lossy();
    file.with_extension(format!("{epoch}.{ending}"))
}

/// Creates a new file. Only its owner can read it, because it shows people. The file is locked while it is written.
pub(crate) fn create(file: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    let made = options.write(true).create_new(true).mode(0o600).open(file)?;
    if let Err(error) = made.try_lock() {
        tracing::debug!(%error, "cannot lock the recording");
    }
    Ok(made)
}

/// The file, and its first entries.
pub(crate) struct Task {
    pub file: File,
    pub about: About,
    pub topics: Vec<String>,
    /// Creates the messages for Foxglove, if they are written.
    pub foxglove: Option<Foxglove>,
}

/// Writes messages until the queue is closed. After a write error, messages are counted as lost.
pub(crate) fn write_all(task: Task, outlet: &Outlet) {
    let Task {
        file,
        about,
        topics,
        mut foxglove,
    } = task;
    let foreign = foxglove.as_ref().map_or_else(Vec::new, Foxglove::topics);
    let begun = Writer::begin_with(file, &about, &topics, &foreign);
    let kinds: Vec<Option<Kind>> = topics.iter().map(|topic| Kind::of_topic(topic)).collect();
    let mut writer = begun.inspect_err(log_error).ok();
    let mut flushed = Instant::now();
    while let Ok(item) = outlet.next(FLUSH_PERIOD) {
        let Some(open) = &mut writer else {
            if let Some(item) = item {
                outlet.lose(&item);
            }
            continue;
        };
        let mut outcome = Ok(());
        if let Some(item) = &item {
            outcome = open.write(item.topic, &item.entry, &item.data);
            let kind = kinds.get(item.topic).copied().flatten();
            if let Some((foxglove, kind)) = foxglove.as_mut().zip(kind) {
                for (nth, json) in foxglove.messages(kind, &item.data) {
                    let written = open.write(topics.len() + nth, &item.entry, json.as_bytes());
                    outcome = outcome.and(written);
                }
            }
        }
        if outcome.is_ok() && flushed.elapsed() >= FLUSH_PERIOD {
            flushed = Instant::now();
            outcome = open.flush(&outlet.lost());
        }
        match (item, outcome) {
            (Some(item), Ok(())) => outlet.written(&item),
            (None, Ok(())) => {}
            (item, Err(error)) => {
                log_error(&error);
                if let Some(item) = item {
                    outlet.lose(&item);
                }
                writer = None;
            }
        }
    }
    if let Some(writer) = writer
        && let Err(error) = writer.finish(&outlet.lost())
    {
        log_error(&error);
    }
}

fn log_error(error: &WriteError) {
    let source = core::error::Error::source(error);
    let why = source.map(ToString::to_string).unwrap_or_default();
    tracing::error!(%error, why, "the recording ends here; the messages in it can be read");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_epoch_has_its_own_file() {
        let file = Path::new("out/run.mcap");
        assert_eq!(file_of_life(file, 0), file);
        assert_eq!(file_of_life(file, 2), Path::new("out/run.2.mcap"));
    }

    #[test]
    fn an_existing_file_is_not_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("run.mcap");
        create(&file).unwrap();
        let refused = create(&file).map(drop).unwrap_err();
        assert_eq!(refused.kind(), io::ErrorKind::AlreadyExists);
    }
}
