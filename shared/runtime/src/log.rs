//! Log lines on standard error, with the time and the name of the process.

use core::fmt;
use std::io;
use std::sync::Arc;

use iceoryx2::prelude::{LogLevel, set_log_level, set_logger};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::time::{FormatTime as _, SystemTime};
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields};
use tracing_subscriber::registry::LookupSpan;

/// Logs the events of this process and of iceoryx2 to standard error.
///
/// A second call has no effect.
///
/// * `process`: its name, part of every line.
/// * `level`: the least severe events that are logged.
pub fn init_logging(process: &str, level: Level) {
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
    adopt_transport_log();
    if set.is_ok() {
        set_log_level(match level {
            Level::TRACE => LogLevel::Trace,
            Level::DEBUG => LogLevel::Debug,
            _ => LogLevel::Error,
        });
    }
}

/// Makes iceoryx2 log through `tracing` instead of to standard error.
pub(crate) fn adopt_transport_log() {
    // False if it is set already.
    set_logger(&FromTransport);
}

/// `2026-01-31T12:00:00.000000Z WARN pose-2: message key=value`.
struct Line {
    process: Arc<str>,
    /// Whether details are logged.
    is_detailed: bool,
}

/// Whether an event is of the link between hosts, whose warnings are details: what they mean for a run the bridge says itself.
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

/// The log of iceoryx2. This crate reports its errors as well, so they are logged as details only.
struct FromTransport;

impl iceoryx2_log::Log for FromTransport {
    fn log(&self, level: LogLevel, origin: fmt::Arguments<'_>, message: fmt::Arguments<'_>) {
        match level {
            LogLevel::Fatal => tracing::error!(%origin, "iceoryx2: {message}"),
            LogLevel::Error | LogLevel::Warn => tracing::debug!(%origin, "iceoryx2: {message}"),
            LogLevel::Trace | LogLevel::Debug | LogLevel::Info => {
                tracing::trace!(%origin, "iceoryx2: {message}");
            }
        }
    }
}
