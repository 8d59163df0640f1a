//! A relay on the loopback that simulates a cable between two hosts: it can be cut and reconnected.

use core::time::Duration;
use std::io::{self, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Longest sleep of a relay thread before it checks whether to end.
const PAUSE: Duration = Duration::from_millis(20);
/// Size of the buffer for relayed data, in bytes.
const BYTES: usize = 1 << 16;

/// The relay, which ends when it is dropped.
#[derive(Debug)]
pub(super) struct Relay {
    port: u16,
    is_cut: Arc<AtomicBool>,
    is_over: Arc<AtomicBool>,
}

impl Relay {
    /// Starts a relay to a port of this machine.
    pub(super) fn to(port: u16) -> io::Result<Self> {
        let listener = TcpListener::bind(("127.0.0.1", 0))?;
        let it = Self {
            port: listener.local_addr()?.port(),
            is_cut: Arc::default(),
            is_over: Arc::default(),
        };
        listener.set_nonblocking(true)?;
        let flags = (Arc::clone(&it.is_cut), Arc::clone(&it.is_over));
        let thread = std::thread::Builder::new().name("relay".to_owned());
        thread.spawn(move || accept(&listener, port, &flags))?;
        Ok(it)
    }

    /// Returns the port on which the relay listens.
    pub(super) fn port(&self) -> u16 {
        self.port
    }

    /// Unplugs or plugs in the simulated cable. While it is unplugged, no data passes and neither side is notified, as with a real cable.
    pub(super) fn cut(&self, is_cut: bool) {
        self.is_cut.store(is_cut, Ordering::Relaxed);
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
    }
}

type Flags = (Arc<AtomicBool>, Arc<AtomicBool>);

fn accept(listener: &TcpListener, port: u16, flags: &Flags) {
    while !flags.1.load(Ordering::Relaxed) {
        let Ok((near, _)) = listener.accept() else {
            std::thread::sleep(PAUSE);
            continue;
        };
        let address = SocketAddr::from(([127, 0, 0, 1], port));
        // If nothing listens on the port, the connection is closed, just as it would be without the relay.
        if let Ok(far) = TcpStream::connect_timeout(&address, Duration::from_secs(1))
            && let Err(error) = join(&near, &far, flags)
        {
            tracing::debug!(%error, "a connection cannot be relayed");
        }
    }
}

/// Relays both directions, each in its own thread.
fn join(near: &TcpStream, far: &TcpStream, flags: &Flags) -> io::Result<()> {
    for it in [near, far] {
        it.set_nonblocking(false)?;
        it.set_nodelay(true)?;
        it.set_read_timeout(Some(PAUSE))?;
    }
    for (from, to) in [(near, far), (far, near)] {
        let (from, to, flags) = (from.try_clone()?, to.try_clone()?, flags.clone());
        let thread = std::thread::Builder::new().name("relay".to_owned());
        thread.spawn(move || pass(from, to, &flags))?;
    }
    Ok(())
}

fn pass(mut from: TcpStream, mut to: TcpStream, (is_cut, is_over): &Flags) {
    let mut bytes = vec![0; BYTES];
    while !is_over.load(Ordering::Relaxed) {
        if is_cut.load(Ordering::Relaxed) {
            std::thread::sleep(PAUSE);
            continue;
        }
        let is_open = match from.read(&mut bytes) {
            Ok(0) => false,
            Ok(n) => to.write_all(&bytes[..n]).is_ok(),
            Err(error) => matches!(
                error.kind(),
                io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted
            ),
        };
        if !is_open {
            break;
        }
    }
    for it in [from, to] {
        if let Err(error) = it.shutdown(std::net::Shutdown::Both) {
            tracing::debug!(%error, "a connection was closed");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cut_link_delivers_nothing_until_it_is_restored_and_then_everything() {
        let server = TcpListener::bind(("127.0.0.1", 0)).unwrap();
        let relay = Relay::to(server.local_addr().unwrap().port()).unwrap();
        let mut client = TcpStream::connect(("127.0.0.1", relay.port())).unwrap();
        let (mut got, _) = server.accept().unwrap();
        let mut bytes = [0; 4];
        client.write_all(b"one ").unwrap();
        got.read_exact(&mut bytes).unwrap();
        relay.cut(true);
        // Data that was in transit when the cable was unplugged still arrives.
        std::thread::sleep(3 * PAUSE);
        client.write_all(b"two ").unwrap();
        got.set_read_timeout(Some(5 * PAUSE)).unwrap();
        assert!(got.read_exact(&mut bytes).is_err());
        relay.cut(false);
        got.set_read_timeout(None).unwrap();
        got.read_exact(&mut bytes).unwrap();
        assert_eq!(&bytes, b"two ");
    }
}
