//! Computes the responses of every filter on every level from the pixels.

use std::ops::Range;
use std::sync::{Arc, Mutex};

use kernels::{CorrelateWorkspace, FilterBank, Isa, Level, Rgb8View, Template};

use crate::features::Features;
use crate::pool::{Pool, in_pool, lock};
use crate::source::Source;
use crate::{Layout, Model, Scope};

/// Computes filter responses. Stores everything that can be prepared once for a model, and workspaces that are reused from frame to frame.
#[derive(Debug)]
pub struct Extractor {
    model: Arc<Model>,
    isa: Isa,
    bank: FilterBank,
    workspaces: Pool<Features>,
    /// One workspace for each thread. This is a stack instead of a [`Pool`]: the workspace that was put back last is taken first, because
    /// it is still in the cache.
    buffers: Mutex<Vec<CorrelateWorkspace>>,
}

impl Extractor {
    /// Prepares the filters of `model`.
    pub fn new(model: Arc<Model>) -> Self {
        Self::on(Isa::best(), model)
    }

    /// Like [`Self::new`], for a given instruction set; the responses are the same on all instruction sets.
    pub fn on(isa: Isa, model: Arc<Model>) -> Self {
        Self::with(FilterBank::new, isa, model)
    }

    /// Like [`Self::new`], but every response is the plain sum of its products. This is slower, and serves as a reference for tests. See
    /// [`FilterBank::correlate`] for the maximum difference.
    pub fn direct(model: Arc<Model>) -> Self {
        let isa = Isa::best();
        Self::with(FilterBank::direct, isa, model)
    }

    fn with(pack: fn(Isa, &[Template<'_>]) -> FilterBank, isa: Isa, model: Arc<Model>) -> Self {
        let filters = model.spec().filters.iter();
        let templates: Vec<_> = filters
            .map(|filter| Template {
                rows: filter.rows,
                cols: filter.cols,
                weights: &filter.weights,
            })
            .collect();
        let bank = pack(isa, &templates);
        Self {
            model,
            isa,
            bank,
            workspaces: Pool::default(),
            buffers: Mutex::default(),
        }
    }

    /// Writes the responses of all filters on all levels of `layout` into `out`.
    ///
    /// Inside a rayon pool, the work is distributed over its threads; elsewhere, it stays on the caller's thread. The values are the same
    /// in both cases. Filters smaller than the largest filter have responses at the same cells as the largest filter, each at the position
    /// of the filter's top-left cell.
    ///
    /// * `out`: at least [`Layout::n_responses`] values, `[level][filter][row][col]`; all of them are overwritten. It may be in shared
    ///   memory.
    ///
    /// # Panics
    ///
    /// If the image, the layout and `out` disagree in size, or the layout belongs to another model.
    pub fn responses(&self, image: Rgb8View<'_>, layout: &Layout, out: &mut [f32]) {
        self.responses_in(image, layout, &Scope::whole(layout), out);
    }

    /// Writes the responses of all filters on the cells of a scope into `out`. Only the features needed for these cells are computed.
    ///
    /// Features are bit-identical to those of [`Self::responses`], except for rounding in the HOG weights if the side of a cell is not a
    /// power of two. Responses differ by at most twice the bound of [`FilterBank::correlate`], because the tiles begin at other cells. A
    /// scope with the whole image as its region gives results bit-identical to [`Self::responses`] on its levels.
    ///
    /// * `out`: at least [`Layout::n_values`] values, `[level][filter][row][col]` without gaps.
    ///
    /// # Panics
    ///
    /// If the image, the layout, the scope and `out` disagree in size, or the layout belongs to another
    /// model.
    pub fn responses_in(
        &self,
        image: Rgb8View<'_>,
        layout: &Layout,
        scope: &Scope,
        out: &mut [f32],
    ) {
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
        let n_values = layout.n_values(scope);
        assert!(out.len() >= n_values, "one value per response");
        let spec = self.model.spec();
        let source = Source {
            isa: self.isa,
            image,
            layout,
            scope,
            interval: spec.interval,
            cell_px: spec.cell_px,
        };
        let mut features = self.workspaces.take();
        let n_threads = if in_pool() {
            rayon::current_num_threads()
        } else {
            1
        };
        features.begin(&source, n_threads);
        self.reserve(layout, n_threads);
        let everything = Part {
            levels: usize::from(scope.levels().start)..usize::from(scope.levels().end),
            panels: 0..self.bank.n_panels(),
        };
        let share = if in_pool() {
            self.work(&source, &everything) / (SHARES * n_threads)
        } else {
            usize::MAX
        };
        let out = &mut out[..n_values];
        self.correlate((&source, &features), everything, share, out);
        self.workspaces.put_back(features);
    }

    /// Reserves a workspace for every thread.
    fn reserve(&self, layout: &Layout, n_threads: usize) {
        let cols = layout.levels.iter().map(|level| level.cols).max().unwrap_or(0);
        let mut buffers = lock(&self.buffers);
        let n_buffers = buffers.len().max(n_threads);
        buffers.resize_with(n_buffers, CorrelateWorkspace::default);
        for buffer in buffers.iter_mut() {
            self.bank.reserve(cols, buffer);
        }
    }

    /// Computes the responses of a part of the work. If the part is larger than one unit of work, it is split into two halves that run in
    /// parallel.
    ///
    /// * `out`: memory for the responses of this part only.
    fn correlate(
        &self,
        (source, features): (&Source<'_>, &Features),
        part: Part,
        share: usize,
        out: &mut [f32],
    ) {
        if self.work(source, &part) > share
            && let Some([first, second]) = self.halves(source, &part)
        {
            let (out, rest) = out.split_at_mut(self.work(source, &first));
            rayon::join(
                || self.correlate((source, features), first, share, out),
                || self.correlate((source, features), second, share, rest),
            );
            return;
        }
        let size = |level| {
            let window = source.layout.window(source.scope, level);
            [window.rows, window.cols]
        };
        let levels = part.levels.map(|level| Level {
            map: features.of_level(source, level),
            size: size(level),
        });
        let mut buffers = lock(&self.buffers).pop().unwrap_or_default();
        self.bank.correlate(part.panels, levels, out, &mut buffers);
        lock(&self.buffers).push(buffers);
    }

    /// Returns the number of responses.
    fn work(&self, source: &Source<'_>, part: &Part) -> usize {
        let windows = part.levels.clone();
        let windows = windows.map(|level| source.layout.window(source.scope, level));
        let area: usize = windows.map(|window| window.rows * window.cols).sum();
        area * self.bank.filters(part.panels.clone()).len()
    }

    /// Splits the levels into two halves that need about the same work; splits the panels of filters if there is only one level.
    fn halves(&self, source: &Source<'_>, part: &Part) -> Option<[Part; 2]> {
        let Range { start, end } = part.levels;
        let cut = |levels: Range<usize>, panels: Range<usize>| Part { levels, panels };
        if end - start > 1 {
            let half = self.work(source, part) / 2;
            let heavy =
                |end: &usize| self.work(source, &cut(start..*end, part.panels.clone())) >= half;
            let middle = (start + 1..end - 1).find(heavy).unwrap_or(end - 1);
            let panels = part.panels.clone();
            return Some([cut(start..middle, panels.clone()), cut(middle..end, panels)]);
        }
        let Range { start, end } = part.panels;
        let middle = usize::midpoint(start, end);
        let levels = part.levels.clone();
        (start < middle).then(|| [cut(levels.clone(), start..middle), cut(levels, middle..end)])
    }
}

/// Minimum number of units into which a thread's work is split, so that other threads can take over some of them.
const SHARES: usize = 4;

/// Some levels and filters, with their responses stored without gaps.
#[derive(Debug, Clone)]
struct Part {
    levels: Range<usize>,
    /// The panels to compute; all panels unless there is only one level.
    panels: Range<usize>,
}
