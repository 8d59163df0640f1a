//! The loop: join the views' answers to a frame, solve this worker's pairs or all views on their evidence, send.

use core::time::Duration;
use std::sync::Arc;

use fmp::Responses;
use join::{Cadence, Joined, Joiner, Last, Push};
use messages::{Cause, PairPose, Span, Stamp, Status, Timing, ViewPose, ViewQuality, topic};
use metrics::Passage;
use multiview::ViewPlan;
use pipeline::{Answer, FuseStep, PairAnswer, Support, Views};
use runtime::{
    Delivery, ExitKind, Failure, OrFail as _, Publisher, Service, Subscriber, Waiter, Woken,
    now_nanos,
};

use wire::{EvidenceView, Expected, WireError};

use crate::evidence::Evidence;
use crate::seen::Seen;

/// What one worker's process has to do.
#[derive(Debug)]
pub struct Job {
    /// The worker.
    pub worker: usize,
    /// What the views are solved in.
    pub views: Views,
    /// Its pairs: their index in the deployment, and their views. All views at once read the views of these.
    pub pairs: Vec<(usize, [usize; 2])>,
    /// The fusion step.
    pub step: Arc<FuseStep>,
    /// The views of the rig.
    pub plans: Vec<Arc<ViewPlan>>,
    /// Whether there are processes that send expected errors.
    pub has_quality: bool,
    /// How long a frame waits for expected errors where the latest wins.
    pub quality_deadline: Duration,
    /// How old the last ones of a view may be to be used instead.
    pub quality_max_age: Duration,
    /// Distance between the frames used, at least 1.
    pub frame_step: u64,
    /// Processes that take the answers.
    pub n_consumers: usize,
    /// How long a view may be silent.
    pub patience: Duration,
}

/// What a view says about a frame.
#[derive(Debug)]
enum Word {
    Pose(Box<ViewPose>),
    Quality(Box<ViewQuality>),
}

/// Answers every frame, until the footage of all views ends or it is told to stop.
///
/// # Errors
///
/// What the transport says.
pub fn run(service: &Service, job: &Job) -> Result<(), Failure> {
    let mut waiter = service.bus().waiter();
    let mut worker = Worker::open(service, job, &mut waiter)?;
    // A pair may be settled at once or after many solutions; levels are alike.
    let step = Arc::clone(&job.step);
    service.progress().follow(move || step.n_sweeps());
    let n = worker
        .publisher
        .wait_for_subscribers(job.n_consumers, service.patience_at_start(job.patience));
    tracing::info!(n, expected = job.n_consumers, "begins");
    loop {
        if waiter.wait(Duration::from_millis(20))? == Woken::Stop {
            return Ok(());
        }
        worker.listen()?;
        while let Some(joined) = worker.next_frame() {
            let begin = now_nanos();
            worker.note_waits(&joined, begin);
            worker.answer(&joined)?;
            worker.answered(&joined, now_nanos() - begin);
            if service.stop().is_requested() {
                return Ok(());
            }
            worker.listen()?;
        }
        if worker.joiner.is_over(now_nanos()) {
            return worker.end(&waiter);
        }
    }
}

struct Worker<'a> {
    service: &'a Service,
    job: &'a Job,
    poses: Vec<Subscriber<ViewPose>>,
    qualities: Vec<Subscriber<ViewQuality>>,
    /// By view; only those that a pair of this worker needs.
    evidence: Vec<Option<Evidence<'a>>>,
    publisher: Publisher<PairPose>,
    joiner: Joiner<Word>,
    /// The last expected errors of every view.
    expected: Last<Box<ViewQuality>>,
    cadence: Cadence,
}

impl<'a> Worker<'a> {
    fn open(service: &'a Service, job: &'a Job, waiter: &mut Waiter) -> Result<Self, Failure> {
        let bus = service.bus();
        let n_views = job.plans.len();
        let (mut poses, mut qualities, mut evidence) = (Vec::new(), Vec::new(), Vec::new());
        for view in 0..n_views {
            poses.push(bus.subscriber(&topic::view_pose(view), waiter)?);
            if job.has_quality {
                qualities.push(bus.subscriber(&topic::view_quality(view), waiter)?);
            }
            let needed = job.pairs.iter().any(|it| it.1.contains(&view));
            evidence.push(if needed {
                Some(Evidence::open(service, view, job.frame_step, waiter)?)
            } else {
                None
            });
        }
        let mut joiner = joiner(service.delivery(), n_views + qualities.len(), job.patience);
        if service.delivery() == Delivery::Realtime {
            let deadline = job.quality_deadline.as_nanos() as u64;
            (0..qualities.len()).for_each(|view| joiner.hurry(n_views + view, deadline));
        }
        Ok(Self {
            service,
            job,
            joiner,
            expected: Last::new(n_views, job.quality_max_age.as_nanos() as u64),
            cadence: Cadence::default(),
            poses,
            qualities,
            evidence,
            publisher: bus.publisher(&topic::pair_pose(job.worker))?,
        })
    }

    /// Takes in what has come. Inputs are numbered poses first, then expected errors.
    fn listen(&mut self) -> Result<(), Failure> {
        for evidence in self.evidence.iter_mut().flatten() {
            evidence.listen()?;
        }
        let n_views = self.poses.len();
        for view in 0..n_views {
            if self.poses[view].n_publishers() > 0 {
                self.joiner.alive(view, now_nanos());
            }
            while let Some(message) = self.poses[view].receive()? {
                let plan = &self.job.plans[view];
                let checked = self.wanted(view).check(&message.stamp, &message.timing);
                let read = || wire::candidates_from_message(&message, plan.model(), plan.layout());
                if self.accepts(checked.and_then(|()| read().map(drop)), "view-pose") {
                    let (stamp, status) = (message.stamp, message.status);
                    self.take(view, stamp, status, Word::Pose(Box::new(message)));
                }
            }
        }
        for view in 0..self.qualities.len() {
            if self.qualities[view].n_publishers() > 0 {
                self.joiner.alive(n_views + view, now_nanos());
            }
            while let Some(message) = self.qualities[view].receive()? {
                let n_parts = self.job.plans[view].model().n_parts();
                let checked = self.wanted(view).check(&message.stamp, &message.timing);
                let read = || expected_errors(&message, n_parts);
                if self.accepts(checked.and_then(|()| read().map(drop)), "view-quality") {
                    let (stamp, status) = (message.stamp, message.status);
                    let word = Word::Quality(Box::new(message));
                    self.take(n_views + view, stamp, status, word);
                }
            }
        }
        Ok(())
    }

    /// What a view's messages are checked against.
    fn wanted(&self, view: usize) -> Expected {
        Expected {
            session: self.service.session(),
            view,
            now_nanos: now_nanos(),
        }
    }

    /// Counts what is refused, before it can take the place of what is right.
    fn accepts(&self, checked: Result<(), WireError>, topic: &str) -> bool {
        checked
            .inspect_err(|error| self.refuse(error, topic))
            .is_ok()
    }

    fn refuse(&self, error: &WireError, topic: &str) {
        let health = self.service.health();
        health.refuse(error.refusal(), topic, error);
    }

    fn take(&mut self, input: usize, stamp: Stamp, status: Status, word: Word) {
        if status == Status::END {
            self.joiner.end(input);
            return;
        }
        self.service.health().received(1);
        if let Word::Quality(quality) = &word
            && status == Status::OK
        {
            // It may come too late for its own frame, and in time for the next.
            let view = input - self.poses.len();
            let captured_at = stamp.captured_at_nanos;
            self.expected
                .keep(view, stamp.frame, captured_at, quality.clone());
        }
        match self.joiner.push(input, stamp.frame, word, now_nanos()) {
            Push::Taken => {}
            Push::Late => self.service.health().dropped(Cause::Late, 1),
            Push::Full => self.service.health().dropped(Cause::QueueFull, 1),
        }
    }

    fn next_frame(&mut self) -> Option<Joined<Word>> {
        match self.service.delivery() {
            Delivery::Lossless => self.joiner.next(now_nanos()),
            Delivery::Realtime => {
                let wants = |it: &Joined<Word>| self.cadence.takes(it.frame / self.job.frame_step);
                let (joined, n_passed) = self.joiner.latest(now_nanos(), wants);
                self.service.health().dropped(Cause::Busy, n_passed);
                joined
            }
        }
    }

    /// How long every view's answer to a frame has been waiting, for others or for this worker.
    fn note_waits(&self, joined: &Joined<Word>, now: u64) {
        let health = self.service.health();
        for (view, item) in joined.items.iter().take(self.poses.len()).enumerate() {
            if let Some(Word::Pose(pose)) = item {
                let waited = now.saturating_sub(pose.timing.sent_at_nanos);
                health.spent(Span::WAITING, Some(view), waited);
            }
        }
        health.queued(self.joiner.n_pending());
    }

    fn answered(&mut self, joined: &Joined<Word>, busy_nanos: u64) {
        if let Some(stamp) = stamp_of(joined) {
            let nth = joined.frame / self.job.frame_step;
            self.cadence
                .answered(nth, stamp.captured_at_nanos, busy_nanos);
        }
    }

    fn answer(&mut self, joined: &Joined<Word>) -> Result<(), Failure> {
        let Some(stamp) = stamp_of(joined) else {
            return Ok(());
        };
        let (answers, sigma_ages) = self.answers(joined);
        // Of every view: one whose partner is missing would else wait for room for ever.
        for evidence in self.evidence.iter_mut().flatten() {
            evidence.advance(joined.frame)?;
        }
        let seen = Seen {
            stamp,
            evidence: self.evidence_of(joined.frame, &answers),
            answers,
            sigma_ages,
        };
        match self.job.views {
            Views::Pairs => self.pairs(&seen)?,
            Views::All => self.all_views(&seen)?,
        }
        drop(seen);
        // Room for the next, whatever its sender has left undone: it may have died half-way.
        for evidence in self.evidence.iter_mut().flatten() {
            evidence.advance(joined.frame + 1)?;
        }
        Ok(())
    }

    /// Solves this worker's pairs, one after the other.
    fn pairs(&self, seen: &Seen<'_>) -> Result<(), Failure> {
        let start = self.job.step.start(&seen.answers);
        for &(index, views) in &self.job.pairs {
            let received_at_nanos = now_nanos();
            self.service.progress().tick();
            let answer = match views.map(|view| seen.evidence[view].as_ref()) {
                [Some(first), Some(second)] => {
                    let evidence = [&first.responses(), &second.responses()];
                    self.job.step.pair(views, &seen.answers, evidence, &start)
                }
                _ => None,
            };
            let message = self.message(views, answer.as_ref(), seen.views_present())?;
            let sent_at = self.send(seen, index, message, received_at_nanos)?;
            self.passed(seen, received_at_nanos, sent_at);
        }
        Ok(())
    }

    /// Solves all views at once.
    fn all_views(&self, seen: &Seen<'_>) -> Result<(), Failure> {
        let received_at_nanos = now_nanos();
        self.service.progress().tick();
        let evidence = seen.evidence.iter();
        let evidence = evidence.map(|it| it.as_ref().map(EvidenceView::responses));
        let evidence: Vec<Option<Responses<'_>>> = evidence.collect();
        let step = &self.job.step;
        let answer = step.all_views(&seen.answers, &evidence, Support::Mean);
        let n_views = seen.answers.len();
        let present = seen.views_present();
        let messages = wire::all_views_to_messages(n_views, answer.as_ref(), present);
        // As for pairs: responses that are no numbers cost the frame, not the process.
        let messages = messages.or_else(|error| {
            self.refuse(&error, "evidence");
            let mut nothing =
                wire::all_views_to_messages(n_views, None, present).or_fail(ExitKind::Run)?;
            for message in &mut nothing {
                message.status = Status::BAD_INPUT;
            }
            Ok::<_, Failure>(nothing)
        })?;
        let mut first_sent_at = None;
        for (index, message) in messages.into_iter().enumerate() {
            let sent_at = self.send(seen, index, message, received_at_nanos)?;
            first_sent_at.get_or_insert(sent_at);
        }
        if let Some(sent_at) = first_sent_at {
            self.passed(seen, received_at_nanos, sent_at);
        }
        Ok(())
    }

    /// Notes where the time of an answer went.
    fn passed(&self, seen: &Seen<'_>, received_at: u64, sent_at: u64) {
        self.service.health().passed(&Passage {
            waiting: None,
            computing: sent_at - received_at,
            publishing: now_nanos() - sent_at,
            since_capture: Some(sent_at.saturating_sub(seen.stamp.captured_at_nanos)),
        });
    }

    /// Sends a message; returns when.
    fn send(
        &self,
        seen: &Seen<'_>,
        index: usize,
        mut message: PairPose,
        received_at_nanos: u64,
    ) -> Result<u64, Failure> {
        message.stamp = Stamp {
            view: index as u32,
            epoch: self.service.epoch(),
            ..seen.stamp
        };
        seen.expect(&mut message).or_fail(ExitKind::Run)?;
        message.timing = Timing {
            received_at_nanos,
            sent_at_nanos: now_nanos(),
        };
        self.publisher.send(&message)?;
        self.service.health().sent(seen.stamp.frame);
        Ok(message.timing.sent_at_nanos)
    }

    /// The answer of a pair. Responses that are no numbers make an energy that is none: their sender is
    /// to blame, and the frame is.
    fn message(
        &self,
        views: [usize; 2],
        answer: Option<&PairAnswer>,
        views_present: u32,
    ) -> Result<PairPose, Failure> {
        let message = wire::pair_to_message(views, answer, views_present);
        message.or_else(|error| {
            self.refuse(&error, "evidence");
            let nothing = wire::pair_to_message(views, None, views_present);
            let nothing = nothing.or_fail(ExitKind::Run)?;
            Ok(PairPose {
                status: Status::BAD_INPUT,
                ..nothing
            })
        })
    }

    /// The evidence of a frame, by view; what says nothing about the view's poses is refused.
    fn evidence_of(&self, frame: u64, answers: &[Option<Answer>]) -> Vec<Option<EvidenceView<'_>>> {
        let fits = |view: usize, it: &EvidenceView<'_>| {
            let answer = answers[view].as_ref();
            let is_within = answer.is_none_or(|answer| answer.is_within(&it.responses()));
            if !is_within {
                let refused = WireError::Mismatch {
                    field: "poses within the evidence",
                    got: 0,
                    expected: 1,
                };
                self.refuse(&refused, "evidence");
            }
            is_within
        };
        let views = self.evidence.iter().zip(&self.job.plans).enumerate();
        views
            .map(|(view, (evidence, plan))| {
                let read = evidence.as_ref()?.of(frame, plan);
                read.filter(|it| fits(view, it))
            })
            .collect()
    }

    /// What every view says, and how many frames old its expected errors are.
    fn answers(&self, joined: &Joined<Word>) -> (Vec<Option<Answer>>, Vec<u64>) {
        let mut ages = vec![0; self.poses.len()];
        let answers = (0..self.poses.len())
            .map(|view| {
                let plan = &self.job.plans[view];
                let Some(Word::Pose(pose)) = &joined.items[view] else {
                    return None;
                };
                let read = wire::candidates_from_message(pose, plan.model(), plan.layout());
                let candidates = read.ok().filter(|it| !it.is_empty())?;
                let mut answer = Answer {
                    candidates,
                    sigma_px: None,
                    tau_px: None,
                };
                if let Some((age, quality)) = self.quality_of(view, joined, &pose.stamp) {
                    ages[view] = age;
                    self.expect(&mut answer, view, quality);
                }
                Some(answer)
            })
            .collect();
        (answers, ages)
    }

    /// What was predicted for a view of this frame, else for the last one while that is fresh; and how
    /// many frames ago.
    fn quality_of<'b>(
        &'b self,
        view: usize,
        joined: &'b Joined<Word>,
        stamp: &Stamp,
    ) -> Option<(u64, &'b ViewQuality)> {
        if let Some(Word::Quality(quality)) = joined.items.get(self.poses.len() + view)? {
            return Some((0, quality));
        }
        let last = self
            .expected
            .of(view, joined.frame, stamp.captured_at_nanos);
        last.map(|(age, quality)| (age, &**quality))
    }

    /// Adds expected errors to an answer, if there are some that can be read.
    fn expect(&self, answer: &mut Answer, view: usize, quality: &ViewQuality) {
        let n_parts = self.job.plans[view].model().n_parts();
        if let Ok((sigma_px, tau_px)) = expected_errors(quality, n_parts) {
            (answer.sigma_px, answer.tau_px) = (sigma_px, tau_px);
        }
    }

    fn end(&self, waiter: &Waiter) -> Result<(), Failure> {
        let mut end = PairPose::default();
        end.stamp.session = self.service.session();
        end.status = Status::END;
        let say = || -> Result<(), Failure> {
            self.publisher.send(&end)?;
            Ok(())
        };
        say()?;
        self.service.health().finished();
        waiter.linger(|| self.publisher.n_connected(), say)
    }
}

/// The expected errors of the parts, and the thresholds that came with them.
type Errors = (Option<Vec<f32>>, Option<Vec<f32>>);

fn expected_errors(message: &ViewQuality, n_parts: usize) -> Result<Errors, WireError> {
    let sigma_px = wire::sigma_from_message(message, n_parts)?;
    Ok((sigma_px, wire::tau_from_message(message, n_parts)?))
}

fn joiner(delivery: Delivery, n_inputs: usize, patience: Duration) -> Joiner<Word> {
    let nanos = patience.as_nanos() as u64;
    match delivery {
        Delivery::Lossless => Joiner::lossless(n_inputs, nanos),
        Delivery::Realtime => Joiner::new(n_inputs, nanos),
    }
}

/// The stamp of the view that was captured first.
fn stamp_of(joined: &Joined<Word>) -> Option<Stamp> {
    let stamps = joined.items.iter().flatten().map(|it| match it {
        Word::Pose(it) => it.stamp,
        Word::Quality(it) => it.stamp,
    });
    stamps.min_by_key(|it| it.captured_at_nanos)
}
