//! Receives every message as soon as it arrives. A separate thread writes the messages.
//!
//! With realtime delivery, no sender waits for the disk: messages that do not fit into the queue are dropped and counted. With lossless
//! delivery, senders wait while the queue is full, but not forever.

use core::time::Duration;
use std::path::PathBuf;
use std::time::Instant;

use failure::{ExitKind, Failure, now_nanos};
use messages::{Cause, Status};
use recording::{About, Entry, Kind};
use runtime::{Bus, Delivery, Service, Waiter, Woken};
use stage::WriterThread;
use stage::any::{Received, Receiver};

use crate::foxglove::{Foxglove, Stage};
use crate::queue::{Inlet, Item, queue};
use crate::sent::Sent;
use crate::topics::{Channel, Topics, counted_by};
use crate::writer::{Task, create, file_of_life, write_all};

/// With lossless delivery, longest wait for space in the queue.
const LONGEST_WAIT: Duration = Duration::from_mins(1);
/// Time to wait for the last heartbeats after the last result.
const LAST_HEARTBEATS: Duration = Duration::from_millis(500);

/// The settings of the process.
#[derive(Debug)]
pub struct Job {
    /// Path of the recording.
    pub file: PathBuf,
    /// Description of the run. Its session is replaced by the session of the service.
    pub about: About,
    /// The topics of the deployment.
    pub topics: Topics,
    /// Maximum size of the messages that wait to be written, in bytes.
    pub queue_bytes: u64,
    /// Cameras and joints for the Foxglove messages; `None` to write none.
    pub foxglove: Option<Stage>,
}

/// Writes every message, until the last result has been received or a stop is requested.
///
/// # Errors
///
/// Fails with [`ExitKind::Input`] if the file cannot be created, and with errors of the transport.
pub fn run(service: &Service, job: Job) -> Result<(), Failure> {
    let mut waiter = service.bus().waiter();
    let epoch = service.epoch();
    if epoch > 0 && is_complete(&file_of_life(&job.file, epoch - 1)) {
        // An earlier start of this process completed the recording, and was then killed.
        return rest(service, &waiter, &[]);
    }
    let kind = if epoch == 0 {
        ExitKind::Input
    } else {
        ExitKind::Run
    };
    let name = file_of_life(&job.file, epoch);
    let file = create(&name).map_err(|error| {
        let text = format!("cannot create the recording {}: {error}", name.display());
        Failure::new(kind, text)
    })?;
    let channels = job.topics.channels(job.about.without);
    let (inlet, outlet) = queue(channels.len(), job.queue_bytes);
    let mut recorder = Recorder::open(service.bus(), &channels, &job, &inlet, &mut waiter)?;
    recorder.session = service.session();
    recorder.service = Some(service);
    let task = Task {
        file,
        about: About {
            session: service.session(),
            ..job.about
        },
        topics: channels.iter().map(|channel| channel.name.clone()).collect(),
        foxglove: job.foxglove.map(Foxglove::new),
    };
    let thread = WriterThread::start(move || write_all(task, &outlet))?;
    let mut over = None;
    while waiter.wait(Duration::from_millis(50))? != Woken::Stop {
        recorder.receive_all()?;
        if recorder.is_over && over.get_or_insert_with(Instant::now).elapsed() > LAST_HEARTBEATS {
            break;
        }
    }
    recorder.receive_all()?;
    recorder.settle(&channels);
    let Recorder {
        receivers, is_over, ..
    } = recorder;
    drop(inlet);
    thread.finish(service)?;
    if !is_over {
        // A stop was requested before the end of the run: the file is valid, but not complete.
        return Ok(());
    }
    rest(service, &waiter, &receivers)
}

fn is_complete(file: &std::path::Path) -> bool {
    let Ok(mut file) = files::open(file) else {
        return false;
    };
    recording::scan(&mut file).is_ok_and(|recording| recording.extent.is_complete)
}

/// Reports that the work is finished, and waits for the stop request. Messages are still received and discarded, because with
/// lossless delivery a sender waits for space, and waits for its receivers before it begins.
fn rest(service: &Service, waiter: &Waiter, receivers: &[Receiver]) -> Result<(), Failure> {
    service.health().finished();
    while waiter.wait(Duration::from_millis(50))? != Woken::Stop {
        for receiver in receivers {
            while receiver.receive(|_| false)?.is_some() {}
        }
    }
    Ok(())
}

/// Receives all messages, and puts them into the queue.
pub(crate) struct Recorder<'a> {
    /// The process of the recorder; `None` for an onlooker (an observing process that is not part of the deployment), for which senders do
    /// not wait.
    service: Option<&'a Service>,
    /// Session of the recorded run.
    pub(crate) session: u64,
    inlet: &'a Inlet,
    receivers: Vec<Receiver>,
    sent: Vec<Sent>,
    /// For each topic, the topics whose messages it counts.
    counts: Vec<Vec<usize>>,
    n_evidence: Vec<u64>,
    /// True if the last result has been received.
    pub(crate) is_over: bool,
}

impl<'a> Recorder<'a> {
    /// Subscribes to all topics.
    pub(crate) fn open(
        bus: &Bus,
        channels: &[Channel],
        job: &Job,
        inlet: &'a Inlet,
        waiter: &mut Waiter,
    ) -> Result<Self, Failure> {
        let mut receivers = Vec::new();
        for channel in channels {
            let heads_only = job.about.without.pixels && channel.kind == Kind::Frame;
            let name = &channel.name;
            receivers.push(Receiver::open(bus, channel.kind, name, waiter, heads_only)?);
        }
        Ok(Self {
            service: None,
            session: 0,
            inlet,
            receivers,
            sent: vec![Sent::default(); channels.len()],
            counts: channels.iter().map(|channel| counted_by(channel, channels)).collect(),
            n_evidence: vec![0; channels.len()],
            is_over: false,
        })
    }

    /// Notes that the run began before the recording.
    pub(crate) fn begin_late(&mut self) {
        self.sent.fill(Sent::late());
    }

    /// Receives all waiting messages.
    pub(crate) fn receive_all(&mut self) -> Result<(), Failure> {
        for topic in 0..self.receivers.len() {
            while let Some(message) = self.receivers[topic].receive(|n| self.has_room(n))? {
                if message.session == self.session {
                    self.take(topic, message);
                }
            }
        }
        Ok(())
    }

    /// Returns true if there is space for a number of bytes. With lossless delivery, waits for space.
    fn has_room(&self, n_bytes: usize) -> bool {
        let Some(service) = self.service else {
            return self.inlet.has_room(n_bytes);
        };
        let begin = Instant::now();
        while !self.inlet.has_room(n_bytes) {
            let may_wait = service.delivery() == Delivery::Lossless
                && !self.inlet.is_broken()
                && !service.stop().is_requested()
                && begin.elapsed() < LONGEST_WAIT;
            if !may_wait {
                return false;
            }
            service.progress().tick();
            std::thread::sleep(Duration::from_millis(1));
        }
        true
    }

    fn take(&mut self, topic: usize, message: Received) {
        let kind = self.receivers[topic].kind();
        self.note(topic, &message);
        let health = self.service.map(Service::health);
        if let Some(health) = health {
            health.received(1);
        }
        self.is_over |= kind == Kind::Skeletons && message.status == Status::END;
        let log_time = now_nanos();
        // Some messages that end a stream have no send time.
        let sent_at = Some(message.sent_at).filter(|nanos| *nanos > 0);
        let entry = Entry {
            log_time,
            publish_time: sent_at.unwrap_or(log_time),
            ..Entry::default()
        };
        let Some(data) = message.data else {
            self.inlet.lost(topic, 1);
            self.dropped(Cause::QueueFull, 1);
            return;
        };
        if !self.inlet.push(Item { topic, entry, data }) {
            self.dropped(Cause::QueueFull, 1);
        } else if let Some(health) = health {
            health.sent(message.frame);
        }
    }

    fn dropped(&self, cause: Cause, n: u64) {
        if let Some(service) = self.service {
            service.health().dropped(cause, n);
        }
    }

    /// Counts a message, and processes its reports about other topics.
    fn note(&mut self, topic: usize, message: &Received) {
        if let Some([epoch, n_sent]) = message.life {
            for &other in &self.counts[topic] {
                self.sent[other].reported(epoch, n_sent);
            }
        }
        if message.has_evidence {
            self.n_evidence[topic] += 1;
            for &other in &self.counts[topic] {
                self.sent[other].reported(0, self.n_evidence[topic]);
            }
        }
        // Senders count all messages except the end of a stream, including frames without a picture.
        let counts = message.status != Status::END;
        if counts {
            self.sent[topic].received();
        }
    }

    /// Counts messages that were sent but not received. For every topic, logs how many messages are not in the file. Returns their total
    /// number.
    pub(crate) fn settle(&mut self, channels: &[Channel]) -> u64 {
        let mut n_lost = 0;
        for (topic, channel) in channels.iter().enumerate() {
            let missed = self.sent[topic].lost();
            self.inlet.lost(topic, missed);
            self.dropped(Cause::Busy, missed);
            let lost = self.inlet.n_lost(topic);
            n_lost += lost;
            if lost > 0 {
                tracing::warn!(
                    topic = channel.name,
                    lost,
                    "messages are missing from the recording"
                );
            }
        }
        n_lost
    }
}
