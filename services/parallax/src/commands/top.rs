//! `parallax top`: shows a running deployment as a table that is updated continuously.

mod screen;
mod terminal;

use core::time::Duration;
use std::io::{self, IsTerminal as _};
use std::process::ExitCode;

use ::terminal::output;
use clap::Args;
use failure::{ExitKind, Failure, OrFail as _, Stop};
use launch::live::{self, Live};

/// Options of `parallax top`.
#[derive(Debug, Args)]
#[command(after_help = "\
Keys: space, j or page down shows the next page, k or page up shows the previous page, and the arrows move by one line. q, Escape \
or Ctrl-C quits. `top` ends when the deployment ends.

States:
    runs     the process works
    done     the process has sent the end of its footage, and waits for the stop request
    begins   the process has not sent a message yet
    silent   the process is alive, but has sent no message for five seconds (it may be stopped)
    dead     there is no process; the supervisor may start it again
The last values of a dead process stay in the table.

Stages:
    waiting         until work on a message begins: transport, a busy receiver, other views
    computing       from the beginning of the work to its end
    publishing      until the result is sent; with lossless delivery, includes slow receivers
    since capture   from the capture of the frame to the message of this process
    end to end      from the capture to the result
Percentiles are over the lifetime of the process. Rates are over the last five seconds.")]
pub(crate) struct Arguments {
    /// Name or file of the deployment. May be left out if only one deployment is running.
    deployment: Option<String>,
    /// Print one table and exit. This is the default if standard output is not a terminal.
    #[arg(long)]
    once: bool,
    /// Interval between updates, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0, value_parser = pause)]
    every: f64,
}

/// Shows a deployment until it ends or the user quits.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let namespace = live::namespace(arguments.deployment.as_deref())?;
    let mut live = Live::open(&namespace)?;
    let snapshot = live.first_snapshot()?;
    if arguments.once || !io::stdout().is_terminal() {
        output::line(live::table(&snapshot).trim_end())?;
        return Ok(ExitCode::SUCCESS);
    }
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    drop(live);
    let pause = Duration::from_secs_f64(arguments.every);
    if screen::show(&namespace, &stop, pause)? {
        output::message("the deployment has ended");
    }
    Ok(ExitCode::SUCCESS)
}

fn pause(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().ok().ok_or("not a number")?;
    let fits = (0.1..=3600.0).contains(&seconds);
    fits.then_some(seconds).ok_or_else(|| "expected 0.1 to 3600".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_refresh_interval_is_limited() {
        assert_eq!(pause("0.5"), Ok(0.5));
        for wrong in ["0", "-1", "nan", "inf", "x", "3601"] {
            assert!(pause(wrong).is_err(), "{wrong}");
        }
    }
}
