//! The feature pyramid of one image, computed on demand.

use std::sync::{Mutex, OnceLock};

use kernels::{
    FeatureMap, HogWorkspace, PartOfResized, Planes, ShrinkWorkspace, hog, reduce, resize_part,
};

use crate::cuts::{Cut, cuts};
use crate::pool::lock;
use crate::source::Source;
use crate::{N_CHANNELS, Scope};

/// Features of all levels, with their buffers.
///
/// A chain consists of the levels that are made from one resized image by repeated halving; chains are independent. The first thread that
/// needs a level of a chain computes the whole chain, while other threads that need it wait. So the computation of responses starts as soon
/// as their features exist, without a barrier. Buffers are reused from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct Features {
    chains: Vec<Chain>,
    /// One arena for each thread. The arena that was put back last is taken first, because it is still in the cache.
    arenas: Mutex<Vec<Arena>>,
}

#[derive(Debug, Default)]
struct Chain {
    /// Feature maps with padding at the border of the image; empty outside the scope.
    maps: OnceLock<Maps>,
    /// Spare memory for new maps.
    spare: Mutex<Maps>,
}

/// Features of every level of a chain.
type Maps = Vec<Vec<f32>>;

/// The buffers for computing a chain.
#[derive(Debug, Default)]
struct Arena {
    image: Planes,
    halved: Planes,
    shrink: ShrinkWorkspace,
    hog: HogWorkspace,
    cuts: Vec<Cut>,
    /// Features of a part of the image, with the same padding as for the whole image.
    padded: Vec<f32>,
}

impl Features {
    /// Discards the last image.
    ///
    /// * `n_threads`: number of threads that will request features.
    pub(crate) fn begin(&mut self, source: &Source<'_>, n_threads: usize) {
        let n_chains = source.interval.min(source.layout.levels.len());
        self.chains.resize_with(n_chains, Chain::default);
        for chain in &mut self.chains {
            if let Some(maps) = chain.maps.take() {
                *lock(&chain.spare) = maps;
            }
        }
        let mut arenas = lock(&self.arenas);
        arenas.resize_with(n_threads.min(n_chains), Arena::default);
        for arena in arenas.iter_mut() {
            arena.reserve(source);
        }
    }

    /// Returns the features of a level in the scope of `source`. The source must be the same for all levels since
    /// [`Self::begin`].
    pub(crate) fn of_level(&self, source: &Source<'_>, level: usize) -> FeatureMap<'_> {
        let [rows, cols] = source.map_size(level);
        FeatureMap {
            rows,
            cols,
            cells: &self.chain(source, level)[level / source.interval],
        }
    }

    fn chain(&self, source: &Source<'_>, level: usize) -> &Maps {
        let first = level % source.interval;
        let chain = &self.chains[first];
        chain.maps.get_or_init(|| {
            let mut maps = std::mem::take(&mut *lock(&chain.spare));
            let arena = lock(&self.arenas).pop();
            let mut arena = arena.unwrap_or_default();
            arena.fill(source, first, &mut maps);
            lock(&self.arenas).push(arena);
            maps
        })
    }
}

impl Arena {
    /// Reserves enough memory for any chain, so that all chains can use this arena.
    fn reserve(&mut self, source: &Source<'_>) {
        let [width, height] = source.layout.image_size;
        self.image.reserve(width, height);
        self.halved.reserve(width.div_ceil(2), height.div_ceil(2));
        self.shrink.reserve(width, height);
        self.hog.reserve(width, height, source.shape());
        self.cuts.clear();
        self.cuts.reserve(source.layout.levels.len());
        let [rows, cols] = source.shape().map_size(width, height);
        if *source.scope != Scope::whole(source.layout) {
            self.padded.clear();
            self.padded.reserve(rows * cols * N_CHANNELS);
        }
    }

    /// Computes the features of the levels `first`, `first + interval` and so on, up to the end of the scope.
    fn fill(&mut self, source: &Source<'_>, first: usize, maps: &mut Maps) {
        let levels = (first..source.layout.levels.len()).step_by(source.interval);
        maps.resize_with(levels.len(), Vec::new);
        cuts(source, first, &mut self.cuts);
        // Images alternate between the two buffers, which are then available for the next chain.
        let Self {
            shrink,
            hog,
            padded,
            cuts,
            ..
        } = self;
        let (mut image, mut other) = (&mut self.image, &mut self.halved);
        for (octave, (level, cut)) in levels.zip(&*cuts).enumerate() {
            if octave == 0 {
                let part = PartOfResized {
                    size: source.layout.levels[level].image_size,
                    x: cut.x.clone(),
                    y: cut.y.clone(),
                };
                resize_part(source.isa, source.image, &part, shrink, image);
            } else {
                reduce(source.isa, image, shrink, other);
                std::mem::swap(&mut image, &mut other);
            }
            if !source.scope.levels().contains(&(level as u16)) {
                continue;
            }
            let map = &mut maps[octave];
            describe(source, (level, cut), image, (hog, padded), map);
        }
    }
}

/// Writes the features of a level's window, from the cut of its image.
fn describe(
    source: &Source<'_>,
    (level, cut): (usize, &Cut),
    image: &Planes,
    (workspace, padded): (&mut HogWorkspace, &mut Vec<f32>),
    map: &mut Vec<f32>,
) {
    let (shape, size) = (source.shape(), source.map_size(level));
    map.resize(size[0] * size[1] * N_CHANNELS, 0.0);
    if size == source.layout.levels[level].padded {
        return hog(source.isa, image, shape, workspace, map);
    }
    let [rows, cols] = shape.map_size(image.width(), image.height());
    padded.resize(rows * cols * N_CHANNELS, 0.0);
    hog(source.isa, image, shape, workspace, padded);
    // Cell indices of the cut equal those of the whole image minus the cells before the cut.
    let window = source.layout.window(source.scope, level);
    let top = window.top - cut.y.start / source.cell_px;
    let left = window.left - cut.x.start / source.cell_px;
    let lines = padded.chunks_exact(cols * N_CHANNELS).skip(top);
    for (to, from) in map.chunks_exact_mut(size[1] * N_CHANNELS).zip(lines) {
        to.copy_from_slice(&from[left * N_CHANNELS..][..size[1] * N_CHANNELS]);
    }
}
