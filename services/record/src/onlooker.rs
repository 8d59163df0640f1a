//! Records a running deployment from a process that is not part of it.

use core::time::Duration;
use std::time::Instant;

use failure::{ExitKind, Failure, OrFail as _};
use runtime::Bus;

use crate::foxglove::Foxglove;
use crate::queue::queue;
use crate::service::{Job, Recorder};
use crate::writer::{Task, create, write_all};

/// Interval at which messages are received. It is short, because the queues of pictures have space for only one picture.
const TURN: Duration = Duration::from_millis(4);
/// Time to wait for the last heartbeats after the last result.
const LAST_HEARTBEATS: Duration = Duration::from_millis(500);

/// Result of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kept {
    /// Messages that were sent during the recording but are not in the file.
    pub n_lost: u64,
}

/// Writes every message of a deployment until its last result, or until `is_over` returns true. Senders never wait: messages that do not
/// fit into the queues are missing from the file, and are counted.
///
/// * `bus`: the bus of a process that is not part of the deployment ([`Bus::as_onlooker`]).
/// * `session`: the session of the run.
/// * `is_over`: returns true to end the recording.
///
/// # Errors
///
/// Fails with [`ExitKind::Input`] if the file cannot be created, and with errors of the transport.
pub fn look_on(
    bus: &Bus,
    session: u64,
    job: Job,
    is_over: impl Fn() -> bool,
) -> Result<Kept, Failure> {
    let file = create(&job.file).map_err(|error| {
        let text = format!(
            "cannot create the recording {}: {error}",
            job.file.display()
        );
        Failure::new(ExitKind::Input, text)
    })?;
    let channels = job.topics.channels(job.about.without);
    let (inlet, outlet) = queue(channels.len(), job.queue_bytes);
    let mut recorder = Recorder::open(bus, &channels, &job, &inlet, &mut bus.waiter())?;
    recorder.session = session;
    recorder.begin_late();
    let names = channels.iter().map(|channel| channel.name.clone());
    let mut about = job.about;
    about.session = session;
    let task = Task {
        file,
        about,
        topics: names.collect(),
        foxglove: job.foxglove.map(Foxglove::new),
    };
    let thread = std::thread::Builder::new().name("writer".to_owned());
    let thread = thread.spawn(move || write_all(task, &outlet));
    let thread = thread.or_fail(ExitKind::Run)?;
    let mut ended = None;
    while !is_over() {
        recorder.receive_all()?;
        if recorder.is_over && ended.get_or_insert_with(Instant::now).elapsed() > LAST_HEARTBEATS {
            break;
        }
        std::thread::sleep(TURN);
    }
    recorder.receive_all()?;
    let n_lost = recorder.settle(&channels);
    drop(recorder);
    drop(inlet);
    let panicked = |_| Failure::new(ExitKind::Run, "the writing thread panicked");
    thread.join().map_err(panicked)?;
    Ok(Kept { n_lost })
}
