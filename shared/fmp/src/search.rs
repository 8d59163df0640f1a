//! The search of single images by a model: extractor and solver together.

use std::sync::Arc;

use kernels::Rgb8View;

use crate::{Extractor, Layout, Model, Responses, Solver};

/// A model, ready to search images.
#[derive(Debug)]
pub struct Search {
    /// The model.
    pub model: Arc<Model>,
    /// Finds its best poses.
    pub solver: Solver,
    /// Computes the responses of its filters.
    pub extractor: Extractor,
}

impl Search {
    /// Prepares the search.
    pub fn new(model: Arc<Model>) -> Self {
        Self {
            extractor: Extractor::new(Arc::clone(&model)),
            solver: Solver::new(Arc::clone(&model)),
            model,
        }
    }

    /// Runs `look` on the responses of all filters on all levels of an image.
    ///
    /// * `layout`: of this model and the size of `image`.
    ///
    /// # Panics
    ///
    /// If `image` has another size than `layout`.
    pub fn on<T>(
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
