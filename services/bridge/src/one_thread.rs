//! Environment variable that makes the link of a host run in one thread.

/// Environment variable and its value, with which Zenoh reads from links and writes to them in one thread. Zenoh reads the variable once,
/// so a process has to be started with it.
///
/// By default, Zenoh reads and writes a TLS connection in two threads at the same time. Neither its TLS library nor Rust allows this
/// (Zenoh's issue 2557, open in version 1.10.2). When a host died, the bridge of the fusing host wrote to a connection in which the other
/// thread had just stored an error, and crashed.
pub const ONE_THREAD: (&str, &str) = (
    "ZENOH_RUNTIME",
    "(rx: (worker_threads: 1), tx: (handover: rx), acc: (handover: rx), net: (handover: rx))",
);

/// Returns true if this process was started with the variable.
pub fn has_one_thread() -> bool {
    let (name, value) = ONE_THREAD;
    std::env::var_os(name).is_some_and(|set| set == value)
}
