//! The feature pyramid of one image, for uses without filter responses.

use kernels::{FeatureMap, Isa, Rgb8View};

use crate::features::Features;
use crate::source::Source;
use crate::{Layout, Model, Scope};

/// The features of an image, level by level; a level is computed at first use.
#[derive(Debug)]
pub struct FeaturePyramid<'a> {
    image: Rgb8View<'a>,
    layout: &'a Layout,
    scope: Scope,
    interval: usize,
    cell_px: usize,
    features: Features,
}

impl<'a> FeaturePyramid<'a> {
    /// Prepares the features of `image`; nothing is computed yet.
    ///
    /// # Panics
    ///
    /// If the layout belongs to another image size.
    pub fn new(model: &Model, image: Rgb8View<'a>, layout: &'a Layout) -> Self {
        assert_eq!(
            layout.image_size,
            [image.width(), image.height()],
            "layout of this image"
        );
        let mut pyramid = Self {
            image,
            layout,
            scope: Scope::whole(layout),
            interval: model.spec().interval,
            cell_px: model.spec().cell_px,
            features: Features::default(),
        };
        let mut features = Features::default();
        features.begin(&pyramid.source(), 1);
        pyramid.features = features;
        pyramid
    }

    /// Returns the padded features of a level. The response of a filter at `(x, y)` is the sum of its
    /// products with the cells starting at row `y` and column `x`.
    ///
    /// # Panics
    ///
    /// If the layout has no such level.
    pub fn level(&self, level: usize) -> FeatureMap<'_> {
        self.features.of_level(&self.source(), level)
    }

    fn source(&self) -> Source<'_> {
        Source {
            isa: Isa::best(),
            image: self.image,
            layout: self.layout,
            scope: &self.scope,
            interval: self.interval,
            cell_px: self.cell_px,
        }
    }
}
