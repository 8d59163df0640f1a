//! Stages of the pipeline as arguments of the command line.

use clap::builder::{MapValueParser, PossibleValue, PossibleValuesParser, TypedValueParser as _};
use deployment::Stage;

/// What a replay from a stage on takes from its recording.
fn taken(from: Stage) -> &'static str {
    match from {
        Stage::Capture => "From the footage on: nothing of the recording is sent",
        Stage::Pose => "The frames are given",
        Stage::Quality => "And the single-view poses, and their evidence",
        Stage::Fuse => "And the expected errors",
        Stage::Triangulate => "And the answers of all pairs",
    }
}

/// A parser of the stages' names, which `--help` explains.
pub(crate) fn parser() -> MapValueParser<PossibleValuesParser, fn(String) -> Stage> {
    let values = Stage::ALL.map(|it| PossibleValue::new(it.name()).help(taken(it)));
    // Only names of stages get here.
    let stage: fn(String) -> Stage = |name| Stage::of_name(&name).unwrap_or(Stage::Capture);
    PossibleValuesParser::new(values).map(stage)
}
