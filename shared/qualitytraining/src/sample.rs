//! What a network learns from: a person in a picture, what the search made of it, and how far off that is.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use datasets::SkeletonTable;
use fmp::{Layout, Model, Responses, Scope, local_scores};
use kernels::Rgb8View;
use pipeline::{ViewSettings, ViewStep};
use serde::{Deserialize, Serialize};
use skeleton::{MIRROR, N_PARTS};
use viewquality::{Normalisation, Sampler, Tile, TileShape, evidence};

/// Pixels beyond every border of a tile that a sample keeps, so that the tile can be moved.
pub const MARGIN: usize = 16;

/// One person in one picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// Whom it shows, or which sequence it is of: what may not be on two sides of a split.
    pub group: String,
    /// Where it is from, for people.
    pub source: String,
    /// The tile with [`MARGIN`] pixels more on every side, `rows x cols x 3`, red, green and blue.
    pub picture: Vec<u8>,
    /// See [`viewquality::evidence()`].
    pub evidence: Vec<f32>,
    /// Height of what the tile shows, pixels of the picture.
    pub height_px: f32,
    /// Distance of every part's centre from the truth, pixels of the picture.
    pub errors_px: Vec<f32>,
}

/// Sides of the picture that a sample of such a tile keeps, height and width.
pub fn picture_size(tile: TileShape) -> [usize; 2] {
    [tile.height, tile.width].map(|it| it + 2 * MARGIN)
}

/// Why a picture makes no sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoSample {
    /// The picture is too small for the model.
    #[error("the picture is too small for the model")]
    Small,
    /// The search found nobody.
    #[error("nobody was found")]
    Nobody,
    /// A true joint is not known.
    #[error("a joint is not known")]
    Unknown,
    /// The model has too many types for the evidence, or another number of parts.
    #[error("the model is not one of 26 parts with 6 types at most")]
    Model,
}

/// Searches pictures as the pipeline does, and compares what it finds with the truth.
#[derive(Debug)]
pub struct Observer {
    model: Arc<Model>,
    table: SkeletonTable,
    shape: TileShape,
    /// Prepared searches by width and height.
    steps: Mutex<BTreeMap<[usize; 2], Arc<ViewStep>>>,
}

impl Observer {
    /// Prepares for tiles of a shape.
    pub fn new(model: Arc<Model>, shape: TileShape) -> Self {
        Self {
            model,
            table: SkeletonTable::published(),
            shape,
            steps: Mutex::default(),
        }
    }

    /// Makes a sample.
    ///
    /// * `joints`: the true ones of `skeleton::PARSE14`, pixels of the picture.
    /// * `named`: group and source of the sample.
    ///
    /// # Errors
    ///
    /// [`NoSample`]
    pub fn observe(
        &self,
        picture: Rgb8View<'_>,
        joints: &[[f64; 2]],
        (group, source): (String, String),
    ) -> Result<Sample, NoSample> {
        if joints.len() != self.table.n_joints()
            || joints.iter().flatten().any(|it| !it.is_finite())
        {
            return Err(NoSample::Unknown);
        }
        let step = self.step([picture.width(), picture.height()])?;
        let layout = step.layout();
        let mut values = vec![0.0; layout.n_responses()];
        let found = step.run(picture, Scope::whole(layout), &mut values);
        let pose = found.candidates.first().ok_or(NoSample::Nobody)?;
        if pose.parts.len() != N_PARTS {
            return Err(NoSample::Model);
        }
        let responses = Responses::within(layout, &values, &found.levels, found.scope);
        let scores = local_scores(&self.model, &responses, pose);
        let bounds = pose.bounding_box(&self.model, layout);
        let tile = Tile::around(bounds, self.shape).ok_or(NoSample::Nobody)?;
        let mut numbers = Vec::new();
        let of = (&*self.model, &**layout);
        evidence(of, &found.candidates, &scores, &tile, &mut numbers)
            .map_err(|_| NoSample::Model)?;
        let truth = self.table.parts_of(joints);
        let errors = part_errors(&pose.centres(&self.model, layout), &truth);
        Ok(Sample {
            group,
            source,
            picture: picture_of(picture, &tile),
            evidence: numbers,
            height_px: tile.height_px() as f32,
            errors_px: errors.into_iter().map(|it| it as f32).collect(),
        })
    }

    fn step(&self, size: [usize; 2]) -> Result<Arc<ViewStep>, NoSample> {
        let mut steps = self.steps.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(step) = steps.get(&size) {
            return Ok(Arc::clone(step));
        }
        let layout = Layout::new(&self.model, size[0], size[1]).map_err(|_| NoSample::Small)?;
        let settings = ViewSettings::default();
        let step = ViewStep::new(Arc::clone(&self.model), Arc::new(layout), settings);
        let step = Arc::new(step);
        // Pictures of a data set are of many sizes: those searches are not kept.
        if steps.len() < 8 {
            steps.insert(size, Arc::clone(&step));
        }
        Ok(step)
    }
}

/// The tile and its margin as bytes.
fn picture_of(picture: Rgb8View<'_>, tile: &Tile) -> Vec<u8> {
    let [height, width] = picture_size(tile.shape);
    let wide = Tile {
        shape: TileShape { height, width },
        ..*tile
    };
    let plain = Normalisation {
        mean: [0.0; 3],
        deviation: [1.0; 3],
    };
    let mut planes = vec![0.0; wide.shape.n_values()];
    Sampler::default().sample(picture, &wide, &plain, &mut planes);
    let area = height * width;
    (0..area)
        .flat_map(|at| [0, 1, 2].map(|channel| planes[channel * area + at]))
        .map(|it| (it * 255.0).round() as u8)
        .collect()
}

/// Distance of every part from the truth.
///
/// A single view cannot tell whether it sees the person from behind, and the model names parts by the side of the
/// picture: the better of both readings counts (the pipeline decides over all views).
pub fn part_errors(centres: &[[f64; 2]], truth: &[[f64; 2]]) -> Vec<f64> {
    let errors = |of: &dyn Fn(usize) -> usize| -> Vec<f64> {
        let error = |(part, at): (usize, &[f64; 2])| {
            let truth = truth[of(part)];
            (at[0] - truth[0]).hypot(at[1] - truth[1])
        };
        centres.iter().enumerate().map(error).collect()
    };
    let plain = errors(&|part| part);
    let exchanged = errors(&|part| MIRROR[part]);
    if exchanged.iter().sum::<f64>() < plain.iter().sum() {
        exchanged
    } else {
        plain
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_better_reading_of_left_and_right_counts() {
        let truth: Vec<[f64; 2]> = (0..N_PARTS).map(|it| [it as f64 * 10.0, 5.0]).collect();
        let exchanged: Vec<[f64; 2]> = MIRROR.iter().map(|it| truth[*it]).collect();
        assert_eq!(part_errors(&truth, &truth), [0.0; N_PARTS]);
        assert_eq!(part_errors(&exchanged, &truth), [0.0; N_PARTS]);
        let mut off = exchanged;
        off[6][1] += 7.0;
        let errors = part_errors(&off, &truth);
        assert_eq!(errors[6], 7.0);
        assert_eq!(errors.iter().sum::<f64>(), 7.0);
    }
}
