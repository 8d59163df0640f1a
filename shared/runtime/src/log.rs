//! The log of iceoryx2, through `tracing`.

use core::fmt;

use iceoryx2::prelude::{LogLevel, set_log_level, set_logger};
use tracing::level_filters::LevelFilter;

/// Makes iceoryx2 log through `tracing` instead of to standard error, as detailed as this process logs.
pub(crate) fn adopt_transport_log() {
    // False if it is set already.
    set_logger(&FromTransport);
    set_log_level(match LevelFilter::current() {
        LevelFilter::TRACE => LogLevel::Trace,
        LevelFilter::DEBUG => LogLevel::Debug,
        _ => LogLevel::Error,
    });
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
