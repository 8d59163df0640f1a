//! The training: from prepared pictures to an ONNX file with its card.

use exports::report::curves::{self, Line, Panel};
use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use inputs::cards::METADATA_KEY;
use training::networks::Trainer;
use training::networks::finder::{self, Cost, FinderTask, Score, Settings};

use super::Prepared;
use crate::trained::{self, Job, Shown};

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
    let from = trained::begun(job, "train finder", |file| {
        finder::begun(&settings.shape, settings.seed, file)
    })?;
    let task = FinderTask::new(settings, shown, from).or_fail(ExitKind::Input)?;
    let written = |trainer: &Trainer<FinderTask<'_>>| {
        let samples = settings.steps * settings.batch;
        let about = trained::about(job, trainer, (shown, samples));
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
    let cost = |name, value: &dyn Fn(&Cost) -> f32| {
        Line::new(name, passes.iter().map(|pass| value(&pass.cost)))
    };
    let judged = || passes.iter().filter_map(|pass| pass.score.as_ref());
    let score = |name, value: &dyn Fn(&Score) -> f32| Line::new(name, judged().map(value));
    let panel = |what, lines| Panel { what, lines };
    let panels = [
        panel(
            "cost",
            vec![
                cost("heat", &|cost| cost.heat),
                cost("sides", &|cost| cost.sides),
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
