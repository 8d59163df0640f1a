//! Takes what another program found in a frame.

use failure::Failure;
use messages::{Searched, Stamp, Status};

use crate::job::Keypoints;
use crate::memory::KeypointState;
use crate::view::{Found, View};

impl View<'_> {
    /// Takes the people of a frame. A frame whose file cannot be read is refused, with a warning the first time; one that no file
    /// tells of has nobody in it.
    pub(crate) fn take(
        &self,
        keypoints: &Keypoints,
        stamp: Stamp,
        state: &mut KeypointState,
    ) -> Result<Result<Found<'_>, Status>, Failure> {
        let KeypointState {
            memory,
            people,
            responses,
            has_failed,
        } = state;
        if let Err(error) = keypoints.source.read(stamp.frame, people) {
            if !*has_failed {
                let error = failure::wording::in_one_line(&error);
                tracing::warn!(
                    frame = stamp.frame,
                    error,
                    "the keypoints of a frame cannot be read"
                );
                *has_failed = true;
            }
            return Ok(Err(Status::BAD_INPUT));
        }
        let seen = people.iter().map(|it| &it.keypoints[..]);
        let Some(scope) = keypoints.step.take(seen, memory) else {
            return Ok(Err(Status::NO_DETECTION));
        };
        let fill = |responses: &mut [f32]| keypoints.step.fill(scope, responses, memory);
        self.fill(&scope, Searched::FULL, responses, fill).map(Ok)
    }
}
