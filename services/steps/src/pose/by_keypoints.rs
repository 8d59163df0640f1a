//! Reads the keypoints that another program found in a frame.

use failure::Failure;
use messages::{Stamp, Status};

use crate::pose::job::Keypoints;
use crate::pose::memory::KeypointState;
use crate::pose::view::{Found, View};

impl View<'_> {
    /// Reads the people of a frame. If the file cannot be read, the frame is refused, with a warning the first time. A frame without a file
    /// contains nobody.
    pub(crate) fn take(
        &self,
        keypoints: &Keypoints,
        stamp: Stamp,
        state: &mut KeypointState,
    ) -> Result<Result<Found<'_>, Status>, Failure> {
        let KeypointState {
            memory,
            people,
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
        let seen = people.iter().map(|person| &person.keypoints[..]);
        keypoints.step.take(seen, memory);
        self.seen(&keypoints.step, memory)
    }
}
