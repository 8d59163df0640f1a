//! The feature pyramid of one image by itself, for those who need features and not responses.

use kernels::{FeatureMap, Isa, Rgb8View};

use crate::features::{Features, Source};
use crate::{Layout, Model};

/// The features of an image, level by level; a level is computed when it is first asked for.
#[derive(Debug)]
pub struct FeaturePyramid<'a> {
    source: Source<'a>,
    features: Features,
}

impl<'a> FeaturePyramid<'a> {
    /// Prepares the features of `image`; nothing is computed yet.
    ///
    /// # Panics
    ///
    /// If the layout is that of an image of another size.
    pub fn new(model: &Model, image: Rgb8View<'a>, layout: &'a Layout) -> Self {
        assert_eq!(
            layout.image_size,
            [image.width(), image.height()],
            "layout of this image"
        );
        let spec = model.spec();
        let source = Source {
            isa: Isa::best(),
            image,
            layout,
            interval: spec.interval,
            cell_px: spec.cell_px,
        };
        let mut features = Features::default();
        features.begin(&source, 1);
        Self { source, features }
    }

    /// The features of a level, padded: the response of a filter at `(x, y)` is the sum of its
    /// products with the cells from row `y` and column `x` on.
    ///
    /// # Panics
    ///
    /// If the layout has no such level.
    pub fn level(&self, level: usize) -> FeatureMap<'_> {
        self.features.of_level(&self.source, level)
    }
}
