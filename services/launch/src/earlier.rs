//! Results that are already in an output folder before a run begins.

use std::fs;
use std::io;
use std::path::Path;

use deployment::Deployment;
use failure::{ExitKind, Failure, in_file};
use runfiles::{FrameLine, LatencyReport, Line as _, RunSummary, TimesLine, ViewLine};
use runtime::Namespace;
use serde_json::Value;

/// Files and folders that a run writes.
const RESULTS: [&str; 10] = [
    FrameLine::FILE,
    "pose3d.csv",
    "pose3d.trc",
    ViewLine::FILE,
    TimesLine::FILE,
    LatencyReport::FILE,
    RunSummary::FILE,
    FrameLine::SMOOTHED_FILE,
    "overlays",
    crate::summary::PAGE,
];
/// Folder to which `parallax export` writes by default.
const EXPORT: &str = "export";
/// Ending of the file that lists the exported files.
const MANIFEST: &str = ".export.json";

/// Refuses a deployment if another deployment with the same name is running. This check comes before checks that take a long time.
/// Deployments of several hosts get a name per host later, and are refused when their processes start.
///
/// # Errors
///
/// Fails if a deployment with the same name is running, or the files in shared memory cannot be created.
pub fn check_name(deployment: &Deployment) -> Result<(), Failure> {
    if deployment.hosts.is_empty() {
        drop(Namespace::new(&deployment.name)?.acquire()?);
    }
    Ok(())
}

/// Refuses an output folder that contains results of an earlier run, or other files with the names of results.
///
/// * `force`: true to replace the results of an earlier run. Files that were exported from these results are removed. The results
///   themselves are kept until the new results are complete.
///
/// # Errors
///
/// Fails if the folder is refused, another run writes to it, or it cannot be read.
pub fn make_way(folder: &Path, force: bool) -> Result<(), Failure> {
    failure::check_claim(folder)?;
    let lies_there = |name: &&str| fs::symlink_metadata(folder.join(name)).is_ok();
    let unfinished = format!("{}.part", FrameLine::FILE);
    let is_unfinished = fs::metadata(folder.join(&unfinished)).is_ok_and(|data| data.len() > 0);
    let first = RESULTS.iter().copied().find(lies_there);
    let Some(first) = first.or(is_unfinished.then_some(unfinished.as_str())) else {
        return Ok(());
    };
    let Some(name) = deployment_of(folder) else {
        let message = format!(
            "{} contains {first}, which no run of parallax has written",
            folder.display()
        );
        let failure = Failure::new(ExitKind::Config, message);
        return Err(failure.with_hint("move it away, or choose another folder with --out"));
    };
    if !force {
        let message = format!(
            "{} has the results of an earlier run of {name} ({first})",
            folder.display()
        );
        let failure = Failure::new(ExitKind::Config, message);
        return Err(
            failure.with_hint("pass --force to replace them, or choose another folder with --out")
        );
    }
    remove_exports(&folder.join(EXPORT)).map_err(|error| in_file(&folder.join(EXPORT), &error))
}

/// Returns the name of the deployment whose results are in a folder, or `None` if no run has written there.
fn deployment_of(folder: &Path) -> Option<String> {
    let text = files::read_text(&folder.join("deployment.json"), files::SETTINGS).ok()?;
    let value: Value = serde_json::from_str(&text).ok()?;
    let name = value.get("deployment")?.get("name")?.as_str()?;
    Some(name.to_owned())
}

/// Removes the files that `parallax export` has written, according to its list. Other files are kept.
fn remove_exports(folder: &Path) -> io::Result<()> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        entries => entries?,
    };
    for entry in entries {
        let manifest = entry?.path();
        let name = manifest.file_name().unwrap_or_default().to_string_lossy();
        if !name.ends_with(MANIFEST) {
            continue;
        }
        let text = files::read_text(&manifest, files::SETTINGS)?;
        let value: Value = serde_json::from_str(&text).map_err(io::Error::other)?;
        let listed = value.get("files").and_then(Value::as_array);
        for file in listed.into_iter().flatten() {
            let path = file.get("path").and_then(Value::as_str).map(Path::new);
            // Only files in the folder are removed, even if the list names files in other folders.
            let Some(name) = path.and_then(Path::file_name) else {
                continue;
            };
            results::remove_pictures(&folder.join(name)).map_err(|error| error.source)?;
        }
        fs::remove_file(&manifest)?;
    }
    match fs::remove_dir(folder) {
        Err(error) if error.kind() != io::ErrorKind::DirectoryNotEmpty => Err(error),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(folder: &Path, force: bool) -> String {
        make_way(folder, force).unwrap_err().to_string()
    }

    #[test]
    fn results_are_replaced_on_request_and_foreign_files_are_never_replaced() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path();
        make_way(&folder.join("not there"), false).unwrap();
        make_way(folder, false).unwrap();
        fs::write(folder.join("pose3d.csv"), "mine").unwrap();
        for force in [false, true] {
            let text = refused(folder, force);
            assert!(
                text.contains("which no run of parallax has written"),
                "{text}"
            );
        }
        let about = "{\"deployment\": {\"name\": \"room\"}}";
        fs::write(folder.join("deployment.json"), about).unwrap();
        let text = refused(folder, false);
        assert!(
            text.contains("an earlier run of room (pose3d.csv)"),
            "{text}"
        );
        make_way(folder, true).unwrap();
        assert!(
            folder.join("pose3d.csv").exists(),
            "until the new one is whole"
        );
    }

    #[test]
    fn replacing_an_unfinished_run_prints_a_message() {
        let dir = tempfile::tempdir().unwrap();
        let part = dir.path().join("pose3d.jsonl.part");
        fs::write(&part, "").unwrap();
        make_way(dir.path(), false).unwrap();
        fs::write(&part, "{}\n").unwrap();
        fs::write(
            dir.path().join("deployment.json"),
            "{\"deployment\": {\"name\": \"a\"}}",
        )
        .unwrap();
        assert!(refused(dir.path(), false).contains("pose3d.jsonl.part"));
    }

    #[test]
    fn exported_files_are_removed_with_their_results_and_other_files_stay() {
        let dir = tempfile::tempdir().unwrap();
        let export = dir.path().join("export");
        fs::create_dir(&export).unwrap();
        let about = "{\"deployment\": {\"name\": \"a\"}}";
        for (name, text) in [
            ("deployment.json", about),
            ("pose3d.csv", ""),
            ("export/pose3d.c3d", ""),
            ("export/notes.txt", ""),
            (
                "export/pose3d.export.json",
                "{\"files\": [{\"path\": \"/elsewhere/export/pose3d.c3d\"}]}",
            ),
        ] {
            fs::write(dir.path().join(name), text).unwrap();
        }
        make_way(dir.path(), true).unwrap();
        let left: Vec<_> = fs::read_dir(&export).unwrap().collect();
        assert_eq!(left.len(), 1);
        assert!(export.join("notes.txt").exists());
        fs::remove_file(export.join("notes.txt")).unwrap();
        make_way(dir.path(), true).unwrap();
        assert!(!export.exists());
    }
}
