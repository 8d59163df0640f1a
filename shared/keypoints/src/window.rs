//! The window of a picture that a network sees.

use crate::card::{Card, Fit, Layout};

/// Where the input of a network lies in a picture.
///
/// Coordinates have pixel centres at integers, in the picture and in the input; the middle of the window is half the width and
/// half the height of the input, as in the published recipes (mmpose).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Its middle in the picture, pixels.
    centre: [f64; 2],
    /// Pixels of the picture for a pixel of the input, across and down.
    step: [f64; 2],
    /// Width and height of the input.
    input: [usize; 2],
}

impl Window {
    /// The window around a person.
    ///
    /// * `outline`: the box: left, top, right, bottom, pixels of the picture.
    /// * Returns `None` for a box without an extent, or with numbers that are not finite.
    pub fn new(card: &Card, outline: [f64; 4]) -> Option<Self> {
        let [left, top, right, bottom] = outline;
        let input = [card.input.width, card.input.height];
        let mut size = [right - left, bottom - top].map(|it| it * card.crop.margin);
        let is_box = outline.iter().all(|it| it.is_finite()) && size.iter().all(|it| *it > 0.0);
        if !is_box {
            return None;
        }
        let [width, height] = input.map(|it| it as f64);
        if card.crop.fit == Fit::Widen {
            size = [
                size[0].max(size[1] * width / height),
                size[1].max(size[0] * height / width),
            ];
        }
        Some(Self {
            centre: [f64::midpoint(left, right), f64::midpoint(top, bottom)],
            step: [size[0] / width, size[1] / height],
            input,
        })
    }

    /// The point of the picture at a point of the input.
    pub fn in_picture(&self, at: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| {
            let middle = self.input[axis] as f64 / 2.0;
            self.centre[axis] + (at[axis] - middle) * self.step[axis]
        })
    }

    /// The point of the input at a point of the picture.
    pub fn in_input(&self, at: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| {
            let middle = self.input[axis] as f64 / 2.0;
            (at[axis] - self.centre[axis]) / self.step[axis] + middle
        })
    }

    /// The same window elsewhere in the picture.
    #[must_use]
    pub fn shifted(self, by: [f64; 2]) -> Self {
        let centre = [self.centre[0] + by[0], self.centre[1] + by[1]];
        Self { centre, ..self }
    }

    /// Pixels of the picture for a pixel of the input, across and down.
    pub fn step(&self) -> [f64; 2] {
        self.step
    }

    /// Writes the input of the network: the window, bilinear, prepared as the card says.
    ///
    /// * `rgb`: the picture, row major, red first; `size` is its width and height.
    /// * `values`: three for every pixel of the input, all of them written.
    ///
    /// # Panics
    ///
    /// If the picture or the values have another length.
    pub fn fill(&self, card: &Card, rgb: &[u8], size: [usize; 2], values: &mut [f32]) {
        let [width, height] = self.input;
        assert_eq!(rgb.len(), 3 * size[0] * size[1], "the picture is RGB");
        assert_eq!(values.len(), 3 * width * height, "three values for a pixel");
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

/// The colour at a point, between four pixels; `fill` for those beyond the picture.
fn sample(rgb: &[u8], [width, height]: [usize; 2], [x, y]: [f64; 2], fill: f32) -> [f32; 3] {
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
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::card::{Colour, tests::card};

    #[test]
    fn a_widened_box_has_the_shape_of_the_input_and_holds_the_box() {
        // 96 wide, 128 high; the box is 100 by 100, with its margin 125 by 125.
        let window = Window::new(&card(), [50.0, 50.0, 150.0, 150.0]).unwrap();
        assert_eq!(window.step()[0], window.step()[1]);
        assert_eq!(window.in_picture([48.0, 64.0]), [100.0, 100.0]);
        let [left, _] = window.in_picture([0.0, 0.0]);
        assert!((left - (100.0 - 62.5)).abs() < 1e-9, "{left}");
    }

    #[test]
    fn a_stretched_box_fills_the_input() {
        let mut card = card();
        card.crop.fit = Fit::Stretch;
        card.crop.margin = 1.0;
        let window = Window::new(&card, [50.0, 60.0, 150.0, 100.0]).unwrap();
        assert_eq!(window.in_picture([0.0, 0.0]), [50.0, 60.0]);
        assert_eq!(window.in_picture([96.0, 128.0]), [150.0, 100.0]);
    }

    #[test]
    fn a_box_without_extent_has_no_window() {
        for outline in [
            [1.0, 1.0, 1.0, 5.0],
            [5.0, 1.0, 2.0, 5.0],
            [f64::NAN, 1.0, 2.0, 5.0],
            [0.0, 1.0, f64::INFINITY, 5.0],
        ] {
            assert_eq!(Window::new(&card(), outline), None, "{outline:?}");
        }
    }

    #[test]
    fn the_input_is_the_picture_prepared_as_the_card_says() {
        let mut card = card();
        (card.crop.margin, card.crop.fill) = (1.0, 9);
        (card.input.scale, card.input.mean, card.input.std) =
            (0.5, [1.0, 2.0, 3.0], [2.0, 4.0, 8.0]);
        // A picture of one colour, in the middle of the window one pixel for one.
        let rgb: Vec<u8> = [10, 20, 30].repeat(96 * 128);
        let window = Window::new(&card, [0.0, 0.0, 96.0, 128.0]).unwrap();
        let mut values = vec![f32::NAN; 3 * 96 * 128];
        window.fill(&card, &rgb, [96, 128], &mut values);
        let plane = 96 * 128;
        assert_eq!(
            [values[0], values[plane], values[2 * plane]],
            [2.0, 2.0, 1.5]
        );
        card.input.colour = Colour::Bgr;
        card.input.layout = Layout::Pixels;
        window.fill(&card, &rgb, [96, 128], &mut values);
        assert_eq!(values[..3], [7.0, 2.0, 0.25]);
        // Beyond the picture.
        let far = Window::new(&card, [500.0, 0.0, 596.0, 128.0]).unwrap();
        far.fill(&card, &rgb, [96, 128], &mut values);
        assert_eq!(values[..3], [1.75, 0.625, 0.1875]);
    }

    proptest! {
        #[test]
        fn there_and_back_is_the_same_place(
            corner in [-500.0..2000.0, -500.0..2000.0_f64], size in [1.0..900.0, 1.0..900.0_f64],
            at in [-100.0..500.0, -100.0..500.0_f64],
        ) {
            let outline = [corner[0], corner[1], corner[0] + size[0], corner[1] + size[1]];
            let window = Window::new(&card(), outline).unwrap();
            let back = window.in_input(window.in_picture(at));
            prop_assert!((0..2).all(|axis| (back[axis] - at[axis]).abs() < 1e-6), "{:?}", back);
        }
    }
}
