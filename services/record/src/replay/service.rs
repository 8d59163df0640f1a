//! The replay loop: reads a message, waits until it is due, and sends it with an envelope of this run.

use core::time::Duration;
use std::fs::File;

use failure::{ExitKind, Failure, OrFail as _, now_nanos};
use messages::{Cause, Stamp, Status, Timing};
use recording::{Buffer, Entry, Envelope, Kind, ReadError, Recording, Track, in_order};
use runtime::{Place, SendError, Service, Woken};
use stage::Stage;
use stage::any::Sender;

use crate::replay::clock::Clock;
use crate::replay::job::{Job, Output};

/// Sends the recorded messages of some topics in the order in which they were sent, then the end of the stream.
///
/// Damaged messages are left out. The command that starts a replay has reported them.
///
/// # Errors
///
/// Fails with [`ExitKind::Input`] if the recording cannot be read or lacks a topic, and with errors of the transport.
pub fn run(service: &Service, job: &Job) -> Result<(), Failure> {
    let mut file = files::open(&job.file).or_fail(ExitKind::Input)?;
    let recording = recording::scan(&mut file).or_fail(ExitKind::Input)?;
    let recorded_session = recording.about.clone().or_fail(ExitKind::Input)?.session;
    let tracks = tracks(job, &recording)?;
    let order = in_order(&tracks);
    service
        .health()
        .set_total(tracks.first().map_or(0, |track| track.entries.len() as u64));
    let playback = Playback::open(service, job, &tracks, &recording)?;
    playback.wait_for_receivers();
    let mut place = Place::of(service.bus());
    let noted = place.noted().filter(|_| service.epoch() > 0);
    let [begin]: [u64; 1] = noted.unwrap_or([0]);
    let mut buffer = Buffer::default();
    let mut end = None;
    for (nth, (output, entry)) in (0_u64..).zip(&order).skip(begin as usize) {
        if playback.stage.wait(Duration::ZERO)? == Woken::Stop || !playback.wait_until_due(entry)? {
            return Ok(());
        }
        let kind = tracks[*output].kind;
        let message = match recording::read(&mut file, kind, entry, &mut buffer) {
            Ok(message) => message,
            Err(error @ ReadError::Read(_)) => return Err(error).or_fail(ExitKind::Input),
            Err(error) => {
                let (topic, frame) = (playback.topic(*output), entry.frame);
                tracing::debug!(%error, topic, frame, "a damaged message is left out");
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
        playback.send(*output, &message, &envelope)?;
        if let Err(error) = place.note([nth + 1]) {
            tracing::debug!(%error, "cannot save the position in the recording");
        }
    }
    let end = end.unwrap_or_else(|| end_after(&order, &tracks, &mut file, job, recorded_session));
    playback.end(&end)
}

/// Returns the outputs that have receivers.
fn received(job: &Job) -> impl Iterator<Item = &Output> {
    job.outputs.iter().filter(|output| output.n_receivers > 0)
}

/// Returns the tracks of the outputs that have receivers, in the order of the outputs.
fn tracks<'a>(job: &Job, recording: &'a Recording) -> Result<Vec<&'a Track>, Failure> {
    let tracks = received(job).map(|output| {
        recording.tracks.get(&output.topic).ok_or_else(|| {
            let message = format!(
                "{} has no messages of topic {}",
                job.file.display(),
                output.topic
            );
            Failure::new(ExitKind::Input, message)
        })
    });
    tracks.collect()
}

/// Returns the end of stream for a recording in which it is missing or damaged: one frame step after the last frame.
fn end_after(
    order: &[(usize, Entry)],
    tracks: &[&Track],
    file: &mut File,
    job: &Job,
    session: u64,
) -> Envelope {
    let last = (0..tracks.len()).filter_map(|output| {
        let kind = tracks[output].kind;
        let entries = order.iter().filter(|(other, _)| *other == output);
        let entries: Vec<_> = entries.map(|(_, entry)| *entry).collect();
        last_of(file, kind, &entries, [session, job.frame_step])
    });
    let mut stamp = last.max_by_key(|stamp| stamp.frame).unwrap_or_default();
    stamp.frame = stamp.frame.saturating_add(job.frame_step);
    Envelope {
        stamp,
        timing: Timing::default(),
        status: Status::END,
    }
}

/// Returns the last frame of a track; `None` if the track has no message of the session.
///
/// This is the frame of the last readable message, or of a damaged one after it. Most frame numbers in a damaged chunk are right, and the
/// last frames of a run would be missing if they were ignored. A number is only used if that many frames fit into the damaged messages.
///
/// * `recorded`: the session, and the distance between two frames.
fn last_of(file: &mut File, kind: Kind, entries: &[Entry], recorded: [u64; 2]) -> Option<Stamp> {
    let [session, frame_step] = recorded;
    let mut buffer = Buffer::default();
    let readable = entries.iter().enumerate().rev().find_map(|(nth, entry)| {
        let message = recording::read(file, kind, entry, &mut buffer).ok()?;
        let stamp = Envelope::of(kind, message.head)?.stamp;
        (stamp.session == session).then_some((nth, stamp))
    });
    let damaged = &entries[readable.map_or(0, |(nth, _)| nth + 1)..];
    let mut head = Vec::new();
    let claims = damaged.iter().filter_map(|entry| {
        let head = recording::read_head(file, kind, entry, &mut head).ok()?;
        let Envelope {
            mut stamp, status, ..
        } = Envelope::of(kind, head)?;
        if status == Status::END {
            stamp.frame = stamp.frame.saturating_sub(frame_step);
        }
        (stamp.session == session).then_some(stamp)
    });
    let claims: Vec<Stamp> = claims.collect();
    let first = claims.iter().min_by_key(|stamp| stamp.frame);
    let known = readable.map(|(_, stamp)| stamp).or(first.copied())?;
    let room = frame_step.saturating_mul(damaged.len() as u64);
    let most = known.frame.saturating_add(room);
    let believed = claims.into_iter().filter(|stamp| stamp.frame <= most);
    believed.chain([known]).max_by_key(|stamp| stamp.frame)
}

/// Returns the index of the view or worker at the end of a topic's name; 0 for a topic of all views.
fn view_in(topic: &str) -> u32 {
    let last = topic.rsplit('/').next();
    last.and_then(|text| text.parse().ok()).unwrap_or_default()
}

/// The outputs of the process, and the clock of the replay.
struct Playback<'a> {
    service: &'a Service,
    job: &'a Job,
    stage: Stage<'a, ()>,
    /// One sender for each output that has receivers.
    senders: Vec<Sender>,
    clock: Clock,
}

impl<'a> Playback<'a> {
    fn open(
        service: &'a Service,
        job: &'a Job,
        tracks: &[&Track],
        recording: &Recording,
    ) -> Result<Self, Failure> {
        let senders = received(job)
            .zip(tracks)
            .map(|(output, track)| Sender::open(service.bus(), track.kind, &output.topic));
        let [recorded, ended] = recording.span().unwrap_or([0; 2]);
        Ok(Self {
            service,
            job,
            stage: Stage::new(service, job.patience),
            senders: senders.collect::<Result<_, _>>()?,
            clock: Clock {
                recorded,
                length: ended.saturating_sub(recorded),
                planned: service.session(),
                pace: job.pace,
            },
        })
    }

    fn topic(&self, output: usize) -> &str {
        let output = received(self.job).nth(output);
        output.map_or("", |output| &output.topic)
    }

    fn wait_for_receivers(&self) {
        let patience = self.service.patience_at_start(self.job.patience);
        for (output, sender) in received(self.job).zip(&self.senders) {
            let expected = output.n_receivers;
            let n = sender.wait_for_subscribers(expected, patience);
            if n < expected {
                tracing::warn!(
                    topic = output.topic,
                    n,
                    expected,
                    "starting before all receivers are connected"
                );
            }
        }
    }

    /// Waits until a message is due. Returns `false` on a stop request.
    fn wait_until_due(&self, entry: &Entry) -> Result<bool, Failure> {
        let due = self.clock.due(entry.publish_time);
        loop {
            let left = due.saturating_sub(now_nanos());
            if left == 0 {
                return Ok(true);
            }
            if self.stage.wait(Duration::from_nanos(left))? == Woken::Stop {
                return Ok(false);
            }
        }
    }

    fn rebased(&self, recorded: &Envelope) -> Envelope {
        let (session, epoch) = (self.service.session(), self.service.epoch());
        self.clock.rebase(recorded, [session, u64::from(epoch), now_nanos()])
    }

    fn send(
        &self,
        output: usize,
        message: &recording::Message<'_>,
        envelope: &Envelope,
    ) -> Result<(), Failure> {
        let health = self.service.health();
        match self.senders[output].send(message, &self.rebased(envelope)) {
            Ok(()) if output == 0 => health.sent(envelope.stamp.frame),
            Ok(()) => {}
            Err(error @ SendError::TooLong { .. }) => {
                tracing::warn!(%error, frame = envelope.stamp.frame, "a message is too long, and is left out");
                health.dropped(Cause::Malformed, 1);
            }
            Err(error) => return Err(error.into()),
        }
        Ok(())
    }

    /// Sends the end of the stream on all outputs, then waits for the stop request.
    fn end(&self, end: &Envelope) -> Result<(), Failure> {
        let send_end = || -> Result<(), Failure> {
            let mut end = self.rebased(end);
            for (output, sender) in received(self.job).zip(&self.senders) {
                end.stamp.view = view_in(&output.topic);
                sender.end(&end)?;
            }
            Ok(())
        };
        let n_connected = || self.senders.first().map_or(0, Sender::n_connected);
        self.stage.end_with(n_connected, send_end)
    }
}

#[cfg(test)]
mod tests {
    use messages::topic;

    use super::*;

    #[test]
    fn the_view_of_an_end_of_stream_is_taken_from_its_topic() {
        assert_eq!(view_in(&topic::frame(0)), 0);
        assert_eq!(view_in(&topic::sightings(13)), 13);
        assert_eq!(view_in(&topic::pair_pose(2)), 2);
        assert_eq!(view_in(&topic::skeletons()), 0);
    }
}
