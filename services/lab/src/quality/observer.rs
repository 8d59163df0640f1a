//! Search of pictures with known joints, as in the pipeline.

use std::sync::Arc;

use fmp::{Model, Responses, Scope, local_scores};
use kernels::Rgb8View;
use skeleton::N_PARTS;
use training::datasets::SkeletonTable;
use training::networks::quality::sample::{Sample, part_errors, picture_size};
use viewquality::{EvidenceError, Normalisation, Sampler, Tile, TileShape, evidence};

use crate::searches::Searches;

/// Reason why there is no sample for a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(super) enum NoSample {
    /// The picture cannot be searched.
    #[error(transparent)]
    Search(#[from] fmp::ImageTooSmall),
    /// The search found no person.
    #[error("no person was found")]
    Nobody,
    /// A true joint is unknown.
    #[error("the true position of a joint is unknown")]
    Unknown,
    /// The model does not have 26 parts.
    #[error("the model does not have 26 parts")]
    Model,
    /// The evidence cannot be written.
    #[error("the results of the search do not fit a network of expected errors")]
    Evidence(#[from] EvidenceError),
}

/// Searches pictures as in the pipeline, and compares the results with the truth.
#[derive(Debug)]
pub(super) struct Observer {
    model: Arc<Model>,
    table: SkeletonTable,
    shape: TileShape,
    searches: Searches,
}

impl Observer {
    /// Prepares the search for tiles of a shape.
    pub(super) fn new(model: Arc<Model>, shape: TileShape) -> Self {
        Self {
            searches: Searches::new(Arc::clone(&model)),
            model,
            table: SkeletonTable::published(),
            shape,
        }
    }

    /// Makes a sample.
    ///
    /// * `joints`: the true joints of `skeleton::PARSE14`, in pixels of the picture.
    /// * `named`: group and source of the sample.
    ///
    /// # Errors
    ///
    /// Fails with [`NoSample`].
    pub(super) fn observe(
        &self,
        picture: Rgb8View<'_>,
        joints: &[[f64; 2]],
        (group, source): (String, String),
    ) -> Result<Sample, NoSample> {
        if joints.len() != self.table.n_joints()
            || joints.iter().flatten().any(|joint| !joint.is_finite())
        {
            return Err(NoSample::Unknown);
        }
        let step = self.searches.of_size([picture.width(), picture.height()])?;
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
        evidence(of, &found.candidates, &scores, &tile, &mut numbers)?;
        let truth = self.table.parts_of(joints);
        let errors = part_errors(&pose.centres(&self.model, layout), &truth);
        Ok(Sample {
            group,
            source,
            picture: picture_of(picture, &tile),
            evidence: numbers,
            height_px: tile.height_px() as f32,
            errors_px: errors.into_iter().map(|error| error as f32).collect(),
        })
    }
}

/// Returns the tile and its margin as bytes.
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
        .map(|value| (value * 255.0).round() as u8)
        .collect()
}
