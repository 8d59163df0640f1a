//! A network that predicts errors, read from an ONNX file and run by the `rten` library or by ONNX
//! Runtime.

use inference::{Input, LoadError, RunError, Session, Side, Values, written};

use crate::{Card, CardError, TileShape, n_evidence};

/// Names of the inputs and of the output.
const TILE: &str = "tile";
const EVIDENCE: &str = "evidence";
const SIGMA: &str = "sigma";

/// A network with checked inputs and output.
#[derive(Debug)]
pub struct Network {
    session: Session,
    takes_tile: bool,
    takes_evidence: bool,
    card: Card,
    shape: TileShape,
    n_parts: usize,
}

/// Reason why a file was rejected as a network.
#[derive(Debug, thiserror::Error)]
pub enum NetworkError {
    /// The file cannot be loaded.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// An entry of the network's card is invalid.
    #[error(transparent)]
    Card(#[from] CardError),
    /// The network has unexpected inputs or outputs.
    #[error("the network has the {what} {got}, expected {expected}")]
    Names {
        /// `inputs` or `outputs`.
        what: &'static str,
        /// Names of the inputs or outputs.
        got: String,
        /// The accepted names.
        expected: &'static str,
    },
    /// An input or the output has an unexpected shape.
    #[error("`{name}` of the network is {got}, expected {expected}")]
    Shape {
        /// Name of the input or output.
        name: &'static str,
        /// The shape found.
        got: String,
        /// The expected shape.
        expected: String,
    },
    /// The network's inputs contradict its card.
    #[error("the network {takes} `evidence`, but the file {declares} a version of the evidence")]
    EvidenceVersion {
        /// `takes` or `does not take`, depending on the inputs.
        takes: &'static str,
        /// `declares` or `does not declare`, depending on the entries.
        declares: &'static str,
    },
    /// The library could not run the network.
    #[error(transparent)]
    Run(#[from] RunError),
}

impl Network {
    /// Reads a network, and runs it once on zeros to check its output.
    ///
    /// The file must come from a trusted source, because a network may use any amount of memory and time.
    ///
    /// * `file`: the bytes of an ONNX file, as described in `NETWORK.md` of this crate.
    /// * `n_parts`: number of parts of the model.
    ///
    /// # Errors
    ///
    /// Fails with [`NetworkError`], with the names and shapes found and expected.
    pub fn parse(file: Vec<u8>, n_parts: usize) -> Result<Self, NetworkError> {
        Self::new(Session::parse(file)?, n_parts)
    }

    fn new(session: Session, n_parts: usize) -> Result<Self, NetworkError> {
        let description = session.description();
        let entries = description.metadata.iter();
        let entries = entries.map(|(name, value)| (name.as_str(), value.as_str()));
        let card = Card::parse(entries, n_parts)?;
        let (inputs, outputs) = (&description.inputs, &description.outputs);
        let takes = |wanted: &str| inputs.iter().find(|input| input.name == wanted);
        let (tile, evidence) = (takes(TILE), takes(EVIDENCE));
        let n_known = [tile, evidence].into_iter().flatten().count();
        if n_known == 0 || n_known < inputs.len() {
            let found: Vec<&str> = inputs.iter().map(|input| input.name.as_str()).collect();
            return Err(names("inputs", &found));
        }
        if !outputs.iter().any(|output| output.name == SIGMA) {
            let found: Vec<&str> = outputs.iter().map(|output| output.name.as_str()).collect();
            return Err(names("outputs", &found));
        }
        if evidence.is_some() != card.evidence.is_some() {
            let [takes, declares] = if evidence.is_some() {
                ["takes", "does not declare"]
            } else {
                ["does not take", "declares"]
            };
            return Err(NetworkError::EvidenceVersion { takes, declares });
        }
        let shape = match tile {
            Some(input) => tile_shape(&input.sides, &card)?,
            None => card.tile.unwrap_or(TileShape::SMALL),
        };
        if let Some(input) = evidence {
            check_evidence(&input.sides, n_parts)?;
        }
        let (takes_tile, takes_evidence) = (tile.is_some(), evidence.is_some());
        let network = Self {
            session,
            takes_tile,
            takes_evidence,
            card,
            shape,
            n_parts,
        };
        let tile = vec![0.0; shape.n_values()];
        network.run(&tile, &vec![0.0; n_evidence(n_parts)])?;
        Ok(network)
    }

    /// The description in the network's file.
    pub fn card(&self) -> &Card {
        &self.card
    }

    /// A fingerprint of the bytes of the network's file (FNV-1a, 32 bits).
    pub fn fingerprint(&self) -> u32 {
        self.session.fingerprint()
    }

    /// The shape of the network's tile. For a network without a tile, the shape to which relative errors
    /// refer.
    pub fn tile_shape(&self) -> TileShape {
        self.shape
    }

    /// Returns true if the network takes the tile.
    pub fn takes_tile(&self) -> bool {
        self.takes_tile
    }

    /// Returns true if the network takes [`evidence`](crate::evidence()).
    pub fn takes_evidence(&self) -> bool {
        self.takes_evidence
    }

    /// Runs the network on one thread. The output is in the network's own [unit](crate::Unit).
    ///
    /// * `tile`: [`TileShape::n_values`] values; ignored by a network without a tile.
    /// * `evidence`: [`n_evidence`] values; ignored by a network without evidence.
    ///
    /// # Errors
    ///
    /// Fails with [`NetworkError::Shape`] if a slice or the output has an unexpected length, and with [`NetworkError::Run`]
    /// if the library fails.
    pub fn run(&self, tile: &[f32], evidence: &[f32]) -> Result<Vec<f32>, NetworkError> {
        let TileShape { height, width } = self.shape;
        let n = n_evidence(self.n_parts);
        let of_tile = [1, 3, height, width];
        let of_evidence = [1, n];
        let mut inputs = Vec::with_capacity(2);
        if self.takes_tile {
            length(TILE, tile, self.shape.n_values())?;
            inputs.push(Input {
                name: TILE,
                shape: &of_tile,
                values: Values::F32(tile),
            });
        }
        if self.takes_evidence {
            length(EVIDENCE, evidence, n)?;
            inputs.push(Input {
                name: EVIDENCE,
                shape: &of_evidence,
                values: Values::F32(evidence),
            });
        }
        let mut sigma = Err("of another type".to_owned());
        self.session.run(&inputs, &[SIGMA], &mut |output| {
            sigma = match output.values {
                Some(values) if output.shape == [1, self.n_parts] => Ok(values.to_vec()),
                Some(_) => Err(format!("f32 {:?}", output.shape)),
                None => Err("of another type".to_owned()),
            };
        })?;
        sigma.map_err(|got| shape(SIGMA, got, format!("f32 [1, {}]", self.n_parts)))
    }
}

fn names(what: &'static str, found: &[&str]) -> NetworkError {
    let found: Vec<String> = found.iter().map(|name| format!("`{name}`")).collect();
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

/// Height and width of the tile, from the card or, if the card does not give them, from the input.
///
/// * `sides`: sides of the input; empty if the file does not declare them.
fn tile_shape(sides: &[Side], card: &Card) -> Result<TileShape, NetworkError> {
    let expected = match card.tile {
        Some(TileShape { height, width }) => format!("[n, 3, {height}, {width}]"),
        None => "[n, 3, H, W] of known height and width, or `parallax.tile`".to_owned(),
    };
    let refused = || shape(TILE, written(sides), expected.clone());
    let [n, channels, height, width] = sides else {
        return Err(refused());
    };
    if !n.may_be(1) || !channels.may_be(3) {
        return Err(refused());
    }
    match (card.tile, height, width) {
        (Some(tile), _, _) if height.may_be(tile.height) && width.may_be(tile.width) => Ok(tile),
        (None, &Side::Fixed(height), &Side::Fixed(width))
            if (1..=crate::card::MAX_SIDE).contains(&height)
                && (1..=crate::card::MAX_SIDE).contains(&width) =>
        {
            Ok(TileShape { height, width })
        }
        _ => Err(refused()),
    }
}

fn check_evidence(sides: &[Side], n_parts: usize) -> Result<(), NetworkError> {
    let k = n_evidence(n_parts);
    match sides {
        [n, numbers] if n.may_be(1) && numbers.may_be(k) => Ok(()),
        _ => Err(shape(EVIDENCE, written(sides), format!("[n, {k}]"))),
    }
}

#[cfg(test)]
mod tests;
