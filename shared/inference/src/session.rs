//! A network that is loaded.

use crate::engine::Engine;
#[cfg(feature = "ort")]
use crate::onnx_runtime::OnnxRuntime;
use crate::rten_engine::Rten;
use crate::{Description, Input, LoadError, Output, RunError, nesting, sizes};

/// A network that is loaded by a library.
#[derive(Debug)]
pub struct Session {
    engine: Box<dyn Engine>,
    description: Description,
    fingerprint: u32,
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
    /// [`LoadError::File`].
    pub fn parse(file: Vec<u8>) -> Result<Self, LoadError> {
        let fingerprint = check(&file)?;
        let (engine, description) = Rten::load(file)?;
        Ok(Self {
            engine: Box::new(engine),
            description,
            fingerprint,
        })
    }

    /// As [`Self::parse`], run by ONNX Runtime.
    ///
    /// # Errors
    ///
    /// [`LoadError`].
    #[cfg(feature = "ort")]
    pub fn parse_with(runtime: &OnnxRuntime, file: &[u8]) -> Result<Self, LoadError> {
        let fingerprint = check(file)?;
        let (engine, description) = runtime.load_network(file)?;
        Ok(Self {
            engine: Box::new(engine),
            description,
            fingerprint,
        })
    }

    /// What it takes and gives.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// A fingerprint of the bytes of its file (FNV-1a, 32 bits).
    pub fn fingerprint(&self) -> u32 {
        self.fingerprint
    }

    /// Runs it on one thread.
    ///
    /// * `outputs`: the names of the wanted outputs.
    /// * `take`: called once for each of them, in any order.
    ///
    /// # Errors
    ///
    /// [`RunError`], with what the library says.
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
    Ok(checksum::fnv1a_32(file))
}
