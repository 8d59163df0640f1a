//! Training of a network that predicts errors.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

use exports::report::curves::{self, Line, Panel};
use serde_json::json;
use training::networks::quality::judge::Judgement;
use training::networks::quality::sample::Sample;
use training::networks::quality::settings::Settings;
use training::networks::quality::store::Samples;
use training::networks::quality::task::{QualityTask, Validated};
use training::networks::quality::vgg;
use training::networks::{Backend, Parameter, TrainError};

use super::replace::replace;
use failure::{Console, ExitKind, Failure, OrFail as _, Stop, in_file};

/// Results of a pass over the samples.
type Pass = training::networks::Pass<f32, Validated>;
type Trainer<'a> = training::networks::Trainer<QualityTask<'a>>;

/// Data and settings for training a network.
#[derive(Debug, Clone)]
pub struct Job {
    /// Files of samples for training and validation.
    pub samples: Vec<PathBuf>,
    /// Files of samples for testing the network, each file separately.
    pub judge: Vec<PathBuf>,
    /// The ONNX file to write; the checkpoint and the curves are in files beside it.
    pub out: PathBuf,
    /// Weights of torchvision's VGG-16 to start from.
    pub weights: Option<PathBuf>,
    /// Identity stored in the file; the file's name if `None`.
    pub identity: Option<String>,
    /// True to continue from the checkpoint of an interrupted training, if there is one.
    pub resume: bool,
}

/// Returns the quality of the network after a pass.
fn validated(pass: &Pass) -> Validated {
    pass.score.unwrap_or(Validated {
        loss: f32::NAN,
        area: f64::NAN,
    })
}

/// Draws two panels: the losses, and below them the area under the ROC curve.
fn drawn(passes: &[Pass], best: Option<usize>) -> String {
    let line = |name, value: &dyn Fn(&Pass) -> f64| Line::new(name, passes.iter().map(value));
    let losses = Panel {
        what: "loss",
        lines: vec![
            line("learnt", &|pass| f64::from(pass.cost)),
            line("validated", &|pass| f64::from(validated(pass).loss)),
        ],
    };
    let area = Panel {
        what: "area",
        lines: vec![line("area under the ROC curve, validated", &|pass| {
            validated(pass).area
        })],
    };
    curves::svg(&[losses, area], best)
}

/// Trains a network and writes it.
///
/// # Errors
///
/// Fails if samples, weights or a checkpoint cannot be used, if a file cannot be written, or on a stop request
/// ([`ExitKind::Interrupted`]).
pub fn train(
    job: &Job,
    settings: &Settings,
    stop: &Stop,
    console: &dyn Console,
) -> Result<(), Failure> {
    let out = &job.out;
    let beside = |ending: &str| {
        let mut path = out.clone().into_os_string();
        path.push(ending);
        PathBuf::from(path)
    };
    let kept = beside(".checkpoint");
    let samples = read_all(&job.samples)?;
    let checkpoint = checkpoint(&kept, job.resume)?;
    let weights = match &job.weights {
        Some(file) => weights(file)?,
        None => Vec::new(),
    };
    let task = QualityTask::new(settings, &samples, &weights).or_fail(ExitKind::Input)?;
    let trainer = Trainer::new(task, Backend::BuiltIn, checkpoint.as_deref());
    let mut trainer = trainer.map_err(|error| refused(error, &kept))?;
    let say = Say {
        console,
        epochs: settings.epochs as usize,
        begin: Instant::now(),
        before: trainer.passes().len(),
    };
    say.begin(&trainer)?;
    while !trainer.is_done() {
        if !trainer.pass(&mut |_| !stop.is_requested()) {
            let failure = Failure::new(ExitKind::Interrupted, "stopped");
            return Err(failure.with_hint(format!("--resume continues from {}", kept.display())));
        }
        replace(&kept, &trainer.checkpoint().or_fail(ExitKind::Run)?)?;
        let drawn = drawn(trainer.passes(), trainer.best());
        replace(&beside(".svg"), drawn.as_bytes())?;
        say.pass(&trainer)?;
    }
    let identity = job
        .identity
        .clone()
        .unwrap_or_else(|| out.file_stem().unwrap_or_default().to_string_lossy().into_owned());
    replace(out, &trainer.onnx(&identity))?;
    say.judged("validation", &trainer.judge(trainer.task().validated()))?;
    for file in &job.judge {
        let samples = read(file)?;
        let all: Vec<&Sample> = samples.all.iter().collect();
        if samples.tile != settings.network.tile().unwrap_or(samples.tile) {
            let message = format!(
                "{}: the tiles do not have the input size of this network",
                file.display()
            );
            return Err(Failure::new(ExitKind::Input, message));
        }
        say.judged(&file.display().to_string(), &trainer.judge(&all))?;
    }
    fs::remove_file(&kept).map_err(|error| in_file(&kept, &error))
}

/// Reads the weights of torchvision's VGG-16.
fn weights(file: &Path) -> Result<Vec<Parameter>, Failure> {
    let bytes = files::read(file, files::RESULTS).map_err(|error| in_file(file, &error))?;
    vgg::parse(&bytes).map_err(|error| in_file(file, &error))
}

fn read(file: &Path) -> Result<Samples, Failure> {
    let bytes = files::read(file, files::RESULTS).map_err(|error| in_file(file, &error))?;
    Samples::from_bytes(&bytes).map_err(|error| in_file(file, &error))
}

/// Reads several files as one set of samples.
fn read_all(files: &[PathBuf]) -> Result<Samples, Failure> {
    let mut all = Samples::default();
    for file in files {
        let samples = read(file)?;
        if !all.all.is_empty() && samples.tile != all.tile {
            let message = format!(
                "{}: the tiles do not have the same size as in the previous files",
                file.display()
            );
            return Err(Failure::new(ExitKind::Input, message));
        }
        all.tile = samples.tile;
        all.all.extend(samples.all);
    }
    Ok(all)
}

fn checkpoint(path: &Path, resume: bool) -> Result<Option<Vec<u8>>, Failure> {
    match files::read(path, files::RESULTS) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(in_file(path, &error)),
        Ok(bytes) if resume => Ok(Some(bytes)),
        Ok(_) => {
            let message = format!("{} exists: a training was interrupted", path.display());
            Err(Failure::new(ExitKind::Usage, message).with_hint(
                "continue from it with --resume; to start from the beginning, delete it",
            ))
        }
    }
}

fn refused(error: TrainError, checkpoint: &Path) -> Failure {
    let is_old = matches!(error, TrainError::Checkpoint(_) | TrainError::Other { .. });
    let failure = Failure::new(ExitKind::Input, error);
    if is_old {
        let path = checkpoint.display();
        return failure.with_hint(format!(
            "--resume needs the same samples and settings; to start from the beginning, delete {path}"
        ));
    }
    failure
}

/// Reports the progress of the training.
struct Say<'a> {
    console: &'a dyn Console,
    epochs: usize,
    begin: Instant,
    /// Number of passes done earlier, by an interrupted process.
    before: usize,
}

impl Say<'_> {
    fn begin(&self, trainer: &Trainer<'_>) -> Result<(), Failure> {
        let [learnt, validated] =
            [trainer.task().learnt(), trainer.task().validated()].map(<[_]>::len);
        let console = self.console;
        console.event(&json!({
            "event": "data", "learnt": learnt, "validated": validated, "resumed": self.before,
        }))?;
        console.message(&format!(
            "{learnt} samples are used for training, and {validated} for validation"
        ));
        if self.before > 0 {
            console.message(&format!("continuing after pass {}", self.before));
        }
        Ok(())
    }

    fn pass(&self, trainer: &Trainer<'_>) -> Result<(), Failure> {
        let Some(pass) = trainer.passes().last() else {
            return Ok(());
        };
        let validated = validated(pass);
        let n = trainer.passes().len();
        let each = self.begin.elapsed().as_secs_f64() / (n - self.before).max(1) as f64;
        let left = each * (self.epochs - n) as f64;
        self.console.event(&json!({
            "event": "pass", "pass": n, "passes": self.epochs, "learnt": pass.cost,
            "validated": validated.loss, "area": validated.area, "seconds_left": left,
        }))?;
        let best = if trainer.best() == Some(n - 1) {
            ", the best so far"
        } else {
            ""
        };
        self.console.message(&format!(
            "pass {n} of {}: loss {:.4}, validated {:.4}, area {:.3}{best}; {left:.0} s left at most",
            self.epochs, pass.cost, validated.loss, validated.area
        ));
        Ok(())
    }

    fn judged(&self, name: &str, judgement: &Judgement) -> Result<(), Failure> {
        self.console.event(&json!({
            "event": "judged", "samples": name, "judgement": judgement,
            "mean_area": judgement.mean_area(),
            "mean_rank_correlation": judgement.mean_rank_correlation(),
        }))?;
        let areas = judgement
            .area
            .iter()
            .map(|area| area.map_or("-".to_owned(), |value| format!("{:.0}", 100.0 * value)));
        let areas: Vec<String> = areas.collect();
        self.console.result(&format!(
            "{name}: {} samples, area under the ROC curve {:.3}, rank correlation {:.3}\n  area by part, %: {}",
            judgement.n,
            judgement.mean_area(),
            judgement.mean_rank_correlation(),
            areas.join(" ")
        ))
    }
}
