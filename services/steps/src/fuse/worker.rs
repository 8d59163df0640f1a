//! Solves one worker's pairs of views, or all views at once, and sends the poses.

use std::cell::Ref;

use failure::{ExitKind, Failure, OrFail as _, now_nanos};
use fmp::Responses;
use messages::{EvidenceHeader, PairPose, Span, Status};
use pipeline::{Following, Others, Support, ViewResult, Views};
use runtime::{Sample, Service};
use stage::{Context, Frame, Held, Output, Turn};
use wire::{EvidenceView, WireError};

use crate::fuse::input::Input;
use crate::fuse::job::Job;

/// The inputs of one frame.
struct FrameViews<'a> {
    turn: &'a Turn,
    answers: Vec<Option<ViewResult>>,
    /// Candidates that are not the followed person.
    others: Others,
    /// Age of the expected errors of every view, in frames.
    sigma_ages: Vec<u64>,
    evidence: Vec<Option<EvidenceView<'a>>>,
}

impl FrameViews<'_> {
    /// Returns a bit mask: bit `v` is set if the poses of view `v` were received in time.
    fn present(&self) -> u32 {
        let answers = self.answers.iter().enumerate();
        let present = answers.filter(|(_, answer)| answer.is_some());
        present.fold(0, |mask, (view, _)| mask | 1_u32 << view)
    }
}

pub(crate) struct Worker<'a> {
    pub(crate) service: &'a Service,
    pub(crate) job: &'a Job,
    /// Evidence by view. Only views in a pair of this worker have evidence.
    pub(crate) evidence: Vec<Option<Held<f32, EvidenceHeader>>>,
    pub(crate) output: Output<'a, PairPose>,
}

impl Worker<'_> {
    /// Solves one frame.
    ///
    /// * `following`: the person followed in previous frames.
    pub(crate) fn fuse(
        &self,
        frame: &mut Frame<'_, Input>,
        following: &mut Following,
    ) -> Result<(), Failure> {
        let (answers, sigma_ages) = self.answers(frame);
        let others = following.others(&self.job.plans, &answers);
        let samples: Vec<Option<Ref<'_, Sample<f32, EvidenceHeader>>>> =
            self.evidence.iter().map(|held| held.as_ref()?.of(frame.number())).collect();
        let evidence = samples.iter().enumerate();
        let evidence =
            evidence.map(|(view, sample)| self.evidence_of(view, sample.as_deref()?, &answers));
        let views = FrameViews {
            turn: frame.turn(),
            evidence: evidence.collect(),
            answers,
            others,
            sigma_ages,
        };
        match self.job.views {
            Views::Pairs => self.pairs(&views),
            Views::All => self.all_views(&views),
        }
    }

    /// Returns the poses of every view with their expected errors, and the age of these errors in frames.
    fn answers(&self, frame: &mut Frame<'_, Input>) -> (Vec<Option<ViewResult>>, Vec<u64>) {
        let n_views = self.job.plans.len();
        let mut ages = vec![0; n_views];
        let mut answers = Vec::with_capacity(n_views);
        for (view, age) in ages.iter_mut().enumerate() {
            let Some(item) = frame.take(view) else {
                answers.push(None);
                continue;
            };
            let now = frame.turn().received_at();
            let waited = now.saturating_sub(item.timing.sent_at_nanos);
            let health = self.service.health();
            health.spent(Span::WAITING, Some(view), waited);
            let found = match item.value {
                Input::Candidates(found) if !found.poses.is_empty() => found,
                _ => {
                    answers.push(None);
                    continue;
                }
            };
            let mut answer = ViewResult {
                candidates: found.poses,
                front: found.front,
                sigma_px: None,
                tau_px: None,
                skew_s: found.skew_s,
            };
            let captured_at = item.stamp.captured_at_nanos;
            if let Some((frames, Input::Errors(errors))) = frame.latest(n_views + view, captured_at)
            {
                *age = frames;
                answer.sigma_px.clone_from(&errors.sigma_px);
                answer.tau_px.clone_from(&errors.tau_px);
            }
            answers.push(Some(answer));
        }
        (answers, ages)
    }

    /// Returns the evidence of a view. It is refused if a pose of the view is outside of the evidence.
    fn evidence_of<'a>(
        &'a self,
        view: usize,
        sample: &'a Sample<f32, EvidenceHeader>,
        answers: &[Option<ViewResult>],
    ) -> Option<EvidenceView<'a>> {
        let layout = self.job.plans[view].layout();
        let read = wire::evidence_from_message(sample.header(), sample.payload(), layout);
        let read = read.and_then(|evidence| match &answers[view] {
            Some(answer) if !answer.is_within(&evidence.responses()) => Err(WireError::Mismatch {
                field: "poses within the evidence",
                got: 0,
                expected: 1,
            }),
            _ => Ok(evidence),
        });
        read.inspect_err(|error| self.refuse_evidence(error)).ok()
    }

    fn refuse_evidence(&self, error: &WireError) {
        Context::of(self.service).count_refused("evidence", error);
    }

    /// Solves this worker's pairs, one after the other.
    fn pairs(&self, frame: &FrameViews<'_>) -> Result<(), Failure> {
        let start = self.job.step.start(&frame.answers, &frame.others);
        for &(index, views) in &self.job.pairs {
            frame.turn.restart(now_nanos());
            self.service.progress().tick();
            let answer = match views.map(|view| frame.evidence[view].as_ref()) {
                [Some(first), Some(second)] => {
                    let evidence = [&first.responses(), &second.responses()];
                    let step = &self.job.step;
                    step.pair(views, &frame.answers, evidence, &start)
                }
                _ => None,
            };
            let message = |answer| {
                let message = wire::pair_to_message(views, answer, frame.present());
                message.map(|message| [message])
            };
            let [message] = self.or_bad_input(message(answer.as_ref()), || message(None))?;
            let sent_at = self.send(frame, index, message)?;
            self.output.account(frame.turn, sent_at, None);
        }
        Ok(())
    }

    /// Solves all views at once.
    fn all_views(&self, frame: &FrameViews<'_>) -> Result<(), Failure> {
        frame.turn.restart(now_nanos());
        let evidence = frame.evidence.iter();
        let evidence = evidence.map(|view| view.as_ref().map(EvidenceView::responses));
        let evidence: Vec<Option<Responses<'_>>> = evidence.collect();
        let step = &self.job.step;
        let answer = step.all_views(&frame.answers, &evidence, &frame.others, Support::Mean);
        let (n_views, present) = (frame.answers.len(), frame.present());
        let messages = wire::all_views_to_messages(n_views, answer.as_ref(), present);
        let messages = self.or_bad_input(messages, || {
            wire::all_views_to_messages(n_views, None, present)
        })?;
        let mut first_sent_at = None;
        for (index, message) in messages.into_iter().enumerate() {
            let sent_at = self.send(frame, index, message)?;
            first_sent_at.get_or_insert(sent_at);
        }
        if let Some(sent_at) = first_sent_at {
            self.output.account(frame.turn, sent_at, None);
        }
        Ok(())
    }

    /// Returns the messages of a solution. If responses are NaN, the energy is NaN too. The evidence is then refused, and the messages say
    /// that there is no solution.
    fn or_bad_input<M: AsMut<[PairPose]>>(
        &self,
        messages: Result<M, WireError>,
        without: impl FnOnce() -> Result<M, WireError>,
    ) -> Result<M, Failure> {
        messages.or_else(|error| {
            self.refuse_evidence(&error);
            let mut messages = without().or_fail(ExitKind::Run)?;
            for message in messages.as_mut() {
                message.status = Status::BAD_INPUT;
            }
            Ok(messages)
        })
    }

    /// Sends a message with the expected errors of its two views. Returns the send time in nanoseconds.
    fn send(
        &self,
        frame: &FrameViews<'_>,
        index: usize,
        mut message: PairPose,
    ) -> Result<u64, Failure> {
        for side in 0..2 {
            let view = message.views[side] as usize;
            let answer = frame.answers[view].as_ref();
            if let Some(sigma_px) = answer.and_then(|answer| answer.sigma_px.as_ref()) {
                let age = frame.sigma_ages[view];
                wire::sigma_to_pair(&mut message, side, age, sigma_px).or_fail(ExitKind::Run)?;
            }
        }
        self.output.send(frame.turn, index, message)
    }
}
