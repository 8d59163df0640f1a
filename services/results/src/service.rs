//! The loop: take everything in at once, and write it on a thread of its own.
//!
//! Whoever sends may wait for its receivers, so this process never lets them wait: it copies what
//! comes and hands it on. If the disk cannot keep up, the newest results are missed and counted.

use core::time::Duration;
use std::cell::Cell;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::{Builder, JoinHandle};

use messages::{Cause, FrameHeader, PairPose, Pose3d, Span, Status, ViewPose, ViewQuality, topic};
use runtime::{
    ExitKind, Failure, OrFail as _, Service, SliceSubscriber, Subscriber, Waiter, Woken, now_nanos,
};
use wire::{Expected, WireError};

use crate::gather::{Gather, Settled};
use crate::{Absent, Config, Folder, FrameRecord, Output, Picture, Scene};

/// Results that may wait to be written.
const QUEUE: usize = 256;

/// What the process has to do.
#[derive(Debug)]
pub struct Job {
    /// What the numbers in messages mean.
    pub scene: Scene,
    /// What to leave behind.
    pub config: Config,
    /// Where.
    pub output: PathBuf,
    /// First frame of the footage that is used.
    pub start_frame: u64,
    /// Number of fusion workers.
    pub n_workers: usize,
    /// Whether there are processes that send expected errors.
    pub has_quality: bool,
}

/// Writes what is published, until the footage ends or it is told to stop.
///
/// # Errors
///
/// [`ExitKind::Input`] if the output folder cannot be used, and what the transport says.
pub fn run(service: &Service, job: Job) -> Result<(), Failure> {
    let mut waiter = service.bus().waiter();
    let n_views = job.scene.views.len();
    let n_joints = job.scene.joints.joints.len();
    if service.epoch() > 0 && Folder::is_finished(&job.output, service.session()) {
        // Killed after its work was done: to begin anew would empty the files.
        return Ports::open(service, &job, &mut waiter)?.rest(service, &waiter);
    }
    let ports = Ports::open(service, &job, &mut waiter)?;
    let frame_step = job.scene.frame_step;
    let writer = Writer::start(job, service)?;
    let mut gather = Gather::new(n_views, writer.next, frame_step, service.epoch() > 0);
    let mut is_over = false;
    while !is_over && waiter.wait(Duration::from_millis(50))? != Woken::Stop {
        ports.listen(service, &mut gather, &writer)?;
        // The result last: what it was made of has been taken in by then.
        while let Some(pose3d) = ports.pose3d.receive()? {
            let check = |it: Expected| it.check(&pose3d.stamp, &pose3d.timing);
            if !is_ours(service, ("pose3d", 0), check) {
                continue;
            }
            if pose3d.status == Status::END {
                ports.listen(service, &mut gather, &writer)?;
                writer.rest(gather.rest());
                is_over = true;
                break;
            }
            service.health().received(1);
            if let Err(error) = wire::check_pose3d(&pose3d, n_views, n_joints) {
                service.health().refuse(error.refusal(), "pose3d", &error);
                continue;
            }
            ports.listen(service, &mut gather, &writer)?;
            let Some(settled) = gather.result(&pose3d) else {
                // A frame has one line.
                service.health().dropped(Cause::Late, 1);
                continue;
            };
            note_times(service, &settled.record);
            if writer.write(settled) {
                service.health().sent(pose3d.stamp.frame);
            } else {
                service.health().dropped(Cause::QueueFull, 1);
            }
            service.health().queued(writer.n_waiting());
        }
    }
    writer.finish(service)?;
    if !is_over {
        // Told to end before the footage did: what was written is whole, but it is not all.
        return Ok(());
    }
    ports.rest(service, &waiter)
}

/// How old a result was when it was sent, over all and of every view that has a part in it; and how
/// long ago that was.
fn note_times(service: &Service, record: &FrameRecord) {
    let (health, pose3d) = (service.health(), &record.pose3d);
    if pose3d.status != Status::OK {
        return;
    }
    let sent_at = pose3d.timing.sent_at_nanos;
    let since = |captured_at: u64| sent_at.saturating_sub(captured_at);
    let captured_at = pose3d.stamp.captured_at_nanos;
    health.spent(Span::END_TO_END, None, since(captured_at));
    for (view, it) in record.views.iter().enumerate() {
        if let Some(frame) = it.frame.filter(|_| it.missing.is_none()) {
            let captured_at = frame.stamp.captured_at_nanos;
            health.spent(Span::END_TO_END, Some(view), since(captured_at));
        }
    }
    let waited = now_nanos().saturating_sub(sent_at);
    health.spent(Span::WAITING, None, waited);
}

struct Ports {
    frames: Vec<SliceSubscriber<u8, FrameHeader>>,
    poses: Vec<Subscriber<ViewPose>>,
    qualities: Vec<Subscriber<ViewQuality>>,
    pairs: Vec<Subscriber<PairPose>>,
    pose3d: Subscriber<Pose3d>,
}

impl Ports {
    fn open(service: &Service, job: &Job, waiter: &mut Waiter) -> Result<Self, Failure> {
        let bus = service.bus();
        let views = 0..job.scene.views.len();
        let with_quality = if job.has_quality { views.clone() } else { 0..0 };
        Ok(Self {
            frames: views
                .clone()
                .map(|it| bus.slice_subscriber(&topic::frame(it), waiter))
                .collect::<Result<_, _>>()?,
            poses: views
                .map(|it| bus.subscriber(&topic::view_pose(it), waiter))
                .collect::<Result<_, _>>()?,
            qualities: with_quality
                .map(|it| bus.subscriber(&topic::view_quality(it), waiter))
                .collect::<Result<_, _>>()?,
            pairs: (0..job.n_workers)
                .map(|it| bus.subscriber(&topic::pair_pose(it), waiter))
                .collect::<Result<_, _>>()?,
            pose3d: bus.subscriber(&topic::pose3d(), waiter)?,
        })
    }

    /// Says that all is done, and waits to be told so. What comes is taken in all the same: a sender whose words have
    /// no part in any result, such as frames when a replay begins behind them, waits for room where nothing may be lost,
    /// and to be heard before it begins.
    fn rest(&self, service: &Service, waiter: &Waiter) -> Result<(), Failure> {
        service.health().finished();
        while waiter.wait(Duration::from_millis(50))? != Woken::Stop {
            for it in &self.frames {
                while it.receive()?.is_some() {}
            }
            for it in &self.poses {
                while it.receive()?.is_some() {}
            }
            for it in &self.qualities {
                while it.receive()?.is_some() {}
            }
            for it in &self.pairs {
                while it.receive()?.is_some() {}
            }
            while self.pose3d.receive()?.is_some() {}
        }
        Ok(())
    }

    /// Takes in all that has come, but for results.
    fn listen(
        &self,
        service: &Service,
        gather: &mut Gather,
        writer: &Writer,
    ) -> Result<(), Failure> {
        for (view, frames) in self.frames.iter().enumerate() {
            while let Some(sample) = frames.receive()? {
                let header = *sample.header();
                let n_bytes = sample.payload().len();
                let check = |it: Expected| wire::check_frame(&header, n_bytes, &it);
                if is_ours(service, ("frame", view), check) {
                    let size = [header.width as usize, header.height as usize];
                    let wanted = header.status == Status::OK && writer.draws(header.stamp.frame);
                    let picture = wanted.then(|| Picture {
                        size,
                        rgb: frames.copy_of(&sample),
                    });
                    gather.frame(view, &header, picture);
                }
            }
        }
        for (view, poses) in self.poses.iter().enumerate() {
            gather.answerers(view, [self.frames[view].publishers(), poses.publishers()]);
            while let Some(pose) = poses.receive()? {
                let check = |it: Expected| it.check(&pose.stamp, &pose.timing);
                if is_ours(service, ("view-pose", view), check) {
                    gather.pose(view, &pose);
                }
            }
        }
        for (view, qualities) in self.qualities.iter().enumerate() {
            while let Some(quality) = qualities.receive()? {
                let check = |it: Expected| it.check(&quality.stamp, &quality.timing);
                let is_ours = is_ours(service, ("view-quality", view), check);
                if is_ours && quality.status != Status::END {
                    gather.quality(view, &quality);
                }
            }
        }
        let n_workers = self.pairs.len();
        for (worker, pairs) in self.pairs.iter().enumerate() {
            while let Some(pair) = pairs.receive()? {
                let check = |it: Expected| match pair.status {
                    Status::END => it.check_end(&pair.stamp, &pair.timing),
                    _ => it.check_pair(&pair.stamp, &pair.timing, n_workers),
                };
                let is_ours = is_ours(service, ("pair-pose", worker), check);
                if is_ours && pair.status != Status::END {
                    gather.pair(&pair);
                }
            }
        }
        Ok(())
    }
}

/// Whether a message is what its topic is for; counts it if it is not.
///
/// * `topic`: what it is about, and the number of its sender.
fn is_ours(
    service: &Service,
    (topic, sender): (&str, usize),
    check: impl FnOnce(Expected) -> Result<(), WireError>,
) -> bool {
    let checked = check(Expected {
        session: service.session(),
        view: sender,
        now_nanos: now_nanos(),
    });
    if let Err(error) = &checked {
        service.health().refuse(error.refusal(), topic, error);
    }
    checked.is_ok()
}

/// What is to be written: frames without a result, and then one that has it.
struct Lot {
    absent: Vec<Absent>,
    record: Option<FrameRecord>,
}

/// The thread that writes, and the queue before it.
struct Writer {
    queue: SyncSender<Lot>,
    thread: JoinHandle<()>,
    n_missed: Arc<AtomicU64>,
    n_written: Arc<AtomicU64>,
    n_handed_on: Cell<u64>,
    /// The first frame that had no line when it began.
    next: u64,
    overlay_every: u64,
    start_frame: u64,
    frame_step: u64,
}

impl Writer {
    fn start(job: Job, service: &Service) -> Result<Self, Failure> {
        let (session, resume) = (service.session(), service.epoch() > 0);
        // What was writable when the run began and is no longer does not stop the others.
        let kind = if resume {
            ExitKind::Run
        } else {
            ExitKind::Input
        };
        let folder = Folder::open(&job.output, resume).or_fail(kind)?;
        let (overlay_every, frame_step) = (job.config.overlay_every, job.scene.frame_step);
        let output = Output::begin(job.scene, &job.config, job.n_workers, folder);
        let output = output.or_fail(kind)?;
        let next = output.next_frame().unwrap_or(job.start_frame);
        let (queue, lots) = sync_channel(QUEUE);
        let n_missed = Arc::new(AtomicU64::new(0));
        let missed = Arc::clone(&n_missed);
        let n_written = Arc::new(AtomicU64::new(0));
        let written = Arc::clone(&n_written);
        let thread = Builder::new()
            .name("writer".to_owned())
            .spawn(move || write_all(output, &lots, [&missed, &written], session))
            .or_fail(ExitKind::Run)?;
        Ok(Self {
            queue,
            thread,
            n_missed,
            n_written,
            n_handed_on: Cell::new(0),
            next,
            overlay_every,
            start_frame: job.start_frame,
            frame_step: frame_step.max(1),
        })
    }

    /// Whether the pixels of a frame are needed.
    fn draws(&self, frame: u64) -> bool {
        let nth = frame.saturating_sub(self.start_frame) / self.frame_step;
        self.overlay_every > 0 && nth.is_multiple_of(self.overlay_every)
    }

    /// Hands a record on; `false` if it was missed, because too many wait already.
    fn write(&self, Settled { absent, record }: Settled) -> bool {
        let record = Some(record);
        match self.queue.try_send(Lot { absent, record }) {
            Ok(()) => {
                self.n_handed_on.set(self.n_handed_on.get() + 1);
                true
            }
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {
                self.n_missed.fetch_add(1, Ordering::Relaxed);
                false
            }
        }
    }

    /// Hands on frames that have no result, behind all others; waits for room, for nothing follows.
    fn rest(&self, absent: Vec<Absent>) {
        let record = None;
        if let Err(error) = self.queue.send(Lot { absent, record }) {
            tracing::debug!(%error, "the writing thread is gone");
        }
    }

    /// Results that wait to be written.
    fn n_waiting(&self) -> usize {
        let written = self.n_written.load(Ordering::Relaxed);
        self.n_handed_on.get().saturating_sub(written) as usize
    }

    /// Waits until everything is written.
    fn finish(self, service: &Service) -> Result<(), Failure> {
        drop(self.queue);
        while !self.thread.is_finished() {
            service.progress().tick();
            std::thread::sleep(Duration::from_millis(20));
        }
        let panicked = |_| Failure::new(ExitKind::Run, "the writing thread panicked");
        self.thread.join().map_err(panicked)
    }
}

fn write_all(
    mut output: Output,
    lots: &Receiver<Lot>,
    [n_missed, n_written]: [&AtomicU64; 2],
    session: u64,
) {
    while let Ok(Lot { absent, record }) = lots.recv() {
        output.absent(&absent);
        let Some(record) = record else { continue };
        output.frame(&record);
        n_written.fetch_add(1, Ordering::Relaxed);
    }
    output.missed(n_missed.load(Ordering::Relaxed));
    output.finish(session);
}
