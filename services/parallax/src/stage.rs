//! Parses stages of the pipeline on the command line.

use clap::builder::{MapValueParser, PossibleValue, PossibleValuesParser, TypedValueParser as _};
use deployment::Stage;

/// The messages that a replay from a stage takes from the recording, in addition to those of the stage before.
fn taken(from: Stage) -> &'static str {
    match from {
        Stage::Capture => "From the footage; no recorded messages are sent",
        Stage::Pose => "With the recorded frames",
        Stage::Quality => "And the single-view poses and their evidence",
        Stage::Fuse => "And the expected errors",
        Stage::Triangulate => "And the pair poses",
    }
}

/// A parser of the names of stages, with their explanation in `--help`.
pub(crate) fn parser() -> MapValueParser<PossibleValuesParser, fn(String) -> Stage> {
    let values = Stage::ALL.map(|stage| PossibleValue::new(stage.name()).help(taken(stage)));
    // The parser has checked that this is the name of a stage.
    let stage: fn(String) -> Stage = |name| Stage::of_name(&name).unwrap_or(Stage::Capture);
    PossibleValuesParser::new(values).map(stage)
}
