//! Passes the log of iceoryx2 to `tracing`.

use core::fmt;

use iceoryx2::prelude::{LogLevel, set_log_level, set_logger};
use tracing::level_filters::LevelFilter;

/// Makes iceoryx2 log through `tracing` instead of to standard error, at the log level of this process.
pub(crate) fn adopt_transport_log() {
    // The result is false if a logger is already set.
    set_logger(&FromTransport);
    set_log_level(match LevelFilter::current() {
        LevelFilter::TRACE => LogLevel::Trace,
        LevelFilter::DEBUG => LogLevel::Debug,
        _ => LogLevel::Error,
    });
}

/// The log of iceoryx2. This crate reports the errors of iceoryx2 as well, so they are logged only as details.
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
