//! Libraries that run networks.

use std::path::Path;

use failure::Failure;
use inference::{Provider, Session};

use crate::refused::refused;

/// Library that runs networks.
#[derive(Debug, Default)]
pub enum Library {
    /// The built-in library.
    #[default]
    BuiltIn,
    /// ONNX Runtime, which the user provides.
    #[cfg(feature = "ort")]
    OnnxRuntime(inference::OnnxRuntime),
}

impl Library {
    /// Loads ONNX Runtime.
    ///
    /// * `file`: the library, for example `/usr/lib/libonnxruntime.so`.
    /// * `provider`: hardware on which it runs networks.
    ///
    /// # Errors
    ///
    /// Fails if the library cannot be loaded.
    #[cfg(feature = "ort")]
    pub fn load(file: &Path, provider: Provider) -> Result<Self, Failure> {
        let loaded = inference::OnnxRuntime::load(file);
        loaded
            .map(|runtime| Self::OnnxRuntime(runtime.on(provider)))
            .map_err(|error| refused(file, &error))
    }

    /// Loads ONNX Runtime.
    ///
    /// * `file`: the library, for example `/usr/lib/libonnxruntime.so`.
    ///
    /// # Errors
    ///
    /// Always fails, because this Parallax was built without ONNX Runtime.
    #[cfg(not(feature = "ort"))]
    pub fn load(file: &Path, _provider: Provider) -> Result<Self, Failure> {
        let message = format!(
            "{} cannot be loaded, because this Parallax was built without ONNX Runtime: build Parallax with --features ort",
            file.display()
        );
        Err(Failure::new(failure::ExitKind::Config, message))
    }

    /// Loads a network.
    ///
    /// * `path`: name of the network in errors.
    ///
    /// # Errors
    ///
    /// Fails if the bytes are not a runnable network.
    pub(crate) fn session(&self, path: &Path, bytes: Vec<u8>) -> Result<Session, Failure> {
        let session = match self {
            Self::BuiltIn => Session::parse(bytes),
            #[cfg(feature = "ort")]
            Self::OnnxRuntime(runtime) => Session::parse_with(runtime, &bytes),
        };
        session.map_err(|error| refused(path, &error))
    }
}
