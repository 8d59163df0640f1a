//! Requests of a program: the parts of a deployment's frames that it takes.

use core::time::Duration;

/// The parts of every frame that a client takes, and the frames that it receives.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wish {
    pub(crate) skeletons: bool,
    pub(crate) poses: bool,
    pub(crate) pictures: bool,
    /// Names of the requested cameras; `None` for all.
    pub(crate) cameras: Option<Vec<String>>,
    /// Maximum number of moments that may wait for the caller.
    pub(crate) waiting: usize,
    /// Longest wait for the parts of a frame, if no message states that they will not arrive.
    pub(crate) patience: Duration,
}

impl Wish {
    /// Requests the skeletons of the newest frame.
    #[must_use]
    pub fn skeletons() -> Self {
        Self {
            skeletons: true,
            poses: false,
            pictures: false,
            cameras: None,
            waiting: 1,
            patience: Duration::from_millis(500),
        }
    }

    /// Requests the views of the newest frame, without skeletons. Add [`Self::with_poses`] or [`Self::with_pictures`].
    #[must_use]
    pub fn views() -> Self {
        Self {
            skeletons: false,
            ..Self::skeletons()
        }
    }

    /// Also requests the single-view pose of every view.
    #[must_use]
    pub fn with_poses(mut self) -> Self {
        self.poses = true;
        self
    }

    /// Also requests the picture of every view.
    ///
    /// With [`Self::skeletons`], the picture is a copy. With [`Self::views`], it stays in the memory of its sender. A client can then hold
    /// only one picture of a view at a time: until a [`Moment`](crate::Moment) is dropped, later frames are returned without their
    /// pictures. The deployment cannot be restarted while a picture is held.
    #[must_use]
    pub fn with_pictures(mut self) -> Self {
        self.pictures = true;
        self
    }

    /// Restricts the request to these cameras. Without this call, all cameras are read.
    #[must_use]
    pub fn of_cameras(mut self, names: &[&str]) -> Self {
        self.cameras = Some(names.iter().map(|name| (*name).to_owned()).collect());
        self
    }

    /// Requests every frame in order, instead of the newest frame only.
    ///
    /// * `most`: maximum number of moments that may wait for the caller, at least 1. If more arrive, the oldest moment is dropped and
    ///   counted.
    #[must_use]
    pub fn every_frame(mut self, most: usize) -> Self {
        self.waiting = most.max(1);
        self
    }

    /// Sets the longest wait for the views of a frame if no skeletons are requested; half a second by default. With skeletons, the
    /// arrival of the skeleton ends the wait.
    #[must_use]
    pub fn with_patience(mut self, patience: Duration) -> Self {
        self.patience = patience;
        self
    }

    /// Returns true if poses or pictures of single views are requested.
    pub(crate) fn has_views(&self) -> bool {
        self.poses || self.pictures
    }

    /// Returns true if only the newest moment is given.
    pub(crate) fn newest_wins(&self) -> bool {
        self.waiting == 1
    }
}
