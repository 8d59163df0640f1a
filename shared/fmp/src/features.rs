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

/// Features of all levels, with the buffers that they are made in.
///
/// The levels that come from one resized image by halving it again and again are a chain; chains
/// have nothing to do with each other. Whoever first asks for a level of a chain computes the chain
/// while others that ask for it wait, so responses begin where features are there, with no barrier
/// in between. Buffers are kept from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct Features {
    chains: Vec<Chain>,
}

#[derive(Debug, Default)]
struct Chain {
    buffers: Mutex<Buffers>,
    /// Padded features of every level of the chain.
    maps: OnceLock<Vec<Vec<f32>>>,
}

#[derive(Debug, Default)]
struct Buffers {
    image: Planes,
    halved: Planes,
    shrink: ShrinkWorkspace,
    hog: HogWorkspace,
    /// What [`Chain::maps`] is made in.
    maps: Vec<Vec<f32>>,
}

impl Features {
    /// Forgets the last image.
    pub(crate) fn begin(&mut self, source: &Source<'_>) {
        let n_chains = source.interval.min(source.layout.levels.len());
        self.chains.resize_with(n_chains, Chain::default);
        for chain in &mut self.chains {
            if let Some(maps) = chain.maps.take() {
                lock(&chain.buffers).maps = maps;
            }
        }
    }

    /// The padded features of a level of `source`, the same one for all levels since [`Self::begin`].
    pub(crate) fn of_level(&self, source: &Source<'_>, level: usize) -> FeatureMap<'_> {
        let first = level % source.interval;
        let chain = &self.chains[first];
        let maps = chain
            .maps
            .get_or_init(|| lock(&chain.buffers).fill(source, first));
        let [rows, cols] = source.layout.levels[level].padded;
        FeatureMap {
            rows,
            cols,
            cells: &maps[level / source.interval],
        }
    }
}

impl Buffers {
    /// Features of the levels `first`, `first + interval` and so on.
    fn fill(&mut self, source: &Source<'_>, first: usize) -> Vec<Vec<f32>> {
        let Source { isa, layout, .. } = *source;
        let shape = HogShape {
            cell_px: source.cell_px,
            pad: layout.pad.map(|it| it + 1),
        };
        let levels = layout.levels[first..].iter().step_by(source.interval);
        let mut maps = std::mem::take(&mut self.maps);
        maps.resize_with(levels.len(), Vec::new);
        for (octave, (level, map)) in levels.zip(&mut maps).enumerate() {
            if octave == 0 {
                let size = level.image_size;
                resize(isa, source.image, size, &mut self.shrink, &mut self.image);
            } else {
                reduce(isa, &self.image, &mut self.shrink, &mut self.halved);
                std::mem::swap(&mut self.image, &mut self.halved);
            }
            map.resize(level.padded[0] * level.padded[1] * crate::N_CHANNELS, 0.0);
            hog(isa, &self.image, shape, &mut self.hog, map);
        }
        maps
    }
}
