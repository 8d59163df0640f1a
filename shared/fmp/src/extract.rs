//! From pixels to the responses of every filter on every level.

use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use kernels::{FilterBank, Isa, Rgb8View, Template};

use crate::features::{Features, Source};
use crate::{Layout, Model};

/// Computes filter responses. Holds what can be prepared once per model, and the workspaces that
/// are used again from frame to frame.
#[derive(Debug)]
pub struct Extractor {
    model: Arc<Model>,
    isa: Isa,
    bank: FilterBank,
    workspaces: Mutex<Vec<Features>>,
}

impl Extractor {
    /// Prepares the filters of `model`.
    pub fn new(model: Arc<Model>) -> Self {
        Self::on(Isa::best(), model)
    }

    /// As [`Self::new`], for a given instruction set; the responses are the same on all.
    pub fn on(isa: Isa, model: Arc<Model>) -> Self {
        let filters = model.spec().filters.iter();
        let templates: Vec<_> = filters
            .map(|it| Template {
                rows: it.rows,
                cols: it.cols,
                weights: &it.weights,
            })
            .collect();
        let bank = FilterBank::new(isa, &templates);
        Self {
            model,
            isa,
            bank,
            workspaces: Mutex::default(),
        }
    }

    /// Writes the responses of all filters on all levels of `layout` into `out`.
    ///
    /// Inside a rayon pool the work is spread over its threads, elsewhere it stays on the caller's;
    /// the values are the same. Filters smaller than the largest have a response at the same cells
    /// as the largest one: where their own top left cell lies.
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
        assert!(out.len() >= layout.n_responses(), "one value per response");
        let spec = self.model.spec();
        let source = Source {
            isa: self.isa,
            image,
            layout,
            interval: spec.interval,
            cell_px: spec.cell_px,
        };
        let mut features = lock(&self.workspaces).pop().unwrap_or_default();
        let n_threads = if in_pool() {
            rayon::current_num_threads()
        } else {
            1
        };
        features.begin(&source, n_threads);
        let n_jobs = layout.levels.len() * self.bank.n_panels();
        let out = &mut out[..layout.n_responses()];
        if n_jobs > 0 {
            self.correlate(&source, &features, 0..n_jobs, out);
        }
        lock(&self.workspaces).push(features);
    }

    /// Computes the responses of some jobs, a job being one panel on one level.
    ///
    /// * `out`: of these jobs only.
    fn correlate(
        &self,
        source: &Source<'_>,
        features: &Features,
        jobs: Range<usize>,
        out: &mut [f32],
    ) {
        if jobs.len() < 2 {
            let (level, panel) = self.job(jobs.start);
            let it = &source.layout.levels[level];
            let map = features.of_level(source, level);
            return self.bank.correlate(panel, map, [it.rows, it.cols], out);
        }
        let middle = jobs.start.midpoint(jobs.end);
        let start = |job| {
            let (level, panel) = self.job(job);
            let it = &source.layout.levels[level];
            it.offset + self.bank.filters(panel).start * it.rows * it.cols
        };
        let (first, second) = out.split_at_mut(start(middle) - start(jobs.start));
        let (before, after) = (jobs.start..middle, middle..jobs.end);
        if in_pool() {
            rayon::join(
                || self.correlate(source, features, before, first),
                || self.correlate(source, features, after, second),
            );
        } else {
            self.correlate(source, features, before, first);
            self.correlate(source, features, after, second);
        }
    }

    /// The level and the panel of a job.
    fn job(&self, job: usize) -> (usize, usize) {
        (job / self.bank.n_panels(), job % self.bank.n_panels())
    }
}

/// Whether the caller runs inside a rayon pool, and so has asked for its threads to be used.
pub(crate) fn in_pool() -> bool {
    rayon::current_thread_index().is_some()
}

/// Locks a pool of workspaces; they hold nothing that a panic could have left half done.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
