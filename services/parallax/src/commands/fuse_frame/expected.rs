//! Expected errors of the parts, from a file.

use std::path::Path;

use runtime::{ExitKind, Failure};

/// Reads the expected errors of every view, and scales them to pixels of the frames.
pub(super) fn sigma(
    file: Option<&Path>,
    scales: &[f32],
    n_parts: usize,
) -> Result<Vec<Option<Vec<f32>>>, Failure> {
    let Some(file) = file else {
        return Ok(vec![None; scales.len()]);
    };
    let text = runtime::read_text(file)?;
    let lines: Vec<&str> = text.lines().filter(|it| !it.trim().is_empty()).collect();
    let wrong =
        |message: String| Failure::new(ExitKind::Input, format!("{}: {message}", file.display()));
    if lines.len() != scales.len() {
        return Err(wrong(format!(
            "{} lines, expected one for each of {} views",
            lines.len(),
            scales.len()
        )));
    }
    let views = lines.iter().zip(scales).enumerate();
    views
        .map(|(index, (line, scale))| {
            let words = line.split(|it: char| it == ',' || it.is_whitespace());
            let words: Vec<&str> = words.filter(|it| !it.is_empty()).collect();
            let numbers: Vec<f32> = words
                .iter()
                .filter_map(|it| it.parse::<f32>().ok())
                .filter(|it| it.is_finite() && *it >= 0.0)
                .map(|it| it * scale)
                .collect();
            if numbers.len() != n_parts || words.len() != n_parts {
                let message = format!("line {}: expected {n_parts} errors in pixels", index + 1);
                return Err(wrong(message));
            }
            Ok(Some(numbers))
        })
        .collect()
}
