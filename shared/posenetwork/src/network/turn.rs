//! Rotation of pictures by quarter turns, so that people who lie down or do a handstand are upright in the network's input.

use keypoints::{Card, Codec, Layout};

use super::{PoseNetwork, Tensor};

/// Direction in which a person's head points in the picture. The picture is rotated so that the head points upward in the input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Turn {
    /// Upward: the picture is not rotated.
    #[default]
    Up,
    /// To the right of the picture.
    Right,
    /// Downward in the picture.
    Down,
    /// To the left of the picture.
    Left,
}

impl Turn {
    /// All directions, in order.
    pub(crate) const ALL: [Self; 4] = [Self::Up, Self::Right, Self::Down, Self::Left];

    /// The direction, in radians clockwise from upward, -pi to pi.
    fn angle(self) -> f64 {
        let quarters = match self {
            Self::Up => 0.0,
            Self::Right => 1.0,
            Self::Down => 2.0,
            Self::Left => -1.0,
        };
        quarters * core::f64::consts::FRAC_PI_2
    }

    /// Returns the direction nearest to the direction of the head. `self` is kept if it differs from the head's direction by at most
    /// `most`, in radians.
    ///
    /// * `towards`: direction of the head, in pixels of the picture, across and down.
    pub(crate) fn towards(self, [x, y]: [f64; 2], most: f64) -> Self {
        let angle = x.atan2(-y);
        let off = |turn: &Self| {
            let off = (angle - turn.angle()).abs();
            off.min(core::f64::consts::TAU - off)
        };
        if off(&self) <= most || !angle.is_finite() {
            return self;
        }
        let all = Self::ALL.into_iter();
        all.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(self)
    }

    /// Returns true if the rotation swaps columns and rows.
    pub(super) fn is_sideways(self) -> bool {
        matches!(self, Self::Right | Self::Left)
    }

    /// Converts a position in the window to the position in the input, both column first.
    ///
    /// * `last`: the last column and row of the window.
    fn in_input(self, [x, y]: [usize; 2], last: [usize; 2]) -> [usize; 2] {
        let [right, low] = [last[0].saturating_sub(x), last[1].saturating_sub(y)];
        match self {
            Self::Up => [x, y],
            Self::Right => [y, right],
            Self::Down => [right, low],
            Self::Left => [low, x],
        }
    }

    /// Rotates the values of a window into the orientation of the input.
    ///
    /// * `window`: width and height of the window, in pixels.
    /// * `memory`: reused from picture to picture.
    pub(super) fn turn_input(
        self,
        card: &Card,
        [width, height]: [usize; 2],
        values: &mut Vec<f32>,
        memory: &mut Vec<f32>,
    ) {
        memory.resize(values.len(), 0.0);
        let columns = card.input.width;
        let plane = width * height;
        for y in 0..height {
            for x in 0..width {
                let [u, v] = self.in_input([x, y], [width - 1, height - 1]);
                let (from, to) = (y * width + x, v * columns + u);
                for channel in 0..3 {
                    match card.input.layout {
                        Layout::Planes => {
                            memory[channel * plane + to] = values[channel * plane + from];
                        }
                        Layout::Pixels => memory[3 * to + channel] = values[3 * from + channel],
                    }
                }
            }
        }
        core::mem::swap(values, memory);
    }

    /// Rotates the outputs for an input back to the window. Outputs of an unexpected shape are not changed, because a later check
    /// refuses them.
    pub(super) fn turn_back(self, network: &PoseNetwork, outputs: &mut [Tensor]) {
        let card = &network.card;
        match &card.output {
            Codec::HeatMap {
                layout,
                udp,
                centred,
                ..
            } => {
                if let Some(maps) = outputs.first_mut() {
                    self.turn_maps(maps, (*layout, *udp || *centred, card.input.width));
                }
            }
            Codec::Simcc { bins_per_pixel, .. } => {
                if let [across, down, ..] = outputs {
                    let n = network.names.len();
                    let bins = bins_per_pixel.round() as usize;
                    if matches!(self, Self::Down | Self::Left) {
                        reverse(across, n, bins);
                    }
                    if matches!(self, Self::Right | Self::Down) {
                        reverse(down, n, bins);
                    }
                    if self.is_sideways() {
                        core::mem::swap(across, down);
                    }
                }
            }
            Codec::Keypoints { .. } => {}
        }
        let front = card.also.front.as_deref();
        let mut named = network.outputs.iter().zip(outputs).rev();
        let found = named.find(|output| Some(output.0.as_str()) == front);
        if let Some(right) = found.and_then(|output| output.1.values.first_mut()) {
            // If the picture is rotated sideways, left and right in the input are up and down in the picture. The network then says
            // nothing about left and right in the picture.
            *right = if self == Self::Down { -*right } else { 0.0 };
        }
    }

    /// * `is_symmetric`: true if the cells of a rotated picture coincide with cells of the picture. If false, each cell is at the first of
    ///   the pixels that it covers, and the rotated maps are moved by one cell. The remaining offset is less than half a cell.
    fn turn_maps(self, maps: &mut Tensor, (layout, is_symmetric, width): (Layout, bool, usize)) {
        let Some([channels, rows, columns]) = maps.map_sides(layout) else {
            return;
        };
        let beyond = usize::from(!is_symmetric && columns < width);
        let [across, down] = if self.is_sideways() {
            [rows, columns]
        } else {
            [columns, rows]
        };
        let mut turned = vec![0.0; maps.values.len()];
        for y in 0..down {
            for x in 0..across {
                let last = [across - 1 + beyond, down - 1 + beyond];
                let [u, v] = self.in_input([x, y], last);
                let (u, v) = (u.min(columns - 1), v.min(rows - 1));
                for channel in 0..channels {
                    match layout {
                        Layout::Planes => {
                            turned[(channel * down + y) * across + x] =
                                maps.values[(channel * rows + v) * columns + u];
                        }
                        Layout::Pixels => {
                            turned[(y * across + x) * channels + channel] =
                                maps.values[(v * columns + u) * channels + channel];
                        }
                    }
                }
            }
        }
        maps.values = turned;
        maps.shape = match layout {
            Layout::Planes => vec![1, channels, down, across],
            Layout::Pixels => vec![1, down, across, channels],
        };
    }
}

/// Reverses distributions: pixel `x` of `n` becomes pixel `n - 1 - x`.
///
/// * `bins`: number of bins per pixel.
fn reverse(of: &mut Tensor, n_keypoints: usize, bins: usize) {
    let n = of.values.len() / n_keypoints.max(1);
    for values in of.values.chunks_exact_mut(n.max(1)) {
        let before = values.to_vec();
        for (bin, value) in values.iter_mut().enumerate() {
            let other = (n - bin).saturating_sub(bins.max(1));
            *value = before[other.min(n - 1)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_head_points_upward_after_the_rotation() {
        for (turn, head) in [
            (Turn::Up, [3, 0]),
            (Turn::Right, [6, 2]),
            (Turn::Down, [3, 4]),
            (Turn::Left, [0, 2]),
        ] {
            // A window of 7 x 5 cells. `head` is the middle of the side at which the head is.
            let [u, v] = turn.in_input(head, [6, 4]);
            let middle = if turn.is_sideways() { 2 } else { 3 };
            assert_eq!([u, v], [middle, 0], "{turn:?}");
        }
    }

    #[test]
    fn a_rotation_is_kept_until_the_head_points_far_away() {
        let most = 60f64.to_radians();
        let towards = |degrees: f64| [degrees.to_radians().sin(), -degrees.to_radians().cos()];
        for (now, degrees, next) in [
            (Turn::Up, 59.0, Turn::Up),
            (Turn::Up, 61.0, Turn::Right),
            (Turn::Up, -61.0, Turn::Left),
            (Turn::Right, 31.0, Turn::Right),
            (Turn::Right, 29.0, Turn::Up),
            (Turn::Down, -170.0, Turn::Down),
            (Turn::Left, 170.0, Turn::Down),
            (Turn::Up, 136.0, Turn::Down),
        ] {
            assert_eq!(
                now.towards(towards(degrees), most),
                next,
                "{now:?} {degrees}"
            );
        }
        assert_eq!(Turn::Left.towards([f64::NAN, 1.0], most), Turn::Left);
    }
}
