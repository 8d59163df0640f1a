//! Connections: their number, their lifetime, and the user at the other end.

use core::net::SocketAddr;
use core::sync::atomic::{AtomicUsize, Ordering};
use core::time::Duration;
use std::io;
use std::net::{TcpListener, TcpStream};
use std::os::fd::AsFd as _;
use std::sync::Arc;

use failure::Stop;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::geteuid;

/// Largest number of simultaneous connections.
const MOST_CONNECTIONS: usize = 256;
/// Longest time for a request; connections that take longer are closed.
pub(crate) const LONGEST_REQUEST: Duration = Duration::from_secs(10);
/// Pause after a failure to accept a connection, for example if there are no free file descriptors.
const PAUSE: Duration = Duration::from_millis(100);

/// Accepts connections, up to a limit, until a stop is requested. `talk` runs in a new thread for each connection.
///
/// # Errors
///
/// Fails if the listener cannot be used.
pub(crate) fn open(
    listener: &TcpListener,
    stop: &Stop,
    talk: impl Fn(TcpStream) + Clone + Send + 'static,
) -> io::Result<()> {
    listener.set_nonblocking(true)?;
    let n_open = Arc::default();
    while !stop.is_requested() {
        match listener.accept() {
            Ok((stream, _)) => {
                // A connection above the limit is closed because it is dropped here.
                let Some(seat) = Seat::take(&n_open, MOST_CONNECTIONS) else {
                    continue;
                };
                let talk = talk.clone();
                let thread = std::thread::Builder::new().name("connection".to_owned());
                let started = thread.spawn(move || {
                    talk(stream);
                    drop(seat);
                });
                if let Err(error) = started {
                    tracing::debug!(%error, "a connection was closed: cannot start a thread for it");
                }
            }
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => wait(listener, stop),
            Err(_) => std::thread::sleep(PAUSE),
        }
    }
    Ok(())
}

/// Waits for a connection or a stop request.
fn wait(listener: &TcpListener, stop: &Stop) {
    let (listener, stop) = (listener.as_fd(), stop.as_fd());
    let mut watched = [&listener, &stop].map(|side| PollFd::new(side, PollFlags::IN));
    let pause = Timespec {
        tv_sec: 1,
        tv_nsec: 0,
    };
    if poll(&mut watched, Some(&pause)).is_err() {
        std::thread::sleep(PAUSE);
    }
}

/// One of a limited number of open connections or pages. Dropping it makes room for another one.
#[derive(Debug)]
pub(crate) struct Seat(Arc<AtomicUsize>);

impl Seat {
    /// Takes a place, if fewer than `most` places are taken.
    pub(crate) fn take(taken: &Arc<AtomicUsize>, most: usize) -> Option<Self> {
        let more = |n: usize| (n < most).then_some(n + 1);
        let before = taken.fetch_update(Ordering::Relaxed, Ordering::Relaxed, more);
        before.is_ok().then(|| Self(Arc::clone(taken)))
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// The other end of a connection.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Peer {
    own: SocketAddr,
    other: SocketAddr,
}

impl Peer {
    /// Returns the addresses of a connection.
    ///
    /// # Errors
    ///
    /// Fails if the connection has ended.
    pub(crate) fn new(stream: &TcpStream) -> io::Result<Self> {
        Ok(Self {
            own: stream.local_addr()?,
            other: stream.peer_addr()?,
        })
    }

    /// Returns true if the other end is a process on this machine of the same user or of root.
    pub(crate) fn is_same_user(self) -> bool {
        let tables = ["/proc/net/tcp", "/proc/net/tcp6"];
        let owner = tables.iter().find_map(|table| {
            let table = std::fs::read_to_string(table).ok()?;
            owner(&table, self.other, self.own)
        });
        owner.is_some_and(|uid| uid == geteuid().as_raw() || uid == 0)
    }
}

/// Returns the user of the socket at one end of a connection, from the kernel's table (`man 5 proc_net_tcp`).
///
/// * `local`: address of this end.
/// * `remote`: address of the other end.
fn owner(table: &str, local: SocketAddr, remote: SocketAddr) -> Option<u32> {
    let (local, remote) = (in_hex(local), in_hex(remote));
    table.lines().find_map(|line| {
        let mut cells = line.split_ascii_whitespace().skip(1);
        let is_end = cells.next()? == local && cells.next()? == remote;
        is_end.then(|| cells.nth(4)?.parse().ok()).flatten()
    })
}

/// Formats an address as in the kernel's table: groups of 32 bits in the byte order of this machine.
fn in_hex(address: SocketAddr) -> String {
    let octets = match address {
        SocketAddr::V4(address) => address.ip().octets().to_vec(),
        SocketAddr::V6(address) => address.ip().octets().to_vec(),
    };
    let words = octets.as_chunks::<4>().0.iter();
    let words = words.map(|word| format!("{:08X}", u32::from_ne_bytes(*word)));
    format!("{}:{:04X}", words.collect::<String>(), address.port())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_user_of_a_connection_is_read_from_the_kernel_table() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let peer = Peer::new(&listener.accept().unwrap().0).unwrap();
        assert_eq!(peer.other, client.local_addr().unwrap());
        assert!(peer.is_same_user());
        let stranger = Peer {
            other: "127.0.0.1:1".parse().unwrap(),
            ..peer
        };
        assert!(!stranger.is_same_user());
    }

    #[test]
    fn a_connection_of_another_user_is_detected() {
        let table = "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode\n   \
            0: 0100007F:1EC6 0100007F:C350 01 00000000:00000000 00:00000000 00000000  1000        0 1\n   \
            1: 0100007F:C350 0100007F:1EC6 01 00000000:00000000 00:00000000 00000000  4001        0 2\n";
        let [page, server] =
            ["127.0.0.1:50000", "127.0.0.1:7878"].map(|text| text.parse().unwrap());
        assert_eq!(owner(table, page, server), Some(4001));
        assert_eq!(owner(table, server, page), Some(1000));
    }

    #[test]
    fn the_number_of_connections_is_limited() {
        let taken = Arc::default();
        let seats: Vec<_> = (0..3).map(|_| Seat::take(&taken, 2)).collect();
        assert_eq!(seats.iter().flatten().count(), 2);
        drop(seats);
        assert!(Seat::take(&taken, 1).is_some());
    }
}
