//! Environment variable that makes the link of a host run in one thread.

/// Environment variable, and the value with which Zenoh reads from its connections and writes to them in a single thread. Zenoh reads the
/// variable only once, so it must be set before the process starts.
///
/// By default, Zenoh reads and writes a TLS connection in two threads at the same time. Neither its TLS library nor Rust allows this
/// (Zenoh's issue 2557, open in version 1.10.2). With two threads, the bridge of the fusing host crashed when another host died: one thread
/// wrote to a connection in which the other thread had just stored an error.
pub const ONE_THREAD: (&str, &str) = (
    "ZENOH_RUNTIME",
    "(rx: (worker_threads: 1), tx: (handover: rx), acc: (handover: rx), net: (handover: rx))",
);

/// Returns true if this process was started with the variable.
pub fn has_one_thread() -> bool {
    let (name, value) = ONE_THREAD;
    std::env::var_os(name).is_some_and(|set| set == value)
}
