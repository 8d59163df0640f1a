//! The window of a picture that becomes the input of a network.

use crate::card::{Card, Codec, Fit, Layout};
use crate::decode::Keypoint;

/// Minimum side of a window over a grid, in pixels of the picture.
const LEAST_SIDE_PX: f64 = 8.0;
/// Maximum ratio of the sides of such a window.
const MOST_SLENDER: f64 = 4.0;

/// Window of the picture that becomes the input of a network.
///
/// Coordinates have pixel centres at integers, in the picture and in the input. A box that is `s` pixels wide about `c` becomes the `W`
/// columns of the input by one of two formulas. Rows follow the same formula.
///
/// * Usually, `u = (x - c) W / s + W / 2`: lengths are counted in pixels. The left edge of the box maps to the centre of the
///   first pixel, and its right edge to one pixel beyond the centre of the last (mmpose's plain recipe).
/// * If the card has `udp = true`, `u = (x - c) (W - 1) / s + (W - 1) / 2`. Unbiased data processing (Huang et al. 2020) counts lengths in
///   steps between pixel centres, and `W` pixels have `W - 1` steps. The edges of the box map to the centres of the first and the last
///   pixel, and the middle of the box maps to the point midway between them (mmpose's `TopdownAffine` with `use_udp`). The aspect ratio of
///   the box is still that of the input, `W / H`, so the steps across and down differ a little. The corner cells of the maps are at the
///   corner pixels ([`HeatMaps::step`](crate::HeatMaps::step)), and therefore at the edges of the box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Middle of the window in the picture, in pixels.
    centre: [f64; 2],
    /// Number of pixels of the picture per pixel of the input, across and down.
    step: [f64; 2],
    /// Width and height of the input.
    input: [usize; 2],
    /// Position of the window's middle in the input.
    middle: [f64; 2],
}

impl Window {
    /// Returns the window around a person; `None` for a box without an extent, or with numbers that are not finite.
    ///
    /// * `outline`: the box: left, top, right, bottom, in pixels of the picture.
    pub fn new(card: &Card, outline: [f64; 4]) -> Option<Self> {
        Self::of_input(card, outline, [card.input.width, card.input.height])
    }

    /// Returns the window around a person who is lying in the picture: its height corresponds to the input's width, and its width to the
    /// input's height. The content of the window is rotated by a quarter turn before it becomes the input.
    ///
    /// * `card`, `outline`: as for [`Self::new`].
    pub fn sideways(card: &Card, outline: [f64; 4]) -> Option<Self> {
        Self::of_input(card, outline, [card.input.height, card.input.width])
    }

    fn of_input(card: &Card, outline: [f64; 4], input: [usize; 2]) -> Option<Self> {
        let [left, top, right, bottom] = outline;
        let mut size = [right - left, bottom - top].map(|value| value * card.crop.margin);
        let is_box =
            outline.iter().all(|value| value.is_finite()) && size.iter().all(|value| *value > 0.0);
        if !is_box {
            return None;
        }
        let [width, height] = input.map(|input| input as f64);
        if card.crop.fit == Fit::Widen {
            size = [
                size[0].max(size[1] * width / height),
                size[1].max(size[0] * height / width),
            ];
        }
        let lengths = if is_unbiased(card) {
            [width - 1.0, height - 1.0]
        } else {
            [width, height]
        };
        Some(Self {
            centre: [f64::midpoint(left, right), f64::midpoint(top, bottom)],
            step: [size[0] / lengths[0], size[1] / lengths[1]],
            input,
            middle: lengths.map(|length| length / 2.0),
        })
    }

    /// Returns the window around a person for use without a network. Its input is a grid of square cells over the box, none of which is
    /// smaller than a pixel. A box that is very slender, or a point, is widened.
    ///
    /// Returns `None` for numbers that are not finite, and for a box whose opposite sides are in the wrong order.
    ///
    /// * `outline`: the box: left, top, right, bottom, in pixels of the picture.
    /// * `margin`: factor by which the box is enlarged about its middle.
    /// * `most_rows`: maximum number of rows of cells. There are at most four times as many columns.
    pub fn grid(outline: [f64; 4], margin: f64, most_rows: usize) -> Option<Self> {
        let [left, top, right, bottom] = outline;
        let [width, height] = [right - left, bottom - top].map(|value| value * margin);
        let is_box = outline.iter().all(|value| value.is_finite()) && width >= 0.0 && height >= 0.0;
        if !is_box || !(width + height).is_finite() || most_rows == 0 {
            return None;
        }
        let [width, height] = [
            width.max(height / MOST_SLENDER).max(LEAST_SIDE_PX),
            height.max(width / MOST_SLENDER).max(LEAST_SIDE_PX),
        ];
        let rows = height.ceil().min(most_rows as f64);
        let step = height / rows;
        let columns = (width / step).ceil().max(1.0);
        let input = [columns as usize, rows as usize];
        Some(Self {
            centre: [f64::midpoint(left, right), f64::midpoint(top, bottom)],
            step: [step; 2],
            input,
            middle: input.map(|input| input as f64 / 2.0),
        })
    }

    /// Returns the width and height of the input.
    pub fn input(&self) -> [usize; 2] {
        self.input
    }

    /// Maps a point in the network's input to the corresponding point in the picture.
    pub fn in_picture(&self, at: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| self.centre[axis] + (at[axis] - self.middle[axis]) * self.step[axis])
    }

    /// Maps a point in the picture to the corresponding point in the network's input.
    pub fn in_input(&self, at: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| (at[axis] - self.centre[axis]) / self.step[axis] + self.middle[axis])
    }

    /// Returns the same window at another position in the picture.
    #[must_use]
    pub fn shifted(self, by: [f64; 2]) -> Self {
        let centre = [self.centre[0] + by[0], self.centre[1] + by[1]];
        Self { centre, ..self }
    }

    /// Returns the number of pixels of the picture per pixel of the input, across and down.
    pub fn step(&self) -> [f64; 2] {
        self.step
    }

    /// Writes the input of the network: the window, sampled bilinearly and prepared as the card specifies.
    ///
    /// * `rgb`: the picture, row major, red first; `size` is its width and height.
    /// * `values`: three values for every pixel of the input, all of which are written.
    ///
    /// # Panics
    ///
    /// Panics if the picture or the values have another length.
    pub fn fill(&self, card: &Card, rgb: &[u8], size: [usize; 2], values: &mut [f32]) {
        let [width, height] = self.input;
        assert_eq!(rgb.len(), 3 * size[0] * size[1], "the picture is RGB");
        assert_eq!(
            values.len(),
            3 * width * height,
            "there must be three values for each pixel"
        );
        let plane = width * height;
        for row in 0..height {
            for column in 0..width {
                let at = self.in_picture([column as f64, row as f64]);
                let colour = sample(rgb, size, at, f32::from(card.crop.fill));
                let pixel = row * width + column;
                for (channel, value) in card.input.prepared(colour).into_iter().enumerate() {
                    values[match card.input.layout {
                        Layout::Planes => channel * plane + pixel,
                        Layout::Pixels => 3 * pixel + channel,
                    }] = value;
                }
            }
        }
    }
}

/// Returns true if the network was trained with unbiased data processing.
fn is_unbiased(card: &Card) -> bool {
    matches!(card.output, Codec::HeatMap { udp: true, .. })
}

/// Returns the box around the keypoints that were found with a score above 0: left, top, right, bottom.
pub fn outline(keypoints: &[Option<Keypoint>]) -> Option<[f64; 4]> {
    let found = keypoints.iter().flatten().filter(|keypoint| keypoint.score > 0.0);
    found.fold(None, |around: Option<[f64; 4]>, it| {
        let [x, y] = it.at;
        let [left, top, right, bottom] = around.unwrap_or([x, y, x, y]);
        Some([left.min(x), top.min(y), right.max(x), bottom.max(y)])
    })
}

/// Returns the colour at a point, interpolated between four pixels; `fill` is the colour outside the picture. The result is bit-identical
/// to the result of [`sample_anywhere`], but the function does not check for every pixel whether it is in the picture.
pub(crate) fn sample(rgb: &[u8], size: [usize; 2], [x, y]: [f64; 2], fill: f32) -> [f32; 3] {
    let [width, height] = size;
    if !(x >= 0.0 && y >= 0.0 && x + 1.0 < width as f64 && y + 1.0 < height as f64) {
        return sample_anywhere(rgb, size, [x, y], fill);
    }
    let (left, top) = (x as usize, y as usize);
    let (right_share, low_share) = ((x - left as f64) as f32, (y - top as f64) as f32);
    let first = 3 * (top * width + left);
    let upper: &[u8] = &rgb[first..first + 6];
    let lower: &[u8] = &rgb[first + 3 * width..first + 3 * width + 6];
    core::array::from_fn(|channel| {
        let row = |line: &[u8]| {
            let (a, b) = (f32::from(line[channel]), f32::from(line[channel + 3]));
            a + (b - a) * right_share
        };
        let (a, b) = (row(upper), row(lower));
        a + (b - a) * low_share
    })
}

/// The readable reference implementation of [`sample`].
fn sample_anywhere(
    rgb: &[u8],
    [width, height]: [usize; 2],
    [x, y]: [f64; 2],
    fill: f32,
) -> [f32; 3] {
    let (left, top) = (x.floor(), y.floor());
    let (right_share, low_share) = ((x - left) as f32, (y - top) as f32);
    let pixel = |column: f64, row: f64, channel: usize| {
        let inside = column >= 0.0 && row >= 0.0 && column < width as f64 && row < height as f64;
        if inside {
            f32::from(rgb[3 * (row as usize * width + column as usize) + channel])
        } else {
            fill
        }
    };
    core::array::from_fn(|channel| {
        let row = |row: f64| {
            let (a, b) = (pixel(left, row, channel), pixel(left + 1.0, row, channel));
            a + (b - a) * right_share
        };
        let (a, b) = (row(top), row(top + 1.0));
        a + (b - a) * low_share
    })
}

#[cfg(test)]
mod tests;
