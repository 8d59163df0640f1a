//! Caches the answers of `ffprobe`, so that each question is asked only once, even by several processes of a run.

use core::time::Duration;
use std::collections::BTreeMap;
use std::fs::Metadata;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

use serde_json::{Value, json};

use super::program::{input_name, input_options, missing};
use crate::{FootageError, SourceSpec};

/// Runs `ffprobe` on a stream of a file, but only once as long as the file does not change, because starting the program takes longer than
/// the query itself.
pub(super) fn run_ffprobe(
    path: &Path,
    spec: &SourceSpec,
    stream: &str,
    wanted: &[&str],
) -> Result<Value, FootageError> {
    let question = Question::about(path, spec, stream, wanted);
    let answers = || ANSWERS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = question.as_ref().and_then(|question| answers().get(question).cloned()) {
        return Ok(known);
    }
    let answer = ask_ffprobe(path, spec, stream, wanted)?;
    if let Some(question) = question {
        let mut answers = answers();
        if answers.len() == MOST_ANSWERS {
            answers.clear();
        }
        answers.insert(question, answer.clone());
    }
    Ok(answer)
}

/// Maximum number of answers that are kept.
const MOST_ANSWERS: usize = 64;
static ANSWERS: Mutex<BTreeMap<Question, Value>> = Mutex::new(BTreeMap::new());

/// A question to `ffprobe` about the current version of a file.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Question {
    program: PathBuf,
    path: PathBuf,
    n_bytes: u64,
    changed_at: SystemTime,
    words: Vec<String>,
}

impl Question {
    /// Returns the question about a file; `None` if the path is not a regular file.
    fn about(path: &Path, spec: &SourceSpec, stream: &str, wanted: &[&str]) -> Option<Self> {
        let metadata = path.metadata().ok().filter(Metadata::is_file)?;
        let words = [stream].into_iter().chain(wanted.iter().copied());
        Some(Self {
            program: spec.ffprobe.clone(),
            path: path.to_path_buf(),
            n_bytes: metadata.len(),
            changed_at: metadata.modified().ok()?,
            words: words.map(str::to_owned).collect(),
        })
    }
}

/// Returns all answers of `ffprobe` so far, for other processes ([`remember_answers`]). The result is a list of `[program, path, size in
/// bytes, time of the last change in nanoseconds since 1970, arguments, answer]`.
pub fn answers_so_far() -> Value {
    let answers = ANSWERS.lock().unwrap_or_else(PoisonError::into_inner);
    let each = answers.iter().filter_map(|(question, answer)| {
        let since = question.changed_at.duration_since(SystemTime::UNIX_EPOCH);
        let changed_at = u64::try_from(since.ok()?.as_nanos()).ok()?;
        let (program, path) = (question.program.to_str()?, question.path.to_str()?);
        let words = &question.words;
        Some(json!([
            program,
            path,
            question.n_bytes,
            changed_at,
            words,
            answer
        ]))
    });
    each.collect()
}

/// Stores the answers that another process received from `ffprobe` ([`answers_so_far`]). For files that have not changed since then,
/// `ffprobe` is not run again. A value that is not such a list is ignored.
pub fn remember_answers(told: &Value) {
    let mut answers = ANSWERS.lock().unwrap_or_else(PoisonError::into_inner);
    for it in told.as_array().into_iter().flatten().take(MOST_ANSWERS) {
        let words = it[4].as_array().into_iter().flatten();
        let words: Option<Vec<String>> =
            words.map(|word| Some(word.as_str()?.to_owned())).collect();
        if let (Some(program), Some(path), Some(n_bytes), Some(changed_at), Some(words)) = (
            it[0].as_str(),
            it[1].as_str(),
            it[2].as_u64(),
            it[3].as_u64(),
            words,
        ) {
            let question = Question {
                program: program.into(),
                path: path.into(),
                n_bytes,
                changed_at: SystemTime::UNIX_EPOCH + Duration::from_nanos(changed_at),
                words,
            };
            answers.insert(question, it[5].clone());
        }
    }
}

fn ask_ffprobe(
    path: &Path,
    spec: &SourceSpec,
    stream: &str,
    wanted: &[&str],
) -> Result<Value, FootageError> {
    let Output {
        status,
        stdout,
        stderr,
    } = Command::new(&spec.ffprobe)
        .args(["-v", "error", "-select_streams", stream, "-of", "json"])
        .args(wanted)
        .args(input_options(path))
        .arg(input_name(path))
        .stdin(Stdio::null())
        .output()
        .map_err(|source| missing(&spec.ffprobe, path, source))?;
    let unreadable = |message: String| FootageError::Video {
        path: path.to_path_buf(),
        message,
    };
    if !status.success() {
        return Err(unreadable(super::log::summary(&stderr)));
    }
    serde_json::from_slice(&stdout)
        .map_err(|error| unreadable(format!("the output of ffprobe is not JSON: {error}")))
}
