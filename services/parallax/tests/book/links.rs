//! Links between Markdown files.

use std::fs;
use std::path::{Path, PathBuf};

use super::blocks::prose;

/// Returns the broken links in files, with their locations.
pub(crate) fn broken(root: &Path, files: &[PathBuf]) -> Vec<String> {
    let mut problems = Vec::new();
    for file in files {
        let text = fs::read_to_string(file).unwrap();
        for target in targets(&text) {
            if let Err(problem) = follow(root, file, &target) {
                problems.push(format!("{}: ({target}): {problem}", file.display()));
            }
        }
    }
    problems
}

/// Returns the targets of a text's links, except web addresses.
fn targets(text: &str) -> Vec<String> {
    let prose = prose(text);
    let without_code: String = prose.split('`').step_by(2).collect();
    let mut found = Vec::new();
    for rest in without_code.split("](").skip(1) {
        let target: String = rest.chars().take_while(|c| *c != ')').collect();
        if !target.contains("://") {
            found.push(target);
        }
    }
    found
}

fn follow(root: &Path, file: &Path, target: &str) -> Result<(), String> {
    let (path, anchor) = target.split_once('#').unwrap_or((target, ""));
    let page = if path.is_empty() {
        file.to_owned()
    } else {
        file.parent().unwrap_or(root).join(path)
    };
    if !page.exists() {
        return Err("there is no such file".to_owned());
    }
    if anchor.is_empty() {
        return Ok(());
    }
    let text = fs::read_to_string(&page).map_err(|error| error.to_string())?;
    let has_heading = prose(&text)
        .lines()
        .filter(|line| line.starts_with('#'))
        .any(|line| anchor_of(line) == anchor);
    if has_heading {
        Ok(())
    } else {
        Err("there is no such heading".to_owned())
    }
}

/// Returns the anchor of a heading: lower case, without punctuation, with a hyphen for each space.
fn anchor_of(heading: &str) -> String {
    let heading = heading.trim_start_matches('#').trim();
    let letters = heading.to_lowercase();
    let kept = letters.chars().filter(|c| c.is_alphanumeric() || [' ', '-', '_'].contains(c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}
