//! Where a format is written, and what it says beside.

use std::io::Write;

/// Where a format is written.
pub type Sink<'a> = dyn Write + Send + 'a;

/// What a format cannot say in itself, for the user.
pub type Notes = Vec<String>;
