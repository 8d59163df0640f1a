//! Hardware on which frames are searched.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Hardware on which frames are searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Device {
    /// A graphics card if a suitable one is present, otherwise the processor.
    #[default]
    Auto,
    /// The processor.
    Cpu,
    /// A graphics card; the run fails if no suitable one is present.
    Gpu,
    /// A program that emulates a graphics card, for tests.
    Software,
}
