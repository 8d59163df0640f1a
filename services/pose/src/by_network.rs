//! Looks at a frame with a network that finds keypoints.

use kernels::Rgb8View;
use messages::{Searched, Stamp, Status};
use pipeline::NetworkStep;
use runtime::Failure;

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
