//! The loop: take every message in at once, and leave the writing to a thread of its own.
//!
//! Where the latest wins, nobody waits for the disk: what does not fit into the queue is counted.
//! Where nothing may be lost, this process makes its senders wait while the queue is full, but not
//! for ever.

use core::time::Duration;
use std::path::PathBuf;
use std::thread::{Builder, JoinHandle};
use std::time::Instant;

use messages::{Cause, Status, topic};
use recording::{About, Entry, Kind, Without};
use runtime::{Delivery, ExitKind, Failure, OrFail as _, Service, Waiter, Woken, now_nanos};

use crate::ear::{Ear, Heard};
use crate::queue::{Inlet, Item, queue};
use crate::sent::Sent;
use crate::writer::{Task, create, file_of_life, write_all};

/// How long room in the queue is waited for where nothing may be lost.
const LONGEST_WAIT: Duration = Duration::from_mins(1);
/// After the last result, the last signs of life take this long.
const LAST_SIGNS: Duration = Duration::from_millis(500);

/// What the process has to do.
#[derive(Debug)]
pub struct Job {
    /// Where to.
    pub file: PathBuf,
    /// Of which run; the session is that of the service.
    pub about: About,
    /// What there is to be heard.
    pub topics: Topics,
    /// Bytes that may wait to be written.
    pub queue_bytes: u64,
}

/// What decides the topics of a deployment.
#[derive(Debug, Clone)]
pub struct Topics {
    /// Number of views.
    pub n_views: usize,
    /// Number of fusion workers.
    pub n_workers: usize,
    /// Whether there are processes that send expected errors.
    pub has_quality: bool,
    /// Names of all processes.
    pub processes: Vec<String>,
}

/// A topic, and the process that sends there.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Channel {
    kind: Kind,
    name: String,
    /// None where its signs of life say nothing of this topic.
    sender: Option<String>,
}

impl Topics {
    /// All topics, signs of life first: who has heard of a message has it, if it came at all.
    fn channels(&self, without: Without) -> Vec<Channel> {
        let mut channels = Vec::new();
        let mut add = |kind, name, sender| channels.push(Channel { kind, name, sender });
        for process in &self.processes {
            add(Kind::Health, topic::health(process), None);
        }
        for view in 0..self.n_views {
            let from = |service: &str| Some(format!("{service}-{view}"));
            add(Kind::Frame, topic::frame(view), from("capture"));
            if !without.evidence {
                add(Kind::Evidence, topic::evidence(view), None);
            }
            add(Kind::ViewPose, topic::view_pose(view), from("pose"));
            if self.has_quality {
                add(
                    Kind::ViewQuality,
                    topic::view_quality(view),
                    from("quality"),
                );
            }
        }
        for worker in 0..self.n_workers {
            let sender = Some(format!("fuse-{worker}"));
            add(Kind::PairPose, topic::pair_pose(worker), sender);
        }
        add(
            Kind::Pose3d,
            topic::pose3d(),
            Some("triangulate".to_owned()),
        );
        channels
    }
}

/// Writes every message, until the last result has come or it is told to stop.
///
/// # Errors
///
/// [`ExitKind::Input`] if the file cannot be made, and what the transport says.
pub fn run(service: &Service, job: Job) -> Result<(), Failure> {
    let mut waiter = service.bus().waiter();
    let epoch = service.epoch();
    if epoch > 0 && is_complete(&file_of_life(&job.file, epoch - 1)) {
        // Killed after its work was done.
        return rest(service, &waiter, &[]);
    }
    let kind = if epoch == 0 {
        ExitKind::Input
    } else {
        ExitKind::Run
    };
    let name = file_of_life(&job.file, epoch);
    let file = create(&name).map_err(|error| {
        Failure::new(
            kind,
            format!("cannot make the recording {}: {error}", name.display()),
        )
    })?;
    let channels = job.topics.channels(job.about.without);
    let (inlet, outlet) = queue(channels.len(), job.queue_bytes);
    let mut tape = Tape::open(service, &channels, job.about.without, &inlet, &mut waiter)?;
    let task = Task {
        file,
        about: About {
            session: service.session(),
            ..job.about
        },
        topics: channels.iter().map(|it| it.name.clone()).collect(),
    };
    let thread = Builder::new()
        .name("writer".to_owned())
        .spawn(move || write_all(task, &outlet))
        .or_fail(ExitKind::Run)?;
    let mut over = None;
    while waiter.wait(Duration::from_millis(50))? != Woken::Stop {
        tape.listen()?;
        if tape.is_over && over.get_or_insert_with(Instant::now).elapsed() > LAST_SIGNS {
            break;
        }
    }
    tape.listen()?;
    tape.settle(&channels);
    let Tape { ears, is_over, .. } = tape;
    drop(inlet);
    finish(service, thread)?;
    if !is_over {
        // Told to end before the run did: what the file holds is whole, but it is not all.
        return Ok(());
    }
    rest(service, &waiter, &ears)
}

fn is_complete(file: &std::path::Path) -> bool {
    let Ok(mut file) = std::fs::File::open(file) else {
        return false;
    };
    recording::scan(&mut file).is_ok_and(|it| it.extent.is_complete)
}

/// Waits until everything is written.
fn finish(service: &Service, thread: JoinHandle<()>) -> Result<(), Failure> {
    while !thread.is_finished() {
        service.progress().tick();
        std::thread::sleep(Duration::from_millis(20));
    }
    let panicked = |_| Failure::new(ExitKind::Run, "the writing thread panicked");
    thread.join().map_err(panicked)
}

/// Says that all is done, and waits to be told so. What comes is taken in all the same: where nothing may be lost a
/// sender that speaks after the last result waits for room, and to be heard before it begins.
fn rest(service: &Service, waiter: &Waiter, ears: &[Ear]) -> Result<(), Failure> {
    service.health().finished();
    while waiter.wait(Duration::from_millis(50))? != Woken::Stop {
        for ear in ears {
            while ear.hear(|_| false)?.is_some() {}
        }
    }
    Ok(())
}

struct Tape<'a> {
    service: &'a Service,
    inlet: &'a Inlet,
    ears: Vec<Ear>,
    sent: Vec<Sent>,
    /// Of every topic, those that its signs of life or poses tell of.
    tells_of: Vec<Vec<usize>>,
    n_evidence: Vec<u64>,
    is_over: bool,
}

impl<'a> Tape<'a> {
    fn open(
        service: &'a Service,
        channels: &[Channel],
        without: Without,
        inlet: &'a Inlet,
        waiter: &mut Waiter,
    ) -> Result<Self, Failure> {
        let mut ears = Vec::new();
        for it in channels {
            let heads_only = without.pixels && it.kind == Kind::Frame;
            let ear = Ear::open(service.bus(), it.kind, &it.name, waiter, heads_only)?;
            ears.push(ear);
        }
        Ok(Self {
            service,
            inlet,
            ears,
            sent: vec![Sent::default(); channels.len()],
            tells_of: channels.iter().map(|it| told_by(it, channels)).collect(),
            n_evidence: vec![0; channels.len()],
            is_over: false,
        })
    }

    /// Takes in all that has come.
    fn listen(&mut self) -> Result<(), Failure> {
        for topic in 0..self.ears.len() {
            while let Some(heard) = self.ears[topic].hear(|n| self.has_room(n))? {
                if heard.session == self.service.session() {
                    self.take(topic, heard);
                }
            }
        }
        Ok(())
    }

    /// Whether so many bytes may come in; where nothing may be lost, waits for it.
    fn has_room(&self, n_bytes: usize) -> bool {
        let begin = Instant::now();
        while !self.inlet.has_room(n_bytes) {
            let may_wait = self.service.delivery() == Delivery::Lossless
                && !self.inlet.is_broken()
                && !self.service.stop().is_requested()
                && begin.elapsed() < LONGEST_WAIT;
            if !may_wait {
                return false;
            }
            self.service.progress().tick();
            std::thread::sleep(Duration::from_millis(1));
        }
        true
    }

    fn take(&mut self, topic: usize, heard: Heard) {
        let kind = self.ears[topic].kind();
        self.note(topic, kind, &heard);
        let health = self.service.health();
        health.received(1);
        self.is_over |= kind == Kind::Pose3d && heard.status == Status::END;
        let log_time = now_nanos();
        // Some ends do not say when they were sent.
        let said = Some(heard.sent_at).filter(|it| *it > 0);
        let entry = Entry {
            log_time,
            publish_time: said.unwrap_or(log_time),
            ..Entry::default()
        };
        let Some(data) = heard.data else {
            self.inlet.lost(topic, 1);
            health.dropped(Cause::QueueFull, 1);
            return;
        };
        if self.inlet.push(Item { topic, entry, data }) {
            health.sent(heard.frame);
        } else {
            health.dropped(Cause::QueueFull, 1);
        }
    }

    /// Notes what a message says of others, and that it came itself.
    fn note(&mut self, topic: usize, kind: Kind, heard: &Heard) {
        if let Some([epoch, n_sent]) = heard.life {
            for &other in &self.tells_of[topic] {
                self.sent[other].said(epoch, n_sent);
            }
        }
        if heard.has_evidence {
            self.n_evidence[topic] += 1;
            for &other in &self.tells_of[topic] {
                self.sent[other].said(0, self.n_evidence[topic]);
            }
        }
        // Senders do not count the end, and cameras not what they could not read.
        let counts = match kind {
            Kind::Frame => heard.status == Status::OK,
            _ => heard.status != Status::END,
        };
        if counts {
            self.sent[topic].came();
        }
    }

    /// Counts what was sent and never came, and says what of every topic is not in the file.
    fn settle(&mut self, channels: &[Channel]) {
        for (topic, it) in channels.iter().enumerate() {
            let missed = self.sent[topic].lost();
            self.inlet.lost(topic, missed);
            self.service.health().dropped(Cause::Busy, missed);
            let lost = self.inlet.n_lost(topic);
            if lost > 0 {
                tracing::warn!(topic = it.name, lost, "messages are not in the recording");
            }
        }
    }
}

/// The topics that a topic tells of: a process of what it sends, poses of the evidence they go with.
fn told_by(it: &Channel, channels: &[Channel]) -> Vec<usize> {
    let is_told = |other: &Channel| match it.kind {
        Kind::Health => {
            let sender = other.sender.as_ref();
            sender.is_some_and(|sender| topic::health(sender) == it.name)
        }
        Kind::ViewPose => {
            let view = |name: &str| name.rsplit('/').next().map(str::to_owned);
            other.kind == Kind::Evidence && view(&other.name) == view(&it.name)
        }
        _ => false,
    };
    let numbered = channels.iter().enumerate();
    numbered.filter(|it| is_told(it.1)).map(|it| it.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channels(without: Without) -> Vec<Channel> {
        let topics = Topics {
            n_views: 2,
            n_workers: 1,
            has_quality: true,
            processes: ["results", "pose-1", "fuse-0"].map(str::to_owned).into(),
        };
        topics.channels(without)
    }

    #[test]
    fn every_topic_is_heard_and_known_by_its_kind() {
        let all = channels(Without::default());
        assert_eq!(all.len(), 3 + 2 * 4 + 1 + 1);
        for it in &all {
            assert_eq!(Kind::of_topic(&it.name), Some(it.kind));
        }
        let without = channels(Without {
            evidence: true,
            pixels: true,
        });
        assert!(without.iter().all(|it| it.kind != Kind::Evidence));
        assert_eq!(without.len(), all.len() - 2);
    }

    #[test]
    fn a_process_tells_of_what_it_sends_and_poses_of_their_evidence() {
        let all = channels(Without::default());
        let told = |name: &str| {
            let it = all.iter().find(|it| it.name == name).unwrap();
            let told = told_by(it, &all).into_iter();
            told.map(|it| all[it].name.clone()).collect::<Vec<_>>()
        };
        assert_eq!(told(&topic::health("pose-1")), [topic::view_pose(1)]);
        assert_eq!(told(&topic::health("fuse-0")), [topic::pair_pose(0)]);
        assert_eq!(told(&topic::view_pose(1)), [topic::evidence(1)]);
        assert_eq!(told(&topic::health("results")), Vec::<String>::new());
    }
}
