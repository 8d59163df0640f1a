//! From a frame and its single-view pose to the expected error of every part, by a network.

use fmp::{Layout, LocalScore, Model, Pose};
use kernels::Rgb8View;

use crate::{EvidenceError, Network, NetworkError, Sampler, Tile, evidence};

/// A network with the memory that it works in.
#[derive(Debug)]
pub struct Forecaster {
    network: Network,
    sampler: Sampler,
    tile: Vec<f32>,
    evidence: Vec<f32>,
}

/// What a view saw and found.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    /// The frame.
    pub image: Rgb8View<'a>,
    /// The model of the person, and the pyramid of the frame.
    pub on: (&'a Model, &'a Layout),
    /// What the pose search found, best first.
    pub candidates: &'a [Pose],
    /// How well each part of the best fits; may be empty where the network takes no evidence.
    pub scores: &'a [LocalScore],
    /// Pixels of the frame per pixel of the original image.
    pub frame_scale: f64,
}

/// What is expected of the best candidate of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Forecast {
    /// What the network looked at.
    pub tile: Tile,
    /// Expected error of every part, pixels of the frame.
    pub sigma_px: Vec<f32>,
    /// Errors beyond which the network's file switches parts off, pixels of the frame; may be empty.
    pub tau_px: Vec<f32>,
}

/// Why nothing can be said of a frame.
#[derive(Debug, thiserror::Error)]
pub enum ForecastError {
    /// The pose search's answer is not what the network was made for, or there is none.
    #[error(transparent)]
    Evidence(#[from] EvidenceError),
    /// The pose has no size.
    #[error("the box of the parts is empty or not finite")]
    NoTile,
    /// The network did not run.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// The network says what is no number of pixels.
    #[error("the network says {got} of part {part}")]
    NotANumber {
        /// 1-based part.
        part: usize,
        /// The output.
        got: f32,
    },
}

impl Forecaster {
    /// Begins to work with a network.
    pub fn new(network: Network) -> Self {
        Self {
            tile: vec![0.0; network.tile_shape().n_values()],
            evidence: Vec::new(),
            sampler: Sampler::default(),
            network,
        }
    }

    /// The network.
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// Predicts the errors of a frame's best candidate.
    ///
    /// # Errors
    ///
    /// [`ForecastError`]
    ///
    /// # Panics
    ///
    /// If the image has no pixels, or a candidate does not lie on the layout.
    pub fn run(&mut self, seen: &Seen<'_>) -> Result<Forecast, ForecastError> {
        let (model, layout) = seen.on;
        let pose = seen.candidates.first().ok_or(EvidenceError::NoPose)?;
        let bounds = pose.bounding_box(model, layout);
        let tile = Tile::around(bounds, self.network.tile_shape()).ok_or(ForecastError::NoTile)?;
        let card = self.network.card();
        if self.network.takes_tile() {
            self.sampler
                .sample(seen.image, &tile, &card.colours, &mut self.tile);
        }
        if self.network.takes_evidence() {
            evidence(
                seen.on,
                seen.candidates,
                seen.scores,
                &tile,
                &mut self.evidence,
            )?;
        }
        let output = self.network.run(&self.tile, &self.evidence)?;
        let height = tile.height_px() / seen.frame_scale;
        let in_frame = |px: f32| (f64::from(px) * seen.frame_scale) as f32;
        let sigma = output.iter().enumerate().map(|(part, &got)| {
            let error = card.unit.error(got, height).map(in_frame);
            let part = part + 1;
            error
                .filter(|it| it.is_finite())
                .ok_or(ForecastError::NotANumber { part, got })
        });
        Ok(Forecast {
            tile,
            sigma_px: sigma.collect::<Result<_, _>>()?,
            tau_px: card.tau_px(height).map(in_frame).collect(),
        })
    }
}
