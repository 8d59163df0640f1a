//! `parallax-lab judge` for a network that finds keypoints.

use core::fmt;
use std::path::Path;
use std::process::ExitCode;

use failure::{Console, ExitKind, Failure, Stop};
use inputs::library::Library;
use lab::evaluation::{Intervals, Judged, Pictures};
use lab::judged;
use lab::judged_network::{self, JointError, NetworkReader, Seen};
use serde_json::{Value, json};
use statistics::score::{Bootstrap, PCK_SHARES, area_under_roc, rank_correlation};
use terminal::output;

use super::Arguments;

/// Runs the command.
pub(super) fn run(
    arguments: &Arguments,
    stop: &Stop,
    console: &dyn Console,
) -> Result<ExitCode, Failure> {
    refuse(arguments)?;
    let named = (arguments.model.as_path(), arguments.card.as_deref());
    let file = inputs::open_network(named, &Library::BuiltIn)?;
    let finder = arguments
        .find_boxes
        .then(|| inputs::detector::open(Path::new(deployment::SHIPPED), None));
    let mut network = file.fitted()?;
    if arguments.mirror {
        network = inputs::mirrored(network, "--mirror")?;
    }
    let reader = NetworkReader {
        network,
        sides: arguments.sides,
        finder: finder.transpose()?,
    };
    let people = arguments.people()?;
    let Seen { pictures, errors } = judged_network::judged(&reader, &people, stop, console)?;
    let expected = Expected::new(&errors);
    let [which, _] = Judged::ALL;
    if arguments.json {
        let mut report = json!({
            "schema_version": 1,
            "network": arguments.model,
            "images": pictures.truths.len(),
            "left_out": pictures.n_left_out,
        });
        report["peaks"] = numbers(&pictures, which);
        report["expected_errors"] = expected.json();
        output::json(&report)?;
        return Ok(ExitCode::SUCCESS);
    }
    output::line(format_args!(
        "maxima of the maps, in the person's box: {}",
        pictures.report(which)
    ))?;
    let Intervals { pcp, pck } = pictures.intervals(which, &Bootstrap::default());
    let [mean_of_ends, both_ends] = pcp.map(interval);
    let [near, far] = pck.map(interval);
    output::line(format_args!(
        "95 % intervals of the totals: PCP mean of ends {mean_of_ends}, both ends {both_ends}; PCK {near}, {far}"
    ))?;
    output::line(format_args!("\n{expected}"))?;
    Ok(ExitCode::SUCCESS)
}

/// Measures of how well the height of the maps predicts the error of a joint.
struct Expected {
    n_joints: usize,
    n_far: usize,
    /// Area under the ROC curve, with its interval.
    auc: Option<(f64, [f64; 2])>,
    rank_correlation: Option<f64>,
}

impl Expected {
    /// * `people`: errors of the joints of each person.
    fn new(people: &[Vec<JointError>]) -> Self {
        let auc = |errors: &[JointError]| {
            let each = errors.iter().map(|error| (error.expected, error.is_far()));
            area_under_roc(&each.collect::<Vec<_>>())
        };
        let errors = people.concat();
        let both: Vec<(f64, f64)> =
            errors.iter().map(|error| (error.expected, error.error)).collect();
        Self {
            n_joints: errors.len(),
            n_far: errors.iter().filter(|error| error.is_far()).count(),
            auc: auc(&errors).zip(Bootstrap::default().interval_of(people, auc)),
            rank_correlation: rank_correlation(&both),
        }
    }

    fn json(&self) -> Value {
        json!({
            "joints": self.n_joints,
            "off_by_half_a_head": self.n_far,
            "auc": self.auc.map(|auc| auc.0),
            "auc_interval": self.auc.map(|auc| auc.1),
            "rank_correlation": self.rank_correlation,
        })
    }
}

impl fmt::Display for Expected {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        let auc = self.auc.map_or_else(
            || "unknown".to_owned(),
            |(auc, [low, high])| format!("{auc:.3} ({low:.3} to {high:.3})"),
        );
        let number = |value: Option<f64>| {
            value.map_or_else(|| "unknown".to_owned(), |number| format!("{number:.3}"))
        };
        write!(
            to,
            "expected errors of the maxima: area under the ROC curve {} ({} of {} joints are off by more than half a head), rank correlation {}",
            auc,
            self.n_far,
            self.n_joints,
            number(self.rank_correlation)
        )
    }
}

/// Refuses options that apply only to models of parts.
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
