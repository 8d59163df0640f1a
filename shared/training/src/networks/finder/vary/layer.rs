//! Pictures placed over each other.

use super::{Around, FILL, Picture};

/// Minimum visible share of a person whom the network should find.
const SEEN: f32 = 0.3;
/// Visible share of a person below which the person counts as invisible.
const UNSEEN: f32 = 0.04;
/// Minimum height of a person, in pixels of the input.
const LEAST_PX: f32 = 14.0;
/// Maximum number of pixels, across and down, that are averaged for a pixel of the input.
const MOST_MEAN: usize = 16;

/// A picture and its placement in the sample.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layer<'a> {
    pub(super) picture: &'a Picture,
    /// The point of the picture at the first pixel of the sample.
    pub(super) from: [f32; 2],
    /// Pixels of the picture per pixel of the sample.
    pub(super) step: f32,
    pub(super) is_mirrored: bool,
    /// The part of the sample that shows the picture: left, top, right, bottom.
    pub(super) window: [f32; 4],
    /// True if the corners of the window are transparent, so that they show the layer below.
    pub(super) is_round: bool,
}

impl Layer<'_> {
    fn across(&self) -> f32 {
        if self.is_mirrored {
            -self.step
        } else {
            self.step
        }
    }

    fn in_picture(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        [
            self.from[0] + x * self.across(),
            self.from[1] + y * self.step,
        ]
    }

    /// Converts a box of the picture to the sample.
    pub(super) fn in_sample(&self, around: &Around) -> Around {
        let [left, top, right, bottom] = around.outline;
        let x = |at: f32| (at - self.from[0]) / self.across();
        let y = |at: f32| (at - self.from[1]) / self.step;
        let ends = [x(left), x(right)];
        Around {
            outline: [
                ends[0].min(ends[1]),
                y(top),
                ends[0].max(ends[1]),
                y(bottom),
            ],
            ..*around
        }
    }

    /// Returns true if a pixel of the sample shows this picture.
    fn shows(&self, [x, y]: [f32; 2]) -> bool {
        let [left, top, right, bottom] = self.window;
        let place = |at: f32, low: f32, high: f32| (2.0 * at - low - high) / (high - low);
        let [x, y] = [place(x, left, right), place(y, top, bottom)];
        !self.is_round || x.powi(4) + y.powi(4) < 1.0
    }

    fn paint(&self, rgb: &mut [[f32; 3]], side: usize) {
        let [left, top, right, bottom] = self.window;
        let pixels = |low: f32, high: f32| {
            let end = (high.ceil().max(0.0) as usize).min(side);
            (low.ceil().max(0.0) as usize).min(end)..end
        };
        for row in pixels(top, bottom) {
            for column in pixels(left, right) {
                let at = [column as f32, row as f32];
                if self.shows(at) {
                    rgb[row * side + column] = self.colour(self.in_picture(at));
                }
            }
        }
    }

    /// The colour at a point: interpolated bilinearly, or averaged if the picture is reduced in size.
    fn colour(&self, [x, y]: [f32; 2]) -> [f32; 3] {
        let Picture { size, rgb, .. } = self.picture;
        let last = size.map(|side| side as f32 - 1.0);
        let pixel = |column: f32, row: f32| {
            let column = column.clamp(0.0, last[0]) as usize;
            let row = row.clamp(0.0, last[1]) as usize;
            let at = 3 * (row * size[0] + column);
            [rgb[at], rgb[at + 1], rgb[at + 2]].map(f32::from)
        };
        let n = (self.step as usize).clamp(1, MOST_MEAN);
        let mut sum = [0.0; 3];
        let mut add = |colour: [f32; 3], weight: f32| {
            for (sum, colour) in sum.iter_mut().zip(colour) {
                *sum += weight * colour;
            }
        };
        if n == 1 {
            let [x, y] = [x.clamp(0.0, last[0]), y.clamp(0.0, last[1])];
            let [right, below] = [x - x.floor(), y - y.floor()];
            add(pixel(x, y), (1.0 - right) * (1.0 - below));
            add(pixel(x + 1.0, y), right * (1.0 - below));
            add(pixel(x, y + 1.0), (1.0 - right) * below);
            add(pixel(x + 1.0, y + 1.0), right * below);
            return sum;
        }
        let half = 0.5 * (n - 1) as f32;
        for part in 0..n * n {
            let [dx, dy] = [(part % n) as f32 - half, (part / n) as f32 - half];
            add(
                pixel((x + dx).round(), (y + dy).round()),
                1.0 / (n * n) as f32,
            );
        }
        sum
    }
}

/// The pixels of the sample with the last layer on top: row by row, 0 to 255.
pub(super) fn painted(layers: &[Layer<'_>], side: usize) -> Vec<[f32; 3]> {
    let mut rgb = vec![[FILL; 3]; side * side];
    for layer in layers {
        layer.paint(&mut rgb, side);
    }
    rgb
}

/// The boxes of all people who are at least partly visible, in pixels of the sample.
pub(super) fn boxes(layers: &[Layer<'_>]) -> Vec<Around> {
    let mut all = Vec::new();
    for (nth, layer) in layers.iter().enumerate() {
        for person in &layer.picture.people {
            let whole = layer.in_sample(person);
            let cut = whole.cut(layer.window);
            let above = layers[nth + 1..].iter();
            let hidden = above.map(|above| cut.cut(above.window).area()).fold(0.0, f32::max);
            let seen = (cut.area() - hidden).max(0.0) / whole.area().max(1e-3);
            if seen > UNSEEN {
                let [_, top, _, bottom] = cut.outline;
                let counts = cut.counts && seen > SEEN && bottom - top > LEAST_PX;
                all.push(Around { counts, ..cut });
            }
        }
    }
    all
}
