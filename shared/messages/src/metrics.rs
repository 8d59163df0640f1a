//! Where the time of one process goes, and what it has lost.

use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

/// Most rows of a [`Metrics`]: a wait for every view, and what is not of one view.
pub const MAX_ROWS: usize = 24;
/// Longest name of a view that [`Metrics`] carries, bytes; a longer one is cut.
pub const MAX_NAME: usize = 32;
/// Number of causes that [`Metrics::n_dropped`] tells apart.
pub const N_CAUSES: usize = 5;
/// In place of a view where a number is about none or about all of them.
pub const NO_VIEW: u32 = u32::MAX;
/// In place of the length of a queue where there is none.
pub const NO_QUEUE: u32 = u32::MAX;

/// What a process has done in this life, sent by every process about once a second, when somebody
/// begins to look, and at its end. Percentiles are those of the whole life, of a histogram with two
/// significant digits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ZeroCopySend, Pod, Zeroable)]
#[type_name("Metrics.v1")]
#[repr(C)]
pub struct Metrics {
    /// Run of the deployment.
    pub session: u64,
    /// Process id.
    pub pid: u32,
    /// How often the process has been restarted.
    pub epoch: u32,
    /// When the process began to count, `CLOCK_MONOTONIC`, nanoseconds.
    pub began_at_nanos: u64,
    /// When this was sent, `CLOCK_MONOTONIC`, nanoseconds.
    pub at_nanos: u64,
    /// Messages taken in.
    pub n_received: u64,
    /// Messages sent out; the recorder: results written.
    pub n_sent: u64,
    /// Messages sent out per second over the last seconds, in thousandths.
    pub sent_millihertz: u64,
    /// Messages or frames lost, by cause: see [`Cause`].
    pub n_dropped: [u64; N_CAUSES],
    /// Evidence sent out, bytes.
    pub evidence_bytes: u64,
    /// Physical memory that the process holds, shared memory that it has mapped included, bytes; 0
    /// where the system does not say.
    pub memory_bytes: u64,
    /// The most it has ever held, bytes.
    pub peak_memory_bytes: u64,
    /// Frames or results that wait in the process, or [`NO_QUEUE`].
    pub queue: u32,
    /// The most that ever waited, or [`NO_QUEUE`].
    pub longest_queue: u32,
    /// Its view, or [`NO_VIEW`].
    pub view: u32,
    /// 1 once the process has seen the end of the footage and passed it on.
    pub finished: u32,
    /// Name of its view, UTF-8, filled up with zeros.
    pub name: [u8; MAX_NAME],
    /// How many rows follow.
    pub n_rows: u32,
    /// Keeps the layout free of padding.
    pub reserved: u32,
    /// Durations, by stage and view; no two are of the same.
    pub rows: [MetricsRow; MAX_ROWS],
}

impl Default for Metrics {
    fn default() -> Self {
        Self {
            session: 0,
            pid: 0,
            epoch: 0,
            began_at_nanos: 0,
            at_nanos: 0,
            n_received: 0,
            n_sent: 0,
            sent_millihertz: 0,
            n_dropped: [0; N_CAUSES],
            evidence_bytes: 0,
            memory_bytes: 0,
            peak_memory_bytes: 0,
            queue: NO_QUEUE,
            longest_queue: NO_QUEUE,
            view: NO_VIEW,
            finished: 0,
            name: [0; MAX_NAME],
            n_rows: 0,
            reserved: 0,
            rows: [MetricsRow::default(); MAX_ROWS],
        }
    }
}

/// Durations of one stage of the work, nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("MetricsRow.v1")]
#[repr(C)]
pub struct MetricsRow {
    /// Which stage: see [`Span`].
    pub span: Span,
    /// Of which view, or [`NO_VIEW`].
    pub view: u32,
    /// How many were measured.
    pub count: u64,
    /// How many per second over the last seconds, in thousandths.
    pub millihertz: u64,
    /// Half are no longer.
    pub p50_nanos: u64,
    /// 99 of 100 are no longer.
    pub p99_nanos: u64,
    /// 999 of 1000 are no longer.
    pub p99_9_nanos: u64,
    /// The longest.
    pub max_nanos: u64,
}

/// What a duration is the duration of. A transparent number, as [`Status`](crate::Status) is.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, ZeroCopySend, Pod, Zeroable,
)]
#[type_name("Span.v1")]
#[repr(C)]
pub struct Span(pub u32);

impl Span {
    /// From a message being sent until work on it begins: transport, a busy receiver, other views.
    pub const WAITING: Self = Self(0);
    /// Work on a frame.
    pub const COMPUTING: Self = Self(1);
    /// Taking memory for the answer and sending it; where nothing may be lost, slow receivers too.
    pub const PUBLISHING: Self = Self(2);
    /// From the capture of a frame until this process's answer to it was ready to be sent.
    pub const SINCE_CAPTURE: Self = Self(3);
    /// From the capture of a frame until its result was ready to be sent.
    pub const END_TO_END: Self = Self(4);

    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::WAITING,
        Self::COMPUTING,
        Self::PUBLISHING,
        Self::SINCE_CAPTURE,
        Self::END_TO_END,
    ];

    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::WAITING => "waiting",
            Self::COMPUTING => "computing",
            Self::PUBLISHING => "publishing",
            Self::SINCE_CAPTURE => "since capture",
            Self::END_TO_END => "end to end",
            Self(_) => "unknown",
        }
    }
}

/// Why something was lost; its number is its place in [`Metrics::n_dropped`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Cause {
    /// The camera's side was behind its clock, and passed frames over.
    BehindClock,
    /// The process was busy, and newer frames took the place of these.
    Busy,
    /// It came after its frame had been answered.
    Late,
    /// Too many waited already.
    QueueFull,
    /// It could not be read.
    Malformed,
}

impl Cause {
    /// All of them, in order.
    pub const ALL: [Self; N_CAUSES] = [
        Self::BehindClock,
        Self::Busy,
        Self::Late,
        Self::QueueFull,
        Self::Malformed,
    ];

    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::BehindClock => "behind clock",
            Self::Busy => "busy",
            Self::Late => "late",
            Self::QueueFull => "queue full",
            Self::Malformed => "malformed",
        }
    }
}
