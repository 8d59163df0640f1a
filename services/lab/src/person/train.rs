//! The training: from data sets to the model's file, with a checkpoint after every step.

use std::path::PathBuf;
use std::time::Instant;

use failure::{ExitKind, Failure, OrFail as _};
use training::datasets::SkeletonTable;
use training::{CheckpointError, Plan, Settings, TrainError, Trainer, Tree};

use super::alarms;
use super::album::Gallery;
use super::data::{self, Chosen, Data};
use super::progress::Progress;
use super::report::Report;
use super::store::Store;

/// Data and settings for training a model.
#[derive(Debug)]
pub struct Job {
    /// The people, and the images without people.
    pub data: Chosen,
    /// Parts of the model, and their positions between the joints.
    pub skeleton: SkeletonTable,
    /// Settings of the training.
    pub settings: Settings,
    /// Folder of images without people, on which false alarms are counted at the end; if `None`, the images of the training are used.
    pub judge: Option<PathBuf>,
    /// True to continue from the checkpoint of an interrupted training, if there is one.
    pub resume: bool,
}

/// Trains a model and writes it, on rayon's current pool.
///
/// # Errors
///
/// Fails if a data set, an image or a checkpoint cannot be used, if a file cannot be written, or on a stop request
/// ([`ExitKind::Interrupted`]).
pub fn train(job: &Job, store: &Store, progress: &Progress) -> Result<Report, Failure> {
    let begin = Instant::now();
    let judged = match &job.judge {
        Some(folder) => Some(data::in_folders(std::slice::from_ref(folder))?),
        None => None,
    };
    let data = Data::read(&job.data, &job.skeleton, progress)?;
    let gallery = Gallery::new(&data, &job.skeleton)?;
    let name = store.model_name();
    let plan = Plan::new(&name, &tree(&job.skeleton), gallery.parts(), &job.settings);
    let plan = plan.or_fail(ExitKind::Input)?;
    let mut report = Report::new(&data, &gallery, &plan);
    progress.data(&report.data_text(), report.data_json())?;
    let mut trainer = start(job, &plan, &gallery, (store, progress))?;
    report.n_resumed = trainer.n_done();
    while let Some(step) = trainer.steps().get(trainer.n_done()).copied() {
        progress.begin(step, trainer.n_done(), trainer.steps());
        trainer.step().map_err(failure)?;
        store.save(
            &trainer.checkpoint(),
            gallery.stamp(),
            trainer.steps().len(),
        )?;
        progress.done()?;
    }
    let model = trainer.model().map_err(failure)?;
    report.n_steps = trainer.steps().len();
    report.n_lost = progress.n_lost();
    drop(trainer);
    store.finish(&model)?;
    report.trained(&model, begin.elapsed());
    let images = judged.as_ref().unwrap_or(&data.negatives);
    report.alarms = Some(alarms::count(&model, images, job.judge.clone(), progress)?);
    report.seconds = begin.elapsed().as_secs_f64();
    progress.finish();
    Ok(report)
}

/// Starts from the beginning or from the checkpoint.
fn start<'a>(
    job: &'a Job,
    plan: &'a Plan,
    gallery: &'a Gallery,
    (store, progress): (&Store, &'a Progress),
) -> Result<Trainer<'a>, Failure> {
    let settings = &job.settings;
    let found = if job.resume {
        store.load(gallery.stamp())?
    } else {
        None
    };
    let Some(checkpoint) = found else {
        return Trainer::new(plan, settings, gallery, progress).map_err(failure);
    };
    progress.resuming(checkpoint.n_done());
    let trainer = Trainer::resume((plan, settings), gallery, progress, checkpoint);
    let trainer = trainer.map_err(|error| match error {
        CheckpointError::Train(error) => failure(error),
        error => store.refused(error),
    })?;
    let (n_done, n_steps) = (trainer.n_done(), trainer.steps().len());
    store.resumed(n_done, n_steps);
    progress.resumed(n_done, n_steps)?;
    Ok(trainer)
}

fn tree(table: &SkeletonTable) -> Tree {
    Tree {
        names: table.names().to_vec(),
        parents: table.parent().to_vec(),
        mirror: Some(table.mirror().to_vec()),
    }
}

fn failure(error: TrainError) -> Failure {
    let kind = match error {
        TrainError::Stopped => ExitKind::Interrupted,
        TrainError::Model(_) => ExitKind::Run,
        _ => ExitKind::Input,
    };
    Failure::new(kind, error)
}
