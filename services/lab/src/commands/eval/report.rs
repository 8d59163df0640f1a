//! Writes the report of an evaluation.

use deployment::paper::Config;
use failure::Failure;
use lab::eval::{self, Done, Job};
use statistics::score::Bootstrap;
use steps::fuse;
use terminal::output;

use super::Arguments;

/// Writes the report, and prints a summary.
pub(super) fn write(
    arguments: &Arguments,
    config: &Config,
    job: &Job<'_>,
    done: &Done,
) -> Result<(), Failure> {
    let bootstrap = Bootstrap {
        block: arguments.block,
        ..Bootstrap::default()
    };
    let summary = done.summary(&job.versions, &bootstrap);
    let about = about(arguments, config, job, done);
    eval::write_report(&arguments.out, &summary, &job.versions, &about)?;
    if arguments.json {
        return output::json(&summary);
    }
    output::line(eval::text(&summary, &job.versions))?;
    output::line(format_args!(
        "report: {}",
        arguments.out.join("report.html").display()
    ))
}

fn about(
    arguments: &Arguments,
    config: &Config,
    job: &Job<'_>,
    done: &Done,
) -> Vec<(String, String)> {
    let n_frames: usize = done.sequences.iter().map(|sequence| sequence.1.len()).sum();
    let file = arguments.sigma.as_ref().or(arguments.network.as_ref());
    let expected = match (file, arguments.oracle) {
        (Some(file), _) => file.display().to_string(),
        (None, true) => {
            "the true errors, with a tenth of the person's size as the threshold".to_owned()
        }
        (None, false) => "none".to_owned(),
    };
    let size = arguments.size.map_or_else(
        || format!("{} of the footage", arguments.scale),
        |[width, height]| format!("{width}x{height}"),
    );
    let frames = format!("{n_frames} instants; sequences: {}", done.sequences.len());
    let settings = fuse::settings(config, 1.0, job.learned);
    let model = arguments.model.as_ref();
    let model = model.map_or("the shipped model".to_owned(), |model| {
        model.display().to_string()
    });
    let upright = if job.film.upright { ", upright" } else { "" };
    [
        ("model", model),
        ("frames", format!("{frames}, {size}{upright}")),
        ("expected errors", expected),
        (
            "energy",
            format!(
                "{}, alpha {}, beta {}, distances {}",
                match config.energy {
                    deployment::paper::Energy::Paper => "the paper's",
                    deployment::paper::Energy::Released => "the released program's",
                },
                settings.alpha,
                settings.beta,
                if settings.max_distance_cells.is_finite() {
                    format!("up to {} cells", settings.max_distance_cells)
                } else {
                    "of any size".to_owned()
                }
            ),
        ),
        (
            "facing",
            if config.facing {
                "decided for every view"
            } else {
                "as named by the model"
            }
            .to_owned(),
        ),
        ("candidates per view", job.n_candidates.to_string()),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .to_vec()
}
