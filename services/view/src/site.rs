//! Data for the responses to every page.

use std::sync::{Arc, Mutex};

use crate::board::Board;
use crate::finished::Finished;

/// Data that is served.
#[derive(Debug, Clone)]
pub(crate) struct Site {
    /// The newest content for the pages.
    pub board: Arc<Board>,
    /// The finished run; `None` for a live run.
    pub finished: Option<Arc<Finished>>,
    /// Lock that is held while a frame of the finished run is read, so that only one page reads at a time.
    pub reading: Arc<Mutex<()>>,
    /// Token that a page must know; `None` only on the loopback.
    pub token: Option<String>,
}
