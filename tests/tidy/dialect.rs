//! Counts the places in the sources that have an outdated style: closure arguments called `it`, functions called `of`, and documentation
//! that begins with a question word instead of a noun or a verb.

use std::fs;
use std::path::PathBuf;

/// Returns the number of places with the outdated style.
pub(crate) fn count(files: &[PathBuf]) -> usize {
    files
        .iter()
        .map(|file| {
            let text = fs::read_to_string(file).unwrap();
            text.lines().map(in_line).sum::<usize>()
        })
        .sum()
}

fn in_line(line: &str) -> usize {
    let line = line.trim_start();
    let doc = ["/// ", "//! "].iter().find_map(|mark| line.strip_prefix(mark));
    if let Some(doc) = doc {
        let begins = ["What ", "Whether ", "Of ", "Whoever ", "Wherever "];
        return usize::from(begins.iter().any(|word| doc.starts_with(word)));
    }
    let closures = ["|it|", "|&it|", "|it:", "|mut it|", "|(it,"];
    let n_closures: usize = closures.iter().map(|closure| line.matches(closure).count()).sum();
    n_closures + usize::from(line.contains("fn of("))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_with_outdated_style_are_counted() {
        assert_eq!(
            in_line("    let names = all.iter().map(|it| it.name).filter(|it| true);"),
            2
        );
        assert_eq!(in_line("/// Whether it is live."), 1);
        assert_eq!(in_line("pub fn of(view: usize) -> Self {"), 1);
        assert_eq!(in_line("/// Returns what it is, |it| included."), 0);
    }
}
