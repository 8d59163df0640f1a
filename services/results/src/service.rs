//! Receives every message as soon as it arrives. A separate thread writes the files.
//!
//! Senders wait for slow receivers, so this process must not be slow: it copies every message into a queue. If the disk cannot keep up, the
//! newest results are dropped and counted.

use core::time::Duration;
use std::time::Instant;

use failure::{Failure, now_nanos};
use messages::{
    Cause, FrameHeader, PairPose, People, Sightings, Skeletons, Span, Status, ViewQuality, topic,
};
use runtime::{Service, SliceSubscriber, Subscriber, Waiter, Woken};
use stage::{Context, Port, Sender};

use crate::gather::Gather;
use crate::job::Job;
use crate::writer::Writer;
use crate::{Folder, FrameRecord, Picture};

/// Maximum wait for expected errors that fusion has used.
const AWAITED: Duration = Duration::from_secs(2);
/// Interval between checks while expected errors are awaited.
const AWAIT_PAUSE: Duration = Duration::from_micros(500);

/// Writes all messages until the footage ends or a stop is requested.
///
/// # Errors
///
/// Fails with [`failure::ExitKind::Input`] if the output folder cannot be used, and with errors of the transport.
pub fn run(service: &Service, job: Job) -> Result<(), Failure> {
    let mut waiter = service.bus().waiter();
    let ports = Ports::open(service, &job, &mut waiter)?;
    if service.epoch() > 0 && Folder::finish_killed(&job.output, service.session()) {
        // The process was killed after its work was complete. Starting over would empty the files.
        return ports.rest(service, &waiter);
    }
    let [n_views, n_joints] = [job.scene.views.len(), job.scene.joints.joints.len()];
    let frame_step = job.scene.frame_step;
    let writer = Writer::start(job, service)?;
    let mut gather = Gather::new(n_views, writer.next, frame_step, service.epoch() > 0);
    let context = Context::of(service);
    let (mut is_over, mut may_await) = (false, true);
    while !is_over && waiter.wait(Duration::from_millis(50))? != Woken::Stop {
        ports.receive_inputs(&context, &mut gather, &writer)?;
        while let Some(skeletons) = ports.skeletons.receive_boxed(&context)? {
            // The inputs of a result were sent before it, so all of them can be received now. Expected errors are an exception: fusion may
            // have received them first.
            ports.receive_inputs(&context, &mut gather, &writer)?;
            let begin = Instant::now();
            while may_await && gather.awaits_quality(skeletons.stamp.frame) {
                std::thread::sleep(AWAIT_PAUSE);
                ports.receive_inputs(&context, &mut gather, &writer)?;
                // The expected errors were lost. The expected errors of later frames may be lost too.
                may_await = begin.elapsed() < AWAITED;
            }
            if skeletons.status == Status::END {
                writer.rest(gather.next(), gather.rest());
                is_over = true;
                break;
            }
            service.health().received(1);
            match wire::check_skeletons(&skeletons, n_views, n_joints) {
                Ok(()) => take(service, skeletons, &mut gather, &writer),
                Err(error) => context.count_refused("skeletons", &error),
            }
        }
    }
    writer.finish(service)?;
    if !is_over {
        // A stop was requested before the end of the footage: the files are valid, but not complete.
        return Ok(());
    }
    ports.rest(service, &waiter)
}

/// Passes a result to the writing thread, with earlier frames that have no result.
fn take(service: &Service, skeletons: Box<Skeletons>, gather: &mut Gather, writer: &Writer) {
    let health = service.health();
    let frame = skeletons.stamp.frame;
    let Some(settled) = gather.result(skeletons) else {
        // The output already has a line for this frame.
        health.dropped(Cause::Late, 1);
        return;
    };
    record_latency(service, &settled.record);
    if writer.write(settled) {
        health.sent(frame);
    } else {
        health.dropped(Cause::QueueFull, 1);
    }
    health.queued(writer.n_waiting());
}

/// Records the latency of a result, overall and for every used view, and its waiting time in this process.
fn record_latency(service: &Service, record: &FrameRecord) {
    let (health, skeletons) = (service.health(), &record.skeletons);
    if skeletons.status != Status::OK {
        return;
    }
    let sent_at = skeletons.timing.sent_at_nanos;
    let since = |captured_at: u64| sent_at.saturating_sub(captured_at);
    let captured_at = skeletons.stamp.captured_at_nanos;
    health.spent(Span::END_TO_END, None, since(captured_at));
    for (view, of_view) in record.views.iter().enumerate() {
        if let Some(frame) = of_view.frame.filter(|_| of_view.missing.is_none()) {
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
    poses: Vec<Port<Subscriber<Sightings>>>,
    qualities: Vec<Port<Subscriber<ViewQuality>>>,
    pairs: Vec<Port<Subscriber<PairPose>>>,
    people: Option<Port<Subscriber<People>>>,
    skeletons: Port<Subscriber<Skeletons>>,
}

impl Ports {
    fn open(service: &Service, job: &Job, waiter: &mut Waiter) -> Result<Self, Failure> {
        let n_workers = job.n_workers;
        let mut ports = Self {
            frames: Vec::new(),
            poses: Vec::new(),
            qualities: Vec::new(),
            pairs: Vec::new(),
            people: None,
            skeletons: Port::open(service, waiter, &topic::skeletons(), Sender::All)?,
        };
        for view in 0..job.scene.views.len() {
            let frames = service.bus().slice_subscriber(&topic::frame(view), waiter)?;
            ports.frames.push(frames);
            let (poses, sender) = (topic::sightings(view), Sender::View(view));
            ports.poses.push(Port::open(service, waiter, &poses, sender)?);
            if job.has_quality {
                let errors = Port::open(service, waiter, &topic::view_quality(view), sender)?;
                ports.qualities.push(errors);
            }
        }
        if job.scene.has_maps {
            let people = Port::open(service, waiter, &topic::people(), Sender::All)?;
            ports.people = Some(people);
            return Ok(ports);
        }
        for worker in 0..n_workers {
            let (pairs, sender) = (
                topic::pair_pose(worker),
                Sender::Worker { worker, n_workers },
            );
            ports.pairs.push(Port::open(service, waiter, &pairs, sender)?);
        }
        Ok(ports)
    }

    /// Receives all waiting messages except results.
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
                    context.count_refused("frame", &error);
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
            gather.note_ports(view, [self.frames[view].publishers(), poses.senders()]);
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
                    gather.fused(pair.stamp.frame, (&pair).into());
                }
            }
        }
        if let Some(port) = &self.people {
            while let Some(people) = port.receive::<People>(context)? {
                if people.status != Status::END {
                    gather.fused(people.stamp.frame, (&people).into());
                }
            }
        }
        Ok(())
    }

    /// Reports that the work is finished, and waits for the stop request. Messages are still received and discarded, because with
    /// lossless delivery a sender waits until there is space. An example is a replay that sends more than the results need.
    fn rest(&self, service: &Service, waiter: &Waiter) -> Result<(), Failure> {
        service.health().finished();
        while waiter.wait(Duration::from_millis(50))? != Woken::Stop {
            for frames in &self.frames {
                while frames.receive()?.is_some() {}
            }
            self.poses.iter().try_for_each(Port::drain::<Sightings>)?;
            self.qualities.iter().try_for_each(Port::drain::<ViewQuality>)?;
            self.pairs.iter().try_for_each(Port::drain::<PairPose>)?;
            self.people.iter().try_for_each(Port::drain::<People>)?;
            self.skeletons.drain::<Skeletons>()?;
        }
        Ok(())
    }
}
