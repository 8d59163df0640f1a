//! From pixels to the responses of every filter on every level.

use std::sync::{Arc, Mutex, PoisonError};

use kernels::{
    FeatureMap, FilterBank, HogShape, HogWorkspace, Isa, Planes, Rgb8View, ShrinkWorkspace,
    Template, hog, reduce, resize,
};
use rayon::prelude::*;

use crate::{Layout, Model};

/// Computes filter responses. Holds what can be prepared once per model, and the workspaces that
/// are used again from frame to frame.
#[derive(Debug)]
pub struct Extractor {
    model: Arc<Model>,
    isa: Isa,
    bank: FilterBank,
    workspaces: Mutex<Vec<Workspace>>,
}

/// Images and features of one frame; one chain per level of the first octave.
#[derive(Debug, Default)]
struct Workspace {
    chains: Vec<Chain>,
}

/// The levels that come from one resized image by halving it again and again.
#[derive(Debug, Default)]
struct Chain {
    image: Planes,
    halved: Planes,
    shrink: ShrinkWorkspace,
    hog: HogWorkspace,
    /// Padded features of every level of the chain.
    features: Vec<Vec<f32>>,
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
        let mut workspaces = lock(&self.workspaces);
        let mut workspace = workspaces.pop().unwrap_or_default();
        drop(workspaces);
        self.compute_features(image, layout, &mut workspace);
        self.correlate(layout, &workspace, out);
        lock(&self.workspaces).push(workspace);
    }

    fn compute_features(&self, image: Rgb8View<'_>, layout: &Layout, workspace: &mut Workspace) {
        let spec = self.model.spec();
        let shape = HogShape {
            cell_px: spec.cell_px,
            pad: layout.pad.map(|it| it + 1),
        };
        let n_chains = spec.interval.min(layout.levels.len());
        workspace.chains.resize_with(n_chains, Chain::default);
        let fill = |(first, chain): (usize, &mut Chain)| {
            let levels = layout.levels[first..].iter().step_by(spec.interval);
            chain.features.resize_with(levels.len(), Vec::new);
            for (octave, level) in levels.enumerate() {
                if octave == 0 {
                    let size = level.image_size;
                    resize(self.isa, image, size, &mut chain.shrink, &mut chain.image);
                } else {
                    reduce(self.isa, &chain.image, &mut chain.shrink, &mut chain.halved);
                    std::mem::swap(&mut chain.image, &mut chain.halved);
                }
                let features = &mut chain.features[octave];
                features.resize(level.padded[0] * level.padded[1] * crate::N_CHANNELS, 0.0);
                hog(self.isa, &chain.image, shape, &mut chain.hog, features);
            }
        };
        if in_pool() {
            workspace.chains.par_iter_mut().enumerate().for_each(fill);
        } else {
            workspace.chains.iter_mut().enumerate().for_each(fill);
        }
    }

    fn correlate(&self, layout: &Layout, workspace: &Workspace, out: &mut [f32]) {
        let interval = self.model.spec().interval;
        let mut jobs = Vec::with_capacity(layout.levels.len() * self.bank.n_panels());
        let mut rest = out;
        for level in 0..layout.levels.len() {
            let map = layout.levels[level].rows * layout.levels[level].cols;
            for panel in 0..self.bank.n_panels() {
                let (maps, after) = rest.split_at_mut(self.bank.filters(panel).len() * map);
                jobs.push((level, panel, maps));
                rest = after;
            }
        }
        let run = |(level, panel, maps): (usize, usize, &mut [f32])| {
            let it = &layout.levels[level];
            let features = FeatureMap {
                rows: it.padded[0],
                cols: it.padded[1],
                cells: &workspace.chains[level % interval].features[level / interval],
            };
            self.bank
                .correlate(panel, features, [it.rows, it.cols], maps);
        };
        if in_pool() {
            jobs.into_par_iter().for_each(run);
        } else {
            jobs.into_iter().for_each(run);
        }
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
