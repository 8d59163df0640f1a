//! The training: from prepared people to an ONNX file with its card.

use exports::report::curves::{self, Line, Panel};
use training::networks::pose::{self, About, Cost, PoseTask, Score, Settings};
use training::networks::{Parameter, Trainer};

use super::Prepared;
use crate::trained::{self, Job, Shown};
use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use inputs::cards::METADATA_KEY;

/// Results of a hundred training steps.
pub type Pass = training::networks::Pass<Cost, Score>;

/// Reads the network to start from; `None` for random parameters.
fn begun(job: &Job, settings: &Settings) -> Result<Option<Vec<Parameter>>, Failure> {
    let Some(from) = &job.from else {
        return Ok(None);
    };
    let begun = pose::begun(&settings.shape, settings.seed, &from.bytes).map_err(|error| {
        let hint = "--from needs a network made by `train network`, with the same `shape` as in the settings";
        failure::in_file(&from.file, &error).with_hint(hint)
    })?;
    Ok(Some(begun))
}

/// Draws the costs of all passes, and the scores on held-out people.
fn drawn(passes: &[Pass]) -> String {
    let cost = |name, value: &dyn Fn(&Pass) -> f32| Line {
        name,
        values: passes.iter().map(|pass| f64::from(value(pass))).collect(),
    };
    let judged: Vec<Score> = passes.iter().filter_map(|pass| pass.score).collect();
    let score = |name, value: &dyn Fn(&Score) -> f32| Line {
        name,
        values: judged.iter().map(|judged| f64::from(value(judged))).collect(),
    };
    let panel = |what, lines| Panel { what, lines };
    let panels = [
        panel(
            "cost of the maps",
            vec![cost("learnt", &|pass| pass.cost.maps)],
        ),
        panel(
            "cost of direction and error",
            vec![
                cost("direction", &|pass| pass.cost.front),
                cost("error", &|pass| pass.cost.error),
            ],
        ),
        panel(
            "shares for held-out people",
            vec![
                score("limbs, both ends", &|score| score.both_ends),
                score("direction", &|score| score.front),
                score("ROC area of errors", &|score| score.area),
                score("extra keypoints", &|score| score.extras),
            ],
        ),
    ];
    curves::svg(&panels, None)
}

/// Trains a network on prepared people, and writes it. After every hundred steps, a checkpoint and the curves (`.svg`) are written.
///
/// # Errors
///
/// Fails if there are no people for training or no held-out people, if the checkpoint is from another training, if a file cannot be
/// written, or on a stop request ([`ExitKind::Interrupted`]).
pub fn train(
    (job, settings): (&Job, &Settings),
    people: &Prepared,
    (stop, console): (&Stop, &dyn Console),
) -> Result<Vec<Pass>, Failure> {
    let learnt = [people.learnt.as_slice(), people.kept.as_slice()];
    let from = begun(job, settings)?;
    let task = PoseTask::new(settings, learnt, from).or_fail(ExitKind::Input)?;
    let shown = Shown {
        curves: &drawn,
        words: &line,
    };
    let written = |trainer: &Trainer<PoseTask<'_>>| {
        let score = trainer.passes().iter().rev().find_map(|pass| pass.score);
        let about = About {
            people: learnt.map(<[_]>::len),
            samples: settings.steps * settings.batch,
            goes_on: job.from.is_some(),
            score: score.unwrap_or_default(),
        };
        let card = pose::card(&settings.shape, &about);
        trainer.onnx(&[(METADATA_KEY.to_owned(), card)])
    };
    trained::run(job, task, &shown, &written, (stop, console))
}

/// Describes a pass in a line of text.
fn line(pass: &Pass) -> String {
    let cost = pass.cost;
    let learnt = format!(
        "maps {:.4}, direction {:.3}, error {:.3}",
        cost.maps, cost.front, cost.error
    );
    let Some(score) = pass.score else {
        return learnt;
    };
    format!(
        "{learnt}; {} held-out people: limbs {:.1} / {:.1} %, direction {:.1} %, ROC area of errors {:.3}, extra keypoints {:.1} %",
        score.people,
        100.0 * score.mean_of_ends,
        100.0 * score.both_ends,
        100.0 * score.front,
        score.area,
        100.0 * score.extras
    )
}
