//! Finds names such as `multiview::estimate_pair` in the pages, and checks them.

use std::fs;
use std::path::Path;

use super::blocks::prose;
use super::files_below;

/// Keywords that declare a name.
const KEYWORDS: [&str; 7] = ["fn", "struct", "enum", "trait", "mod", "const", "type"];

/// Returns all code spans that are a path in a crate.
pub(crate) fn paths(text: &str) -> Vec<String> {
    let is_path = |span: &&str| {
        let mut letters = span.chars();
        span.contains("::")
            && letters.next().is_some_and(|letter| letter.is_ascii_lowercase())
            && letters
                .all(|letter| letter.is_ascii_alphanumeric() || letter == '_' || letter == ':')
    };
    let prose = prose(text);
    let spans = prose.split('`').skip(1).step_by(2);
    spans.filter(is_path).map(str::to_owned).collect()
}

/// Returns true if the crate exists and declares everything that the path names.
pub(crate) fn exists(root: &Path, path: &str) -> bool {
    let mut segments = path.split("::");
    let name = segments.next().unwrap_or_default();
    let sources = ["shared", "services"].map(|group| root.join(group).join(name).join("src"));
    let Some(source) = sources.iter().find(|source| source.exists()) else {
        return false;
    };
    let files = files_below(source, ".rs");
    let texts: Vec<String> = files.iter().map(|file| fs::read_to_string(file).unwrap()).collect();
    segments.all(|segment| texts.iter().any(|text| declares(text, segment)))
}

/// Returns true if a file declares a name, or has it as a variant of an enum.
fn declares(text: &str, name: &str) -> bool {
    let is_end =
        |rest: &str| !rest.starts_with(|letter: char| letter.is_alphanumeric() || letter == '_');
    text.lines().map(str::trim_start).any(|line| {
        let is_variant = line
            .strip_prefix(name)
            .is_some_and(|rest| rest.is_empty() || rest.starts_with([',', '(', ' ']));
        let declaration = |keyword: &&str| {
            let words = format!("{keyword} {name}");
            line.match_indices(words.as_str())
                .any(|(at, found)| is_end(&line[at + found.len()..]))
        };
        is_variant || KEYWORDS.iter().any(declaration)
    })
}
