//! The table of `top` on a terminal: updated continuously, scrolled by keys.

use core::time::Duration;
use std::time::Instant;

use failure::{ExitKind, Failure, OrFail as _, Stop};
use launch::live::{self, Live};
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyModifiers};
use ratatui::layout::{Constraint, Layout};
use ratatui::style::{Style, Stylize as _};
use ratatui::text::Line;
use ratatui::widgets::Paragraph;
use ratatui::{DefaultTerminal, Frame};
use runtime::Namespace;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

/// How often a stop request and the end of the deployment are checked.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

/// The action of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Key {
    NextPage,
    PreviousPage,
    NextLine,
    PreviousLine,
    /// The size of the terminal has changed.
    Resized,
    Quit,
}

/// Shows a deployment until it ends, the user quits, or a stop is requested. Returns whether the deployment has ended.
///
/// * `pause`: the interval of updates.
///
/// # Errors
///
/// The terminal cannot be used, or the metrics cannot be received.
pub(super) fn show(namespace: &Namespace, stop: &Stop, pause: Duration) -> Result<bool, Failure> {
    let mut live = Live::open(namespace)?;
    let mut screen = Screen {
        terminal: ratatui::try_init().or_fail(ExitKind::Run)?,
    };
    let mut first = 0;
    let mut text = live::table(&live.snapshot()?);
    let mut updated_at = Instant::now();
    while !stop.is_requested() {
        if live.is_over() {
            return Ok(true);
        }
        if updated_at.elapsed() >= pause {
            text = live::table(&live.snapshot()?);
            updated_at = Instant::now();
        }
        let mut page_len = 1;
        let drawn = screen.terminal.draw(|frame| {
            [first, page_len] = draw(frame, &text, first);
        });
        drawn.or_fail(ExitKind::Run)?;
        if is_gone() {
            stop.request();
            break;
        }
        let left = pause.saturating_sub(updated_at.elapsed());
        match next_key(left.min(POLL_INTERVAL))? {
            Some(Key::Quit) => break,
            Some(Key::NextPage) => first += page_len,
            Some(Key::PreviousPage) => first = first.saturating_sub(page_len),
            Some(Key::NextLine) => first += 1,
            Some(Key::PreviousLine) => first = first.saturating_sub(1),
            Some(Key::Resized) | None => {}
        }
    }
    Ok(false)
}

/// The terminal, restored when this is dropped.
#[derive(Debug)]
struct Screen {
    terminal: DefaultTerminal,
}

impl Drop for Screen {
    fn drop(&mut self) {
        if let Err(error) = ratatui::try_restore() {
            tracing::debug!(%error, "cannot restore the terminal");
        }
    }
}

/// Draws the lines from `first` on, above a line that lists the keys. Returns the first line that is shown, which is less
/// than `first` near the end so that the last page is full, and the number of lines that fit.
fn draw(frame: &mut Frame<'_>, text: &str, first: usize) -> [usize; 2] {
    let [body, foot] =
        Layout::vertical([Constraint::Min(1), Constraint::Length(1)]).areas(frame.area());
    let lines: Vec<Line<'_>> = text.trim_end().lines().map(styled).collect();
    let (n, page_len) = (lines.len(), usize::from(body.height).max(1));
    let first = first.min(n.saturating_sub(page_len));
    let end = n.min(first + page_len);
    let keys = if n > page_len {
        format!(
            "lines {} to {end} of {n}; space: next page, k: previous page, arrows: one line, q: quit",
            first + 1
        )
    } else {
        "q: quit".to_owned()
    };
    let shown: Vec<Line<'_>> = lines.into_iter().skip(first).take(page_len).collect();
    frame.render_widget(Paragraph::new(shown), body);
    frame.render_widget(Paragraph::new(Line::from(keys).dim()), foot);
    [first, page_len]
}

/// Styles a line: titles are bold, dead processes red, silent ones yellow.
fn styled(line: &str) -> Line<'_> {
    let has = |word: &str| line.split_whitespace().any(|it| it == word);
    let style = if line.starts_with("PROCESS") {
        Style::new().bold()
    } else if has("dead") {
        Style::new().red()
    } else if has("silent") {
        Style::new().yellow()
    } else {
        Style::new()
    };
    Line::styled(line, style)
}

/// Whether the terminal has been closed.
fn is_gone() -> bool {
    let out = std::io::stdout();
    let mut watched = [PollFd::new(&out, PollFlags::empty())];
    let now = Timespec::default();
    poll(&mut watched, Some(&now)).is_ok()
        && watched[0]
            .revents()
            .intersects(PollFlags::HUP | PollFlags::ERR)
}

fn next_key(wait: Duration) -> Result<Option<Key>, Failure> {
    if !event::poll(wait).or_fail(ExitKind::Run)? {
        return Ok(None);
    }
    Ok(match event::read().or_fail(ExitKind::Run)? {
        Event::Key(key) if key.is_press() => action_of(key),
        Event::Resize(..) => Some(Key::Resized),
        _ => None,
    })
}

fn action_of(key: KeyEvent) -> Option<Key> {
    let is_control = key.modifiers.contains(KeyModifiers::CONTROL);
    Some(match key.code {
        KeyCode::Char('c') if is_control => Key::Quit,
        KeyCode::Char('q') | KeyCode::Esc => Key::Quit,
        KeyCode::Char(' ' | 'j') | KeyCode::PageDown => Key::NextPage,
        KeyCode::Char('k') | KeyCode::PageUp => Key::PreviousPage,
        KeyCode::Down => Key::NextLine,
        KeyCode::Up => Key::PreviousLine,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    use super::*;

    /// The lines of a terminal after drawing, and what [`draw`] returns.
    fn drawn(text: &str, first: usize, [columns, rows]: [u16; 2]) -> (Vec<String>, [usize; 2]) {
        let mut terminal = Terminal::new(TestBackend::new(columns, rows)).unwrap();
        let mut shown = [0, 0];
        terminal
            .draw(|frame| shown = draw(frame, text, first))
            .unwrap();
        let buffer = terminal.backend().buffer();
        let cells = buffer.content().chunks(usize::from(columns));
        let lines = cells.map(|row| {
            let row: String = row.iter().map(ratatui::buffer::Cell::symbol).collect();
            row.trim_end().to_owned()
        });
        (lines.collect(), shown)
    }

    #[test]
    fn a_text_that_fits_is_shown_completely() {
        let (lines, shown) = drawn("one\ntwo\n", 0, [20, 4]);
        assert_eq!(lines, ["one", "two", "", "q: quit"]);
        assert_eq!(shown, [0, 3]);
    }

    #[test]
    fn a_long_text_is_shown_page_by_page_and_the_last_page_is_full() {
        let text = (0..10)
            .map(|nth| format!("line {nth}"))
            .collect::<Vec<_>>()
            .join("\n");
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
    fn a_process_that_is_dead_or_silent_is_marked() {
        assert_eq!(
            styled("pose-1  b  dead  -"),
            Line::from("pose-1  b  dead  -").red()
        );
        assert_eq!(
            styled("pose-1  b  silent"),
            Line::from("pose-1  b  silent").yellow()
        );
        assert_eq!(styled("pose-1  b  runs"), Line::from("pose-1  b  runs"));
    }

    #[test]
    fn keys_have_the_actions_in_the_help() {
        let plain = |code| action_of(KeyEvent::new(code, KeyModifiers::NONE));
        assert_eq!(plain(KeyCode::Char(' ')), Some(Key::NextPage));
        assert_eq!(plain(KeyCode::Char('k')), Some(Key::PreviousPage));
        assert_eq!(plain(KeyCode::Char('q')), Some(Key::Quit));
        assert_eq!(plain(KeyCode::Char('c')), None);
        let ctrl_c = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
        assert_eq!(action_of(ctrl_c), Some(Key::Quit));
    }
}
