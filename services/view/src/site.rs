//! Source of the answers to every page.

use std::sync::{Arc, Mutex};

use crate::board::Board;
use crate::finished::Finished;

/// Content that is served.
#[derive(Debug, Clone)]
pub(crate) struct Site {
    /// The newest of everything.
    pub board: Arc<Board>,
    /// The finished run, if it is one.
    pub finished: Option<Arc<Finished>>,
    /// Held while a frame of it is read: pages take turns.
    pub reading: Arc<Mutex<()>>,
    /// Token that a page must know; none only on the loopback.
    pub token: Option<String>,
}
