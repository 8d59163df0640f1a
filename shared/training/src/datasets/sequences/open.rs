//! Finds the sequences at a path.

use std::path::{Path, PathBuf};

use crate::datasets::sequences::error::io;
use crate::datasets::sequences::{
    Options, Sequence, SequenceError, described, humaneva, synthetic, umpm,
};

/// Reads all sequences at a path.
///
/// | path | sequences |
/// |---|---|
/// | a `.toml` file | a description: rig, cameras, a TRC file (`configs/sequences/`) |
/// | a folder with `truth.jsonl` | a sequence of `parallax-lab synth` |
/// | a folder with `Image_Data` and `Mocap_Data` | a subject of `HumanEva-I`: the paper's test frames of every action |
/// | a folder with `NAME.json` and `Groundtruth` | a sequence of UMPM |
/// | a folder of such folders | all their sequences, in the order of the folder names |
///
/// # Errors
///
/// Fails with [`SequenceError`], which names the file.
pub fn read(path: &Path, options: &Options) -> Result<Vec<Sequence>, SequenceError> {
    if path.extension().is_some_and(|extension| extension == "toml") {
        return Ok(vec![described::read(path, options)?]);
    }
    if let Some(sequences) = folder(path, options) {
        return sequences;
    }
    let mut entries: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(path).map_err(|error| io(path, error))? {
        entries.push(entry.map_err(|error| io(path, error))?.path());
    }
    entries.sort();
    let mut sequences = Vec::new();
    for path in entries {
        if let Some(more) = folder(&path, options) {
            sequences.extend(more?);
        }
    }
    if sequences.is_empty() {
        return Err(SequenceError::Unknown {
            path: path.to_owned(),
        });
    }
    Ok(sequences)
}

/// The sequences of a folder; `None` if its layout is unknown.
fn folder(path: &Path, options: &Options) -> Option<Result<Vec<Sequence>, SequenceError>> {
    if path.join(synthetic::TRUTH).is_file() {
        return Some(synthetic::read(path, options).map(|sequence| vec![sequence]));
    }
    if path.join("Image_Data").is_dir() && path.join("Mocap_Data").is_dir() {
        return Some(humaneva::read_subject(path, options));
    }
    umpm::description(path).map(|_| umpm::read(path, options).map(|sequence| vec![sequence]))
}
