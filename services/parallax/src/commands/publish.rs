//! `parallax publish`: sends the skeletons of a running deployment as datagrams.

use std::process::ExitCode;

use clap::Args;
use client::publish::{Companion, Target};
use failure::{ExitKind, Failure, OrFail as _, Stop};
use launch::live;
use terminal::{Globals, output};

/// Options of `parallax publish`.
#[derive(Debug, Args)]
#[command(after_help = "\
No process of the deployment waits for this command, so it may be started and stopped at any time. Each person of \
a frame is sent in a datagram of at most 1400 bytes, as JSON on one line or as OSC bundles. A joint without a position is sent with the \
reason, never as zeros. Datagrams that no program receives are lost. docs/guide/programs.md describes both formats.

Examples:
    parallax publish demo udp://127.0.0.1:9000
    parallax publish demo osc://127.0.0.1:9001 udp://127.0.0.1:9000
    parallax publish demo udp://192.168.1.20:9000 --beyond-this-machine
    nc -klu 127.0.0.1 9000                              print the datagrams")]
pub(crate) struct Arguments {
    /// Name or file of the deployment. The deployment need not be running yet.
    deployment: String,
    /// The target: udp://HOST:PORT for JSON lines, or osc://HOST:PORT (or udp://HOST:PORT?format=osc) for OSC.
    #[arg(required = true, value_name = "TARGET")]
    targets: Vec<String>,
    /// Allow targets on other machines. Skeletons are sent unencrypted.
    #[arg(long)]
    beyond_this_machine: bool,
    /// End when the deployment ends, instead of waiting for its next run.
    #[arg(long)]
    until_end: bool,
    /// Print the counts as JSON at the end.
    #[arg(long)]
    json: bool,
}

/// Publishes until Ctrl-C or the end of the deployment.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let targets = targets(&arguments.targets, arguments.beyond_this_machine)?;
    let namespace = live::namespace(Some(&arguments.deployment))?;
    let name = namespace.name();
    if !globals.quiet {
        for target in &targets {
            output::message(format_args!(
                "publishing the skeletons of {name} to {target}"
            ));
        }
    }
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let counts = client::publish::run(name, &targets, arguments.until_end, &stop)?;
    if arguments.json {
        output::json(&serde_json::json!({
            "frames": counts.frames, "sent": counts.sent, "unsent": counts.unsent,
            "too_large": counts.too_large, "missed": counts.missed,
        }))?;
    } else if !globals.quiet {
        output::message(format_args!(
            "{} frames in {} datagrams, {} datagrams not sent, {} frames too large, {} frames missed",
            counts.frames, counts.sent, counts.unsent, counts.too_large, counts.missed
        ));
    }
    Ok(ExitCode::SUCCESS)
}

/// Parses the targets. A target on another machine is refused, unless `beyond` is true; then it is only reported.
fn targets(texts: &[String], beyond: bool) -> Result<Vec<Target>, Failure> {
    let mut targets = Vec::new();
    for text in texts {
        let target = Target::parse(text).map_err(|error| usage(&error))?;
        match target.stays_here() {
            Ok(()) => {}
            Err(error) if beyond => output::message(error),
            Err(error) => {
                return Err(usage(&error).with_hint("pass --beyond-this-machine to allow it"));
            }
        }
        targets.push(target);
    }
    Ok(targets)
}

fn usage(error: &client::publish::TargetError) -> Failure {
    Failure::new(ExitKind::Usage, error.to_string())
}

/// Waits for the process that [`beside`] started, and prints its messages.
pub(crate) fn finish(companion: Option<Companion>, quiet: bool) {
    let said = companion.map(Companion::finish).unwrap_or_default();
    let first = "publishing the skeletons";
    for line in said.iter().filter(|said| !quiet && !said.contains(first)) {
        output::message(format_args!("publish: {line}"));
    }
}

/// Starts a separate process that publishes the skeletons of a deployment's run, for the option `--publish`. Returns `None` if there are no
/// targets.
///
/// * `name`: name of the deployment.
/// * `beyond`: true to allow targets on other machines.
pub(crate) fn beside(
    name: &str,
    texts: &[String],
    beyond: bool,
) -> Result<Option<Companion>, Failure> {
    if texts.is_empty() {
        return Ok(None);
    }
    for target in targets(texts, beyond)? {
        output::message(format_args!(
            "publishing the skeletons of {name} to {target}"
        ));
    }
    let executable = std::env::current_exe().or_fail(ExitKind::Run)?;
    Companion::start(&executable, name, texts, beyond).map(Some)
}
