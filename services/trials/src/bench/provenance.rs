//! Provenance of a measurement: time, machine, load, version and commit.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::Serialize;

/// Provenance of a measurement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Provenance {
    /// Date and time, UTC.
    pub date: String,
    /// Processor, number of usable cores, and kernel.
    pub machine: String,
    /// Load averages of the last 1, 5 and 15 minutes, before the measurement.
    pub load: String,
    /// Version of the program.
    pub version: &'static str,
    /// Commit of the working tree that contains the executable, with `-dirty` if the tree has changes; `unknown` if the executable is not
    /// in a working tree.
    pub commit: String,
}

impl Provenance {
    /// Returns the provenance of a measurement that starts now.
    pub(super) fn now() -> Self {
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        let cores = runtime::own_cores().map_or(0, |own_core| own_core.len());
        let cpu = first("/proc/cpuinfo", "model name\t: ");
        let kernel = first("/proc/sys/kernel/osrelease", "");
        let load = first("/proc/loadavg", "");
        let load: Vec<&str> = load.split(' ').take(3).collect();
        Self {
            date: date(since.map_or(0, |since| since.as_secs())),
            machine: format!("{cpu}, {cores} cores, Linux {kernel}"),
            load: load.join(" "),
            version: env!("CARGO_PKG_VERSION"),
            commit: commit().unwrap_or_else(|| "unknown".to_owned()),
        }
    }

    /// Returns the provenance in two lines.
    pub(super) fn text(&self) -> String {
        format!(
            "{}, version {}, commit {}\n{}, load average {}",
            self.date, self.version, self.commit, self.machine, self.load
        )
    }
}

/// Returns the text after a prefix in the first line with this prefix; `unknown` if no line has the prefix.
fn first(file: &str, prefix: &str) -> String {
    let text = fs::read_to_string(file).unwrap_or_default();
    let mut lines = text.lines();
    let found = lines.find_map(|line| line.strip_prefix(prefix));
    found.unwrap_or("unknown").trim().to_owned()
}

fn commit() -> Option<String> {
    let executable = std::env::current_exe().ok()?;
    let folder = executable.parent()?;
    let commit = git(folder, &["rev-parse", "--short=12", "HEAD"])?;
    let changes = git(folder, &["status", "--porcelain", "--untracked-files=no"])?;
    let dirty = if changes.is_empty() { "" } else { "-dirty" };
    Some(format!("{commit}{dirty}"))
}

fn git(folder: &Path, arguments: &[&str]) -> Option<String> {
    let mut command = Command::new("git");
    let output = command.current_dir(folder).args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}

/// Formats seconds since 1970 as `2026-11-21 17:38:39 UTC`.
///
/// Uses Howard Hinnant's `civil_from_days`: years start in March, so that a leap day is the last day of its year.
fn date(seconds: u64) -> String {
    let (days, second) = (seconds / 86_400 + 719_468, seconds % 86_400);
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = (month_from_march + 2) % 12 + 1;
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    let (hour, minute) = (second / 3600, second / 60 % 60);
    format!(
        "{year:04}-{month:02}-{day:02} {hour:02}:{minute:02}:{:02} UTC",
        second % 60
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_converted_correctly() {
        for (seconds, expected) in [
            (0, "1970-01-01 00:00:00 UTC"),
            (951_782_399, "2000-02-28 23:59:59 UTC"),
            (951_782_400, "2000-02-29 00:00:00 UTC"),
            (951_868_800, "2000-03-01 00:00:00 UTC"),
            (1_767_225_599, "2025-12-31 23:59:59 UTC"),
            (4_107_542_400, "2100-03-01 00:00:00 UTC"),
        ] {
            assert_eq!(date(seconds), expected);
        }
    }

    #[test]
    fn the_provenance_names_machine_load_and_commit() {
        let provenance = Provenance::now();
        assert!(
            provenance.machine.contains(" cores, Linux "),
            "{}",
            provenance.machine
        );
        assert_eq!(provenance.load.split(' ').count(), 3, "{}", provenance.load);
        assert!(provenance.text().contains(&provenance.commit));
    }
}
