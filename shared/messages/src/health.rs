//! Signs of life.

use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::Refusal;

/// Sent by every process a few times a second; a counter that stands still means a hang.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("Health.v4")]
#[repr(C)]
pub struct Health {
    /// Run of the deployment.
    pub session: u64,
    /// Process id.
    pub pid: u32,
    /// How often the process has been restarted.
    pub epoch: u32,
    /// Turns of the process's main loop.
    pub n_loops: u64,
    /// `CLOCK_MONOTONIC`, nanoseconds.
    pub at_nanos: u64,
    /// Messages taken in.
    pub n_received: u64,
    /// Messages sent out.
    pub n_sent: u64,
    /// Messages or frames lost before they reached this process, or that came too late.
    pub n_dropped: u64,
    /// Last frame sent.
    pub last_frame: u64,
    /// Median computing time of a frame, microseconds.
    pub p50_micros: u64,
    /// 99th percentile of the computing time, microseconds.
    pub p99_micros: u64,
    /// Most physical memory that the process has held, shared memory that it has mapped included,
    /// bytes; 0 where the system does not say.
    pub peak_memory_bytes: u64,
    /// 1 once the process has seen the end of the footage and passed it on.
    pub finished: u32,
    /// Processor time that all threads of the process have used, milliseconds, modulo 2^32; 0 where the system
    /// does not say.
    pub cpu_millis: u32,
    /// Work that the process has before it, if it knows (capture: frames in the footage), else 0.
    pub n_total: u64,
    /// Messages that were refused, by cause: [`Refusal::ALL`].
    pub refused: [u64; Refusal::N],
}
