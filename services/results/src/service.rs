//! Receives everything at once, and writes it on a thread of its own.
//!
//! A sender may wait for its receivers, so this process never lets one wait: it copies what comes and queues it. If the
//! disk cannot keep up, the newest results are missed and counted.

use core::time::Duration;

use messages::{Cause, FrameHeader, PairPose, Pose3d, Span, Status, ViewPose, ViewQuality, topic};
use runtime::{Failure, Service, SliceSubscriber, Subscriber, Waiter, Woken, now_nanos};
use stage::{Context, Port, Sender};

use crate::gather::Gather;
use crate::job::Job;
use crate::writer::Writer;
use crate::{Folder, FrameRecord, Picture};

/// Writes what is published, until the footage ends or the process is to stop.
///
/// # Errors
///
/// [`runtime::ExitKind::Input`] if the output folder cannot be used, and what the transport reports.
pub fn run(service: &Service, job: Job) -> Result<(), Failure> {
    let mut waiter = service.bus().waiter();
    let ports = Ports::open(service, &job, &mut waiter)?;
    if service.epoch() > 0 && Folder::is_finished(&job.output, service.session()) {
        // Killed after its work was done: to begin again would empty the files.
        return ports.rest(service, &waiter);
    }
    let [n_views, n_joints] = [job.scene.views.len(), job.scene.joints.joints.len()];
    let frame_step = job.scene.frame_step;
    let writer = Writer::start(job, service)?;
    let mut gather = Gather::new(n_views, writer.next, frame_step, service.epoch() > 0);
    let context = Context::of(service);
    let mut is_over = false;
    while !is_over && waiter.wait(Duration::from_millis(50))? != Woken::Stop {
        ports.receive_inputs(&context, &mut gather, &writer)?;
        while let Some(pose3d) = ports.pose3d.receive::<Pose3d>(&context)? {
            // What a result was made of was sent before it: it has all come by now.
            ports.receive_inputs(&context, &mut gather, &writer)?;
            if pose3d.status == Status::END {
                writer.rest(gather.rest());
                is_over = true;
                break;
            }
            service.health().received(1);
            match wire::check_pose3d(&pose3d, n_views, n_joints) {
                Ok(()) => take(service, &pose3d, &mut gather, &writer),
                Err(error) => context.refuse("pose3d", &error),
            }
        }
    }
    writer.finish(service)?;
    if !is_over {
        // Told to end before the footage did: what was written is whole, but it is not all.
        return Ok(());
    }
    ports.rest(service, &waiter)
}

/// Hands a result, and the frames before it that have none, to the writing thread.
fn take(service: &Service, pose3d: &Pose3d, gather: &mut Gather, writer: &Writer) {
    let health = service.health();
    let Some(settled) = gather.result(pose3d) else {
        // A frame has one line.
        health.dropped(Cause::Late, 1);
        return;
    };
    note_times(service, &settled.record);
    if writer.write(settled) {
        health.sent(pose3d.stamp.frame);
    } else {
        health.dropped(Cause::QueueFull, 1);
    }
    health.queued(writer.n_waiting());
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

/// The topics of the deployment.
struct Ports {
    frames: Vec<SliceSubscriber<u8, FrameHeader>>,
    poses: Vec<Port<Subscriber<ViewPose>>>,
    qualities: Vec<Port<Subscriber<ViewQuality>>>,
    pairs: Vec<Port<Subscriber<PairPose>>>,
    pose3d: Port<Subscriber<Pose3d>>,
}

impl Ports {
    fn open(service: &Service, job: &Job, waiter: &mut Waiter) -> Result<Self, Failure> {
        let n_workers = job.n_workers;
        let mut ports = Self {
            frames: Vec::new(),
            poses: Vec::new(),
            qualities: Vec::new(),
            pairs: Vec::new(),
            pose3d: Port::open(service, waiter, &topic::pose3d(), Sender::All)?,
        };
        for view in 0..job.scene.views.len() {
            let frames = service
                .bus()
                .slice_subscriber(&topic::frame(view), waiter)?;
            ports.frames.push(frames);
            let (poses, sender) = (topic::view_pose(view), Sender::View(view));
            ports
                .poses
                .push(Port::open(service, waiter, &poses, sender)?);
            if job.has_quality {
                let errors = Port::open(service, waiter, &topic::view_quality(view), sender)?;
                ports.qualities.push(errors);
            }
        }
        for worker in 0..n_workers {
            let (pairs, sender) = (
                topic::pair_pose(worker),
                Sender::Worker { worker, n_workers },
            );
            ports
                .pairs
                .push(Port::open(service, waiter, &pairs, sender)?);
        }
        Ok(ports)
    }

    /// Receives all that waits, but for results.
    fn receive_inputs(
        &self,
        context: &Context<'_>,
        gather: &mut Gather,
        writer: &Writer,
    ) -> Result<(), Failure> {
        for (view, frames) in self.frames.iter().enumerate() {
            while let Some(sample) = frames.receive()? {
                let (header, expected) = (*sample.header(), context.expected(view));
                if let Err(error) = wire::check_frame(&header, sample.payload().len(), &expected) {
                    context.refuse("frame", &error);
                    continue;
                }
                let is_drawn = header.status == Status::OK && writer.draws(header.stamp.frame);
                let picture = is_drawn.then(|| Picture {
                    size: [header.width as usize, header.height as usize],
                    rgb: frames.copy_of(&sample),
                });
                gather.frame(view, &header, picture);
            }
        }
        for (view, poses) in self.poses.iter().enumerate() {
            gather.answerers(view, [self.frames[view].publishers(), poses.publishers()]);
            while let Some(pose) = poses.receive(context)? {
                gather.pose(view, &pose);
            }
        }
        for (view, qualities) in self.qualities.iter().enumerate() {
            while let Some(quality) = qualities.receive::<ViewQuality>(context)? {
                if quality.status != Status::END {
                    gather.quality(view, &quality);
                }
            }
        }
        for pairs in &self.pairs {
            while let Some(pair) = pairs.receive::<PairPose>(context)? {
                if pair.status != Status::END {
                    gather.pair(&pair);
                }
            }
        }
        Ok(())
    }

    /// Reports that all is done, and waits for the stop request. Messages are still received and discarded: where nothing
    /// may be lost a sender waits for room, such as a replay that sends more than the results need.
    fn rest(&self, service: &Service, waiter: &Waiter) -> Result<(), Failure> {
        service.health().finished();
        while waiter.wait(Duration::from_millis(50))? != Woken::Stop {
            for frames in &self.frames {
                while frames.receive()?.is_some() {}
            }
            self.poses.iter().try_for_each(Port::drain::<ViewPose>)?;
            self.qualities
                .iter()
                .try_for_each(Port::drain::<ViewQuality>)?;
            self.pairs.iter().try_for_each(Port::drain::<PairPose>)?;
            self.pose3d.drain::<Pose3d>()?;
        }
        Ok(())
    }
}
