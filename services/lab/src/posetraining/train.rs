//! The training itself: from prepared people to an ONNX file with its card.

use std::path::{Path, PathBuf};
use std::time::Instant;

use exports::report::curves::{self, Line, Panel};
use training::networks::pose::{self, About, Begun, Cost, PoseTask, Score, Settings};
use training::networks::{Backend, TrainError, Trainer};

use super::Prepared;
use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use inputs::cards::METADATA_KEY;

/// The results of a hundred steps.
pub type Pass = training::networks::Pass<Cost, Score>;

/// A network that was trained before.
#[derive(Debug, Clone)]
pub struct Earlier {
    /// Its file, for errors.
    pub file: PathBuf,
    /// The bytes of the file.
    pub bytes: Vec<u8>,
}

/// What is written, and how.
#[derive(Debug, Clone)]
pub struct Job {
    /// The ONNX file.
    pub out: PathBuf,
    /// A network that was trained before, to go on from.
    pub from: Option<Earlier>,
    /// Whether to go on from the checkpoint of an interrupted training.
    pub resume: bool,
    /// What calculates.
    pub backend: Backend,
}

/// Reads the network that the training goes on from; nothing for random parameters.
fn begun(job: &Job, settings: &Settings) -> Result<Option<Begun>, Failure> {
    let Some(from) = &job.from else {
        if settings.extras_alone {
            let message = "extras_alone = true keeps all but the extra keypoints of a network, and none is named";
            let hint = "name the network with --from, or take extras_alone out of the settings";
            return Err(Failure::new(ExitKind::Usage, message).with_hint(hint));
        }
        return Ok(None);
    };
    let begun = pose::begun(&settings.shape, settings.seed, &from.bytes).map_err(|error| {
        let hint = "--from takes a network of `train network` that has the `shape` of the settings";
        failure::in_file(&from.file, &error).with_hint(hint)
    })?;
    Ok(Some(begun))
}

/// A file beside the one that is written.
fn beside(out: &Path, ending: &str) -> PathBuf {
    let mut name = out.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}

/// What was learned, and how good the network is on people who are kept apart.
fn drawn(passes: &[Pass]) -> String {
    let cost = |name, value: &dyn Fn(&Pass) -> f32| Line {
        name,
        values: passes.iter().map(|it| f64::from(value(it))).collect(),
    };
    let judged: Vec<Score> = passes.iter().filter_map(|it| it.score).collect();
    let score = |name, value: &dyn Fn(&Score) -> f32| Line {
        name,
        values: judged.iter().map(|it| f64::from(value(it))).collect(),
    };
    let panel = |what, lines| Panel { what, lines };
    let panels = [
        panel("cost of the maps", vec![cost("learnt", &|it| it.cost.maps)]),
        panel(
            "cost of direction and error",
            vec![
                cost("direction", &|it| it.cost.front),
                cost("error", &|it| it.cost.error),
            ],
        ),
        panel(
            "share, people kept apart",
            vec![
                score("limbs, both ends", &|it| it.both_ends),
                score("direction", &|it| it.front),
                score("area of errors", &|it| it.area),
                score("extra keypoints", &|score| score.extras),
            ],
        ),
    ];
    curves::svg(&panels, None)
}

/// Trains a network on prepared people, and writes it; a checkpoint, and curves (`.svg`), follow every hundred steps.
///
/// # Errors
///
/// Nobody to learn from, or nobody kept apart; the checkpoint is of another training; a file cannot be written; it was stopped
/// ([`ExitKind::Interrupted`]).
pub fn train(
    (job, settings): (&Job, &Settings),
    people: &Prepared,
    (stop, console): (&Stop, &dyn Console),
) -> Result<Vec<Pass>, Failure> {
    let file = beside(&job.out, ".checkpoint");
    let write = |path: &Path, bytes: &[u8]| {
        files::replace(path, bytes).map_err(|error| failure::in_file(path, &error))
    };
    let kept = match files::read(&file, files::RESULTS) {
        Ok(bytes) if job.resume => Some(bytes),
        Ok(_) => {
            let message = format!("{} is of an interrupted training", file.display());
            let hint = "go on from it with --resume, or delete it";
            return Err(Failure::new(ExitKind::Usage, message).with_hint(hint));
        }
        Err(_) => None,
    };
    let learnt = [people.learnt.as_slice(), people.kept.as_slice()];
    let from = begun(job, settings)?;
    let task = PoseTask::new(settings, learnt, from).or_fail(ExitKind::Input)?;
    let trainer = Trainer::new(task, job.backend, kept.as_deref());
    let mut trainer = trainer.map_err(|error| {
        let kind = match error {
            TrainError::Precision => ExitKind::Config,
            TrainError::Checkpoint(_) | TrainError::Other { .. } => ExitKind::Input,
        };
        Failure::new(kind, error)
    })?;
    let n_steps = settings.steps + settings.error_steps;
    let (began, from) = (Instant::now(), trainer.step());
    while !trainer.is_done() {
        if !trainer.pass(&mut |_| !stop.is_requested()) {
            let message = format!("stopped after step {}", trainer.step());
            let hint = "go on with --resume";
            return Err(Failure::new(ExitKind::Interrupted, message).with_hint(hint));
        }
        write(&file, &trainer.checkpoint().or_fail(ExitKind::Run)?)?;
        write(
            &beside(&job.out, ".svg"),
            drawn(trainer.passes()).as_bytes(),
        )?;
        if let Some(pass) = trainer.passes().last() {
            let done = (trainer.step() - from) as f64;
            let left = (n_steps - trainer.step()) as f64;
            let minutes = began.elapsed().as_secs_f64() / 60.0 * left / done;
            console.message(&line(pass, n_steps, minutes));
        }
    }
    let passes = trainer.passes().to_vec();
    let score = passes.iter().rev().find_map(|it| it.score);
    let about = About {
        people: learnt.map(<[_]>::len),
        samples: settings.steps * settings.batch,
        goes_on: job.from.is_some(),
        extras_alone: settings.extras_alone,
        score: score.unwrap_or_default(),
    };
    let card = pose::card(&settings.shape, &about);
    write(&job.out, &trainer.onnx(&[(METADATA_KEY.to_owned(), card)]))?;
    std::fs::remove_file(&file).map_err(|error| failure::in_file(&file, &error))?;
    Ok(passes)
}

/// What a pass came to, for people.
fn line(pass: &Pass, of: usize, minutes: f64) -> String {
    let cost = pass.cost;
    let learnt = format!(
        "step {} of {of}: maps {:.4}, direction {:.3}, error {:.3}, {minutes:.0} minutes left",
        pass.step, cost.maps, cost.front, cost.error
    );
    let Some(score) = pass.score else {
        return learnt;
    };
    format!(
        "{learnt}; {} people kept apart: limbs {:.1} / {:.1} %, direction {:.1} %, errors told by {:.3}, extra keypoints {:.1} %",
        score.people,
        100.0 * score.mean_of_ends,
        100.0 * score.both_ends,
        100.0 * score.front,
        score.area,
        100.0 * score.extras
    )
}
