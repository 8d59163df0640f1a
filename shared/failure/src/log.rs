//! Log lines on standard error, with the time and the name of the process.

use core::fmt;
use std::io;
use std::sync::Arc;

use tracing::{Event, Level, Subscriber};
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::time::{FormatTime as _, SystemTime};
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields};
use tracing_subscriber::registry::LookupSpan;

/// Logs the events of this process to standard error.
///
/// A second call has no effect.
///
/// * `process`: name of the process, part of every line.
/// * `level`: the least severe events that are logged.
pub fn init_logging(process: &str, level: Level) {
    // The result is false if there is a subscriber already.
    let set = tracing_subscriber::fmt()
        .with_max_level(level)
        .with_writer(io::stderr)
        .with_ansi(false)
        .log_internal_errors(false)
        .event_format(Line {
            process: Arc::from(process),
            is_detailed: level >= Level::DEBUG,
        })
        .try_init();
    drop(set);
}

/// Format of a line: `2026-01-31T12:00:00.000000Z WARN pose-2: message key=value`.
struct Line {
    process: Arc<str>,
    /// True if details are logged.
    is_detailed: bool,
}

/// Returns true if an event comes from the link between hosts. Its warnings count as details, because the bridge reports their
/// meaning.
fn is_of_link(event: &Event<'_>) -> bool {
    let about = event.metadata();
    about.target().starts_with("zenoh") && *about.level() != Level::ERROR
}

impl<S, N> FormatEvent<S, N> for Line
where
    S: Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
{
    fn format_event(
        &self,
        context: &FmtContext<'_, S, N>,
        mut writer: Writer<'_>,
        event: &Event<'_>,
    ) -> fmt::Result {
        if is_of_link(event) && !self.is_detailed {
            return Ok(());
        }
        SystemTime.format_time(&mut writer)?;
        write!(writer, " {} {}: ", event.metadata().level(), self.process)?;
        context.format_fields(writer.by_ref(), event)?;
        writeln!(writer)
    }
}
