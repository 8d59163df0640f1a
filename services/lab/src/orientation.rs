//! Training of the network that sees in which direction a person faces.
//!
//! The people come from two sources: photographs with marked joints in which left and right are sides of the body, and synthetic scenes,
//! which are searched as in the pipeline.

mod marked;
mod rendered;

pub(crate) use marked::front as facing;
pub(crate) use rendered::front_in_view;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use failure::{Console, ExitKind, Failure, Stop};
use fmp::Model;
use viewquality::orientation::{Detector, Network, Score, Settings};

use crate::scenes::Scenes;

/// Data for training and evaluation.
#[derive(Debug, Clone)]
pub struct Job {
    /// Annotated people: folders or files.
    pub datasets: Vec<PathBuf>,
    /// Selections of people to use; all people if empty. A selection may name its data set: `DATASET=SELECTION`.
    pub only: Vec<String>,
    /// Selections of people who are used for the evaluation, and left out of the training.
    pub judge: Vec<String>,
    /// Synthetic scenes for training.
    pub scenes: Scenes,
    /// Synthetic scenes for evaluation.
    pub judge_scenes: Scenes,
    /// Settings of the training.
    pub settings: Settings,
}

/// Quality of the network on people who are not in the training data.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// Name of the data set, or `scenes`.
    pub on: String,
    /// Number of people.
    pub n: usize,
    /// Fraction of people, from 0 to 1, for whom the network prefers the true direction to the opposite direction.
    pub right: f64,
    /// 95 % interval of `right` (Wilson).
    pub interval: [f64; 2],
    /// Mean cross-entropy in nats; 0.693 (ln 2) if the network gives no information.
    pub surprise: f64,
}

/// Result of a training, and the amount of its data.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// Number of photographs for training.
    pub n_photographs: usize,
    /// Number of photographs for training that show a person from behind.
    pub n_behind: usize,
    /// Number of pictures of scenes for training.
    pub n_rendered: usize,
    /// Results on every set of the evaluation.
    pub judged: Vec<Judged>,
}

/// Trains a network on rayon's current pool, evaluates it and writes it. The result does not depend on the number of threads.
///
/// # Errors
///
/// Fails if a data set, a picture or a scene cannot be used, if there are no people to train on, if the file cannot be written, or on a
/// stop request ([`ExitKind::Interrupted`]).
pub fn train(
    job: &Job,
    out: &Path,
    model: &Arc<Model>,
    (stop, console): (Stop, &dyn Console),
) -> Result<Report, Failure> {
    let (mut samples, mut judged) = marked::samples(job, &stop)?;
    let n_photographs = samples.len();
    let n_behind = samples.iter().filter(|sample| sample.front[1] < 0.0).count();
    console.message(&format!(
        "{n_photographs} photographs of people, {n_behind} of them from behind"
    ));
    samples.extend(rendered::samples(&job.scenes, model, &stop)?);
    let n_rendered = samples.len() - n_photographs;
    if job.judge_scenes.n > 0 {
        let scenes = rendered::samples(&job.judge_scenes, model, &stop)?;
        judged.push(("scenes".to_owned(), scenes));
    }
    console.message(&format!("{n_rendered} pictures of scenes"));
    let watch = |pass: viewquality::orientation::Pass| {
        console.message(&format!(
            "pass {} of {}: loss {:.4}",
            pass.nth, pass.of, pass.loss
        ));
        !stop.is_requested()
    };
    let network = viewquality::orientation::train(&samples, &job.settings, watch);
    stop.check("stopped")?;
    let network = network.ok_or_else(|| {
        let message = "there are no people for training, because no person's direction is known";
        Failure::new(ExitKind::Input, message)
    })?;
    write(out, &network)?;
    let detector = Detector::new(network);
    let judged = judged.into_iter().map(|(on, samples)| {
        let score = viewquality::orientation::score(&detector, &samples);
        judged_on(on, &score)
    });
    Ok(Report {
        n_photographs,
        n_behind,
        n_rendered,
        judged: judged.collect(),
    })
}

fn judged_on(on: String, score: &Score) -> Judged {
    Judged {
        on,
        n: score.n,
        right: score.share(),
        interval: wilson(score.n_right, score.n),
        surprise: score.surprise,
    }
}

/// Returns the 95 % interval of a share (Wilson 1927).
fn wilson(k: usize, n: usize) -> [f64; 2] {
    const Z: f64 = 1.96;
    if n == 0 {
        return [0.0, 1.0];
    }
    let [k, n] = [k as f64, n as f64];
    let share = k / n;
    let centre = share + Z * Z / (2.0 * n);
    let half = Z * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
    let scale = 1.0 + Z * Z / n;
    [(centre - half) / scale, (centre + half) / scale]
}

fn write(out: &Path, network: &Network) -> Result<(), Failure> {
    files::replace(out, &network.to_bytes()).map_err(|error| {
        let message = format!("cannot write {}: {error}", out.display());
        Failure::new(ExitKind::Run, message)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_of_a_fraction_is_the_wilson_interval() {
        let [low, high] = wilson(8, 10);
        assert!((low - 0.490).abs() < 1e-3 && (high - 0.943).abs() < 1e-3);
        assert_eq!(wilson(0, 0), [0.0, 1.0]);
        assert!(wilson(10, 10)[1] <= 1.0 + 1e-12);
    }
}
