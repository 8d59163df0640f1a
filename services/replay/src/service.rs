//! The loop: read a message, wait until it is due, send it in an envelope of this run.

use core::time::Duration;
use std::fs::File;
use std::path::PathBuf;

use messages::{Cause, Stamp, Status, Timing};
use recording::{Entry, Envelope, ReadError, Recording, Track, in_order};
use runtime::{
    ExitKind, Failure, OrFail as _, Place, SendError, Service, Waiter, Woken, now_nanos,
};

use crate::Pace;
use crate::clock::Clock;
use stage::any::Sender;

/// What the process has to do.
#[derive(Debug)]
pub struct Job {
    /// The recording.
    pub file: PathBuf,
    /// What the process that it stands in for sends. The first says when it is over.
    pub lines: Vec<Line>,
    /// How fast.
    pub pace: Pace,
    /// Distance between the frames used, for the end of a recording that lacks it.
    pub frame_step: u64,
    /// How long receivers are waited for.
    pub patience: Duration,
}

/// A topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Line {
    /// Its name.
    pub topic: String,
    /// Processes that take its messages; with none, nothing is sent there.
    pub n_consumers: usize,
}

/// Sends what the recording holds of some topics, in the order in which it was sent, then its end. A message that is
/// not what was written is left out: who starts the replay has named it.
///
/// # Errors
///
/// [`ExitKind::Input`] if the recording cannot be read, or lacks a topic; and what the transport says.
pub fn run(service: &Service, job: &Job) -> Result<(), Failure> {
    let mut file = File::open(&job.file).or_fail(ExitKind::Input)?;
    let recording = recording::scan(&mut file).or_fail(ExitKind::Input)?;
    let recorded_session = recording.about.clone().or_fail(ExitKind::Input)?.session;
    let tracks = tracks(job, &recording)?;
    let order = in_order(&tracks);
    service
        .health()
        .set_total(tracks.first().map_or(0, |it| it.entries.len() as u64));
    let speaker = Speaker::open(service, job, &tracks, &recording)?;
    speaker.wait_for_all();
    let mut place = Place::of(service.bus());
    let noted = place.noted().filter(|_| service.epoch() > 0);
    let [begin]: [u64; 1] = noted.unwrap_or([0]);
    let mut buffer = Vec::new();
    let mut end = None;
    for (nth, (line, entry)) in (0_u64..).zip(&order).skip(begin as usize) {
        if speaker.waiter.wait(Duration::ZERO)? == Woken::Stop || !speaker.wait_until_due(entry)? {
            return Ok(());
        }
        let kind = tracks[*line].kind;
        let message = match recording::read(&mut file, kind, entry, &mut buffer) {
            Ok(message) => message,
            Err(error @ ReadError::Read(_)) => return Err(error).or_fail(ExitKind::Input),
            Err(error) => {
                let (topic, frame) = (speaker.topic(*line), entry.frame);
                tracing::debug!(%error, topic, frame, "damaged: left out");
                service.health().dropped(Cause::Malformed, 1);
                continue;
            }
        };
        let Some(envelope) = Envelope::of(kind, message.head) else {
            continue;
        };
        if envelope.stamp.session != recorded_session {
            continue;
        }
        if envelope.status == Status::END {
            end = Some(envelope);
            continue;
        }
        speaker.say(*line, &message, &envelope)?;
        if let Err(error) = place.note([nth + 1]) {
            tracing::debug!(%error, "cannot note the place in the recording");
        }
    }
    let end = end.unwrap_or_else(|| after(&order, &tracks, &mut file, job.frame_step));
    speaker.end(&end)
}

/// The tracks of the lines that anybody takes, in their order.
fn tracks<'a>(job: &Job, recording: &'a Recording) -> Result<Vec<&'a Track>, Failure> {
    let lines = job.lines.iter().filter(|it| it.n_consumers > 0);
    let tracks = lines.map(|it| {
        recording.tracks.get(&it.topic).ok_or_else(|| {
            let message = format!("{} holds nothing of {}", job.file.display(), it.topic);
            Failure::new(ExitKind::Input, message)
        })
    });
    tracks.collect()
}

/// The end of a recording that lacks it: the frame after the last of the first line.
fn after(
    order: &[(usize, Entry)],
    tracks: &[&Track],
    file: &mut File,
    frame_step: u64,
) -> Envelope {
    let mut end = Envelope {
        stamp: Stamp::default(),
        timing: Timing::default(),
        status: Status::END,
    };
    let last = order.iter().rev().find(|it| it.0 == 0);
    if let (Some((_, entry)), Some(track)) = (last, tracks.first()) {
        let mut buffer = Vec::new();
        let read = recording::read(file, track.kind, entry, &mut buffer).ok();
        if let Some(it) = read.and_then(|it| Envelope::of(track.kind, it.head)) {
            end.stamp = it.stamp;
            end.stamp.frame = it.stamp.frame.saturating_add(frame_step);
        }
    }
    end
}

struct Speaker<'a> {
    service: &'a Service,
    job: &'a Job,
    senders: Vec<Sender>,
    clock: Clock,
    waiter: Waiter,
}

impl<'a> Speaker<'a> {
    fn open(
        service: &'a Service,
        job: &'a Job,
        tracks: &[&Track],
        recording: &Recording,
    ) -> Result<Self, Failure> {
        let lines = job.lines.iter().filter(|it| it.n_consumers > 0);
        let senders = lines
            .zip(tracks)
            .map(|(line, track)| Sender::open(service.bus(), track.kind, &line.topic));
        let [recorded, ended] = recording.span().unwrap_or([0; 2]);
        Ok(Self {
            service,
            job,
            senders: senders.collect::<Result<_, _>>()?,
            clock: Clock {
                recorded,
                length: ended.saturating_sub(recorded),
                planned: service.session(),
                pace: job.pace,
            },
            waiter: service.bus().waiter(),
        })
    }

    fn topic(&self, line: usize) -> &str {
        let mut lines = self.job.lines.iter().filter(|it| it.n_consumers > 0);
        lines.nth(line).map_or("", |it| &it.topic)
    }

    fn wait_for_all(&self) {
        let patience = self.service.patience_at_start(self.job.patience);
        let lines = self.job.lines.iter().filter(|it| it.n_consumers > 0);
        for (line, sender) in lines.zip(&self.senders) {
            let n = sender.wait_for_subscribers(line.n_consumers, patience);
            if n < line.n_consumers {
                let expected = line.n_consumers;
                tracing::warn!(
                    topic = line.topic,
                    n,
                    expected,
                    "beginning without all receivers"
                );
            }
        }
    }

    /// `false` if the process was asked to stop.
    fn wait_until_due(&self, entry: &Entry) -> Result<bool, Failure> {
        let due = self.clock.due(entry.publish_time);
        loop {
            let left = due.saturating_sub(now_nanos());
            if left == 0 {
                return Ok(true);
            }
            if self.waiter.wait(Duration::from_nanos(left))? == Woken::Stop {
                return Ok(false);
            }
        }
    }

    fn rebased(&self, it: &Envelope) -> Envelope {
        let (session, epoch) = (self.service.session(), self.service.epoch());
        self.clock
            .rebase(it, [session, u64::from(epoch), now_nanos()])
    }

    fn say(
        &self,
        line: usize,
        message: &recording::Message<'_>,
        envelope: &Envelope,
    ) -> Result<(), Failure> {
        let health = self.service.health();
        match self.senders[line].send(message, &self.rebased(envelope)) {
            Ok(()) if line == 0 => health.sent(envelope.stamp.frame),
            Ok(()) => {}
            Err(error @ SendError::TooLong { .. }) => {
                tracing::warn!(%error, frame = envelope.stamp.frame, "left out");
                health.dropped(Cause::Malformed, 1);
            }
            Err(error) => return Err(error.into()),
        }
        Ok(())
    }

    fn end(&self, it: &Envelope) -> Result<(), Failure> {
        let say = || -> Result<(), Failure> {
            let end = self.rebased(it);
            for sender in &self.senders {
                sender.end(&end)?;
            }
            Ok(())
        };
        say()?;
        self.service.health().finished();
        let n_connected = || self.senders.first().map_or(0, Sender::n_connected);
        self.waiter.linger(n_connected, say)
    }
}
