//! The loop: join the pairs' answers to a frame, settle left and right, triangulate, send.

use core::time::Duration;
use std::sync::Arc;

use join::{Joined, Joiner, Push};
use messages::{Cause, PairPose, Pose3d, Stamp, Status, Timing, ViewPose, topic};
use metrics::Passage;
use multiview::ViewPlan;
use pipeline::{AllViewsAnswer, Answer, PairAnswer, Skeleton, SkeletonStep, Views};
use runtime::{
    Delivery, ExitKind, Failure, OrFail as _, Publisher, Service, Subscriber, Waiter, Woken,
    now_nanos,
};
use wire::{Expected, WireError};

/// What the process has to do.
#[derive(Debug)]
pub struct Job {
    /// The views of the rig.
    pub plans: Vec<Arc<ViewPlan>>,
    /// What the views are solved in.
    pub views: Views,
    /// The pairs of the deployment, or a view beside each that is not the first, which are dealt to the workers in
    /// turn.
    pub pairs: Vec<[usize; 2]>,
    /// Number of fusion workers.
    pub n_workers: usize,
    /// Processes that take the result.
    pub n_consumers: usize,
    /// How long a view or a worker may be silent.
    pub patience: Duration,
}

/// What is said about a frame: by a view, or by a pair.
#[derive(Debug)]
enum Word {
    Pose(Box<ViewPose>),
    Pair(Box<PairPose>),
}

/// Answers every frame, until all inputs end or it is told to stop.
///
/// * `step`: remembers the facing of the frame before.
///
/// # Errors
///
/// What the transport says.
pub fn run(service: &Service, job: &Job, mut step: SkeletonStep) -> Result<(), Failure> {
    let mut waiter = service.bus().waiter();
    let mut stage = Stage::open(service, job, &mut waiter)?;
    let n = stage
        .publisher
        .wait_for_subscribers(job.n_consumers, service.patience_at_start(job.patience));
    tracing::info!(n, expected = job.n_consumers, "begins");
    while waiter.wait(Duration::from_millis(20))? != Woken::Stop {
        stage.listen()?;
        while let Some(joined) = stage.joiner.next(now_nanos()) {
            stage.answer(&joined, &mut step)?;
        }
        if stage.joiner.is_over(now_nanos()) {
            return stage.end(&waiter);
        }
    }
    Ok(())
}

struct Stage<'a> {
    service: &'a Service,
    job: &'a Job,
    poses: Vec<Subscriber<ViewPose>>,
    pairs: Vec<Subscriber<PairPose>>,
    publisher: Publisher<Pose3d>,
    joiner: Joiner<Word>,
}

impl<'a> Stage<'a> {
    fn open(service: &'a Service, job: &'a Job, waiter: &mut Waiter) -> Result<Self, Failure> {
        let bus = service.bus();
        let (mut poses, mut pairs) = (Vec::new(), Vec::new());
        for view in 0..job.plans.len() {
            poses.push(bus.subscriber(&topic::view_pose(view), waiter)?);
        }
        for worker in 0..job.n_workers {
            pairs.push(bus.subscriber(&topic::pair_pose(worker), waiter)?);
        }
        Ok(Self {
            service,
            job,
            joiner: joiner(
                service.delivery(),
                poses.len() + job.pairs.len(),
                job.patience,
            ),
            poses,
            pairs,
            publisher: bus.publisher(&topic::pose3d())?,
        })
    }

    /// Takes in what has come. Inputs are numbered views first, then pairs.
    fn listen(&mut self) -> Result<(), Failure> {
        let n_views = self.poses.len();
        for view in 0..n_views {
            if self.poses[view].n_publishers() > 0 {
                self.joiner.alive(view, now_nanos());
            }
            while let Some(message) = self.poses[view].receive()? {
                if let Err(error) = self.check_pose(view, &message) {
                    self.refuse(&error, "view-pose");
                } else if message.status == Status::END {
                    self.joiner.end(view);
                } else {
                    self.take(view, message.stamp.frame, Word::Pose(Box::new(message)));
                }
            }
        }
        for worker in 0..self.pairs.len() {
            let its = (worker..self.job.pairs.len()).step_by(self.job.n_workers);
            if self.pairs[worker].n_publishers() > 0 {
                let now = now_nanos();
                its.clone()
                    .for_each(|pair| self.joiner.alive(n_views + pair, now));
            }
            while let Some(message) = self.pairs[worker].receive()? {
                if let Err(error) = self.check_pair(worker, &message) {
                    self.refuse(&error, "pair-pose");
                } else if message.status == Status::END {
                    its.clone().for_each(|pair| self.joiner.end(n_views + pair));
                } else {
                    let input = n_views + message.stamp.view as usize;
                    self.take(input, message.stamp.frame, Word::Pair(Box::new(message)));
                }
            }
        }
        Ok(())
    }

    fn expected(&self, view: usize) -> Expected {
        Expected {
            session: self.service.session(),
            view,
            now_nanos: now_nanos(),
        }
    }

    /// All of it, before it can take the place of what is right.
    fn check_pose(&self, view: usize, message: &ViewPose) -> Result<(), WireError> {
        let expected = self.expected(view);
        expected.check(&message.stamp, &message.timing)?;
        let plan = &self.job.plans[view];
        wire::candidates_from_message(message, plan.model(), plan.layout()).map(drop)
    }

    /// The end is about all pairs of the worker, and names none.
    fn check_pair(&self, worker: usize, message: &PairPose) -> Result<(), WireError> {
        let expected = self.expected(worker);
        if message.status == Status::END {
            return expected.check_end(&message.stamp, &message.timing);
        }
        expected.check_pair(&message.stamp, &message.timing, self.job.n_workers)?;
        match self.job.views {
            Views::Pairs => wire::check_views(message, &self.job.pairs)?,
            Views::All => wire::check_all_views(message, self.job.plans.len())?,
        }
        wire::pair_from_message(message, &self.job.plans)?;
        let n_parts = self.job.plans.first().map_or(0, |it| it.model().n_parts());
        for side in 0..2 {
            wire::sigma_from_pair(message, side, n_parts)?;
        }
        Ok(())
    }

    fn refuse(&self, error: &WireError, topic: &str) {
        let health = self.service.health();
        health.refuse(error.refusal(), topic, error);
    }

    fn take(&mut self, input: usize, frame: u64, word: Word) {
        self.service.health().received(1);
        match self.joiner.push(input, frame, word, now_nanos()) {
            Push::Taken => {}
            Push::Late => self.service.health().dropped(Cause::Late, 1),
            Push::Full => self.service.health().dropped(Cause::QueueFull, 1),
        }
    }

    fn answer(&self, joined: &Joined<Word>, step: &mut SkeletonStep) -> Result<(), Failure> {
        let received_at_nanos = now_nanos();
        let answers = self.answers(joined);
        let present = (0..answers.len()).filter(|it| answers[*it].is_some());
        let views_present = present.fold(0, |mask, view| mask | 1_u32 << view);
        let skeleton = self.skeleton(joined, &answers, step);
        let mut message =
            wire::skeleton_to_message(&skeleton, views_present).or_fail(ExitKind::Run)?;
        message.stamp = Stamp {
            session: self.service.session(),
            frame: joined.frame,
            captured_at_nanos: captured_at(joined),
            view: 0,
            epoch: self.service.epoch(),
        };
        message.timing = Timing {
            received_at_nanos,
            sent_at_nanos: now_nanos(),
        };
        self.publisher.send(&message)?;
        let health = self.service.health();
        health.sent(joined.frame);
        health.queued(self.joiner.n_pending());
        let sent_at = message.timing.sent_at_nanos;
        let waited = |last: u64| received_at_nanos.saturating_sub(last);
        health.passed(&Passage {
            waiting: last_sent_at(joined).map(waited),
            computing: sent_at - received_at_nanos,
            publishing: now_nanos() - sent_at,
            since_capture: Some(sent_at.saturating_sub(message.stamp.captured_at_nanos)),
        });
        Ok(())
    }

    /// Settles a frame by what was fused, and by what its views found alone.
    fn skeleton(
        &self,
        joined: &Joined<Word>,
        answers: &[Option<Answer>],
        step: &mut SkeletonStep,
    ) -> Skeleton {
        let mut pairs = self.fused(joined);
        // A view may have been used whose own answer did not come.
        let is_here = |view: usize| answers[view].is_some();
        match self.job.views {
            Views::Pairs => {
                pairs.retain(|it| it.views.iter().all(|&view| is_here(view)));
                step.run(answers, &pairs)
            }
            Views::All => match all_views(&pairs).and_then(|it| it.only(is_here)) {
                Some(found) => step.run_all_views(answers, &found),
                None => step.run(answers, &[]),
            },
        }
    }

    /// What came from the workers.
    fn fused(&self, joined: &Joined<Word>) -> Vec<PairAnswer> {
        let words = joined.items.iter().flatten();
        let pairs = words.filter_map(|it| match it {
            Word::Pair(it) => wire::pair_from_message(it, &self.job.plans)
                .inspect_err(|error| tracing::warn!(%error, "unreadable pair"))
                .ok()
                .flatten(),
            Word::Pose(_) => None,
        });
        pairs.collect()
    }

    fn answers(&self, joined: &Joined<Word>) -> Vec<Option<Answer>> {
        let views = self.job.plans.iter().zip(&joined.items);
        views
            .enumerate()
            .map(|(view, (plan, item))| {
                let Some(Word::Pose(pose)) = item else {
                    return None;
                };
                let candidates = wire::candidates_from_message(pose, plan.model(), plan.layout())
                    .ok()
                    .filter(|it| !it.is_empty())?;
                Some(Answer {
                    candidates,
                    sigma_px: expected_errors(joined, view, plan.model().n_parts()),
                    tau_px: None,
                })
            })
            .collect()
    }

    /// Takes in what comes after the end.
    fn discard(&self) {
        for it in &self.poses {
            while it.receive().is_ok_and(|it| it.is_some()) {}
        }
        for it in &self.pairs {
            while it.receive().is_ok_and(|it| it.is_some()) {}
        }
    }

    fn end(&self, waiter: &Waiter) -> Result<(), Failure> {
        let say = || -> Result<(), Failure> {
            let end = wire::end_of_results(self.service.session());
            self.publisher.send(&end)?;
            Ok(())
        };
        say()?;
        self.service.health().finished();
        // Who was given up on as silent may speak again; nobody shall wait for room here.
        let n_connected = || {
            self.discard();
            self.publisher.n_connected()
        };
        waiter.linger(n_connected, say)
    }
}

/// What fusion knew of a view's errors; the latest prediction where its workers knew different ones.
fn expected_errors(joined: &Joined<Word>, view: usize, n_parts: usize) -> Option<Vec<f32>> {
    let words = joined.items.iter().flatten();
    let predicted = words.filter_map(|it| {
        let Word::Pair(pair) = it else { return None };
        let side = pair.views.iter().position(|it| *it as usize == view)?;
        wire::sigma_from_pair(pair, side, n_parts).ok().flatten()
    });
    predicted
        .min_by_key(|(age, _)| *age)
        .map(|(_, sigma)| sigma)
}

/// What all views found at once, put together.
fn all_views(pairs: &[PairAnswer]) -> Option<AllViewsAnswer> {
    wire::all_views_from_pairs(pairs)
        .inspect_err(|error| tracing::warn!(%error, "unreadable answer of all views"))
        .ok()
        .flatten()
}

fn joiner(delivery: Delivery, n_inputs: usize, patience: Duration) -> Joiner<Word> {
    let nanos = patience.as_nanos() as u64;
    match delivery {
        Delivery::Lossless => Joiner::lossless(n_inputs, nanos),
        Delivery::Realtime => Joiner::new(n_inputs, nanos),
    }
}

/// When the last of what a frame's result is made of was sent.
fn last_sent_at(joined: &Joined<Word>) -> Option<u64> {
    let timings = joined.items.iter().flatten().map(|it| match it {
        Word::Pose(it) => it.timing,
        Word::Pair(it) => it.timing,
    });
    timings.map(|it| it.sent_at_nanos).max()
}

/// When the first view of the frame was captured.
fn captured_at(joined: &Joined<Word>) -> u64 {
    let stamps = joined.items.iter().flatten().map(|it| match it {
        Word::Pose(it) => it.stamp,
        Word::Pair(it) => it.stamp,
    });
    stamps.map(|it| it.captured_at_nanos).min().unwrap_or(0)
}
