//! Parses stages of the pipeline on the command line.

use clap::builder::{MapValueParser, PossibleValue, PossibleValuesParser, TypedValueParser as _};
use deployment::Stage;

/// Describes the recorded messages that a replay from this stage sends, but a replay from the previous stage does not.
fn taken(from: Stage) -> &'static str {
    match from {
        Stage::Capture => "Start from the footage, and send no recorded messages",
        Stage::Pose => "Send the recorded frames",
        Stage::Quality => "Also send the recorded single-view poses and their evidence",
        Stage::Fuse => "Also send the recorded expected errors",
        Stage::Triangulate => "Also send the recorded pair poses",
    }
}

/// Returns a parser for the names of stages, with their explanations for `--help`.
pub(crate) fn parser() -> MapValueParser<PossibleValuesParser, fn(String) -> Stage> {
    let values = Stage::ALL.map(|stage| PossibleValue::new(stage.name()).help(taken(stage)));
    // The parser accepts only names of stages, so the fallback is never used.
    let stage: fn(String) -> Stage = |name| Stage::of_name(&name).unwrap_or(Stage::Capture);
    PossibleValuesParser::new(values).map(stage)
}
