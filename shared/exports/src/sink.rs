//! Destination of a format, and the notes about it.

use std::io::Write;

/// Destination to which a format is written.
pub type Sink<'a> = dyn Write + Send + 'a;

/// Notes for the user on what a format cannot express.
pub type Notes = Vec<String>;
