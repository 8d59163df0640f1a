//! Parses stages of the pipeline on the command line.

use clap::builder::{MapValueParser, PossibleValue, PossibleValuesParser, TypedValueParser as _};
use deployment::Stage;

/// The messages that a replay from a stage takes from the recording, in addition to those of the stage before.
fn taken(from: Stage) -> &'static str {
    match from {
        Stage::Capture => "Start from the footage, and send no recorded messages",
        Stage::Pose => "Send the recorded frames",
        Stage::Quality => "Also send the recorded single-view poses and their evidence",
        Stage::Fuse => "Also send the recorded expected errors",
        Stage::Triangulate => "Also send the recorded pair poses",
    }
}

/// A parser of the names of stages, with their explanation in `--help`.
pub(crate) fn parser() -> MapValueParser<PossibleValuesParser, fn(String) -> Stage> {
    let values = Stage::ALL.map(|stage| PossibleValue::new(stage.name()).help(taken(stage)));
    // The parser has checked that this is the name of a stage.
    let stage: fn(String) -> Stage = |name| Stage::of_name(&name).unwrap_or(Stage::Capture);
    PossibleValuesParser::new(values).map(stage)
}
