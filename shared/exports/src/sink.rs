//! Where a format is written, and what it says beside.

use std::io::Write;

/// Where a format is written.
pub type Sink<'a> = dyn Write + Send + 'a;

/// Notes for the user on what a format cannot express.
pub type Notes = Vec<String>;
