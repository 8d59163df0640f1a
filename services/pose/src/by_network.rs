//! Looks at a frame with a network that finds keypoints.

use kernels::Rgb8View;
use messages::{Searched, Stamp, Status};
use pipeline::{NetworkMemory, NetworkStep};
use runtime::Failure;

use crate::view::{Found, View};

/// How long nobody is seen before a warning says so, nanoseconds: a minute.
const LONG_NANOS: u64 = 60_000_000_000;

/// What is kept from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct NetworkState {
    memory: NetworkMemory,
    /// Responses that do not lie in shared memory.
    responses: Vec<f32>,
    /// When somebody was seen last, or a warning was given, and the number of frames since.
    nobody: Option<(u64, u64)>,
    /// Whether a failure of the network was told.
    has_failed: bool,
}

impl NetworkState {
    /// Warns if nobody has been seen for a minute.
    fn sees(&mut self, is_somebody: bool, stamp: &Stamp) {
        let now = stamp.captured_at_nanos;
        let (since, n) = self.nobody.unwrap_or((now, 0));
        if is_somebody {
            self.nobody = None;
        } else if now.saturating_sub(since) >= LONG_NANOS {
            tracing::warn!(
                "nobody was seen in the last {} frames ({} s): is somebody there, and does the detector fit (pose.detector, \
                 pose.detector_card)?",
                n + 1,
                now.saturating_sub(since) / 1_000_000_000
            );
            self.nobody = Some((now, 0));
        } else {
            self.nobody = Some((since, n + 1));
        }
    }
}

impl View<'_> {
    /// Looks at a frame. One that the network cannot answer for is refused, with a warning the first time.
    pub(crate) fn look(
        &self,
        step: &NetworkStep,
        (image, stamp): (Rgb8View<'_>, Stamp),
        state: &mut NetworkState,
    ) -> Result<Result<Found<'_>, Status>, Failure> {
        let looked = step.look(image, &mut state.memory);
        let scope = match looked {
            Ok(scope) => scope,
            Err(error) => {
                if !state.has_failed {
                    let error = causes::in_one_line(&error);
                    tracing::warn!(
                        frame = stamp.frame,
                        error,
                        "the network has no answer for a frame"
                    );
                    state.has_failed = true;
                }
                return Ok(Err(Status::BAD_INPUT));
            }
        };
        state.sees(scope.is_some(), &stamp);
        let Some(scope) = scope else {
            return Ok(Err(Status::NO_DETECTION));
        };
        let searched = if state.memory.has_searched() {
            Searched::FULL
        } else {
            Searched::TRACKED
        };
        let NetworkState {
            memory, responses, ..
        } = state;
        let fill = |responses: &mut [f32]| step.fill(scope, responses, memory);
        self.fill(&scope, searched, responses, fill).map(Ok)
    }
}
