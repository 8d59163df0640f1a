//! Hard negatives: false positives of the model on images without people.

use std::sync::Arc;

use crate::datasets::Picture;
use fmp::{Extractor, Layout, Model, Pose, Responses, Solver};

/// Searches images for false positives.
#[derive(Debug)]
pub(crate) struct Miner {
    model: Arc<Model>,
    extractor: Extractor,
    solver: Solver,
}

impl Miner {
    /// Prepares the search.
    ///
    /// * `model`: the model, whose interval is the number of levels per octave to search.
    pub(crate) fn new(model: Model) -> Self {
        let model = Arc::new(model);
        Self {
            extractor: Extractor::new(Arc::clone(&model)),
            solver: Solver::new(Arc::clone(&model)),
            model,
        }
    }

    /// The poses of an image that score at least `threshold`: at most the `max` best. The list is empty if the image
    /// is too small for the model.
    pub(crate) fn search(&self, picture: &Picture, threshold: f32, max: usize) -> Vec<Pose> {
        let image = picture.view();
        let Ok(layout) = Layout::new(&self.model, image.width(), image.height()) else {
            return Vec::new();
        };
        let mut values = vec![0.0; layout.n_responses()];
        self.extractor.responses(image, &layout, &mut values);
        let levels: Vec<_> = (0..layout.levels.len() as u16).collect();
        let evidence = Responses::new(&layout, &values, &levels);
        self.solver.above(&evidence, threshold, max)
    }
}
