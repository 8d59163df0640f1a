//! Predicts the expected error of every part from a frame and its single-view pose, with a network.

use fmp::{Layout, LocalScore, Model, Pose};
use kernels::Rgb8View;

use crate::{EvidenceError, Network, NetworkError, Sampler, Tile, evidence};

/// A network with its work buffers.
#[derive(Debug)]
pub struct Forecaster {
    network: Network,
    sampler: Sampler,
    tile: Vec<f32>,
    evidence: Vec<f32>,
}

/// The input of a forecast: a frame and its single-view result.
#[derive(Debug, Clone, Copy)]
pub struct ForecastInput<'a> {
    /// Image of the frame.
    pub image: Rgb8View<'a>,
    /// The model of the person, and the layout of the frame's pyramid.
    pub on: (&'a Model, &'a Layout),
    /// The candidates of the pose search, best first.
    pub candidates: &'a [Pose],
    /// Local scores of the parts of the best candidate; may be empty if the network takes no
    /// evidence.
    pub scores: &'a [LocalScore],
    /// Pixels of the frame per pixel of the original image.
    pub frame_scale: f64,
}

/// The prediction for the best candidate of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Forecast {
    /// The tile that the network used.
    pub tile: Tile,
    /// Expected error of every part, in pixels of the frame.
    pub sigma_px: Vec<f32>,
    /// Thresholds in the network's file, in pixels of the frame. A part is switched off if its expected error is above the threshold. The
    /// list may be empty.
    pub tau_px: Vec<f32>,
}

/// Reason why there is no prediction for a frame.
#[derive(Debug, thiserror::Error)]
pub enum ForecastError {
    /// There is no candidate, or the network does not support poses of this kind.
    #[error(transparent)]
    Evidence(#[from] EvidenceError),
    /// The box around the pose is empty or not finite.
    #[error("the box of the parts is empty or not finite")]
    NoTile,
    /// The network could not be run.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// The network's output is not a valid number of pixels.
    #[error("the network's output for part {part} is {got}")]
    NotANumber {
        /// Number of the part, from 1.
        part: usize,
        /// The network's output.
        got: f32,
    },
}

impl Forecaster {
    /// Creates a forecaster for a network.
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
    /// Fails with [`ForecastError`].
    ///
    /// # Panics
    ///
    /// Panics if the image has no pixels, or a candidate is not on the layout.
    pub fn run(&mut self, input: &ForecastInput<'_>) -> Result<Forecast, ForecastError> {
        let (model, layout) = input.on;
        let pose = input.candidates.first().ok_or(EvidenceError::NoPose)?;
        let bounds = pose.bounding_box(model, layout);
        let tile = Tile::around(bounds, self.network.tile_shape()).ok_or(ForecastError::NoTile)?;
        let card = self.network.card();
        if self.network.takes_tile() {
            self.sampler.sample(input.image, &tile, &card.colours, &mut self.tile);
        }
        if self.network.takes_evidence() {
            evidence(
                input.on,
                input.candidates,
                input.scores,
                &tile,
                &mut self.evidence,
            )?;
        }
        let output = self.network.run(&self.tile, &self.evidence)?;
        let height = tile.height_px() / input.frame_scale;
        let in_frame = |px: f32| (f64::from(px) * input.frame_scale) as f32;
        let sigma = output.iter().enumerate().map(|(part, &got)| {
            let error = card.unit.error(got, height).map(in_frame);
            let part = part + 1;
            error
                .filter(|sigma| sigma.is_finite())
                .ok_or(ForecastError::NotANumber { part, got })
        });
        Ok(Forecast {
            tile,
            sigma_px: sigma.collect::<Result<_, _>>()?,
            tau_px: card.tau_px(height).map(in_frame).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use fmp::{Filter, ModelSpec, N_CHANNELS, PartSpec, Placement};
    use inference::onnx::Side;

    use super::*;
    use crate::{Card, Unit};

    /// A model of one part with 3 x 3 cells of 4 pixels.
    fn model() -> Model {
        Model::new(ModelSpec {
            name: "one".to_owned(),
            parts: vec![PartSpec {
                name: "head".to_owned(),
                filter_of_type: vec![0],
                edge: None,
            }],
            filters: vec![Filter {
                rows: 3,
                cols: 3,
                weights: vec![0.0; 9 * N_CHANNELS],
            }],
            root_bias: 0.0,
            interval: 5,
            cell_px: 4,
            threshold: -1.0,
            mirror: None,
        })
        .unwrap()
    }

    /// A network with a constant output for every tile of 4 x 3 pixels.
    fn constant(sigma: f32, unit: Unit, tau: f32) -> Forecaster {
        let mut net = inference::onnx::Network::default();
        let sides = [1, 3, 4, 3].map(Side::Fixed);
        net.inputs.push(("tile".to_owned(), sides.to_vec()));
        let one = vec![Side::Fixed(1), Side::Fixed(1)];
        net.outputs.push(("sigma".to_owned(), one));
        net.floats("w", &[3, 1], vec![0.0; 3]);
        net.floats("b", &[1], vec![sigma]);
        net.node("GlobalAveragePool", &["tile"], "mean", vec![]);
        net.node("Flatten", &["mean"], "flat", vec![]);
        net.node("Gemm", &["flat", "w", "b"], "sigma", vec![]);
        let card = Card {
            unit,
            tau: vec![tau],
            ..Card::default()
        };
        let entries = card.entries().into_iter();
        net.metadata = entries.map(|(name, it)| (name.to_owned(), it)).collect();
        Forecaster::new(Network::parse(net.file(), 1).unwrap())
    }

    fn run(forecaster: &mut Forecaster, frame_scale: f64) -> Result<Forecast, ForecastError> {
        let model = model();
        let layout = Layout::new(&model, 80, 60).unwrap();
        let pixels = vec![7; 80 * 60 * 3];
        let pose = Pose {
            score: 1.0,
            level: 0,
            parts: vec![Placement {
                x: 5,
                y: 4,
                mixture: 0,
            }],
        };
        forecaster.run(&ForecastInput {
            image: Rgb8View::new(80, 60, &pixels).unwrap(),
            on: (&model, &layout),
            candidates: &[pose],
            scores: &[],
            frame_scale,
        })
    }

    fn close(got: &[f32], expected: f32) {
        assert!((got[0] - expected).abs() < 1e-5, "{got:?}, not {expected}");
    }

    #[test]
    fn positions_are_in_pixels_of_the_original_image() {
        let forecast = run(&mut constant(8.0, Unit::Pixels, 6.0), 0.5).unwrap();
        close(&forecast.sigma_px, 4.0);
        close(&forecast.tau_px, 3.0);
    }

    #[test]
    fn relative_errors_scale_with_the_tile_at_every_frame_scale() {
        // The box is 12 pixels wide. A tile of this shape around it is 16 pixels high, plus a tenth.
        for frame_scale in [0.25, 1.0, 3.0] {
            let forecast = run(&mut constant(0.1, Unit::Relative, 0.2), frame_scale).unwrap();
            assert!((forecast.tile.height_px() - 17.6).abs() < 1e-9);
            close(&forecast.sigma_px, 1.76);
            close(&forecast.tau_px, 3.52);
        }
        let mut network = constant(2.0_f32.ln(), Unit::LogRelative, 0.2);
        let forecast = run(&mut network, 0.25).unwrap();
        close(&forecast.sigma_px, 0.176);
        close(&forecast.tau_px, 3.52);
    }

    #[test]
    fn an_infinite_output_is_rejected() {
        let error = run(&mut constant(f32::INFINITY, Unit::Pixels, 1.0), 1.0).unwrap_err();
        assert_eq!(error.to_string(), "the network's output for part 1 is inf");
    }
}
