//! Searches prepared for the sizes of pictures.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use fmp::{ImageTooSmall, Layout, Model};
use pipeline::{ViewSettings, ViewStep};

/// Number of sizes whose prepared searches are kept: the pictures of a data set have many sizes.
const MOST_SIZES: usize = 8;

/// Searches with one model, by the size of the picture.
#[derive(Debug)]
pub(crate) struct Searches {
    model: Arc<Model>,
    /// Prepared searches by width and height.
    steps: Mutex<BTreeMap<[usize; 2], Arc<ViewStep>>>,
}

impl Searches {
    pub(crate) fn new(model: Arc<Model>) -> Self {
        Self {
            model,
            steps: Mutex::default(),
        }
    }

    /// Returns the search for pictures of a size.
    pub(crate) fn of_size(
        &self,
        [width, height]: [usize; 2],
    ) -> Result<Arc<ViewStep>, ImageTooSmall> {
        let mut steps = self.steps.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(step) = steps.get(&[width, height]) {
            return Ok(Arc::clone(step));
        }
        let layout = Arc::new(Layout::new(&self.model, width, height)?);
        let step = ViewStep::new(Arc::clone(&self.model), layout, ViewSettings::default());
        let step = Arc::new(step);
        if steps.len() < MOST_SIZES {
            steps.insert([width, height], Arc::clone(&step));
        }
        Ok(step)
    }
}
