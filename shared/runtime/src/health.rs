//! Signs of life, sent by a thread of their own.

use core::time::Duration;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread::{self, JoinHandle};

use hdrhistogram::Histogram;
use messages::Health as HealthMessage;

use crate::{Bus, Launch, PortError, Progress, memory, now_nanos};

/// Pause between two signs of life.
const PERIOD: Duration = Duration::from_millis(150);
/// Longest computation that is told apart, microseconds.
const LONGEST_MICROS: u64 = 3_600_000_000;

/// Signs of life cannot be sent.
#[derive(Debug, thiserror::Error)]
pub enum HealthError {
    /// The topic is not there.
    #[error(transparent)]
    Port(#[from] PortError),
    /// The thread cannot be started.
    #[error("cannot start the thread that sends signs of life")]
    Thread(#[source] std::io::Error),
}

impl crate::Fault for HealthError {}

/// What a process has done, published several times a second until this is dropped.
///
/// A thread of its own sends, so that a process which is stopped (SIGSTOP) falls silent, while one
/// whose main loop hangs goes on sending a [`Progress`] that stands still.
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
    n_dropped: AtomicU64,
    n_total: AtomicU64,
    last_frame: AtomicU64,
    finished: AtomicU32,
    ended: AtomicBool,
    micros: Mutex<Histogram<u64>>,
}

impl Health {
    /// Begins to send.
    ///
    /// # Errors
    ///
    /// [`HealthError`].
    pub fn start(bus: &Bus, launch: &Launch) -> Result<Self, HealthError> {
        let counts = Arc::new(Counts {
            session: launch.session,
            epoch: launch.epoch,
            progress: bus.progress().clone(),
            n_received: AtomicU64::new(0),
            n_sent: AtomicU64::new(0),
            n_dropped: AtomicU64::new(0),
            n_total: AtomicU64::new(0),
            last_frame: AtomicU64::new(0),
            finished: AtomicU32::new(0),
            ended: AtomicBool::new(false),
            micros: Mutex::new(histogram()),
        });
        // Ports stay in the thread that makes them, so it has to make its own.
        let (answer, answered) = mpsc::sync_channel(1);
        let seed = bus.seed();
        let topic = messages::topic::health(&launch.process);
        let shared = Arc::clone(&counts);
        let thread = thread::Builder::new()
            .name("health".to_owned())
            .spawn(move || {
                let bus = seed.grow();
                match bus.publisher::<HealthMessage>(&topic) {
                    Ok(publisher) => {
                        if answer.send(Ok(())).is_ok() {
                            shared.send_until_ended(&publisher);
                        }
                    }
                    Err(error) => {
                        if answer.send(Err(error)).is_err() {
                            tracing::debug!("nobody waits for the signs of life");
                        }
                    }
                }
            })
            .map_err(HealthError::Thread)?;
        let health = Self {
            counts,
            thread: Some(thread),
        };
        match answered.recv() {
            Ok(result) => result?,
            Err(error) => {
                return Err(HealthError::Thread(std::io::Error::other(error)));
            }
        }
        Ok(health)
    }

    /// Counts messages taken in.
    pub fn received(&self, n: u64) {
        self.counts.n_received.fetch_add(n, Ordering::Relaxed);
    }

    /// Counts a message sent out.
    pub fn sent(&self, frame: u64) {
        self.counts.n_sent.fetch_add(1, Ordering::Relaxed);
        self.counts.last_frame.store(frame, Ordering::Relaxed);
    }

    /// Counts messages that were lost or came too late.
    pub fn dropped(&self, n: u64) {
        self.counts.n_dropped.fetch_add(n, Ordering::Relaxed);
    }

    /// Notes how long the computation of a frame took.
    pub fn computed(&self, time: Duration) {
        let micros = (time.as_micros() as u64).clamp(1, LONGEST_MICROS);
        self.counts
            .histogram(|histogram| histogram.saturating_record(micros));
    }

    /// Says how much work there is, if that is known.
    pub fn set_total(&self, frames: u64) {
        self.counts.n_total.store(frames, Ordering::Relaxed);
    }

    /// Says that the end of the footage has been seen and passed on.
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
                tracing::debug!("the thread that sends signs of life has panicked");
            }
        }
    }
}

impl Counts {
    /// The last message goes out after the end, so that the final counts are seen.
    fn send_until_ended(&self, publisher: &crate::Publisher<HealthMessage>) {
        loop {
            let ended = self.ended.load(Ordering::Acquire);
            if let Err(error) = publisher.send(&self.message()) {
                tracing::debug!(%error, "cannot send a sign of life");
            }
            if ended {
                return;
            }
            thread::park_timeout(PERIOD);
        }
    }

    fn message(&self) -> HealthMessage {
        let (p50_micros, p99_micros) = self.histogram(|histogram| {
            (
                histogram.value_at_quantile(0.5),
                histogram.value_at_quantile(0.99),
            )
        });
        HealthMessage {
            session: self.session,
            pid: std::process::id(),
            epoch: self.epoch,
            n_loops: self.progress.count(),
            at_nanos: now_nanos(),
            n_received: self.n_received.load(Ordering::Relaxed),
            n_sent: self.n_sent.load(Ordering::Relaxed),
            n_dropped: self.n_dropped.load(Ordering::Relaxed),
            last_frame: self.last_frame.load(Ordering::Relaxed),
            p50_micros,
            p99_micros,
            peak_memory_bytes: memory::peak_memory().unwrap_or(0),
            finished: self.finished.load(Ordering::Relaxed),
            reserved: 0,
            n_total: self.n_total.load(Ordering::Relaxed),
        }
    }

    fn histogram<T>(&self, use_it: impl FnOnce(&mut Histogram<u64>) -> T) -> T {
        let mut histogram = self.micros.lock().unwrap_or_else(PoisonError::into_inner);
        use_it(&mut histogram)
    }
}

#[expect(clippy::expect_used, reason = "the arguments are constants")]
fn histogram() -> Histogram<u64> {
    Histogram::new_with_bounds(1, LONGEST_MICROS, 2).expect("1 <= 2 * low <= high, 2 digits")
}
