//! The table of `top` on a terminal: updated continuously, scrolled with keys.

use core::fmt::Write as _;
use core::time::Duration;
use std::time::Instant;

use failure::{ExitKind, Failure, OrFail as _, Stop};
use launch::live::{self, Live};
use runtime::Namespace;

use super::terminal::{Key, Size, Terminal};

/// Interval at which a stop request, the terminal size and the end of the deployment are checked.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

/// Shows a deployment until it ends, the user quits, or a stop is requested. Returns true if the deployment has ended.
///
/// * `pause`: the interval between updates.
///
/// # Errors
///
/// Fails if the terminal cannot be used, or the metrics cannot be received.
pub(super) fn show(namespace: &Namespace, stop: &Stop, pause: Duration) -> Result<bool, Failure> {
    let mut live = Live::open(namespace)?;
    let terminal = Terminal::open().or_fail(ExitKind::Run)?;
    let mut first = 0;
    let mut text = live::table(&live.snapshot()?);
    let mut updated_at = Instant::now();
    let mut on_screen = String::new();
    while !stop.is_requested() {
        if live.is_over() {
            return Ok(true);
        }
        if updated_at.elapsed() >= pause {
            text = live::table(&live.snapshot()?);
            updated_at = Instant::now();
        }
        let size = Terminal::size();
        let page = Page::new(&text, first, size);
        let drawn = page.escaped(size);
        let mut written = Ok(());
        if drawn != on_screen {
            written = Terminal::write(drawn.as_bytes());
            on_screen = drawn;
        }
        if terminal.is_gone() {
            stop.request();
            break;
        }
        written.or_fail(ExitKind::Run)?;
        first = page.first;
        let page_len = page.len;
        let left = pause.saturating_sub(updated_at.elapsed());
        for key in terminal.keys(left.min(POLL_INTERVAL)).or_fail(ExitKind::Run)? {
            match key {
                Key::Quit => return Ok(false),
                Key::NextPage => first += page_len,
                Key::PreviousPage => first = first.saturating_sub(page_len),
                Key::NextLine => first += 1,
                Key::PreviousLine => first = first.saturating_sub(1),
            }
        }
    }
    Ok(false)
}

/// The visible lines of a text, above a line that lists the keys.
#[derive(Debug)]
struct Page<'t> {
    lines: Vec<&'t str>,
    /// Index of the first visible line. Near the end of the text, it is lower than requested, so that the screen stays full.
    first: usize,
    /// Number of lines that fit on the screen.
    len: usize,
    keys: String,
}

impl<'t> Page<'t> {
    fn new(text: &'t str, first: usize, size: Size) -> Self {
        let n = text.trim_end().lines().count();
        let len = size.rows.saturating_sub(1).max(1);
        let first = first.min(n.saturating_sub(len));
        let end = n.min(first + len);
        let keys = if n > len {
            format!(
                "lines {} to {end} of {n}; space: next page, k: previous page, arrows: one line, q: quit",
                first + 1
            )
        } else {
            "q: quit".to_owned()
        };
        Self {
            lines: text.trim_end().lines().skip(first).take(len).collect(),
            first,
            len,
            keys,
        }
    }

    /// Returns the escape sequences that draw this page over the previous page.
    fn escaped(&self, size: Size) -> String {
        const DIM: &str = "2";
        let empty = self.len - self.lines.len();
        let body = self.lines.iter().copied().chain((0..empty).map(|_| ""));
        let foot = (size.rows > 1).then_some((self.keys.as_str(), DIM));
        let rows = body.map(|line| (line, style(line))).chain(foot);
        let mut drawn = String::from("\x1b[H");
        for (nth, (line, style)) in rows.enumerate() {
            let end_of_last = if nth == 0 { "" } else { "\r\n" };
            let shown = line.chars().filter(|letter| !letter.is_control());
            let shown: String = shown.take(size.columns).collect();
            // Writing to a string cannot fail.
            let _ok = write!(drawn, "{end_of_last}\x1b[{style}m{shown}\x1b[0m\x1b[K");
        }
        drawn
    }
}

/// Returns the style of a line (ECMA-48, 8.3.117): bold for titles, red for dead processes, yellow for silent processes.
fn style(line: &str) -> &'static str {
    let has = |word: &str| line.split_whitespace().any(|found| found == word);
    if line.starts_with("PROCESS") {
        "1"
    } else if has("dead") {
        "31"
    } else if has("silent") {
        "33"
    } else {
        "0"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Draws on a terminal, and returns the rows of the terminal and the page.
    fn drawn(text: &str, first: usize, [columns, rows]: [usize; 2]) -> (Vec<String>, [usize; 2]) {
        let size = Size { columns, rows };
        let page = Page::new(text, first, size);
        let escaped = page.escaped(size);
        let lines = escaped.strip_prefix("\x1b[H").unwrap().split("\r\n");
        let lines = lines.map(|line| {
            let (_, line) = line.split_once('m').unwrap();
            line.strip_suffix("\x1b[0m\x1b[K").unwrap().to_owned()
        });
        let lines: Vec<String> = lines.collect();
        assert_eq!(lines.len(), rows);
        assert!(lines.iter().all(|line| line.chars().count() <= columns));
        (lines, [page.first, page.len])
    }

    #[test]
    fn a_text_that_fits_is_shown_completely() {
        let (lines, shown) = drawn("one\ntwo\n", 0, [20, 4]);
        assert_eq!(lines, ["one", "two", "", "q: quit"]);
        assert_eq!(shown, [0, 3]);
    }

    #[test]
    fn a_long_text_is_shown_page_by_page_and_the_last_page_is_full() {
        let text = (0..10).map(|nth| format!("line {nth}")).collect::<Vec<_>>().join("\n");
        let (lines, shown) = drawn(&text, 4, [80, 5]);
        assert_eq!(lines[..4], ["line 4", "line 5", "line 6", "line 7"]);
        assert!(lines[4].starts_with("lines 5 to 8 of 10; "), "{lines:?}");
        assert_eq!(shown, [4, 4]);
        let (lines, shown) = drawn(&text, 99, [80, 5]);
        assert_eq!(lines[0], "line 6");
        assert_eq!(shown, [6, 4]);
    }

    #[test]
    fn long_lines_are_cut_and_no_terminal_is_too_small() {
        let (lines, _) = drawn("\u{e4}\u{f6}\u{fc}", 0, [2, 2]);
        assert_eq!(lines[0], "\u{e4}\u{f6}");
        for size in [[1, 1], [80, 1], [1, 24]] {
            drawn("one\ntwo\n", 1, size);
        }
    }

    #[test]
    fn control_characters_in_names_do_not_reach_the_terminal() {
        let (lines, _) = drawn("a\x1b[2Jb\x07\n", 0, [20, 2]);
        assert_eq!(lines[0], "a[2Jb");
    }

    #[test]
    fn a_process_that_is_dead_or_silent_is_marked() {
        assert_eq!(style("pose-1  b  dead  -"), "31");
        assert_eq!(style("pose-1  b  silent"), "33");
        assert_eq!(style("pose-1  b  runs"), "0");
    }
}
