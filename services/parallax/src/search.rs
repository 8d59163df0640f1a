//! The exact search of single images, outside the pipeline.

use std::sync::Arc;

use fmp::{Extractor, Layout, Model, Precision, Responses, Solver};
use kernels::{NoAmx, Rgb8View};

/// A model, ready to search images.
#[derive(Debug)]
pub(crate) struct Search {
    /// The model.
    pub(crate) model: Arc<Model>,
    /// Finds its best poses.
    pub(crate) solver: Solver,
    extractor: Extractor,
}

impl Search {
    /// Prepares the search.
    pub(crate) fn new(model: Arc<Model>) -> Self {
        Self {
            extractor: Extractor::new(Arc::clone(&model)),
            solver: Solver::new(Arc::clone(&model)),
            model,
        }
    }

    /// The same, in a given precision.
    pub(crate) fn in_precision(precision: Precision, model: Arc<Model>) -> Result<Self, NoAmx> {
        Ok(Self {
            extractor: Extractor::in_precision(precision, Arc::clone(&model))?,
            ..Self::new(model)
        })
    }

    /// Runs `look` on what the filters answer to an image, on all levels.
    pub(crate) fn on<T>(
        &self,
        image: Rgb8View<'_>,
        layout: &Layout,
        look: impl FnOnce(&Responses<'_>) -> T,
    ) -> T {
        let mut values = vec![0.0; layout.n_responses()];
        self.extractor.responses(image, layout, &mut values);
        let levels: Vec<u16> = (0..layout.levels.len() as u16).collect();
        look(&Responses::new(layout, &values, &levels))
    }
}
