//! False alarms of a model on images without people.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use failure::Failure;
use fmp::{CandidateSettings, Layout, Model, Search};
use rayon::prelude::*;
use serde_json::{Value, json};
use training::datasets::Picture;

use super::progress::Progress;

/// Largest overlap with the boxes of a better detection at which a detection is kept, as in `detect`.
const OVERLAP: f64 = 0.1;

/// Largest number of detections in an image.
const MOST: usize = 1000;

/// False alarms on images without people.
#[derive(Debug)]
pub(super) struct Alarms {
    /// Folder of the images; `None` for the images of the training.
    folder: Option<PathBuf>,
    n_images: usize,
    n_unreadable: usize,
    /// Threshold and number of false alarms, for the threshold of the training and for the threshold of `detect`.
    counts: [(f64, usize); 2],
}

/// Counts the detections on images without people.
///
/// * `folder`: folder of the images; `None` for the images of the training.
pub(super) fn count(
    model: &Model,
    images: &[PathBuf],
    folder: Option<PathBuf>,
    progress: &Progress,
) -> Result<Alarms, Failure> {
    let model = Arc::new(model.clone());
    let thresholds = [model.spec().threshold, model.detection_threshold()];
    let search = Search::new(model);
    let settings = CandidateSettings {
        threshold: thresholds[1] as f32,
        overlap: OVERLAP,
        max: MOST,
    };
    progress.begin_alarms(images.len());
    let scores: Vec<_> = images
        .par_iter()
        .map(|image| {
            progress.go_on_or_stop()?;
            let scores = scores(&search, &settings, image);
            progress.looked_at_one();
            Ok::<_, Failure>(scores)
        })
        .collect::<Result<_, _>>()?;
    let mut alarms = Alarms {
        folder,
        n_images: 0,
        n_unreadable: 0,
        counts: thresholds.map(|threshold| (threshold, 0)),
    };
    for (image, scores) in images.iter().zip(scores) {
        match scores {
            Ok(scores) => {
                alarms.n_images += 1;
                for (threshold, count) in &mut alarms.counts {
                    let above = |score: &&f32| f64::from(**score) >= *threshold;
                    *count += scores.iter().filter(above).count();
                }
            }
            Err(error) => {
                alarms.n_unreadable += 1;
                progress.unreadable(image, &error)?;
            }
        }
    }
    Ok(alarms)
}

/// Returns the scores of the detections; empty for images that are too small.
fn scores(
    search: &Search,
    settings: &CandidateSettings,
    image: &Path,
) -> Result<Vec<f32>, footage::FootageError> {
    let picture = Picture::read(image)?;
    let size = picture.size();
    let Ok(layout) = Layout::new(&search.model, size.width, size.height) else {
        return Ok(Vec::new());
    };
    let found = search.on(picture.view(), &layout, |evidence| {
        search.solver.candidates(evidence, settings)
    });
    Ok(found.iter().map(|candidate| candidate.score).collect())
}

impl Alarms {
    fn per_image(&self, count: usize) -> f64 {
        count as f64 / self.n_images.max(1) as f64
    }

    /// Returns the counts as text.
    pub(super) fn text(&self) -> String {
        let [(trained, at_trained), (used, at_used)] = self.counts;
        let of = match &self.folder {
            Some(folder) => format!("images of {}", folder.display()),
            None => "negatives of the training".to_owned(),
        };
        let n = self.n_images;
        let of_trained = self.per_image(at_trained);
        let where_detection_begins = if used < trained {
            let of_used = self.per_image(at_used);
            format!(", {of_used:.3} at the detection threshold {used}")
        } else {
            String::new()
        };
        format!(
            "{of_trained:.3} per image at the trained threshold {trained:.4}{where_detection_begins} \
             ({n} {of})"
        )
    }

    /// Returns the counts as JSON.
    pub(super) fn json(&self) -> Value {
        let at = |(threshold, count): (f64, usize)| json!({ "threshold": threshold, "count": count, "per_image": self.per_image(count) });
        json!({
            "folder": self.folder,
            "images": self.n_images,
            "unreadable": self.n_unreadable,
            "trained_on": self.folder.is_none(),
            "at_trained_threshold": at(self.counts[0]),
            "at_detection_threshold": at(self.counts[1]),
        })
    }
}
