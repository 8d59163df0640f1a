//! The person's tile: the part of a frame that a network takes as input.

use kernels::Rgb8View;

/// Height shown by a tile, relative to the height of the person's box.
///
/// The box already extends half a part beyond the outermost centres. Because of the margin, the network also sees the surroundings of the
/// ends of limbs.
const MARGIN: f64 = 1.1;

/// The size of a tile in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TileShape {
    /// Height in pixels, at least 1.
    pub height: usize,
    /// Width in pixels, at least 1.
    pub width: usize,
}

impl TileShape {
    /// The tile of the small network.
    pub const SMALL: Self = Self {
        height: 160,
        width: 64,
    };
    /// The tile of VGG-16. Halved five times, it becomes 5 x 1.
    pub const VGG16: Self = Self {
        height: 160,
        width: 48,
    };

    /// Number of values of a tile, which has three channels.
    pub fn n_values(self) -> usize {
        3 * self.height * self.width
    }
}

/// The position of a tile in its frame. The tile is upright and not distorted, with the same scale in both
/// directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tile {
    /// The size of the tile.
    pub shape: TileShape,
    /// Centre of the tile in the frame, `[x, y]` in pixels; the centre of the top-left pixel is (0, 0).
    pub centre: [f64; 2],
    /// Pixels of the frame per pixel of the tile, above 0.
    pub scale: f64,
}

impl Tile {
    /// Returns the smallest tile that shows a box with a margin of a tenth.
    ///
    /// For a box of width `b` and height `h`, the tile shows a height of `1.1 max(h, b H / W)` pixels of the frame
    /// around the box's centre. `H x W` is the tile's shape.
    ///
    /// * `bounds`: `[x1, y1, x2, y2]`, centres of the outermost pixels, as returned by
    ///   [`Pose::bounding_box`](fmp::Pose::bounding_box) of the single-view pose.
    /// * Returns `None` if the box is empty or not finite.
    pub fn around(bounds: [f64; 4], shape: TileShape) -> Option<Self> {
        let [x1, y1, x2, y2] = bounds;
        let [width, height] = [x2 - x1 + 1.0, y2 - y1 + 1.0];
        let by_width = width * shape.height as f64 / shape.width as f64;
        let scale = MARGIN * height.max(by_width) / shape.height as f64;
        let centre = [f64::midpoint(x1, x2), f64::midpoint(y1, y2)];
        let is_finite = scale.is_finite() && centre.iter().all(|value| value.is_finite());
        (is_finite && width > 0.0 && height > 0.0).then_some(Self {
            shape,
            centre,
            scale,
        })
    }

    /// Height that the tile shows, in pixels of the frame. Relative errors are fractions of this height.
    pub fn height_px(&self) -> f64 {
        self.shape.height as f64 * self.scale
    }

    /// Width that the tile shows, in pixels of the frame.
    pub fn width_px(&self) -> f64 {
        self.shape.width as f64 * self.scale
    }

    /// The rectangle that the tile shows, `[x1, y1, x2, y2]`: the centres of its outermost pixels of
    /// the frame.
    pub fn rectangle(&self) -> [f64; 4] {
        let [x, y] = self.centre;
        let [dx, dy] = [self.width_px(), self.height_px()].map(|side| (side - 1.0) / 2.0);
        [x - dx, y - dy, x + dx, y + dy]
    }

    /// The position of a point of the frame relative to the tile's centre, `[x, y]` in heights of
    /// the tile.
    pub fn place(&self, point: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.centre;
        [point[0] - x, point[1] - y].map(|value| value / self.height_px())
    }
}

/// The normalisation of colours for a network: `(v / 255 - mean) / deviation` per channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Normalisation {
    /// Mean of red, green and blue, from 0 to 1.
    pub mean: [f32; 3],
    /// Standard deviation of red, green and blue, above 0.
    pub deviation: [f32; 3],
}

impl Normalisation {
    /// Normalisation for networks that were trained on `ImageNet`, such as torchvision's.
    pub const IMAGENET: Self = Self {
        mean: [0.485, 0.456, 0.406],
        deviation: [0.229, 0.224, 0.225],
    };
}

/// Resamples tiles; its buffers are reused between calls.
#[derive(Debug, Clone, Default)]
pub struct Sampler {
    taps: Vec<Taps>,
    weights: Vec<f32>,
    band: Vec<f32>,
}

/// The pixels of a row or column of the frame whose weighted mean is a pixel of the tile.
#[derive(Debug, Clone, Copy)]
struct Taps {
    /// Index of the first pixel. It may be outside the frame; there, the border of the frame is repeated.
    first: i64,
    /// Index of the first weight. The next field is the number of weights.
    begin: usize,
    count: usize,
}

impl Sampler {
    /// Resamples a tile from its frame, as `3 x height x width` normalised values.
    ///
    /// Every pixel is a weighted mean, first over one direction, then over the other. The weight of a pixel of the frame falls linearly to
    /// 0 at `max(1, s)` pixels from the position of the tile's pixel, where `s` is the scale. This is bilinear interpolation if the tile
    /// has the higher resolution, and averaging without aliasing if it has the lower one. Outside the frame, the border of the frame is
    /// repeated. Sums are computed in f32 in ascending order, columns first, so that the same frame and tile give the same bits everywhere.
    ///
    /// * `out`: [`TileShape::n_values`] values, overwritten; red, green, blue planes, row major.
    ///
    /// # Panics
    ///
    /// Panics if `out` has the wrong length, or the image has no pixels.
    pub fn sample(
        &mut self,
        image: Rgb8View<'_>,
        tile: &Tile,
        colours: &Normalisation,
        out: &mut [f32],
    ) {
        let TileShape { height, width } = tile.shape;
        assert_eq!(out.len(), tile.shape.n_values(), "one value per colour");
        assert!(image.width() > 0 && image.height() > 0, "an image");
        self.taps.clear();
        self.weights.clear();
        self.add_taps(tile.centre[1], tile.scale, height);
        self.add_taps(tile.centre[0], tile.scale, width);
        let columns = self.columns(height, image.width());
        self.band.resize(3 * (columns[1] - columns[0]), 0.0);
        for row in 0..height {
            self.mix_rows(image, row, columns);
            for col in 0..width {
                let mean = self.mix_columns(height + col, image.width(), columns);
                for channel in 0..3 {
                    let value = (mean[channel] / 255.0 - colours.mean[channel])
                        / colours.deviation[channel];
                    out[(channel * height + row) * width + col] = value;
                }
            }
        }
    }

    /// Computes the pixels and weights of one direction.
    fn add_taps(&mut self, centre: f64, scale: f64, n: usize) {
        let reach = scale.max(1.0);
        for i in 0..n {
            let at = centre + (i as f64 - (n as f64 - 1.0) / 2.0) * scale;
            let [first, last] = [(at - reach).ceil() as i64, (at + reach).floor() as i64];
            let begin = self.weights.len();
            let weight = |value: i64| (1.0 - (value as f64 - at).abs() / reach).max(0.0);
            let total: f64 = (first..=last).map(weight).sum();
            self.weights.extend((first..=last).map(|i| (weight(i) / total) as f32));
            let count = self.weights.len() - begin;
            self.taps.push(Taps {
                first,
                begin,
                count,
            });
        }
    }

    /// First column of the frame that the tile needs, and the column after the last one.
    fn columns(&self, height: usize, image_width: usize) -> [usize; 2] {
        let inside = |value: i64| value.clamp(0, image_width as i64 - 1) as usize;
        let columns = &self.taps[height..];
        let first = columns.iter().map(|column| inside(column.first)).min();
        let last = columns
            .iter()
            .map(|column| inside(column.first + column.count as i64 - 1))
            .max();
        [first.unwrap_or(0), last.map_or(1, |value| value + 1)]
    }

    /// Writes to `band` the weighted mean of the frame's rows for one row of the tile.
    fn mix_rows(&mut self, image: Rgb8View<'_>, row: usize, [left, right]: [usize; 2]) {
        let taps = self.taps[row];
        self.band.fill(0.0);
        for (i, &weight) in self.weights[taps.begin..][..taps.count].iter().enumerate() {
            let y = (taps.first + i as i64).clamp(0, image.height() as i64 - 1) as usize;
            let pixels = &image.data()[3 * (y * image.width() + left)..][..3 * (right - left)];
            for (sum, &value) in self.band.iter_mut().zip(pixels) {
                *sum += weight * f32::from(value);
            }
        }
    }

    /// The weighted mean, for one column of the tile, of the pixels in the row that [`Self::mix_rows`] has written.
    fn mix_columns(&self, taps: usize, image_width: usize, [left, _]: [usize; 2]) -> [f32; 3] {
        let taps = self.taps[taps];
        let mut mean = [0.0; 3];
        for (i, &weight) in self.weights[taps.begin..][..taps.count].iter().enumerate() {
            let x = (taps.first + i as i64).clamp(0, image_width as i64 - 1) as usize - left;
            for (sum, &value) in mean.iter_mut().zip(&self.band[3 * x..][..3]) {
                *sum += weight * value;
            }
        }
        mean
    }
}

#[cfg(test)]
mod tests;
