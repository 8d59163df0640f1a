//! Features for the network: gradients and colours of three patches around the head.

use kernels::{HogShape, HogWorkspace, Isa, Planes, Rgb8View, ShrinkWorkspace, hog, resize};

use crate::orientation::tile::{Crop, Tile};

/// A square patch.
struct Patch {
    /// Vertical distance by which the centre of the patch is below the head's centre, in pixels of the tile.
    below: f32,
    /// Side of the patch, in pixels of the patch.
    side: usize,
    /// Pixels of the tile per pixel of the patch.
    scale: f32,
    /// Side of a cell, in pixels of the patch.
    cell: usize,
}

/// Patches for the head with the shoulders, for the face, and for the upper part of the body. This set was chosen from eight sets by the
/// results for held-out people of `LSP-extended`. Patches of whole bodies and of feet did not help.
const PATCHES: [Patch; 3] = [
    Patch {
        below: 0.0,
        side: 56,
        scale: 0.8,
        cell: 7,
    },
    Patch {
        below: 0.0,
        side: 64,
        scale: 0.5,
        cell: 8,
    },
    Patch {
        below: 20.0,
        side: 80,
        scale: 1.0,
        cell: 8,
    },
];

/// Number of colour channels of a cell.
const N_COLOURS: usize = 3;

impl Patch {
    fn shape(&self) -> HogShape {
        HogShape {
            cell_px: self.cell,
            pad: [0, 0],
        }
    }

    fn n_gradients(&self) -> usize {
        let [rows, columns] = self.shape().map_size(self.side, self.side);
        rows * columns * kernels::N_CHANNELS
    }

    /// Number of cells along a side.
    fn n_cells(&self) -> usize {
        self.side / self.cell
    }
}

/// Number of features.
pub(crate) fn n_features() -> usize {
    let of_patch = |patch: &Patch| patch.n_gradients() + patch.n_cells().pow(2) * N_COLOURS;
    PATCHES.iter().map(of_patch).sum()
}

/// Buffers of [`features`].
#[derive(Debug, Default)]
pub(crate) struct Buffers {
    patch: Vec<u8>,
    planes: Planes,
    shrink: ShrinkWorkspace,
    hog: HogWorkspace,
    means: Vec<[f32; 3]>,
}

/// Computes the features of a tile for a given crop.
///
/// * `out`: overwritten with [`n_features`] values.
pub(crate) fn features(tile: &Tile, crop: &Crop, buffers: &mut Buffers, out: &mut Vec<f32>) {
    out.clear();
    for patch in &PATCHES {
        let side = patch.side;
        tile.patch((patch.below, side, patch.scale), crop, &mut buffers.patch);
        gradients(patch, buffers, out);
        colours(patch, buffers, out);
    }
}

fn gradients(patch: &Patch, buffers: &mut Buffers, out: &mut Vec<f32>) {
    let isa = Isa::best();
    let side = patch.side;
    let before = out.len();
    out.resize(before + patch.n_gradients(), 0.0);
    // The buffer has the size of the patch, so this cannot fail.
    if let Ok(view) = Rgb8View::new(side, side, &buffers.patch) {
        let planes = &mut buffers.planes;
        resize(isa, view, [side; 2], &mut buffers.shrink, planes);
        hog(
            isa,
            planes,
            patch.shape(),
            &mut buffers.hog,
            &mut out[before..],
        );
    }
}

/// For every cell, the brightness relative to the brightness of the patch, and the red and blue components of the colour.
fn colours(patch: &Patch, buffers: &mut Buffers, out: &mut Vec<f32>) {
    let (side, cell, n) = (patch.side, patch.cell, patch.n_cells());
    buffers.means.clear();
    buffers.means.resize(n * n, [0.0; 3]);
    for y in 0..n * cell {
        for x in 0..n * cell {
            let mean = &mut buffers.means[(y / cell) * n + x / cell];
            for (channel, sum) in mean.iter_mut().enumerate() {
                *sum += f32::from(buffers.patch[(y * side + x) * 3 + channel]);
            }
        }
    }
    let full = (cell * cell) as f32 * 255.0;
    let mut total = 0.0;
    for mean in &mut buffers.means {
        *mean = mean.map(|sum| sum / full);
        total += mean.iter().sum::<f32>();
    }
    let brightness = total / (n * n) as f32 + 0.05;
    for [red, green, blue] in &buffers.means {
        let grey = (red + green + blue) / 3.0;
        out.push(0.3 * (grey / brightness - 1.0));
        out.push(1.5 * (red - green) / (grey + 0.1));
        out.push(1.5 * (blue - green) / (grey + 0.1));
    }
}
