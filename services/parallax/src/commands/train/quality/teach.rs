//! The training itself, in a Parallax that was built with it.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use qualitytraining::curves;
use qualitytraining::judge::Judgement;
use qualitytraining::sample::Sample;
use qualitytraining::settings::Settings;
use qualitytraining::store::Samples;
use qualitytraining::trainer::{TrainError, Trainer};
use runtime::{ExitKind, Failure, OrFail as _, Stop};
use serde_json::json;

use super::network::Arguments;
use super::replace;
use crate::globals::Globals;
use crate::{inputs, output};

/// Trains until the network is written, or it is told to stop.
pub(super) fn train(
    arguments: &Arguments,
    settings: &Settings,
    globals: Globals,
) -> Result<ExitCode, Failure> {
    let out = arguments.out.clone().unwrap_or_default();
    let beside = |ending: &str| {
        let mut path = out.clone().into_os_string();
        path.push(ending);
        PathBuf::from(path)
    };
    let kept = beside(".checkpoint");
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let samples = read_all(&arguments.samples)?;
    let checkpoint = checkpoint(&kept, arguments.resume)?;
    let weights = match &arguments.weights {
        Some(file) => super::weights::read(file)?,
        None => Vec::new(),
    };
    let trainer = Trainer::new(settings, &samples, &weights, checkpoint.as_deref());
    let mut trainer = trainer.map_err(|error| refused(error, &kept))?;
    let say = Say {
        quiet: globals.quiet,
        json: arguments.json,
        epochs: settings.epochs as usize,
        begin: Instant::now(),
        before: trainer.passes().len(),
    };
    say.begin(&trainer)?;
    while !trainer.is_done() {
        if !trainer.pass(&mut |_, _| !stop.is_requested()) {
            let failure = Failure::new(ExitKind::Interrupted, "stopped");
            return Err(failure.with_hint(format!("--resume goes on from {}", kept.display())));
        }
        replace(&kept, &trainer.checkpoint().or_fail(ExitKind::Run)?)?;
        let drawn = curves::svg(trainer.passes(), trainer.best());
        replace(&beside(".svg"), drawn.as_bytes())?;
        say.pass(&trainer)?;
    }
    let identity = arguments.identity.clone().unwrap_or_else(|| {
        out.file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    });
    replace(&out, &trainer.onnx(&identity))?;
    say.judged("validation", &trainer.judge(trainer.validated()))?;
    for file in &arguments.judge {
        let samples = read(file)?;
        let all: Vec<&Sample> = samples.all.iter().collect();
        if samples.tile != settings.network.tile().unwrap_or(samples.tile) {
            let message = format!("{}: its tiles are of another network", file.display());
            return Err(Failure::new(ExitKind::Input, message));
        }
        say.judged(&file.display().to_string(), &trainer.judge(&all))?;
    }
    fs::remove_file(&kept).map_err(|error| inputs::in_file(&kept, &error))?;
    Ok(ExitCode::SUCCESS)
}

fn read(file: &Path) -> Result<Samples, Failure> {
    let bytes = fs::read(file).map_err(|error| inputs::in_file(file, &error))?;
    Samples::from_bytes(&bytes).map_err(|error| inputs::in_file(file, &error))
}

/// Several files as one.
fn read_all(files: &[PathBuf]) -> Result<Samples, Failure> {
    let mut all = Samples::default();
    for file in files {
        let samples = read(file)?;
        if !all.all.is_empty() && samples.tile != all.tile {
            let message = format!("{}: its tiles are of another size", file.display());
            return Err(Failure::new(ExitKind::Input, message));
        }
        all.tile = samples.tile;
        all.all.extend(samples.all);
    }
    Ok(all)
}

fn checkpoint(path: &Path, resume: bool) -> Result<Option<Vec<u8>>, Failure> {
    match fs::read(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(inputs::in_file(path, &error)),
        Ok(bytes) if resume => Ok(Some(bytes)),
        Ok(_) => {
            let message = format!("{} is there: a training was interrupted", path.display());
            Err(Failure::new(ExitKind::Usage, message)
                .with_hint("--resume goes on from it; to begin anew, delete it"))
        }
    }
}

fn refused(error: TrainError, checkpoint: &Path) -> Failure {
    let is_old = matches!(error, TrainError::Checkpoint(_) | TrainError::Other);
    let failure = Failure::new(ExitKind::Input, error);
    if is_old {
        let path = checkpoint.display();
        return failure.with_hint(format!(
            "--resume needs the samples and settings that it was made with; to begin anew, delete {path}"
        ));
    }
    failure
}

/// Says how far the training is.
struct Say {
    quiet: bool,
    json: bool,
    epochs: usize,
    begin: Instant,
    /// Passes that were done before.
    before: usize,
}

impl Say {
    fn begin(&self, trainer: &Trainer<'_>) -> Result<(), Failure> {
        let [learnt, validated] = trainer.n_samples();
        if self.json {
            let n = self.before;
            return output::json(&json!({
                "event": "data", "learnt": learnt, "validated": validated, "resumed": n,
            }));
        }
        if !self.quiet {
            output::message(format_args!(
                "{learnt} samples to learn from, {validated} to validate on"
            ));
            if self.before > 0 {
                output::message(format_args!("going on after pass {}", self.before));
            }
        }
        Ok(())
    }

    fn pass(&self, trainer: &Trainer<'_>) -> Result<(), Failure> {
        let Some(pass) = trainer.passes().last() else {
            return Ok(());
        };
        let n = trainer.passes().len();
        let each = self.begin.elapsed().as_secs_f64() / (n - self.before).max(1) as f64;
        let left = each * (self.epochs - n) as f64;
        if self.json {
            return output::json(&json!({
                "event": "pass", "pass": n, "passes": self.epochs, "learnt": pass.learnt,
                "validated": pass.validated, "area": pass.area, "seconds_left": left,
            }));
        }
        if !self.quiet {
            let best = if trainer.best() == Some(n - 1) {
                ", the best"
            } else {
                ""
            };
            output::message(format_args!(
                "pass {n} of {}: loss {:.4}, validated {:.4}, area {:.3}{best}; {left:.0} s left at most",
                self.epochs, pass.learnt, pass.validated, pass.area
            ));
        }
        Ok(())
    }

    fn judged(&self, name: &str, judgement: &Judgement) -> Result<(), Failure> {
        if self.json {
            return output::json(&json!({
                "event": "judged", "samples": name, "judgement": judgement,
                "mean_area": judgement.mean_area(),
                "mean_rank_correlation": judgement.mean_rank_correlation(),
            }));
        }
        if !self.quiet {
            let areas = judgement
                .area
                .iter()
                .map(|it| it.map_or("-".to_owned(), |it| format!("{:.0}", 100.0 * it)));
            let areas: Vec<String> = areas.collect();
            output::line(format_args!(
                "{name}: {} samples, area under the ROC {:.3}, rank correlation {:.3}\n  area by part, %: {}",
                judgement.n,
                judgement.mean_area(),
                judgement.mean_rank_correlation(),
                areas.join(" ")
            ))?;
        }
        Ok(())
    }
}
