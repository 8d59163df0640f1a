//! Options: the run to show, and the address to listen on.

use core::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;

/// Subject of a page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Subject {
    /// Name of a running deployment; `None` for the only running deployment.
    Deployment(Option<String>),
    /// Folder with the results of a run.
    Folder(PathBuf),
    /// Recording file.
    Recording(PathBuf),
}

/// Address at which the page is served.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Listen {
    /// Address to listen on; port 0 means any free port.
    pub address: SocketAddr,
    /// True to use another port if the port of `address` is in use.
    pub may_move: bool,
    /// Token that a page must know; `None` only on the loopback.
    pub token: Option<String>,
}

impl Listen {
    /// Port that is tried first if none is given.
    pub const PORT: u16 = 7878;

    /// Returns the loopback address with the usual port, or another port if it is in use.
    pub fn usual() -> Self {
        Self {
            address: SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), Self::PORT),
            may_move: true,
            token: None,
        }
    }
}

/// Options of a view.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Options {
    /// Subject of the page.
    pub subject: Subject,
    /// Listening address.
    pub listen: Listen,
    /// Largest number of pictures per second that are sent for each camera.
    pub pictures_per_second: u32,
}
