//! Options: subject of the page, and address to listen on.

use core::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;

/// Subject of a page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Subject {
    /// A deployment while it runs, by its name; the only one that runs if there is no name.
    Deployment(Option<String>),
    /// The folder that a run left.
    Folder(PathBuf),
    /// A recording.
    Recording(PathBuf),
}

/// Where the page is served.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Listen {
    /// The address; the port is 0 for any free one.
    pub address: SocketAddr,
    /// True if another port is taken where this one is in use.
    pub may_move: bool,
    /// Token that a page must know; none only on the loopback.
    pub token: Option<String>,
}

impl Listen {
    /// The port that is tried first, if none is given.
    pub const PORT: u16 = 7878;

    /// The loopback, at the usual port or another.
    pub fn usual() -> Self {
        Self {
            address: SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), Self::PORT),
            may_move: true,
            token: None,
        }
    }
}

/// The options of a view.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Options {
    /// Subject of the page.
    pub subject: Subject,
    /// Where to listen.
    pub listen: Listen,
    /// Most pictures of a camera that are sent in a second.
    pub pictures_per_second: u32,
}
