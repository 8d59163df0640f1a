//! Searches single images with a model, by means of an extractor and a solver.

use std::sync::Arc;

use kernels::Rgb8View;

use crate::{Extractor, Layout, Model, Responses, Solver};

/// A model, ready to search images.
#[derive(Debug)]
pub struct Search {
    /// The model to search for.
    pub model: Arc<Model>,
    /// The solver that finds the best poses.
    pub solver: Solver,
    /// The extractor that computes the filter responses.
    pub extractor: Extractor,
}

impl Search {
    /// Prepares the search for a model.
    pub fn new(model: Arc<Model>) -> Self {
        Self {
            extractor: Extractor::new(Arc::clone(&model)),
            solver: Solver::new(Arc::clone(&model)),
            model,
        }
    }

    /// Calls `look` with the responses of all filters on all levels of an image.
    ///
    /// * `layout`: layout of this model for the size of `image`.
    ///
    /// # Panics
    ///
    /// If the size of `image` differs from that of `layout`.
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
