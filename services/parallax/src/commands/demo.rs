//! `parallax demo`: runs a deployment of four synthetic cameras, kills one of its processes, and writes a report.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use failure::{ExitKind, Failure};
use scene::Action;
use terminal::{Globals, output, rate};
use trials::demo::{self, Options};

use super::view;

const HELP: &str = "\
The demo needs only this program. The capture processes render pictures of a synthetic person during the run (see \
`parallax-lab synth --help`), and the shipped network finds the joints. Four cameras around the person capture 320x240 pixels in \
real time. Every stage and camera is a separate process, as in `parallax run`. After two fifths of the frames, the process of \
camera c3 is killed (SIGKILL), as in a crash. The other three cameras continue. The supervisor restarts the process, which continues with \
the current frame.

The frame rate is chosen by a measurement of about two seconds, in which frames are rendered and searched on all cores. Other \
programs that run at that time slow the measurement down. The rate is at most 5 frames per second, and computing takes at most half of the time between \
two frames. If the machine is slow or busy, the demo says so, with numbers. Below 2.5 frames per second, every frame is searched for the person, which takes \
longer.

OUT contains report.html, report.json with the same numbers, deployment.toml and rig.toml, and run/ with the \
results of the run. Open report.html in a browser. It shows the skeleton in space beside the truth, the views of every \
result, the cost of the kill, the latency of every stage, the account of all frames, and pictures with skeletons. \
`parallax run OUT/deployment.toml` runs the deployment again. Files of an earlier demo are replaced.

The demo checks limits that a broken pipeline would exceed. At least --min-results of the frames have a result, at least --min-skeletons of \
the results have a skeleton, and PCP3D over all people in all results is at least --min-pcp3d. The killed camera is back within --max-return-ms. \
Meanwhile there are results from the other cameras, with no pause longer than --max-pause-ms. This is checked only if the camera was away for \
longer than the interval of results and the deadline of a stage. Every frame of every view is accounted for, except two frames that the killed \
process may have been processing. No other process fails, and all results are written.

Limits on times are for a machine that keeps up with 5 frames per second. At a lower frame rate, --max-return-ms grows in \
proportion to the interval between frames, at most by a factor of 20. The time for one frame on all cores is measured before \
and after the run. If the longer of the two is above 100 ms, --max-pause-ms (20 times 100 ms) grows in proportion. A stage waits for \
1.5 frame intervals, at least 500 ms. With --rate, nothing is measured or scaled.

Exit codes: 0 all limits were met; 6 a limit was exceeded (the report says which); 1 the run failed; 2 the command line is \
wrong; 130 stopped by Ctrl-C.

Examples:
    parallax demo
    parallax demo --seconds 60 --action boxing --subject 4 --out /tmp/boxing
    parallax demo --no-kill --json
    parallax demo --people 2                two people who pass each other
    parallax demo --seconds 300 --view      watch it in the browser";

/// Options of `parallax demo`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// Folder for the report and the run.
    #[arg(long, value_name = "DIR", default_value = "out/demo")]
    out: PathBuf,
    /// Frames per camera. If not given, the number of frames in twenty seconds, but at least 30.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(10..=1_000_000))]
    frames: Option<u64>,
    /// Duration of the run in seconds, instead of --frames.
    #[arg(long, value_name = "S", conflicts_with = "frames", value_parser = clap::value_parser!(u32).range(2..=36_000))]
    seconds: Option<u32>,
    /// Frames per second. If not given, as many as this machine can process, up to 5.
    #[arg(long, value_name = "HZ", value_parser = rate)]
    rate: Option<f64>,
    /// Action of the person. `parallax-lab synth --help` lists the actions.
    #[arg(long, value_name = "NAME", default_value = "walking", value_parser = action)]
    action: Action,
    /// Number of the person, which determines shape, clothes and style of movement.
    #[arg(long, value_name = "N", default_value_t = 1)]
    subject: u64,
    /// Number of people. The others walk through the room and pass the person.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=4))]
    people: u64,
    /// Seed of the motion, the room and the lighting.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Time that a stage waits for a late view, in milliseconds. If not given, 500, or more on a slow machine.
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u64).range(1..=60_000))]
    deadline_ms: Option<u64>,
    /// Do not kill a process.
    #[arg(long)]
    no_kill: bool,
    /// Configurable limits.
    #[command(flatten)]
    limits: Limits,
    /// Name of the deployment. It must be unique among running deployments.
    #[arg(long, value_name = "NAME", default_value = "demo")]
    name: String,
    /// Serve a page about the run while it runs, on this machine only. `parallax view --help` describes the page.
    #[arg(long)]
    view: bool,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

/// Configurable limits.
#[derive(Debug, Clone, Copy, Args)]
#[command(next_help_heading = "Limits")]
struct Limits {
    /// Minimum share of frames with a result, in percent. Slow machines drop frames, and dropped frames count as frames without a result.
    #[arg(long, value_name = "PERCENT", default_value_t = 10.0)]
    min_results: f64,
    /// Minimum share of results with a skeleton, in percent.
    #[arg(long, value_name = "PERCENT", default_value_t = 90.0)]
    min_skeletons: f64,
    /// Minimum PCP3D at gamma 0.5 over all results, in percent.
    #[arg(long, value_name = "PERCENT", default_value_t = 50.0)]
    min_pcp3d: f64,
    /// Longest time until a frame of the killed camera is used in a result again, in milliseconds. The limit is for a machine that keeps
    /// up with 5 frames per second.
    #[arg(long, value_name = "MS", default_value_t = 8000.0)]
    max_return_ms: f64,
    /// Longest pause between results while the killed camera is missing, in milliseconds. The limit is for a machine that keeps up with 5
    /// frames per second.
    #[arg(long, value_name = "MS", default_value_t = 2000.0)]
    max_pause_ms: f64,
}

/// Parses the name of an action.
fn action(name: &str) -> Result<Action, String> {
    let known = || Action::ALL.map(Action::name).join(", ");
    Action::by_name(name).ok_or_else(|| format!("expected one of {}", known()))
}

impl Arguments {
    fn options(&self) -> Options {
        let limits = &self.limits;
        Options {
            out: self.out.clone(),
            frames: self.frames,
            seconds: self.seconds,
            rate_hz: self.rate,
            action: self.action,
            subject: self.subject,
            people: self.people,
            seed: self.seed,
            deadline_ms: self.deadline_ms,
            kills: !self.no_kill,
            limits: demo::Limits {
                min_results: limits.min_results,
                min_skeletons: limits.min_skeletons,
                min_pcp3d: limits.min_pcp3d,
                max_return_ms: limits.max_return_ms,
                max_pause_ms: limits.max_pause_ms,
            },
            name: self.name.clone(),
        }
    }
}

/// Runs the demo, and prints the report.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let page = arguments.view.then(|| view::beside(&arguments.name));
    let page = page.transpose()?;
    let outcome = demo::run(&arguments.options(), globals.verbosity());
    drop(page);
    let Some(outcome) = outcome? else {
        output::message("stopped: no limits were checked, and no report was written");
        return Ok(ExitCode::from(ExitKind::Interrupted.status()));
    };
    if arguments.json {
        output::json(&outcome.json)?;
    } else if !globals.quiet {
        output::line(outcome.text)?;
    }
    let status = if outcome.is_held {
        0
    } else {
        ExitKind::Limit.status()
    };
    Ok(ExitCode::from(status))
}
