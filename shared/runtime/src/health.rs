//! Heartbeats and metrics, sent by a separate thread.

use core::time::Duration;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread::{self, JoinHandle};

use crate::metrics::{Meter, Passage, Rates};
use messages::{CameraCounts, Cause, Health as HealthMessage, Metrics, Refusal, Span, topic};

use crate::{Bus, Launch, PortError, Progress, Publisher, memory};
use failure::{now_nanos, processor_nanos};

/// Interval between heartbeats.
pub const HEARTBEAT: Duration = Duration::from_millis(150);
/// Number of heartbeats from one metrics message to the next, which takes about a second.
const HEARTBEATS_PER_METRICS: u32 = 7;

/// Reason why heartbeats cannot be sent.
#[derive(Debug, thiserror::Error)]
pub enum HealthError {
    /// The topic cannot be opened.
    #[error(transparent)]
    Port(#[from] PortError),
    /// The thread cannot be started.
    #[error("cannot start the thread that sends heartbeats")]
    Thread(#[source] std::io::Error),
}

impl failure::Fault for HealthError {}

/// The counters and times of a process, published several times a second until this value is dropped.
///
/// A separate thread sends them. A process that is stopped (SIGSTOP) therefore sends nothing. A process whose main
/// loop hangs continues to send, with a [`Progress`] that does not change.
#[derive(Debug)]
pub struct Health {
    counts: Arc<Counts>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug)]
struct Counts {
    session: u64,
    epoch: u32,
    progress: Progress,
    n_received: AtomicU64,
    n_sent: AtomicU64,
    n_total: AtomicU64,
    n_without_gpu: AtomicU64,
    n_waiting: AtomicU64,
    last_frame: AtomicU64,
    finished: AtomicU32,
    refused: [AtomicU64; Refusal::N],
    ended: AtomicBool,
    /// Frame number used for fault injection: once the message of a later frame has been sent, the main loop hangs on purpose.
    spins_after: AtomicU64,
    began_at_nanos: u64,
    meter: Mutex<Meter>,
}

impl Health {
    /// Starts sending heartbeats and metrics.
    ///
    /// # Errors
    ///
    /// Returns a [`HealthError`] on failure.
    pub fn start(bus: &Bus, launch: &Launch) -> Result<Self, HealthError> {
        let counts = Arc::new(Counts {
            session: launch.session,
            epoch: launch.epoch,
            progress: bus.progress().clone(),
            n_received: AtomicU64::new(0),
            n_sent: AtomicU64::new(0),
            n_total: AtomicU64::new(0),
            n_without_gpu: AtomicU64::new(0),
            n_waiting: AtomicU64::new(0),
            last_frame: AtomicU64::new(0),
            finished: AtomicU32::new(0),
            refused: [const { AtomicU64::new(0) }; Refusal::N],
            ended: AtomicBool::new(false),
            spins_after: AtomicU64::new(u64::MAX),
            began_at_nanos: now_nanos(),
            meter: Mutex::default(),
        });
        // Ports cannot move to another thread, so the thread creates its own ports.
        let (result_sender, result_receiver) = mpsc::sync_channel(1);
        let parts = bus.parts();
        let process = launch.process.clone();
        let shared = Arc::clone(&counts);
        let thread = thread::Builder::new()
            .name("health".to_owned())
            .spawn(move || {
                let bus = parts.into_bus();
                match Sender::open(&bus, &process, &shared) {
                    Ok(sender) => {
                        if result_sender.send(Ok(())).is_ok() {
                            sender.send_until_ended();
                        }
                    }
                    Err(error) => {
                        if result_sender.send(Err(error)).is_err() {
                            tracing::debug!(
                                "the caller no longer waits for the start of the heartbeats"
                            );
                        }
                    }
                }
            })
            .map_err(HealthError::Thread)?;
        let health = Self {
            counts,
            thread: Some(thread),
        };
        match result_receiver.recv() {
            Ok(result) => result?,
            Err(error) => {
                return Err(HealthError::Thread(std::io::Error::other(error)));
            }
        }
        Ok(health)
    }

    /// Counts received messages.
    pub fn received(&self, n: u64) {
        self.counts.n_received.fetch_add(n, Ordering::Relaxed);
    }

    /// Counts a sent message. This also counts as an iteration of the main loop, because a process that is always busy never waits.
    ///
    /// The first message triggers a heartbeat at once, so that the supervisor soon knows that the process works.
    pub fn sent(&self, frame: u64) {
        self.counts.last_frame.store(frame, Ordering::Relaxed);
        self.counts.progress.tick();
        let n_before = self.counts.n_sent.fetch_add(1, Ordering::Relaxed);
        if let Some(thread) = self.thread.as_ref().filter(|_| n_before == 0) {
            thread.thread().unpark();
        }
        if frame > self.counts.spins_after.load(Ordering::Relaxed) {
            spin();
        }
    }

    /// Makes [`Self::sent`] loop forever on purpose, once a message of a later frame has been sent.
    pub fn spin_after(&self, frame: u64) {
        self.counts.spins_after.store(frame, Ordering::Relaxed);
    }

    /// Counts messages or frames that were lost.
    pub fn dropped(&self, cause: Cause, n: u64) {
        if n > 0 {
            self.counts.meter(|meter| meter.dropped(cause, n));
        }
    }

    /// Counts a rejected message. Logs the reason for the first message of every cause, and then each time the count has doubled.
    pub fn refuse(&self, cause: Refusal, topic: &str, why: &dyn core::fmt::Display) {
        self.dropped(Cause::Malformed, 1);
        let n = 1 + self.counts.refused[cause as usize].fetch_add(1, Ordering::Relaxed);
        if n.is_power_of_two() {
            tracing::warn!(n, topic, cause = cause.name(), "refused a message: {why}");
        }
    }

    /// Records the times of a frame in the process.
    pub fn passed(&self, passage: &Passage) {
        self.counts.meter(|meter| meter.passed(passage));
    }

    /// Records a duration, in nanoseconds.
    ///
    /// * `view`: view that the duration belongs to, if there is one.
    pub fn spent(&self, span: Span, view: Option<usize>, nanos: u64) {
        self.counts.meter(|meter| meter.spent(span, view, nanos));
    }

    /// Records the number of frames or results that are waiting in the process.
    pub fn queued(&self, n: usize) {
        self.counts.meter(|meter| meter.queued(n));
    }

    /// Records the number of frames that wait for a message of another view, or are being processed. A process with such frames is not idle.
    pub fn waits(&self, n: usize) {
        self.counts.n_waiting.store(n as u64, Ordering::Relaxed);
    }

    /// Records the number of people in a result.
    pub fn counted_people(&self, n: u32) {
        self.counts.meter(|meter| meter.counted_people(n));
    }

    /// Records the counts of the pictures of a live camera.
    pub fn camera(&self, counts: CameraCounts) {
        self.counts.meter(|meter| meter.camera(counts));
    }

    /// Counts a frame that was computed on the processor because the GPU was lost. Logs the first such frame.
    pub fn without_gpu(&self) {
        if self.counts.n_without_gpu.fetch_add(1, Ordering::Relaxed) == 0 {
            tracing::warn!("the GPU was lost: the processor computes from now on");
        }
    }

    /// Counts bytes of evidence that was sent.
    pub fn sent_evidence(&self, bytes: u64) {
        self.counts.meter(|meter| meter.sent_evidence(bytes));
    }

    /// Sets the view that the process works for.
    ///
    /// * `name`: name of the camera.
    pub fn belongs_to(&self, view: usize, name: &str) {
        self.counts.meter(|meter| meter.belongs_to(view, name));
    }

    /// Sets the total number of frames, if the number is known.
    pub fn set_total(&self, frames: u64) {
        self.counts.n_total.store(frames, Ordering::Relaxed);
    }

    /// Records that the end of stream has been received and sent on.
    pub fn finished(&self) {
        self.counts.finished.store(1, Ordering::Relaxed);
    }
}

impl Drop for Health {
    fn drop(&mut self) {
        self.counts.ended.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            if thread.join().is_err() {
                tracing::debug!("the thread that sends heartbeats has panicked");
            }
        }
    }
}

/// The ports of the sending thread.
struct Sender<'a> {
    counts: &'a Counts,
    heartbeats: Publisher<HealthMessage>,
    metrics: Publisher<Metrics>,
}

impl<'a> Sender<'a> {
    fn open(bus: &Bus, process: &str, counts: &'a Counts) -> Result<Self, PortError> {
        Ok(Self {
            counts,
            heartbeats: bus.publisher(&topic::health(process))?,
            metrics: bus.publisher(&topic::metrics(process))?,
        })
    }

    /// Sends messages until the work of this process has ended. The last messages are sent after that, so that they contain the final
    /// counts. A new observer gets metrics at once.
    fn send_until_ended(&self) {
        let mut rates = Rates::new(self.counts.began_at_nanos);
        let (mut n_heartbeats, mut n_observers) = (0_u32, 0);
        loop {
            let ended = self.counts.ended.load(Ordering::Acquire);
            if let Err(error) = self.heartbeats.send(&self.counts.message()) {
                tracing::debug!(%error, "cannot send a heartbeat");
            }
            let n_now = self.metrics.n_connected();
            if ended || n_heartbeats.is_multiple_of(HEARTBEATS_PER_METRICS) || n_now > n_observers {
                let mut message = self.counts.metrics();
                rates.fill(&mut message);
                if let Err(error) = self.metrics.send(&message) {
                    tracing::debug!(%error, "cannot send metrics");
                }
            }
            (n_heartbeats, n_observers) = (n_heartbeats.wrapping_add(1), n_now);
            if ended {
                return;
            }
            thread::park_timeout(HEARTBEAT);
        }
    }
}

impl Counts {
    fn message(&self) -> HealthMessage {
        let computing = self.meter(|meter| {
            (0..meter.n_rows())
                .filter_map(|index| meter.row(index))
                .find(|row| row.span == Span::COMPUTING)
        });
        let micros = |nanos: Option<u64>| nanos.map_or(0, |nanos| nanos / 1000);
        HealthMessage {
            session: self.session,
            pid: std::process::id(),
            epoch: self.epoch,
            n_loops: self.progress.count(),
            at_nanos: now_nanos(),
            n_received: self.n_received.load(Ordering::Relaxed),
            n_sent: self.n_sent.load(Ordering::Relaxed),
            n_dropped: self.meter(|meter| meter.n_dropped()),
            last_frame: self.last_frame.load(Ordering::Relaxed),
            p50_micros: micros(computing.map(|row| row.p50_nanos)),
            p99_micros: micros(computing.map(|row| row.p99_nanos)),
            peak_memory_bytes: memory::peak_memory().unwrap_or(0),
            finished: self.finished.load(Ordering::Relaxed),
            cpu_millis: cpu_millis(),
            n_total: self.n_total.load(Ordering::Relaxed),
            n_without_gpu: self.n_without_gpu.load(Ordering::Relaxed),
            n_waiting: self.n_waiting.load(Ordering::Relaxed),
            refused: self.refused.each_ref().map(|count| count.load(Ordering::Relaxed)),
        }
    }

    /// Returns the metrics without the rates. The meter is locked row by row, so that the main loop waits for at most one row.
    fn metrics(&self) -> Metrics {
        let [memory_bytes, peak_memory_bytes] = memory::memory_now().unwrap_or_default();
        let mut message = Metrics {
            session: self.session,
            pid: std::process::id(),
            epoch: self.epoch,
            began_at_nanos: self.began_at_nanos,
            at_nanos: now_nanos(),
            n_received: self.n_received.load(Ordering::Relaxed),
            n_sent: self.n_sent.load(Ordering::Relaxed),
            memory_bytes,
            peak_memory_bytes,
            finished: self.finished.load(Ordering::Relaxed),
            ..self.meter(|meter| meter.head())
        };
        for (row, index) in message.rows.iter_mut().zip(0_u32..) {
            let Some(now) = self.meter(|meter| meter.row(index as usize)) else {
                break;
            };
            *row = now;
            message.n_rows = index + 1;
        }
        message
    }

    fn meter<T>(&self, use_it: impl FnOnce(&mut Meter) -> T) -> T {
        use_it(&mut self.meter.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

fn spin() -> ! {
    tracing::warn!("injected fault: this process now loops forever");
    loop {
        core::hint::spin_loop();
    }
}

/// Returns the processor time that this process has used, in milliseconds, modulo 2^32.
fn cpu_millis() -> u32 {
    // The high bits do not matter, because only differences are used.
    (processor_nanos() / 1_000_000) as u32
}
