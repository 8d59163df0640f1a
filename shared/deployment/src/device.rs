//! Where frames are searched.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where frames are searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Device {
    /// On a graphics card where there is one that can do it, else on the processor.
    #[default]
    Auto,
    /// On the processor.
    Cpu,
    /// On a graphics card; the run fails where none can do it.
    Gpu,
    /// By a program that plays a graphics card: for tests.
    Software,
}
