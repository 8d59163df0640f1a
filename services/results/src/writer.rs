//! The writing thread and its queue.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crossbeam::channel::{Receiver, Sender, TrySendError, bounded};
use failure::{ExitKind, Failure, OrFail as _};
use runtime::Service;
use stage::WriterThread;

use crate::gather::Settled;
use crate::job::Job;
use crate::{Absent, Folder, FrameRecord, Output};

/// Number of results that may wait to be written.
const QUEUE: usize = 256;

/// Records to be written: frames without a result, then a frame with a result.
struct Batch {
    /// First frame that no batch before the end of the run contained. Results before it may have been dropped.
    next: Option<u64>,
    absent: Vec<Absent>,
    record: Option<FrameRecord>,
}

/// The writing thread, and the sending end of its queue.
pub(crate) struct Writer {
    queue: Sender<Batch>,
    thread: WriterThread,
    n_missed: Arc<AtomicU64>,
    n_written: Arc<AtomicU64>,
    n_queued: Cell<u64>,
    /// The first frame without a line when the process started.
    pub(crate) next: u64,
    overlay_every: u64,
    start_frame: u64,
    frame_step: u64,
}

impl Writer {
    pub(crate) fn start(job: Job, service: &Service) -> Result<Self, Failure> {
        let (session, resume) = (service.session(), service.epoch() > 0);
        // A folder that becomes unwritable during the run is no reason to end the other processes.
        let kind = if resume {
            ExitKind::Run
        } else {
            ExitKind::Input
        };
        let folder = Folder::open(&job.output, resume).or_fail(kind)?;
        let (overlay_every, frame_step) = (job.config.overlay_every, job.scene.frame_step);
        let output = Output::begin(job.scene, &job.config, job.n_workers, folder);
        let mut output = output.or_fail(kind)?;
        if job.config.smooth {
            output.smooth().or_fail(kind)?;
        }
        let next = output.next_frame().unwrap_or(job.start_frame);
        let (queue, batches) = bounded(QUEUE);
        let n_missed = Arc::new(AtomicU64::new(0));
        let missed = Arc::clone(&n_missed);
        let n_written = Arc::new(AtomicU64::new(0));
        let written = Arc::clone(&n_written);
        let thread = WriterThread::start(move || {
            // The pictures of a frame can wait; the next frame cannot.
            runtime::give_way();
            write_all(output, &batches, [&missed, &written], session);
        })?;
        Ok(Self {
            queue,
            thread,
            n_missed,
            n_written,
            n_queued: Cell::new(0),
            next,
            overlay_every,
            start_frame: job.start_frame,
            frame_step: frame_step.max(1),
        })
    }

    /// Returns true if the pixels of a frame are needed.
    pub(crate) fn draws(&self, frame: u64) -> bool {
        let nth = frame.saturating_sub(self.start_frame) / self.frame_step;
        self.overlay_every > 0 && nth.is_multiple_of(self.overlay_every)
    }

    /// Queues a record. Returns `false` if it was dropped because the queue is full.
    pub(crate) fn write(&self, Settled { absent, record }: Settled) -> bool {
        let batch = Batch {
            next: None,
            absent,
            record: Some(record),
        };
        match self.queue.try_send(batch) {
            Ok(()) => {
                self.n_queued.set(self.n_queued.get() + 1);
                true
            }
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {
                self.n_missed.fetch_add(1, Ordering::Relaxed);
                false
            }
        }
    }

    /// Queues the frames without a result after the last result. Waits for space, because nothing follows.
    ///
    /// * `next`: first frame after the last result.
    pub(crate) fn rest(&self, next: u64, absent: Vec<Absent>) {
        let batch = Batch {
            next: Some(next),
            absent,
            record: None,
        };
        if let Err(error) = self.queue.send(batch) {
            tracing::debug!(%error, "the writing thread has ended");
        }
    }

    /// Returns the number of results that wait to be written.
    pub(crate) fn n_waiting(&self) -> usize {
        let written = self.n_written.load(Ordering::Relaxed);
        self.n_queued.get().saturating_sub(written) as usize
    }

    /// Waits until everything is written.
    pub(crate) fn finish(self, service: &Service) -> Result<(), Failure> {
        drop(self.queue);
        self.thread.finish(service)
    }
}

fn write_all(
    mut output: Output,
    batches: &Receiver<Batch>,
    [n_missed, n_written]: [&AtomicU64; 2],
    session: u64,
) {
    while let Ok(batch) = batches.recv() {
        if let Some(next) = batch.next {
            output.fill_up_to(next);
        }
        output.absent(&batch.absent);
        let Some(record) = batch.record else { continue };
        output.frame(&record);
        n_written.fetch_add(1, Ordering::Relaxed);
    }
    output.missed(n_missed.load(Ordering::Relaxed));
    output.finish(session);
}
