//! Wishes of a program: the parts of a deployment's frames that it takes.

use core::time::Duration;

/// Parts of every frame that a client takes, and choice of the frames that it is given.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wish {
    pub(crate) skeletons: bool,
    pub(crate) poses: bool,
    pub(crate) pictures: bool,
    /// None for all.
    pub(crate) cameras: Option<Vec<String>>,
    /// How many moments may wait for the caller.
    pub(crate) waiting: usize,
    /// How long parts of a frame are waited for, where nothing says that they will not come.
    pub(crate) patience: Duration,
}

impl Wish {
    /// The skeleton of the newest frame.
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

    /// The views of the newest frame, without skeleton: add [`Self::with_poses`] or [`Self::with_pictures`].
    #[must_use]
    pub fn views() -> Self {
        Self {
            skeletons: false,
            ..Self::skeletons()
        }
    }

    /// And the pose of every view, as the single views found it.
    #[must_use]
    pub fn with_poses(mut self) -> Self {
        self.poses = true;
        self
    }

    /// And the picture of every view.
    ///
    /// With [`Self::views`] it is where its sender wrote it. A client can hold one picture of a view at a time, so frames that
    /// come before a [`Moment`](crate::Moment) is dropped are given without theirs; and as long as it is held, the deployment
    /// cannot be started anew. With [`Self::skeletons`] it is a copy.
    #[must_use]
    pub fn with_pictures(mut self) -> Self {
        self.pictures = true;
        self
    }

    /// Only of these cameras; of all without it.
    #[must_use]
    pub fn of_cameras(mut self, names: &[&str]) -> Self {
        self.cameras = Some(names.iter().map(|name| (*name).to_owned()).collect());
        self
    }

    /// Every frame in order, instead of the newest.
    ///
    /// * `most`: how many may wait for the caller, at least 1; where more come, the oldest is dropped and counted.
    #[must_use]
    pub fn every_frame(mut self, most: usize) -> Self {
        self.waiting = most.max(1);
        self
    }

    /// How long the views of a frame are waited for where no skeleton is asked for, whose arrival says that all is there;
    /// half a second if it is not set.
    #[must_use]
    pub fn with_patience(mut self, patience: Duration) -> Self {
        self.patience = patience;
        self
    }

    /// Returns true if anything of single views is asked for.
    pub(crate) fn has_views(&self) -> bool {
        self.poses || self.pictures
    }

    /// Returns true if only the newest moment is given.
    pub(crate) fn newest_wins(&self) -> bool {
        self.waiting == 1
    }
}
