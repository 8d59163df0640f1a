//! A loaded network.

use core::fmt;

use crate::direct::{Direct, Parts};
use crate::engine::Engine;
#[cfg(feature = "ort")]
use crate::onnx_runtime::OnnxRuntime;
use crate::provider::Place;
use crate::rten_engine::Rten;
use crate::{Description, Input, LoadError, Output, RunError, nesting, sizes};

/// A network loaded by a library.
#[derive(Debug)]
pub struct Session {
    engine: Box<dyn Engine>,
    description: Description,
    fingerprint: u32,
    by: RunBy,
}

/// A library that runs networks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RunBy {
    /// Parallax itself runs the convolutions, and `rten` the later layers.
    Parallax,
    /// `rten` runs all layers. The text is the reason why Parallax does not run the convolutions.
    Rten(String),
    /// ONNX Runtime.
    OnnxRuntime(Place),
}

impl fmt::Display for RunBy {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Parallax => to.write_str("Parallax"),
            Self::Rten(why) => write!(to, "rten, since {why}"),
            Self::OnnxRuntime(place) => write!(to, "ONNX Runtime on {place}"),
        }
    }
}

impl Session {
    /// Loads a network into the built-in library.
    ///
    /// The file must come from a trusted source: a network may use any amount of memory and time.
    ///
    /// * `file`: the bytes of an ONNX file.
    ///
    /// # Errors
    ///
    /// Fails with [`LoadError::File`].
    pub fn parse(file: Vec<u8>) -> Result<Self, LoadError> {
        let fingerprint = check(&file)?;
        let parts = Parts::find(&file);
        let (whole, description) = Rten::load(file)?;
        let (engine, by): (Box<dyn Engine>, _) = match parts {
            Ok(parts) => (Box::new(Direct { parts, whole }), RunBy::Parallax),
            Err(why) => (Box::new(whole), RunBy::Rten(why.to_string())),
        };
        Ok(Self {
            engine,
            description,
            fingerprint,
            by,
        })
    }

    /// Works like [`Self::parse`], but `rten` runs the whole network; for comparisons.
    ///
    /// # Errors
    ///
    /// Fails with [`LoadError::File`].
    pub fn parse_by_rten(file: Vec<u8>) -> Result<Self, LoadError> {
        let fingerprint = check(&file)?;
        let (engine, description) = Rten::load(file)?;
        Ok(Self {
            engine: Box::new(engine),
            description,
            fingerprint,
            by: RunBy::Rten("it was asked for".to_owned()),
        })
    }

    /// Works like [`Self::parse`], but ONNX Runtime runs the network.
    ///
    /// # Errors
    ///
    /// Fails with [`LoadError`].
    #[cfg(feature = "ort")]
    pub fn parse_with(runtime: &OnnxRuntime, file: &[u8]) -> Result<Self, LoadError> {
        let fingerprint = check(file)?;
        let (engine, description, place) = runtime.load_network(file)?;
        Ok(Self {
            engine: Box::new(engine),
            description,
            fingerprint,
            by: RunBy::OnnxRuntime(place),
        })
    }

    /// The library that runs the network.
    pub fn run_by(&self) -> &RunBy {
        &self.by
    }

    /// Returns the description of the network's inputs and outputs.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// A fingerprint of the bytes of the network's file (FNV-1a, 32 bits).
    pub fn fingerprint(&self) -> u32 {
        self.fingerprint
    }

    /// Runs the network on one thread.
    ///
    /// * `outputs`: names of the requested outputs.
    /// * `take`: called once for each requested output, in any order.
    ///
    /// # Errors
    ///
    /// Fails with [`RunError`], with the library's error.
    pub fn run(
        &self,
        inputs: &[Input<'_>],
        outputs: &[&str],
        take: &mut dyn FnMut(Output<'_>),
    ) -> Result<(), RunError> {
        self.engine.run(inputs, outputs, take).map_err(RunError)
    }
}

fn check(file: &[u8]) -> Result<u32, LoadError> {
    nesting::check(file).map_err(|error| LoadError::File(Box::new(error)))?;
    sizes::check(file).map_err(|error| LoadError::File(Box::new(error)))?;
    Ok(formats::checksum::fnv1a_32(file))
}
