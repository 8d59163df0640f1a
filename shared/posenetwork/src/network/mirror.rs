//! Runs of a network on the mirror image of a window, in addition to the window itself.

use keypoints::{Card, Codec, Layout, mirrored};

use super::{PoseNetwork, Tensor};

/// Conversion of the output for a mirror image to the output for the picture.
#[derive(Debug)]
pub(super) struct Mirror {
    /// For each keypoint of the mirror image, the index of the corresponding keypoint of the picture.
    partner: Vec<usize>,
}

impl Mirror {
    /// * `names`: names of the keypoints.
    /// * Returns an error if the network cannot process mirror images.
    pub(super) fn new(card: &Card, names: &[String]) -> Result<Self, String> {
        if matches!(card.output, Codec::Keypoints { .. }) {
            return Err(
                "the positions cannot be compared with the positions in a mirror image".to_owned(),
            );
        }
        let partner = |name: &String| {
            let Some(other) = mirrored(name) else {
                return Ok(None);
            };
            let at = names.iter().position(|name| *name == other);
            at.map(Some)
                .ok_or_else(|| format!("there is a keypoint `{name}`, but no `{other}`"))
        };
        let partners: Result<Vec<Option<usize>>, String> = names.iter().map(partner).collect();
        let numbered = partners?.into_iter().enumerate();
        Ok(Self {
            partner: numbered.map(|(at, it)| it.unwrap_or(at)).collect(),
        })
    }

    /// Mirrors an input.
    pub(super) fn flip(card: &Card, values: &mut [f32]) {
        let width = card.input.width;
        match card.input.layout {
            Layout::Planes => values.chunks_exact_mut(width).for_each(<[f32]>::reverse),
            Layout::Pixels => {
                for row in values.chunks_exact_mut(3 * width) {
                    row.reverse();
                    // `reverse` has also reversed the colours of every pixel.
                    row.chunks_exact_mut(3).for_each(<[f32]>::reverse);
                }
            }
        }
    }

    /// Replaces the outputs for the picture by the mean of both outputs. Outputs of an unexpected shape are not changed, because a later
    /// check refuses them.
    pub(super) fn blend(&self, network: &PoseNetwork, outputs: &mut [Tensor], seen: &[Tensor]) {
        let card = &network.card;
        let n_outputs = if matches!(card.output, Codec::Simcc { .. }) {
            2
        } else {
            1
        };
        for (at, (to, from)) in outputs.iter_mut().zip(seen).enumerate() {
            if to.shape != from.shape || to.values.len() != from.values.len() {
                continue;
            }
            let name = Some(network.outputs[at].as_str());
            if at >= n_outputs {
                if name == card.also.front.as_deref() {
                    blend_front(to, from);
                } else {
                    self.blend_errors(to, from);
                }
                continue;
            }
            match &card.output {
                Codec::HeatMap {
                    layout,
                    udp,
                    centred,
                    ..
                } => {
                    let is_symmetric = *udp || *centred;
                    self.blend_maps(to, from, (*layout, is_symmetric, card.input.width));
                }
                Codec::Simcc { bins_per_pixel, .. } => {
                    let bins = (at == 0).then(|| bins_per_pixel.round() as usize);
                    self.blend_bins(to, from, bins);
                }
                Codec::Keypoints { .. } => {}
            }
        }
    }

    /// * `is_symmetric`: true if the cells of a mirror image coincide with cells of the picture. If false, each cell is at the first of the
    ///   pixels that it covers, and the maps of the mirror image are moved by one cell. The remaining offset is less than half a cell.
    fn blend_maps(
        &self,
        to: &mut Tensor,
        from: &Tensor,
        (layout, is_symmetric, width): (Layout, bool, usize),
    ) {
        let Some([channels, rows, columns]) = to.map_sides(layout) else {
            return;
        };
        if channels < self.partner.len() {
            return;
        }
        let index = |channel: usize, row: usize, column: usize| match layout {
            Layout::Planes => (channel * rows + row) * columns + column,
            Layout::Pixels => (row * columns + column) * channels + channel,
        };
        let beyond = usize::from(!is_symmetric && columns < width);
        for (channel, &partner) in self.partner.iter().enumerate() {
            for row in 0..rows {
                for column in beyond..columns {
                    let it = &mut to.values[index(channel, row, column)];
                    let other = index(partner, row, columns - 1 - column + beyond);
                    *it = f32::midpoint(*it, from.values[other]);
                }
            }
        }
    }

    /// * `bins`: number of bins per pixel of a distribution over columns. `None` for a distribution over rows, which is the same in a
    ///   mirror image.
    fn blend_bins(&self, to: &mut Tensor, from: &Tensor, bins: Option<usize>) {
        let n = to.values.len() / self.partner.len().max(1);
        for (at, &partner) in self.partner.iter().enumerate() {
            for bin in 0..n {
                let other = match bins {
                    // Pixel x becomes pixel width - 1 - x.
                    Some(bins) => (n - bin).checked_sub(bins),
                    None => Some(bin),
                };
                if let Some(other) = other.filter(|other| *other < n) {
                    let it = &mut to.values[at * n + bin];
                    *it = f32::midpoint(*it, from.values[partner * n + other]);
                }
            }
        }
    }

    fn blend_errors(&self, to: &mut Tensor, from: &Tensor) {
        let both = to.values.iter_mut().zip(&self.partner);
        for (it, &partner) in both {
            *it = f32::midpoint(*it, from.values.get(partner).copied().unwrap_or(*it));
        }
    }
}

/// The right of the picture is the left of the mirror image.
fn blend_front(to: &mut Tensor, from: &Tensor) {
    for ((it, other), sign) in to.values.iter_mut().zip(&from.values).zip([-1.0, 1.0]) {
        *it = f32::midpoint(*it, sign * other);
    }
}
