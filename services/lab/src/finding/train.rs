//! The training: from prepared pictures to an ONNX file with its card.

use exports::report::curves::{self, Line, Panel};
use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use inputs::cards::METADATA_KEY;
use training::networks::Trainer;
use training::networks::finder::{self, About, Cost, FinderTask, Score, Settings};

use super::Prepared;
use crate::trained::{self, Earlier, Job, Shown};

/// Results of a hundred training steps.
pub type Pass = training::networks::Pass<Cost, Score>;

/// Trains a network on prepared pictures, and writes it. After every hundred steps, a checkpoint and the curves (`.svg`) are written.
///
/// # Errors
///
/// Fails if there are no training pictures or no held-out pictures, if the checkpoint is from another training, if a file cannot be
/// written, or on a stop request ([`ExitKind::Interrupted`]).
pub fn train(
    (job, settings): (&Job, &Settings),
    pictures: &Prepared,
    (stop, console): (&Stop, &dyn Console),
) -> Result<Vec<Pass>, Failure> {
    let shown = [pictures.learnt.as_slice(), pictures.kept.as_slice()];
    let begun = |from: &Earlier| {
        let begun = finder::begun(&settings.shape, settings.seed, &from.bytes);
        begun.map_err(|error| {
            let hint = "--from needs a network made by `train finder`, with the same `shape` as in the settings";
            failure::in_file(&from.file, &error).with_hint(hint)
        })
    };
    let from = job.from.as_ref().map(begun).transpose()?;
    let task = FinderTask::new(settings, shown, from).or_fail(ExitKind::Input)?;
    let written = |trainer: &Trainer<FinderTask<'_>>| {
        let score = trainer.passes().iter().rev().find_map(|pass| pass.score);
        let about = About {
            pictures: shown.map(<[_]>::len),
            samples: settings.steps * settings.batch,
            goes_on: job.from.is_some(),
            score: score.unwrap_or_default(),
        };
        let card = finder::card(&settings.shape, &about);
        trainer.onnx(&[(METADATA_KEY.to_owned(), card)])
    };
    let shown = Shown {
        curves: &drawn,
        words: &words,
    };
    trained::run(job, task, &shown, &written, (stop, console))
}

/// Draws the costs, and the quality of the network on held-out pictures.
fn drawn(passes: &[Pass]) -> String {
    let cost = |name, value: &dyn Fn(&Pass) -> f32| Line {
        name,
        values: passes.iter().map(|pass| f64::from(value(pass))).collect(),
    };
    let judged: Vec<Score> = passes.iter().filter_map(|pass| pass.score).collect();
    let score = |name, value: &dyn Fn(&Score) -> f32| Line {
        name,
        values: judged.iter().map(|score| f64::from(value(score))).collect(),
    };
    let panel = |what, lines| Panel { what, lines };
    let panels = [
        panel(
            "cost",
            vec![
                cost("heat", &|pass| pass.cost.heat),
                cost("sides", &|pass| pass.cost.sides),
            ],
        ),
        panel(
            "held-out pictures",
            vec![
                score("recall", &|score| score.recall),
                score("false boxes per picture", &|score| score.false_boxes),
                score("empty pictures without a box", &|score| score.quiet),
            ],
        ),
    ];
    curves::svg(&panels, None)
}

/// Describes a pass in a line of text.
fn words(pass: &Pass) -> String {
    let learnt = format!("heat {:.3}, sides {:.3}", pass.cost.heat, pass.cost.sides);
    let Some(score) = pass.score else {
        return learnt;
    };
    format!("{learnt}; {score}")
}
