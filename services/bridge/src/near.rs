//! The bridge of the fusing host: publishes the messages of the other hosts for the frames of its run, and reports why a message is
//! missing.

mod listen;
mod publish;
mod remote;
mod report;

use core::time::Duration;
use std::sync::Arc;
use std::time::Instant;

use crate::hosts::{Arrivals, Gap, Place, Signal};
use crossbeam::channel::{Receiver, RecvTimeoutError};
use failure::{ExitKind, Failure, OrFail as _, now_nanos};
use messages::{Cause, Status};
use runtime::{Service, Woken};
use stage::Stage;

use crate::job::{Job, Near};
use crate::link::Link;
use crate::topics::Topics;
use listen::{Arrived, listen};
use publish::{Publisher, Times};
use remote::Remote;
use report::Report;

/// Interval at which the clocks of the other hosts are queried at the beginning.
const PING_SOON: Duration = Duration::from_millis(100);
/// Interval at which the clocks of the other hosts are queried later.
const PING_EVERY: Duration = Duration::from_millis(500);
const SOON: Duration = Duration::from_secs(10);
/// Interval at which the state is written.
const REPORT_EVERY: Duration = Duration::from_millis(250);
/// Tolerance for the time of a message that is in the future, in addition to one frame period, in nanoseconds.
const FUTURE: u64 = 100_000_000;
/// Longest sleep.
const LONGEST: Duration = Duration::from_millis(20);

/// A view of another host.
struct View {
    /// Index of the view.
    index: usize,
    remote: usize,
    publisher: Publisher,
    arrivals: Arrivals,
    /// Frame at which the stream ends, once it is known.
    end: Option<u64>,
    has_ended: bool,
}

struct Receiving<'a> {
    service: &'a Service,
    job: &'a Job,
    role: &'a Near,
    link: Arc<Link>,
    remotes: Arc<Vec<Remote>>,
    views: Vec<View>,
    report: Report,
    pinged: Option<Instant>,
    origin: u64,
}

/// Publishes the messages of the other hosts, until all views have ended or a stop is requested.
pub(crate) fn run(service: &Service, job: &Job, role: &Near) -> Result<(), Failure> {
    let stage: Stage<'_, ()> = Stage::new(service, role.patience);
    service.health().set_total(role.n_frames);
    let remotes: Arc<Vec<Remote>> = Arc::new(role.hosts.iter().map(Remote::new).collect());
    let views = views(service, job, role)?;
    let link = Arc::new(Link::open(&job.address).or_fail(ExitKind::Run)?);
    let origin = fastrand::u64(..);
    let report = Report::new(role.file.clone());
    let arrived = listen(
        service,
        (job, role),
        &link,
        &remotes,
        (origin, report.text()),
    )?;
    let patience = service.patience_at_start(role.patience);
    for it in &views {
        it.publisher.wait_for_receivers(
            role.n_receivers.get(it.index).copied().unwrap_or(0),
            patience,
        );
    }
    let mut it = Receiving {
        service,
        job,
        role,
        link,
        remotes,
        views,
        report,
        pinged: None,
        origin,
    };
    let begin = Instant::now();
    while !it.views.iter().all(|view| view.has_ended) {
        if stage.wait(Duration::ZERO)? == Woken::Stop {
            it.write_report(true);
            return Ok(());
        }
        it.ping(begin.elapsed());
        it.take(&arrived)?;
        it.give_up_overdue()?;
        it.watch();
        it.write_report(false);
    }
    it.write_report(true);
    let n_connected = || it.views.iter().map(|view| view.publisher.n_connected()).sum();
    let send_ends = || it.views.iter().try_for_each(|view| it.end(view));
    stage.end_with(n_connected, send_ends)
}

fn views(service: &Service, job: &Job, role: &Near) -> Result<Vec<View>, Failure> {
    let grid = job.grid(service.session());
    let period = job.period_nanos.round() as u64;
    let deadline = role.patience.as_nanos() as u64;
    // The frames that were due while the process was dead are lost.
    let next = if service.epoch() == 0 {
        0
    } else {
        grid.latest(now_nanos()) + 1
    };
    let mut views = Vec::new();
    for (remote, host) in role.hosts.iter().enumerate() {
        for &view in &host.views {
            let patience = [deadline + 2 * period, period + 50_000_000];
            views.push(View {
                index: view,
                remote,
                publisher: Publisher::open(service, job, view)?,
                arrivals: Arrivals::new(grid, patience, role.n_frames, next),
                end: None,
                has_ended: false,
            });
        }
    }
    Ok(views)
}

impl Receiving<'_> {
    /// Queries the clocks of all hosts.
    fn ping(&mut self, since: Duration) {
        let every = if since < SOON { PING_SOON } else { PING_EVERY };
        if self.pinged.is_some_and(|at| at.elapsed() < every) {
            return;
        }
        self.pinged = Some(Instant::now());
        let topics = Topics::of(&self.job.address.deployment);
        for remote in self.remotes.iter() {
            let ping = Signal::Ping {
                origin: self.origin,
                asked_at: now_nanos(),
            };
            let bytes = ping.to_bytes().to_vec();
            self.link.send(&topics.down(&remote.name), bytes, true);
        }
    }

    /// Waits for messages, and publishes them.
    fn take(&mut self, arrived: &Receiver<Arrived>) -> Result<(), Failure> {
        let mut limit = self.until_due();
        loop {
            match arrived.recv_timeout(limit) {
                Ok(it) => self.publish(&it)?,
                Err(RecvTimeoutError::Timeout) => return Ok(()),
                Err(RecvTimeoutError::Disconnected) => {
                    let message = "the threads that receive from the link have ended";
                    return Err(Failure::new(ExitKind::Run, message));
                }
            }
            limit = Duration::ZERO;
        }
    }

    /// Returns the time until the next frame of a view is given up.
    fn until_due(&self) -> Duration {
        let now = now_nanos();
        let open = self.views.iter().filter(|view| !view.has_ended);
        let due = open.map(|view| {
            let is_there = self.remotes[view.remote].is_there(now);
            view.arrivals.due_nanos(is_there).saturating_sub(now)
        });
        let due = Duration::from_nanos(due.min().unwrap_or(0));
        due.clamp(Duration::from_millis(1), LONGEST)
    }

    fn publish(&mut self, arrived: &Arrived) -> Result<(), Failure> {
        let health = self.service.health();
        health.received(1);
        let Some(index) = self.views.iter().position(|view| view.index == arrived.view()) else {
            return Ok(());
        };
        let remote = &self.remotes[self.views[index].remote];
        let Some(clock) = remote.estimate(now_nanos()) else {
            // The clock of the host is not known yet, so the message cannot be assigned to a frame. After the end, none can.
            remote.count_without_clock();
            if arrived.head.status == Status::END {
                let it = &mut self.views[index];
                it.end = Some(it.arrivals.next());
                return self.end_if_over(index);
            }
            return Ok(());
        };
        let (service, job) = (self.service, self.job);
        let it = &mut self.views[index];
        let instant = clock.ours(arrived.head.instant_nanos);
        // The clock is not known yet, or the time of the host is wrong. This message is not a reason to give up frames that are not due
        // yet.
        let soon = now_nanos().saturating_add(job.period_nanos as u64 + FUTURE);
        if instant > soon && arrived.head.status != Status::END {
            remote.malformed(&"the message has an instant in the future");
            return Ok(());
        }
        let grid = job.grid(service.session());
        let times = |nth: u64| Times::of(&arrived.head, &clock, instant, grid.at(nth));
        if arrived.is_beside() {
            let nth = it.arrivals.nearest(instant);
            return it.publisher.send(service, job.frame(nth), arrived, &times(nth));
        }
        if arrived.head.status == Status::END {
            let end = it.arrivals.nearest(instant).min(self.role.n_frames).max(it.arrivals.next());
            it.end = Some(end);
            return self.end_if_over(index);
        }
        match it.arrivals.place(instant) {
            Place::Frame(nth) => {
                while it.arrivals.next() < nth {
                    let frame = job.frame(it.arrivals.next());
                    it.publisher.send_nothing(service, frame, Gap::LeftOut.status())?;
                    it.arrivals.gave_up(Gap::LeftOut);
                }
                it.publisher.send(service, job.frame(nth), arrived, &times(nth))?;
                it.arrivals.used();
                health.sent(job.frame(nth));
                self.report.took(it.index, arrived, &clock);
            }
            Place::Late => health.dropped(Cause::Late, 1),
            Place::Surplus => {}
        }
        self.end_if_over(index)
    }

    /// Gives up frames whose message is overdue, and sends the reason.
    fn give_up_overdue(&mut self) -> Result<(), Failure> {
        let now = now_nanos();
        for index in 0..self.views.len() {
            let it = &mut self.views[index];
            let is_there = self.remotes[it.remote].is_there(now);
            while !it.has_ended
                && let Some(gap) = it.arrivals.overdue(now, is_there)
            {
                let frame = self.job.frame(it.arrivals.next());
                it.publisher.send_nothing(self.service, frame, gap.status())?;
                it.arrivals.gave_up(gap);
                self.service.health().sent(frame);
            }
            self.end_if_over(index)?;
        }
        Ok(())
    }

    /// Ends the stream of a view once all its frames are published.
    fn end_if_over(&mut self, index: usize) -> Result<(), Failure> {
        let it = &mut self.views[index];
        let is_over = it.arrivals.is_over() || it.end.is_some_and(|end| it.arrivals.next() >= end);
        if !is_over || it.has_ended {
            return Ok(());
        }
        it.end = Some(it.arrivals.next());
        it.has_ended = true;
        self.end(&self.views[index])
    }

    fn end(&self, view: &View) -> Result<(), Failure> {
        let frame = self.job.frame(view.end.unwrap_or(view.arrivals.next()));
        view.publisher.send_nothing(self.service, frame, Status::END)
    }

    /// Logs when a host appears or disappears, and when the clock of a host is not known accurately enough.
    fn watch(&self) {
        for remote in self.remotes.iter() {
            remote.watch(
                now_nanos(),
                self.job.period_nanos,
                self.role.max_clock_share,
            );
        }
    }

    fn write_report(&mut self, is_last: bool) {
        if !is_last && !self.report.is_due(REPORT_EVERY) {
            return;
        }
        let views = self.views.iter().map(|view| (view.index, view.remote, view.arrivals.tally()));
        self.report.write(&self.remotes, &views.collect::<Vec<_>>(), is_last);
    }
}
