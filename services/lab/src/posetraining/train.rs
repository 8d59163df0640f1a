//! The training: from prepared people to an ONNX file with its card.

use exports::report::curves::{self, Line, Panel};
use training::networks::Trainer;
use training::networks::pose::{self, Cost, PoseTask, Score, Settings};

use super::Prepared;
use crate::trained::{self, Job, Shown};
use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use inputs::cards::METADATA_KEY;

/// Results of a hundred training steps.
pub type Pass = training::networks::Pass<Cost, Score>;

/// Draws the costs of all passes, and the scores on held-out people.
fn drawn(passes: &[Pass]) -> String {
    let cost = |name, value: &dyn Fn(&Cost) -> f32| {
        Line::new(name, passes.iter().map(|pass| value(&pass.cost)))
    };
    let judged = || passes.iter().filter_map(|pass| pass.score.as_ref());
    let score = |name, value: &dyn Fn(&Score) -> f32| Line::new(name, judged().map(value));
    let panel = |what, lines| Panel { what, lines };
    let panels = [
        panel("cost of the maps", vec![cost("learnt", &|cost| cost.maps)]),
        panel(
            "cost of direction and error",
            vec![
                cost("direction", &|cost| cost.front),
                cost("error", &|cost| cost.error),
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
    let from = trained::begun(job, "train network", |file| {
        pose::begun(&settings.shape, settings.seed, file)
    })?;
    let task = PoseTask::new(settings, learnt, from).or_fail(ExitKind::Input)?;
    let shown = Shown {
        curves: &drawn,
        words: &line,
    };
    let written = |trainer: &Trainer<PoseTask<'_>>| {
        let samples = settings.steps * settings.batch;
        let about = trained::about(job, trainer, (learnt, samples));
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
