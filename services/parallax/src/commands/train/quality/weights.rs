//! Weights of torchvision's VGG-16, read from a file.

use std::path::Path;

use qualitytraining::parameters::Parameter;
use runtime::{ExitKind, Failure};

use crate::inputs;

/// Reads `.safetensors`.
pub(super) fn read(file: &Path) -> Result<Vec<Parameter>, Failure> {
    let bytes = std::fs::read(file).map_err(|error| inputs::in_file(file, &error))?;
    let read = qualitytraining::vgg::parse(&bytes);
    read.map_err(|error| {
        let message = format!("{}: {error}", file.display());
        Failure::new(ExitKind::Input, message)
    })
}
