//! Connections: how many, how long, and of which user.

use core::net::SocketAddr;
use core::pin::Pin;
use core::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use core::task::{Context, Poll};
use core::time::Duration;
use std::io;
use std::sync::Arc;

use axum::extract::connect_info::Connected;
use axum::serve::{IncomingStream, Listener};
use rustix::process::geteuid;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::time::{Sleep, sleep};

/// Most connections at the same time.
const MOST_CONNECTIONS: usize = 256;
/// How long a connection lives that is no page: a request that is not finished by then never will be.
const LONGEST_REQUEST: Duration = Duration::from_secs(10);
/// Pause after a failure to accept, for example for want of descriptors.
const PAUSE: Duration = Duration::from_millis(100);

/// Accepts connections, up to a limit.
#[derive(Debug)]
pub(crate) struct Door {
    listener: TcpListener,
    n_open: Arc<AtomicUsize>,
}

impl Door {
    pub(crate) fn new(listener: TcpListener) -> Self {
        let n_open = Arc::default();
        Self { listener, n_open }
    }
}

impl Listener for Door {
    type Io = Connection;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (Connection, SocketAddr) {
        loop {
            let Ok((stream, address)) = self.listener.accept().await else {
                sleep(PAUSE).await;
                continue;
            };
            // One that is not counted is closed by being dropped.
            if let Some(seat) = Seat::take(&self.n_open, MOST_CONNECTIONS) {
                let connection = Connection {
                    stream,
                    deadline: Box::pin(sleep(LONGEST_REQUEST)),
                    is_page: Arc::default(),
                    _seat: seat,
                };
                return (connection, address);
            }
        }
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }
}

/// A place among a limited number, until it is dropped.
#[derive(Debug)]
pub(crate) struct Seat(Arc<AtomicUsize>);

impl Seat {
    /// A place, if fewer than `most` are taken.
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

/// A connection that ends after a while if it is not a page.
#[derive(Debug)]
pub(crate) struct Connection {
    stream: TcpStream,
    deadline: Pin<Box<Sleep>>,
    is_page: Arc<AtomicBool>,
    _seat: Seat,
}

impl Connection {
    fn check(&mut self, context: &mut Context<'_>) -> io::Result<()> {
        let is_late = !self.is_page.load(Ordering::Relaxed)
            && self.deadline.as_mut().poll(context).is_ready();
        if is_late {
            return Err(io::ErrorKind::TimedOut.into());
        }
        Ok(())
    }
}

impl AsyncRead for Connection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        self.check(context)?;
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl AsyncWrite for Connection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        self.check(context)?;
        Pin::new(&mut self.stream).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.check(context)?;
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.check(context)?;
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

/// The other end of a connection.
#[derive(Debug, Clone)]
pub(crate) struct Peer {
    own: Option<SocketAddr>,
    other: SocketAddr,
    is_page: Arc<AtomicBool>,
}

impl Connected<IncomingStream<'_, Door>> for Peer {
    fn connect_info(stream: IncomingStream<'_, Door>) -> Self {
        Self {
            own: stream.io().stream.local_addr().ok(),
            other: *stream.remote_addr(),
            is_page: Arc::clone(&stream.io().is_page),
        }
    }
}

impl Peer {
    /// Lets the connection live on as a page.
    pub(crate) fn become_page(&self) {
        self.is_page.store(true, Ordering::Relaxed);
    }

    /// Whether the other end is a process of the same user on this machine, or of root.
    pub(crate) fn is_same_user(&self) -> bool {
        let Some(own) = self.own else {
            return false;
        };
        let tables = ["/proc/net/tcp", "/proc/net/tcp6"];
        let owner = tables.iter().find_map(|table| {
            let table = std::fs::read_to_string(table).ok()?;
            owner(&table, self.other, own)
        });
        owner.is_some_and(|uid| uid == geteuid().as_raw() || uid == 0)
    }
}

/// User of the socket at one end of a connection, by the table of the kernel (`man 5 proc_net_tcp`).
///
/// * `local`, `remote`: the address of that end, and of the other.
fn owner(table: &str, local: SocketAddr, remote: SocketAddr) -> Option<u32> {
    let (local, remote) = (in_hex(local), in_hex(remote));
    table.lines().find_map(|line| {
        let mut cells = line.split_ascii_whitespace().skip(1);
        let is_end = cells.next()? == local && cells.next()? == remote;
        is_end.then(|| cells.nth(4)?.parse().ok()).flatten()
    })
}

/// An address as the kernel writes it: words of 32 bits in the order of this machine.
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
    fn the_user_of_the_other_end_is_read_from_the_table_of_the_kernel() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let client = std::net::TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let peer = Peer {
            own: Some(listener.local_addr().unwrap()),
            other: client.local_addr().unwrap(),
            is_page: Arc::default(),
        };
        assert!(peer.is_same_user());
        let stranger = Peer {
            other: "127.0.0.1:1".parse().unwrap(),
            ..peer
        };
        assert!(!stranger.is_same_user());
    }

    #[test]
    fn an_end_of_another_user_is_told_apart() {
        let table = "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode\n   \
            0: 0100007F:1EC6 0100007F:C350 01 00000000:00000000 00:00000000 00000000  1000        0 1\n   \
            1: 0100007F:C350 0100007F:1EC6 01 00000000:00000000 00:00000000 00000000  4001        0 2\n";
        let [page, server] =
            ["127.0.0.1:50000", "127.0.0.1:7878"].map(|text| text.parse().unwrap());
        assert_eq!(owner(table, page, server), Some(4001));
        assert_eq!(owner(table, server, page), Some(1000));
    }

    #[test]
    fn no_more_places_are_taken_than_there_are() {
        let taken = Arc::default();
        let seats: Vec<_> = (0..3).map(|_| Seat::take(&taken, 2)).collect();
        assert_eq!(seats.iter().flatten().count(), 2);
        drop(seats);
        assert!(Seat::take(&taken, 1).is_some());
    }
}
