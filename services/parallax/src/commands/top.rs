//! `parallax top`: a deployment that runs, as a table that renews itself.

use core::time::Duration;
use std::io::{self, IsTerminal as _, Write as _};
use std::path::Path;
use std::process::ExitCode;

use clap::Args;
use launch::{
    live::{self, Live},
    load, output,
};
use runtime::{ExitKind, Failure, Keys, Namespace, OrFail as _, Stop, deployments};

/// The screen beside the one that scrolls, without a cursor; and back.
const ENTER: &str = "\x1b[?1049h\x1b[?25l";
const LEAVE: &str = "\x1b[?25h\x1b[?1049l";
/// To the upper left; and what clears the rest of a line, and of the screen.
const HOME: &str = "\x1b[H";
const CLEAR_LINE: &str = "\x1b[K";
const CLEAR_REST: &str = "\x1b[J";

/// What to look at.
#[derive(Debug, Args)]
#[command(after_help = "\
Keys: space or j shows the next page, k the one before, q or Ctrl-C ends. `top` ends with the deployment.

States: runs; done (has passed on the end of its footage, and waits to be told to end); begins (has not said
anything yet); silent (lives, but has said nothing for five seconds: stopped, or starved); dead (does not live; the
supervisor may start it again). What a dead process said last stays in the table.

Stages: waiting, from a message being sent until work on it begins (transport, a busy receiver, other views);
computing; publishing, until the answer is sent (where nothing may be lost, slow receivers too); since capture, from
the capture of the frame to this process's answer; end to end, from the capture to the result. Percentiles are those
of the process's whole life; rates are those of the last five seconds.")]
pub(crate) struct Arguments {
    /// Name of the deployment, or its file; the one that runs if there is only one.
    deployment: Option<String>,
    /// Print one table and end; so it is where standard output is no terminal.
    #[arg(long)]
    once: bool,
    /// Pause between two tables, seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0, value_parser = pause)]
    every: f64,
}

/// Shows a deployment until it ends, or the user has seen enough.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let mut live = Live::open(&namespace(arguments.deployment.as_deref())?)?;
    let board = live.first_look()?;
    if arguments.once || !io::stdout().is_terminal() {
        output::line(live::table(&board).trim_end())?;
        return Ok(ExitCode::SUCCESS);
    }
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let over = Screen::open()?.show(&mut live, &stop, arguments.every)?;
    if over {
        output::message("the deployment has ended");
    }
    Ok(ExitCode::SUCCESS)
}

/// The deployment that is meant.
///
/// * `named`: its name or its file; none for the only one that runs.
pub(crate) fn namespace(named: Option<&str>) -> Result<Namespace, Failure> {
    if let Some(named) = named {
        let is_file = Path::new(named).extension().is_some_and(|it| it == "toml");
        let name = if is_file {
            load::read(Path::new(named), &[])?.deployment.name
        } else {
            named.to_owned()
        };
        return Namespace::new(&name).or_fail(ExitKind::Usage);
    }
    let mut running = deployments(&Namespace::usual_base())?;
    running.retain(|it| it.supervisor.is_some());
    if running.len() > 1 {
        let names: Vec<&str> = running.iter().map(|it| it.namespace.name()).collect();
        let message = format!("{} deployments run: {}", names.len(), names.join(", "));
        return Err(Failure::new(ExitKind::Usage, message).with_hint("name one of them"));
    }
    let none = || Failure::new(ExitKind::Usage, "no deployment runs");
    running.pop().map(|it| it.namespace).ok_or_else(none)
}

fn pause(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().ok().ok_or("not a number")?;
    let fits = (0.1..=3600.0).contains(&seconds);
    fits.then_some(seconds)
        .ok_or_else(|| "not from 0.1 to 3600".to_owned())
}

/// The terminal, given back as it was when this is dropped.
#[derive(Debug)]
struct Screen {
    keys: Keys,
}

impl Screen {
    fn open() -> Result<Self, Failure> {
        let keys = Keys::new().or_fail(ExitKind::Run)?;
        write(ENTER)?;
        Ok(Self { keys })
    }

    /// Shows table after table; answers whether the deployment has ended.
    fn show(mut self, live: &mut Live, stop: &Stop, seconds: f64) -> Result<bool, Failure> {
        let pause = Duration::from_secs_f64(seconds);
        let mut first = 0;
        while !stop.is_requested() {
            if live.is_over() {
                return Ok(true);
            }
            let text = live::table(&live.look()?);
            let size = Keys::size().unwrap_or([80, 24]);
            let page = Page::new(&text, first, size);
            first = page.first;
            write(&page.draw())?;
            match live.rest(&mut self.keys, stop, pause)? {
                Some(b'q') => break,
                Some(b' ' | b'j') => first = page.next,
                Some(b'k') => first = first.saturating_sub(page.lines.len()),
                _ => {}
            }
        }
        Ok(false)
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        if let Err(error) = write(LEAVE) {
            tracing::debug!(%error, "cannot give the screen back");
        }
    }
}

fn write(text: &str) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    let written = stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush());
    written.or_fail(ExitKind::Run)
}

/// As many lines as fit on a terminal, each as long as fits.
#[derive(Debug, PartialEq, Eq)]
struct Page {
    lines: Vec<String>,
    /// The line of the text that it begins with.
    first: usize,
    /// Where the next page begins; 0 after the last.
    next: usize,
    foot: String,
}

impl Page {
    fn new(text: &str, first: usize, [columns, rows]: [usize; 2]) -> Self {
        let all: Vec<&str> = text.trim_end().lines().collect();
        // The last line of the terminal says what the keys do.
        let room = rows.saturating_sub(1).max(1);
        let first = if first < all.len() { first } else { 0 };
        let end = all.len().min(first + room);
        let cut = |line: &&str| line.chars().take(columns).collect::<String>();
        let foot = if all.len() > room {
            format!(
                "lines {} to {end} of {}; space: next page, q: end",
                first + 1,
                all.len()
            )
        } else {
            "q: end".to_owned()
        };
        Self {
            lines: all[first..end].iter().map(cut).collect(),
            first,
            next: if end < all.len() { end } else { 0 },
            foot: foot.chars().take(columns).collect(),
        }
    }

    /// What puts it onto the terminal, without flicker: nothing is cleared before it is overwritten.
    fn draw(&self) -> String {
        let mut text = HOME.to_owned();
        for line in &self.lines {
            text.push_str(line);
            text.push_str(CLEAR_LINE);
            text.push_str("\r\n");
        }
        text + &self.foot + CLEAR_LINE + CLEAR_REST
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fits_is_one_page() {
        let page = Page::new("one\ntwo\n", 0, [80, 24]);
        assert_eq!(page.lines, ["one", "two"]);
        assert_eq!((page.next, page.foot.as_str()), (0, "q: end"));
    }

    #[test]
    fn pages_follow_each_other_and_the_first_follows_the_last() {
        let text = "line\n".repeat(10);
        let mut first = 0;
        let mut seen = Vec::new();
        for _ in 0..4 {
            let page = Page::new(&text, first, [80, 5]);
            seen.push([page.first, page.lines.len()]);
            first = page.next;
        }
        assert_eq!(seen, [[0, 4], [4, 4], [8, 2], [0, 4]]);
    }

    #[test]
    fn a_text_that_has_become_shorter_begins_anew() {
        assert_eq!(Page::new("one\ntwo", 7, [80, 24]).first, 0);
    }

    #[test]
    fn long_lines_are_cut_between_characters() {
        let page = Page::new("\u{e4}\u{f6}\u{fc}", 0, [2, 2]);
        assert_eq!(page.lines, ["\u{e4}\u{f6}"]);
        assert_eq!(page.foot, "q:");
    }

    #[test]
    fn a_terminal_without_size_shows_one_line() {
        assert_eq!(Page::new("one\ntwo", 0, [80, 0]).lines, ["one"]);
    }

    #[test]
    fn nothing_of_what_was_there_before_is_left_on_the_screen() {
        let drawn = Page::new("one\ntwo", 0, [80, 24]).draw();
        assert!(drawn.starts_with(HOME) && drawn.ends_with(CLEAR_REST));
        assert_eq!(drawn.matches(CLEAR_LINE).count(), 3);
    }

    #[test]
    fn pauses_are_of_a_sensible_length() {
        assert_eq!(pause("0.5"), Ok(0.5));
        for wrong in ["0", "-1", "nan", "inf", "x", "3601"] {
            assert!(pause(wrong).is_err(), "{wrong}");
        }
    }
}
