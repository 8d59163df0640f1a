//! The stages, each measured on existing buffers.

use std::hint::black_box;
use std::sync::{Arc, Mutex};

use fmp::{Extractor, Responses, Solver, TrackSettings, Tracker};
use kernels::{HogShape, HogWorkspace, Isa, Planes, ShrinkWorkspace, hog, reduce, resize};
use rayon::prelude::*;

use crate::clock::Clock;
use crate::options::Options;
use crate::workload::{OtherView, Workload};

/// Times in milliseconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Times {
    pub(crate) min: f64,
    pub(crate) median: f64,
    /// Shortest processor time, summed over all threads.
    pub(crate) cpu: f64,
}

impl Times {
    fn less(self, other: Self) -> Self {
        Self {
            min: (self.min - other.min).max(0.0),
            median: (self.median - other.median).max(0.0),
            cpu: (self.cpu - other.cpu).max(0.0),
        }
    }
}

/// Times of the elementary stages on one thread, in milliseconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StageTimes {
    pub(crate) shrink: f64,
    pub(crate) hog: f64,
    pub(crate) filters: f64,
    pub(crate) messages: f64,
}

impl StageTimes {
    /// Returns the total of the elementary stages that make up a stage, if there are any.
    pub(crate) fn of(&self, stage: Stage) -> Option<f64> {
        let extract = self.shrink + self.hog + self.filters;
        match stage {
            Stage::Shrink => Some(self.shrink),
            Stage::Hog => Some(self.hog),
            Stage::Filters => Some(self.filters),
            Stage::Extract => Some(extract),
            Stage::Messages | Stage::Best | Stage::Iteration => Some(self.messages),
            Stage::Frame => Some(extract + self.messages),
            Stage::Backtrack | Stage::Tracked => None,
        }
    }
}

/// A row of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stage {
    Shrink,
    Hog,
    Filters,
    Extract,
    Messages,
    Backtrack,
    Best,
    Frame,
    Tracked,
    Iteration,
}

impl Stage {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Shrink => "resize+reduce",
            Self::Hog => "hog",
            Self::Filters => "filters",
            Self::Extract => "responses",
            Self::Messages => "messages",
            Self::Backtrack => "backtrack",
            Self::Best => "best",
            Self::Frame => "frame",
            Self::Tracked => "tracked",
            Self::Iteration => "iteration",
        }
    }
}

/// Memory that one thread needs for images and features.
#[derive(Default)]
struct Arena {
    images: [Planes; 2],
    shrink: ShrinkWorkspace,
    hog: HogWorkspace,
}

/// One workload on one instruction set with a given number of threads.
pub(crate) struct Bench<'a> {
    workload: &'a Workload,
    isa: Isa,
    extractor: Extractor,
    solver: Solver,
    levels: Vec<u16>,
    pool: Option<rayon::ThreadPool>,
}

impl<'a> Bench<'a> {
    pub(crate) fn new(workload: &'a Workload, isa: Isa, threads: usize) -> Self {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let model = Arc::clone(&workload.model);
        Self {
            extractor: Extractor::on(isa, model),
            solver: Solver::on(isa, Arc::clone(&workload.model)),
            levels: (0..workload.layout.levels.len() as u16).collect(),
            pool: (threads > 1).then(|| pool.build().unwrap()),
            workload,
            isa,
        }
    }

    /// Measures the requested stages.
    pub(crate) fn run(&self, clock: &Clock, options: &Options) -> Vec<(Stage, Times)> {
        match &self.pool {
            Some(pool) => pool.install(|| self.run_here(clock, options)),
            None => self.run_here(clock, options),
        }
    }

    fn run_here(&self, clock: &Clock, options: &Options) -> Vec<(Stage, Times)> {
        let wants = |stages: &[Stage]| stages.iter().any(|stage| options.wants_stage(*stage));
        let mut all = Vec::new();
        let layout = &self.workload.layout;
        let mut values = vec![0.0; layout.n_responses()];
        let mut extract = || {
            let image = self.workload.image();
            self.extractor.responses(image, layout, &mut values);
        };
        if wants(&[Stage::Shrink, Stage::Hog, Stage::Filters]) {
            let shrink = self.images(clock, false);
            all.push((Stage::Shrink, shrink));
            all.push((Stage::Hog, self.images(clock, true).less(shrink)));
        }
        if wants(&[Stage::Filters, Stage::Extract, Stage::Frame]) {
            all.push((Stage::Extract, clock.measure(&mut extract)));
        } else {
            extract();
        }
        if let [(_, shrink), (_, hog), (_, extract)] = all[..] {
            all.insert(2, (Stage::Filters, extract.less(shrink).less(hog)));
        }
        let evidence = Responses::new(layout, &values, &self.levels);
        if wants(&[Stage::Messages, Stage::Backtrack, Stage::Best]) {
            let messages = clock.measure(|| self.messages(&evidence));
            let best = clock.measure(|| drop(black_box(self.solver.best(&evidence, None))));
            all.push((Stage::Messages, messages));
            all.push((Stage::Backtrack, best.less(messages)));
            all.push((Stage::Best, best));
        }
        if wants(&[Stage::Iteration]) {
            let view = OtherView::new(layout);
            let fuse = || drop(black_box(self.solver.best(&evidence, Some(&view))));
            all.push((Stage::Iteration, clock.measure(fuse)));
        }
        if wants(&[Stage::Frame]) {
            let times = clock.measure(|| {
                let image = self.workload.image();
                self.extractor.responses(image, layout, &mut values);
                let evidence = Responses::new(layout, &values, &self.levels);
                black_box(self.solver.best(&evidence, None));
            });
            all.push((Stage::Frame, times));
        }
        if wants(&[Stage::Tracked]) {
            all.push((Stage::Tracked, self.tracked(clock, &mut values)));
        }
        all.retain(|entry| options.wants_stage(entry.0));
        all
    }

    /// Measures a frame that is searched only near the best pose, with the default settings.
    fn tracked(&self, clock: &Clock, values: &mut [f32]) -> Times {
        let Workload { model, layout, .. } = self.workload;
        let mut tracker = Tracker::new(Some(TrackSettings::default()));
        let mut frame = |number: u64| {
            let scope = tracker.scope(layout, number);
            let image = self.workload.image();
            self.extractor.responses_in(image, layout, &scope, values);
            let levels = scope.levels();
            let levels = &self.levels[usize::from(levels.start)..usize::from(levels.end)];
            let evidence = Responses::within(layout, values, levels, scope);
            let best = self.solver.best(&evidence, None);
            if number == 0 {
                tracker.update((model, layout), (number, &scope), best.as_ref());
            }
            black_box(best);
        };
        frame(0);
        clock.measure(|| frame(1))
    }

    /// Measures the images of all levels and, if requested, their features: level after level in the same
    /// buffers, like the extractor.
    fn images(&self, clock: &Clock, features: bool) -> Times {
        let Workload { model, layout, .. } = self.workload;
        let interval = model.spec().interval;
        let shape = HogShape {
            cell_px: model.spec().cell_px,
            pad: layout.pad.map(|pad| pad + 1),
        };
        let n_threads = self.pool.as_ref().map_or(1, rayon::ThreadPool::current_num_threads);
        let arenas: Vec<_> = (0..n_threads).map(|_| Mutex::new(Arena::default())).collect();
        let maps = layout.levels.iter().map(|level| level.padded[0] * level.padded[1]);
        let maps = maps.map(|map| Mutex::new(vec![0.0; map * fmp::N_CHANNELS]));
        let maps: Vec<_> = maps.collect();
        let chain = |first: usize| {
            let mut arena = arenas[rayon::current_thread_index().unwrap_or(0)].lock().unwrap();
            let Arena {
                images: [image, halved],
                shrink,
                hog: workspace,
            } = &mut *arena;
            for level in (first..layout.levels.len()).step_by(interval) {
                if level < interval {
                    let size = layout.levels[level].image_size;
                    resize(self.isa, self.workload.image(), size, shrink, image);
                } else {
                    reduce(self.isa, image, shrink, halved);
                    std::mem::swap(image, halved);
                }
                if features {
                    hog(
                        self.isa,
                        image,
                        shape,
                        workspace,
                        &mut maps[level].lock().unwrap(),
                    );
                }
            }
        };
        let n_chains = interval.min(layout.levels.len());
        clock.measure(|| match &self.pool {
            Some(_) => (0..n_chains).into_par_iter().for_each(chain),
            None => (0..n_chains).for_each(chain),
        })
    }

    fn messages(&self, evidence: &Responses<'_>) {
        let solve = |&level: &u16| drop(black_box(self.solver.root_scores(evidence, level, None)));
        match &self.pool {
            Some(_) => self.levels.par_iter().for_each(solve),
            None => self.levels.iter().for_each(solve),
        }
    }
}
