//! The evidence from the picture about the direction in which a person faces.

use crate::Sampler;
use kernels::Rgb8View;
use multiview::FrontEvidence;

use crate::orientation::features::{Buffers, features};
use crate::orientation::network::Network;
use crate::orientation::tile::{Crop, Tile};

/// Estimates the direction in which a person faces from the picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Detector {
    network: Network,
}

/// Buffers of a [`Detector`].
#[derive(Debug, Default)]
pub struct Workspace {
    sampler: Sampler,
    buffers: Buffers,
    features: Vec<f32>,
}

/// The midpoint between head and neck, `[x, y]` in the unit of the parts. Head and neck are parts 0 and 1 of the published model.
///
/// * Returns `None` for a model that does not have the 26 parts of the published model.
pub fn head_of(parts: &[[f64; 2]]) -> Option<[f64; 2]> {
    const N_PARTS: usize = 26;
    let ([head, neck, ..], N_PARTS) = (parts, parts.len()) else {
        return None;
    };
    Some([0, 1].map(|axis| f64::midpoint(head[axis], neck[axis])))
}

impl Detector {
    /// Makes a detector from a network.
    pub fn new(network: Network) -> Self {
        Self { network }
    }

    /// Returns the evidence from the picture about the direction in which the person of a pose faces.
    ///
    /// * `bounds`: the pose's box in the frame, `[x1, y1, x2, y2]` in pixels.
    /// * `head`: the midpoint between head and neck in the frame, `[x, y]` in pixels.
    /// * Returns zeros, which are no evidence, for a pose that is not finite.
    pub fn evidence(
        &self,
        frame: Rgb8View<'_>,
        bounds: [f64; 4],
        head: [f64; 2],
        workspace: &mut Workspace,
    ) -> FrontEvidence {
        match Tile::around(frame, bounds, head, &mut workspace.sampler) {
            Some(tile) => self.of_tile(&tile, workspace),
            None => [0.0; 2],
        }
    }

    /// Returns the evidence from a tile: the mean over the tile and its mirror image.
    pub fn of_tile(&self, tile: &Tile, workspace: &mut Workspace) -> FrontEvidence {
        let mut look = |mirrored: bool| {
            let crop = Crop {
                mirrored,
                ..Crop::default()
            };
            features(tile, &crop, &mut workspace.buffers, &mut workspace.features);
            self.network.standardise(&mut workspace.features);
            self.network.run(&workspace.features)
        };
        let [plain, mirrored] = [look(false), look(true)];
        [
            (plain[0] - mirrored[0]) / 2.0,
            f32::midpoint(plain[1], mirrored[1]),
        ]
    }
}
