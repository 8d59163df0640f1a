//! Times and losses of a process.

use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

/// Maximum number of rows of a [`Metrics`]: one row of waiting times for each view, and the rows that do not belong to a view.
pub const MAX_ROWS: usize = 24;
/// Maximum length of a view name in [`Metrics`], in bytes; longer names are truncated.
pub const MAX_NAME: usize = 32;
/// Number of causes in [`Metrics::n_dropped`].
pub const N_CAUSES: usize = 5;
/// Value of the view index for a number that belongs to no view, or to all views.
pub const NO_VIEW: u32 = u32::MAX;
/// Value of the queue length for a process without a queue.
pub const NO_QUEUE: u32 = u32::MAX;
/// Value of the number of people for a process that does not count them.
pub const NO_PEOPLE: u32 = u32::MAX;

/// Value of a camera measurement that is not available yet.
pub const UNMEASURED: i64 = i64::MIN;

/// The metrics of a process since its last start.
///
/// Every process sends them about once a second, when a subscriber connects, and at its end. Percentiles cover
/// the whole time since the start. They come from a histogram with two significant digits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ZeroCopySend, Pod, Zeroable)]
#[type_name("Metrics.v5")]
#[repr(C)]
pub struct Metrics {
    /// Run of the deployment.
    pub session: u64,
    /// Process id.
    pub pid: u32,
    /// Number of restarts of the process.
    pub epoch: u32,
    /// Time at which counting began, `CLOCK_MONOTONIC`, in nanoseconds.
    pub began_at_nanos: u64,
    /// Time of sending, `CLOCK_MONOTONIC`, in nanoseconds.
    pub at_nanos: u64,
    /// Number of messages received.
    pub n_received: u64,
    /// Number of messages sent; for the process `results`, the number of results written.
    pub n_sent: u64,
    /// Messages sent per second, averaged over the last seconds, in thousandths.
    pub sent_millihertz: u64,
    /// Number of messages or frames lost, by [`Cause`].
    pub n_dropped: [u64; N_CAUSES],
    /// Size of the evidence sent, in bytes.
    pub evidence_bytes: u64,
    /// Physical memory of the process, including mapped shared memory, in bytes; 0 if the system does not report it.
    pub memory_bytes: u64,
    /// Peak physical memory of the process, in bytes.
    pub peak_memory_bytes: u64,
    /// Number of frames or results that are waiting in the process, or [`NO_QUEUE`].
    pub queue: u32,
    /// Maximum number of frames or results that were waiting at any time, or [`NO_QUEUE`].
    pub longest_queue: u32,
    /// Index of the process's view, or [`NO_VIEW`].
    pub view: u32,
    /// 1 once the process has reached the end of the stream and forwarded it.
    pub finished: u32,
    /// Name of the view, UTF-8, padded with zeros.
    pub name: [u8; MAX_NAME],
    /// Number of valid rows.
    pub n_rows: u32,
    /// Number of people in the last result, or [`NO_PEOPLE`].
    pub n_people: u32,
    /// Counts of the pictures of the process's live camera; all 0 without a live camera.
    pub camera: CameraCounts,
    /// Durations, at most one row for each span and view.
    pub rows: [MetricsRow; MAX_ROWS],
}

/// Counts of the pictures of a live camera since the process began.
///
/// Each picture that the camera takes is either lost or delivered. Each delivered picture is used, surplus, overtaken or rejected, unless
/// it is still being processed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("CameraCounts.v3")]
#[repr(C)]
pub struct CameraCounts {
    /// Number of times that the camera was opened; 0 for footage.
    pub n_connections: u64,
    /// Number of pictures that the camera took, from the camera's own picture numbers, or from its times if it does not number pictures.
    pub n_made: u64,
    /// Number of pictures that the camera took but did not deliver.
    pub n_lost: u64,
    /// Number of pictures that the camera delivered.
    pub n_delivered: u64,
    /// Number of delivered pictures that were sent on.
    pub n_used: u64,
    /// Number of delivered pictures that were not used because each common instant near them already had a picture.
    pub n_surplus: u64,
    /// Number of delivered pictures that were replaced by a newer one because this process was slow.
    pub n_overtaken: u64,
    /// Number of delivered pictures that are damaged, frozen or have an impossible time.
    pub n_refused: u64,
    /// Frame rate measured by the times of the camera, in millionths of a picture per second; 0 if unknown.
    pub rate_microhertz: u64,
    /// Time from the common instant until the last used picture was taken, in nanoseconds; negative if it was taken earlier.
    pub off_grid_nanos: i64,
    /// Median of `off_grid_nanos` over the last pictures, in nanoseconds, or [`UNMEASURED`].
    pub skew_nanos: i64,
    /// Rate at which the camera falls behind the common instants, in parts per billion, or [`UNMEASURED`]. Negative if the camera runs
    /// ahead.
    pub drift_ppb: i64,
    /// Shortest time from capture to arrival over the last ten seconds, by the clock of the camera, in nanoseconds;
    /// [`UNMEASURED`] if it is not known.
    pub delay_nanos: i64,
    /// Source of the time at which the last picture was taken.
    pub timed_by: TimedBy,
}

/// Source of the times at which the pictures of a camera were taken. A transparent number, like [`Status`](crate::Status).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("TimedBy.v1")]
#[repr(C)]
pub struct TimedBy(pub u64);

impl TimedBy {
    /// No source: there is no picture yet, or the pictures are footage.
    pub const NOTHING: Self = Self(0);
    /// The kernel: the time at which it received the picture from the camera.
    pub const DRIVER: Self = Self(1);
    /// The clock of the camera.
    pub const CAMERA: Self = Self(2);
    /// The arrival of the pictures. They were taken earlier, by the time that the transfer took.
    pub const ARRIVAL: Self = Self(3);
    /// The arrival of the pictures, because the time stated by the camera is not plausible.
    pub const DISBELIEVED: Self = Self(4);

    /// Returns the name for messages to users.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::NOTHING => "-",
            Self::DRIVER => "driver",
            Self::CAMERA => "camera",
            Self::ARRIVAL => "arrival",
            Self::DISBELIEVED => "arrival (the camera's clock is not used)",
            Self(_) => "unknown",
        }
    }

    /// Returns true if the time of a picture is the time of its arrival.
    #[must_use]
    pub fn is_arrival(self) -> bool {
        matches!(self, Self::ARRIVAL | Self::DISBELIEVED)
    }
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
            n_people: NO_PEOPLE,
            camera: CameraCounts::default(),
            rows: [MetricsRow::default(); MAX_ROWS],
        }
    }
}

/// Statistics of the durations of one span (a stage of processing), in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("MetricsRow.v1")]
#[repr(C)]
pub struct MetricsRow {
    /// Span that was measured.
    pub span: Span,
    /// Index of the view, or [`NO_VIEW`].
    pub view: u32,
    /// Number of measurements.
    pub count: u64,
    /// Measurements per second, averaged over the last seconds, in thousandths.
    pub millihertz: u64,
    /// Median duration.
    pub p50_nanos: u64,
    /// 99th percentile of the durations.
    pub p99_nanos: u64,
    /// 99.9th percentile of the durations.
    pub p99_9_nanos: u64,
    /// Maximum duration.
    pub max_nanos: u64,
}

/// Span that a duration measures. A transparent number, like [`Status`](crate::Status).
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, ZeroCopySend, Pod, Zeroable,
)]
#[type_name("Span.v1")]
#[repr(C)]
pub struct Span(pub u32);

impl Span {
    /// Time from the sending of a message until work on it begins. It includes transport, a busy receiver, and waiting
    /// for other views.
    pub const WAITING: Self = Self(0);
    /// Time spent on computing the result of a frame.
    pub const COMPUTING: Self = Self(1);
    /// Time to reserve memory for the result and send it. In lossless delivery, it includes waiting for slow
    /// receivers.
    pub const PUBLISHING: Self = Self(2);
    /// Time from the capture of a frame until the result of this process is ready to be sent.
    pub const SINCE_CAPTURE: Self = Self(3);
    /// Time from the capture of a frame until its final result is ready to be sent.
    pub const END_TO_END: Self = Self(4);

    /// All spans.
    pub const ALL: [Self; 5] = [
        Self::WAITING,
        Self::COMPUTING,
        Self::PUBLISHING,
        Self::SINCE_CAPTURE,
        Self::END_TO_END,
    ];

    /// Returns the name for messages to users.
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

/// Cause of a loss of messages or frames. The discriminant is the index into [`Metrics::n_dropped`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Cause {
    /// The source of the frames fell behind its clock and skipped frames.
    BehindClock,
    /// The process was busy, so newer frames replaced the lost ones.
    Busy,
    /// The message arrived after its frame had been processed.
    Late,
    /// The queue was full.
    QueueFull,
    /// The message could not be read.
    Malformed,
}

impl Cause {
    /// All causes, in order.
    pub const ALL: [Self; N_CAUSES] = [
        Self::BehindClock,
        Self::Busy,
        Self::Late,
        Self::QueueFull,
        Self::Malformed,
    ];

    /// Returns the name for messages to users.
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
