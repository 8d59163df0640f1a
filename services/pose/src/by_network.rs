//! Looks at a frame with a network that finds keypoints.

use failure::{Failure, now_nanos};
use kernels::Rgb8View;
use messages::{Searched, Stamp, Status};
use pipeline::{NetworkMemory, NetworkStep};

use crate::memory::NetworkState;
use crate::view::{Found, View};

impl View<'_> {
    /// Looks at a frame. One that the network cannot answer for is refused, with a warning the first time.
    pub(crate) fn look(
        &self,
        step: &NetworkStep,
        (image, stamp): (Rgb8View<'_>, Stamp),
        state: &mut NetworkState,
    ) -> Result<Result<Found<'_>, Status>, Failure> {
        state.memory.begin(stamp.frame, self.job.most_apart);
        let begin = now_nanos();
        let looked = step.look(image, &mut state.memory);
        self.put_off_search(now_nanos() - begin, &mut state.memory);
        let scope = match looked {
            Ok(scope) => scope,
            Err(error) => {
                if !state.has_failed {
                    let error = failure::wording::in_one_line(&error);
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

    /// Puts off the next search for boxes where this one took long: of a slow machine the others need the cores as well.
    fn put_off_search(&self, took_nanos: u64, memory: &mut NetworkMemory) {
        let limits = self.job.search_share.zip(self.job.frame_rate_hz);
        if let Some((share, rate_hz)) = limits.filter(|_| memory.has_searched()) {
            memory.put_off(took_nanos as f64 * 1e-9 * rate_hz, share);
        }
    }
}
