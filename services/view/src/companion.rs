//! The web page of a run, served by a separate process (`parallax view`). The process ends with the run, and is restarted if it dies.

use core::net::SocketAddr;
use core::time::Duration;
use std::net::TcpListener;
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use failure::{ExitKind, Failure, OrFail as _};

use crate::options::Listen;

/// Pause before a view process that died is restarted.
const PAUSE: Duration = Duration::from_millis(500);
/// Time between two checks of the process.
const TURN: Duration = Duration::from_millis(100);
/// Largest number of starts.
const MOST_STARTS: u32 = 100;

/// The process that serves the web page of a run. It ends when this value is dropped, and also when this process ends in any other way.
#[derive(Debug)]
pub struct Companion {
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Companion {
    /// Starts the view: `executable view --deployment NAME --port PORT --with-parent`.
    ///
    /// * `name`: name of the deployment.
    ///
    /// # Errors
    ///
    /// Fails if no port is free, or the thread that watches the view cannot be started.
    pub fn start(executable: &Path, name: &str) -> Result<Self, Failure> {
        let port = free_port().or_fail(ExitKind::Run)?;
        let mut command = Command::new(executable);
        command
            .args(["view", "--deployment", name, "--with-parent", "--port"])
            .arg(port.to_string())
            // The view ends when this pipe is closed. It must not receive Ctrl-C, which is meant for the run.
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .process_group(0);
        let over = Arc::new(AtomicBool::new(false));
        let asked = Arc::clone(&over);
        let thread = std::thread::Builder::new().name("view".to_owned());
        let thread = thread.spawn(move || watch(command, &asked));
        Ok(Self {
            over,
            thread: Some(thread.or_fail(ExitKind::Run)?),
        })
    }
}

impl Drop for Companion {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::debug!("the thread that watches the view panicked");
        }
    }
}

/// Returns the usual port, or another port that is free.
fn free_port() -> std::io::Result<u16> {
    let usual = Listen::usual().address;
    let bound = TcpListener::bind(usual);
    let bound = bound.or_else(|_| TcpListener::bind(SocketAddr::new(usual.ip(), 0)));
    Ok(bound?.local_addr()?.port())
}

/// Keeps the view running.
fn watch(mut command: Command, over: &AtomicBool) {
    for _ in 0..MOST_STARTS {
        let mut child = match command.spawn() {
            Ok(child) => child,
            Err(error) => {
                tracing::warn!(%error, "cannot start the view");
                return;
            }
        };
        while !over.load(Ordering::Relaxed) {
            match child.try_wait() {
                Ok(None) => std::thread::sleep(TURN),
                Ok(Some(status)) => {
                    tracing::warn!(%status, "the view ended and will be restarted");
                    break;
                }
                Err(error) => {
                    tracing::warn!(%error, "cannot watch the view");
                    break;
                }
            }
        }
        if over.load(Ordering::Relaxed) {
            end(child);
            return;
        }
        std::thread::sleep(PAUSE);
    }
}

fn end(mut child: Child) {
    drop(child.stdin.take());
    for _ in 0..20 {
        if child.try_wait().is_ok_and(|status| status.is_some()) {
            return;
        }
        std::thread::sleep(TURN);
    }
    if let Err(error) = child.kill().and_then(|()| child.wait().map(drop)) {
        tracing::debug!(%error, "cannot end the view");
    }
}
