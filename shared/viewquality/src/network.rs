//! A network that predicts errors, read from an ONNX file and run by the `rten` library.

mod frame;

use std::sync::Arc;

use rten::{Dimension, Model, NodeId, RunOptions, ThreadPool, Value, ValueOrView};
use rten_tensor::prelude::*;
use rten_tensor::{NdTensorView, TensorView};

use crate::{Card, CardError, TileShape, n_evidence};

/// Names of the inputs and of the output.
const TILE: &str = "tile";
const EVIDENCE: &str = "evidence";
const SIGMA: &str = "sigma";

/// A network, known to take what there is and to give one number per part.
#[derive(Debug)]
pub struct Network {
    model: Model,
    tile: Option<NodeId>,
    evidence: Option<NodeId>,
    sigma: NodeId,
    card: Card,
    shape: TileShape,
    n_parts: usize,
    fingerprint: u32,
    threads: Arc<ThreadPool>,
}

/// Why a file is no network that predicts errors.
#[derive(Debug, thiserror::Error)]
pub enum NetworkError {
    /// The library cannot read it: no ONNX file, cut off, or of operations that it does not know.
    #[error("the file is no network that can be run")]
    Load(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// It says something of itself that cannot be.
    #[error(transparent)]
    Card(#[from] CardError),
    /// It takes or gives something else.
    #[error("the network has the {what} {got}, expected {expected}")]
    Names {
        /// `inputs` or `outputs`.
        what: &'static str,
        /// Their names.
        got: String,
        /// Those that would do.
        expected: &'static str,
    },
    /// An input or the output has another shape.
    #[error("`{name}` of the network is {got}, expected {expected}")]
    Shape {
        /// Its name.
        name: &'static str,
        /// The shape found.
        got: String,
        /// The shape that would do.
        expected: String,
    },
    /// The input and what the file says of it do not agree.
    #[error("the network {takes} `evidence`, but its file {says} which version of it")]
    EvidenceVersion {
        /// Whether there is the input.
        takes: &'static str,
        /// Whether there is the entry.
        says: &'static str,
    },
    /// It cannot be run on what there is.
    #[error("the network cannot be run")]
    Run(#[source] Box<dyn std::error::Error + Send + Sync>),
}

impl Network {
    /// Reads a network, and runs it once on zeros to see what it gives.
    ///
    /// Who gives the file is trusted: a network may ask for any amount of memory and time.
    ///
    /// * `file`: the bytes of an ONNX file, as `NETWORK.md` beside this crate describes it.
    /// * `n_parts`: parts of the model.
    ///
    /// # Errors
    ///
    /// [`NetworkError`], with the names and shapes found and expected.
    pub fn parse(file: Vec<u8>, n_parts: usize) -> Result<Self, NetworkError> {
        let fingerprint = fnv1a(&file);
        frame::check(&file).map_err(|it| NetworkError::Load(Box::new(it)))?;
        let model = Model::load(file).map_err(|it| NetworkError::Load(Box::new(it)))?;
        let card = Card::parse(model.metadata().fields(), n_parts)?;
        let [mut tile, mut evidence] = [None, None];
        for &id in model.input_ids() {
            match name(&model, id) {
                TILE => tile = Some(id),
                EVIDENCE => evidence = Some(id),
                _ => return Err(names("inputs", &model, model.input_ids())),
            }
        }
        if tile.is_none() && evidence.is_none() {
            return Err(names("inputs", &model, model.input_ids()));
        }
        let sigma = model.output_ids().iter().copied();
        let sigma = sigma.filter(|it| name(&model, *it) == SIGMA).last();
        let sigma = sigma.ok_or_else(|| names("outputs", &model, model.output_ids()))?;
        if evidence.is_some() != card.evidence.is_some() {
            let [takes, says] = if evidence.is_some() {
                ["takes", "does not say"]
            } else {
                ["does not take", "says"]
            };
            return Err(NetworkError::EvidenceVersion { takes, says });
        }
        let shape = match tile {
            Some(id) => tile_shape(&model, id, &card)?,
            None => card.tile.unwrap_or(TileShape::SMALL),
        };
        if let Some(id) = evidence {
            check_evidence(&model, id, n_parts)?;
        }
        let network = Self {
            model,
            tile,
            evidence,
            sigma,
            card,
            shape,
            n_parts,
            fingerprint,
            threads: Arc::new(ThreadPool::with_num_threads(1)),
        };
        let tile = vec![0.0; shape.n_values()];
        network.run(&tile, &vec![0.0; n_evidence(n_parts)])?;
        Ok(network)
    }

    /// What its file says of it.
    pub fn card(&self) -> &Card {
        &self.card
    }

    /// A number made of the bytes of its file (FNV-1a, 32 bits): another for another file.
    pub fn fingerprint(&self) -> u32 {
        self.fingerprint
    }

    /// The tile that it looks at; of a network that looks at none, the one its errors are relative to.
    pub fn tile_shape(&self) -> TileShape {
        self.shape
    }

    /// Whether it looks at the tile.
    pub fn takes_tile(&self) -> bool {
        self.tile.is_some()
    }

    /// Whether it takes [`evidence`](crate::evidence()).
    pub fn takes_evidence(&self) -> bool {
        self.evidence.is_some()
    }

    /// Runs it on one thread; the output as it is, in its own [unit](crate::Unit).
    ///
    /// * `tile`: [`TileShape::n_values`] values; ignored by a network that does not look at it.
    /// * `evidence`: [`n_evidence`] numbers; ignored by a network that does not take them.
    ///
    /// # Errors
    ///
    /// [`NetworkError::Shape`] if a slice or the output has another length, [`NetworkError::Run`] if the
    /// library says so.
    pub fn run(&self, tile: &[f32], evidence: &[f32]) -> Result<Vec<f32>, NetworkError> {
        let mut inputs: Vec<(NodeId, ValueOrView<'_>)> = Vec::with_capacity(2);
        if let Some(id) = self.tile {
            let TileShape { height, width } = self.shape;
            length(TILE, tile, self.shape.n_values())?;
            let view = NdTensorView::from_data([1, 3, height, width], tile);
            inputs.push((id, view.into()));
        }
        if let Some(id) = self.evidence {
            let n = n_evidence(self.n_parts);
            length(EVIDENCE, evidence, n)?;
            inputs.push((id, NdTensorView::from_data([1, n], evidence).into()));
        }
        let options = RunOptions::default().with_thread_pool(Some(Arc::clone(&self.threads)));
        let run = self.model.run(inputs, &[self.sigma], Some(options));
        let outputs = run.map_err(|it| NetworkError::Run(Box::new(it)))?;
        let expected = || format!("f32 [1, {}]", self.n_parts);
        let sigma: Option<TensorView<'_, f32>> = outputs.first().and_then(Value::as_tensor_view);
        let Some(sigma) = sigma else {
            return Err(shape(SIGMA, "of another type".to_owned(), expected()));
        };
        if sigma.shape() != [1, self.n_parts] {
            return Err(shape(SIGMA, format!("f32 {:?}", sigma.shape()), expected()));
        }
        Ok(sigma.iter().copied().collect())
    }
}

/// The published hash; its letters are checked in the tests.
fn fnv1a(bytes: &[u8]) -> u32 {
    let step = |hash: u32, byte: &u8| (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193);
    bytes.iter().fold(0x811c_9dc5, step)
}

fn name(model: &Model, id: NodeId) -> &str {
    let info = model.node_info(id);
    info.and_then(|it| it.name()).unwrap_or_default()
}

fn names(what: &'static str, model: &Model, ids: &[NodeId]) -> NetworkError {
    let found: Vec<String> = ids
        .iter()
        .map(|it| format!("`{}`", name(model, *it)))
        .collect();
    let expected = match what {
        "inputs" => "`tile` f32 [n, 3, H, W], `evidence` f32 [n, K], or both",
        _ => "`sigma` f32 [n, parts]",
    };
    NetworkError::Names {
        what,
        got: found.join(", "),
        expected,
    }
}

fn shape(name: &'static str, got: String, expected: String) -> NetworkError {
    NetworkError::Shape {
        name,
        got,
        expected,
    }
}

fn length(name: &'static str, values: &[f32], expected: usize) -> Result<(), NetworkError> {
    if values.len() != expected {
        let count = |n: usize| format!("{n} values");
        return Err(shape(name, count(values.len()), count(expected)));
    }
    Ok(())
}

/// The sides of an input, and how they are written; no sides where the file does not say.
fn sides(model: &Model, id: NodeId) -> (Vec<Dimension>, String) {
    let sides = model.node_info(id).and_then(|it| it.shape());
    let sides = sides.unwrap_or_default();
    let words: Vec<String> = sides
        .iter()
        .map(|it| match it {
            Dimension::Fixed(n) => n.to_string(),
            Dimension::Symbolic(name) => name.clone(),
        })
        .collect();
    let text = format!("[{}]", words.join(", "));
    (sides, text)
}

/// Whether a side may have a size.
fn may_be(side: &Dimension, size: usize) -> bool {
    match side {
        Dimension::Fixed(n) => *n == size,
        Dimension::Symbolic(_) => true,
    }
}

/// Height and width of the tile: what the file says of itself, else what its input says.
fn tile_shape(model: &Model, id: NodeId, card: &Card) -> Result<TileShape, NetworkError> {
    let (sides, got) = sides(model, id);
    let expected = match card.tile {
        Some(TileShape { height, width }) => format!("[n, 3, {height}, {width}]"),
        None => "[n, 3, H, W] of known height and width, or `parallax.tile`".to_owned(),
    };
    let refused = || shape(TILE, got.clone(), expected.clone());
    let [n, channels, height, width] = sides.as_slice() else {
        return Err(refused());
    };
    if !may_be(n, 1) || !may_be(channels, 3) {
        return Err(refused());
    }
    match (card.tile, height, width) {
        (Some(tile), _, _) if may_be(height, tile.height) && may_be(width, tile.width) => Ok(tile),
        (None, &Dimension::Fixed(height), &Dimension::Fixed(width))
            if (1..=crate::card::MAX_SIDE).contains(&height)
                && (1..=crate::card::MAX_SIDE).contains(&width) =>
        {
            Ok(TileShape { height, width })
        }
        _ => Err(refused()),
    }
}

fn check_evidence(model: &Model, id: NodeId, n_parts: usize) -> Result<(), NetworkError> {
    let (sides, got) = sides(model, id);
    let k = n_evidence(n_parts);
    match sides.as_slice() {
        [n, numbers] if may_be(n, 1) && may_be(numbers, k) => Ok(()),
        _ => Err(shape(EVIDENCE, got, format!("[n, {k}]"))),
    }
}

#[cfg(test)]
mod tests;
