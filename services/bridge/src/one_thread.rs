//! Why the link of a host runs in one thread.

/// The variable of the environment that makes Zenoh read from links and write to them in one thread, and its value. Zenoh reads it once, so
/// a process has to be started with it.
///
/// By default Zenoh reads and writes a TLS connection in two threads at the same time, which neither its TLS library nor Rust allows
/// (Zenoh's issue 2557, open in version 1.10.2): when a host died, the bridge of the fusing host wrote to what the other thread had just put an
/// error into, and died of it.
pub const ONE_THREAD: (&str, &str) = (
    "ZENOH_RUNTIME",
    "(rx: (worker_threads: 1), tx: (handover: rx), acc: (handover: rx), net: (handover: rx))",
);

/// Returns true if this process was started with that variable.
pub fn has_one_thread() -> bool {
    let (name, value) = ONE_THREAD;
    std::env::var_os(name).is_some_and(|set| set == value)
}
