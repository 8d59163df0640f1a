//! The feature pyramid of one image, computed as it is asked for.

use std::sync::{Mutex, OnceLock};

use kernels::{
    FeatureMap, HogShape, HogWorkspace, Isa, Planes, Rgb8View, ShrinkWorkspace, hog, reduce, resize,
};

use crate::Layout;
use crate::extract::lock;

/// What the features are made of.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Source<'a> {
    pub(crate) isa: Isa,
    pub(crate) image: Rgb8View<'a>,
    pub(crate) layout: &'a Layout,
    /// Levels per octave.
    pub(crate) interval: usize,
    pub(crate) cell_px: usize,
}

impl Source<'_> {
    fn shape(&self) -> HogShape {
        HogShape {
            cell_px: self.cell_px,
            pad: self.layout.pad.map(|it| it + 1),
        }
    }
}

/// Features of all levels, with the buffers that they are made in.
///
/// The levels that come from one resized image by halving it again and again are a chain; chains
/// have nothing to do with each other. Whoever first asks for a level of a chain computes the chain
/// while others that ask for it wait, so responses begin where features are there, with no barrier
/// in between. Buffers are kept from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct Features {
    chains: Vec<Chain>,
    /// One per thread: the last one put back is the first one taken, and still in the cache.
    arenas: Mutex<Vec<Arena>>,
}

#[derive(Debug, Default)]
struct Chain {
    /// Padded features of every level of the chain.
    maps: OnceLock<Maps>,
    /// What they are made in.
    spare: Mutex<Maps>,
}

type Maps = Vec<Vec<f32>>;

/// What is needed while a chain is computed.
#[derive(Debug, Default)]
struct Arena {
    image: Planes,
    halved: Planes,
    shrink: ShrinkWorkspace,
    hog: HogWorkspace,
}

impl Features {
    /// Forgets the last image.
    ///
    /// * `n_threads`: how many will ask for features at once.
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

    /// The padded features of a level of `source`, the same one for all levels since [`Self::begin`].
    pub(crate) fn of_level(&self, source: &Source<'_>, level: usize) -> FeatureMap<'_> {
        let first = level % source.interval;
        let chain = &self.chains[first];
        let maps = chain.maps.get_or_init(|| {
            let mut maps = std::mem::take(&mut *lock(&chain.spare));
            let arena = lock(&self.arenas).pop();
            let mut arena = arena.unwrap_or_default();
            arena.fill(source, first, &mut maps);
            lock(&self.arenas).push(arena);
            maps
        });
        let [rows, cols] = source.layout.levels[level].padded;
        FeatureMap {
            rows,
            cols,
            cells: &maps[level / source.interval],
        }
    }
}

impl Arena {
    /// Makes room for every chain, so that it does not matter which one comes here.
    fn reserve(&mut self, source: &Source<'_>) {
        let [width, height] = source.layout.image_size;
        self.image.reserve(width, height);
        self.halved.reserve(width.div_ceil(2), height.div_ceil(2));
        self.shrink.reserve(width, height);
        self.hog.reserve(width, height, source.shape());
    }

    /// Features of the levels `first`, `first + interval` and so on.
    fn fill(&mut self, source: &Source<'_>, first: usize, maps: &mut Maps) {
        let Source { isa, layout, .. } = *source;
        let levels = layout.levels[first..].iter().step_by(source.interval);
        maps.resize_with(levels.len(), Vec::new);
        // Images take turns in the two buffers, which keep their places for the next chain.
        let (mut image, mut other) = (&mut self.image, &mut self.halved);
        for (octave, (level, map)) in levels.zip(maps).enumerate() {
            if octave == 0 {
                resize(isa, source.image, level.image_size, &mut self.shrink, image);
            } else {
                reduce(isa, image, &mut self.shrink, other);
                std::mem::swap(&mut image, &mut other);
            }
            map.resize(level.padded[0] * level.padded[1] * crate::N_CHANNELS, 0.0);
            hog(isa, image, source.shape(), &mut self.hog, map);
        }
    }
}
