//! Heartbeats.

use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::Refusal;

/// The heartbeat, which every process sends a few times a second. A loop counter that does not
/// change means that the process hangs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("Health.v6")]
#[repr(C)]
pub struct Health {
    /// Run of the deployment.
    pub session: u64,
    /// Process id.
    pub pid: u32,
    /// Number of restarts of the process.
    pub epoch: u32,
    /// Number of iterations of the process's main loop.
    pub n_loops: u64,
    /// Time of sending, `CLOCK_MONOTONIC`, in nanoseconds.
    pub at_nanos: u64,
    /// Number of messages received.
    pub n_received: u64,
    /// Number of messages sent.
    pub n_sent: u64,
    /// Number of messages or frames that were lost before they reached this process or arrived too late.
    pub n_dropped: u64,
    /// Last frame sent.
    pub last_frame: u64,
    /// Median computing time of a frame, in microseconds.
    pub p50_micros: u64,
    /// 99th percentile of the computing time, in microseconds.
    pub p99_micros: u64,
    /// Peak physical memory of the process, including mapped shared memory, in bytes; 0 if the system does not report it.
    pub peak_memory_bytes: u64,
    /// 1 once the process has reached the end of the stream and forwarded it.
    pub finished: u32,
    /// Processor time of all threads of the process, in milliseconds, modulo 2^32; 0 if the system does not report it.
    pub cpu_millis: u32,
    /// Total amount of work, if it is known (for `capture`, the number of frames in the footage); otherwise 0.
    pub n_total: u64,
    /// Number of frames that the processor computed because the GPU was lost.
    pub n_without_gpu: u64,
    /// Number of frames that wait for a message of another view.
    pub n_waiting: u64,
    /// Number of rejected messages by cause, see [`Refusal::ALL`].
    pub refused: [u64; Refusal::N],
}
