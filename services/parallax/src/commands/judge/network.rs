//! `parallax model judge` of a network that finds keypoints.

use std::path::Path;
use std::process::ExitCode;

use evaluation::{Bootstrap, PCK_SHARES};
use experiment::{Intervals, Judged, Pictures};
use fmp::Solver;
use launch::{inputs, output};
use offline::Console;
use offline::judged;
use offline::judged_network::{self, NetworkReader};
use offline::network::NetworkFile;
use runtime::{ExitKind, Failure, Stop};
use serde_json::{Value, json};

use super::Arguments;

/// What is judged, as [`Judged::ALL`]: keys and titles.
const NAMES: [(&str, &str); 2] = [
    ("peaks", "maxima of the maps, in the person's box"),
    ("springs", "the same maps, held together by springs"),
];

/// Runs the command.
pub(super) fn run(
    arguments: &Arguments,
    stop: &Stop,
    console: &dyn Console,
) -> Result<ExitCode, Failure> {
    refuse(arguments)?;
    let file = NetworkFile::open(&arguments.model, arguments.card.as_deref())?;
    let shipped = Path::new(deployment::SHIPPED);
    let springs = arguments.springs.as_deref().unwrap_or(shipped);
    let reader = NetworkReader {
        network: file.fitted()?,
        springs: Solver::new(inputs::springs(springs)?),
    };
    let people = arguments.people()?;
    let pictures = judged_network::judged(&reader, &people, stop, console)?;
    if arguments.json {
        let mut report = json!({
            "schema_version": 1,
            "network": arguments.model,
            "images": pictures.truths.len(),
            "left_out": pictures.n_left_out,
        });
        for ((key, _), which) in NAMES.into_iter().zip(Judged::ALL) {
            report[key] = numbers(&pictures, which);
        }
        output::json(&report)?;
        return Ok(ExitCode::SUCCESS);
    }
    for (nth, ((_, title), which)) in NAMES.into_iter().zip(Judged::ALL).enumerate() {
        let gap = if nth == 0 { "" } else { "\n" };
        output::line(format_args!("{gap}{title}: {}", pictures.report(which)))?;
        let Intervals { pcp, pck } = pictures.intervals(which, &Bootstrap::default());
        let [mean_of_ends, both_ends] = pcp.map(interval);
        let [near, far] = pck.map(interval);
        output::line(format_args!(
            "95 % intervals of the totals: PCP mean of ends {mean_of_ends}, both ends {both_ends}; PCK {near}, {far}"
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Refuses what only models of parts have.
fn refuse(arguments: &Arguments) -> Result<(), Failure> {
    let unused = if arguments.offsets {
        "--offsets"
    } else if arguments.joint_map != Path::new(deployment::SHIPPED) {
        "--joint-map"
    } else {
        return Ok(());
    };
    let message = format!(
        "{}: {unused} is for models of parts, not for networks",
        arguments.model.display()
    );
    Err(Failure::new(ExitKind::Usage, message))
}

fn numbers(pictures: &Pictures, which: Judged) -> Value {
    let Intervals { pcp, pck } = pictures.intervals(which, &Bootstrap::default());
    let mut value = judged::numbers(&pictures.report(which));
    value["intervals"] = json!({
        "pcp": {"mean_of_ends": pcp[0], "both_ends": pcp[1]},
        "pck": {PCK_SHARES[0].to_string(): pck[0], PCK_SHARES[1].to_string(): pck[1]},
    });
    value
}

fn interval(of: Option<[f64; 2]>) -> String {
    of.map_or_else(
        || "unknown".to_owned(),
        |[low, high]| format!("{low:.1} to {high:.1}"),
    )
}
