//! The window of a picture that a network sees.

use crate::card::{Card, Fit, Layout};
use crate::decode::Keypoint;

/// Least side of the window over a grid, pixels of the picture.
const LEAST_SIDE_PX: f64 = 8.0;
/// Most that one side of such a window is longer than the other.
const MOST_SLENDER: f64 = 4.0;

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

    /// The window around a person without a network: its input is a grid of square cells over the box, none of them smaller than
    /// a pixel. A box that is very slender, or a point, is widened.
    ///
    /// * `outline`: the box: left, top, right, bottom, pixels of the picture.
    /// * `margin`: the box is enlarged by it about its middle.
    /// * `most_rows`: most cells down; across there are at most four times as many.
    /// * Returns `None` for numbers that are not finite, and for a box whose sides are exchanged.
    pub fn grid(outline: [f64; 4], margin: f64, most_rows: usize) -> Option<Self> {
        let [left, top, right, bottom] = outline;
        let [width, height] = [right - left, bottom - top].map(|it| it * margin);
        let is_box = outline.iter().all(|it| it.is_finite()) && width >= 0.0 && height >= 0.0;
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
        Some(Self {
            centre: [f64::midpoint(left, right), f64::midpoint(top, bottom)],
            step: [step; 2],
            input: [columns as usize, rows as usize],
        })
    }

    /// Width and height of the input.
    pub fn input(&self) -> [usize; 2] {
        self.input
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

/// The box around the keypoints that were found with a score above 0: left, top, right, bottom.
pub fn outline(keypoints: &[Option<Keypoint>]) -> Option<[f64; 4]> {
    let found = keypoints.iter().flatten().filter(|it| it.score > 0.0);
    found.fold(None, |around: Option<[f64; 4]>, it| {
        let [x, y] = it.at;
        let [left, top, right, bottom] = around.unwrap_or([x, y, x, y]);
        Some([left.min(x), top.min(y), right.max(x), bottom.max(y)])
    })
}

/// The colour at a point, between four pixels; `fill` for those beyond the picture. The same bits as [`sample_anywhere`], without its
/// question for every pixel whether it is in the picture.
fn sample(rgb: &[u8], size: [usize; 2], [x, y]: [f64; 2], fill: f32) -> [f32; 3] {
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

/// The readable reference of [`sample`].
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

    proptest! {
        #[test]
        fn a_point_has_the_same_colour_either_way(
            x in -2.0..9.0_f64,
            y in -2.0..7.0_f64,
            whole in any::<bool>(),
            rgb in proptest::collection::vec(any::<u8>(), 3 * 7 * 5),
        ) {
            let at = if whole { [x.floor(), y.floor()] } else { [x, y] };
            let both = [sample, sample_anywhere].map(|it| it(&rgb, [7, 5], at, 12.5));
            prop_assert_eq!(both[0], both[1]);
        }
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

    #[test]
    fn a_grid_holds_the_box_in_square_cells() {
        let window = Window::grid([100.0, 50.0, 300.0, 450.0], 1.25, 64).unwrap();
        assert_eq!(window.input(), [32, 64]);
        assert_eq!(window.step(), [7.8125; 2]);
        assert_eq!(window.in_picture([16.0, 32.0]), [200.0, 250.0]);
        let small = Window::grid([0.0, 0.0, 20.0, 24.0], 1.25, 64).unwrap();
        assert_eq!((small.input(), small.step()), ([25, 30], [1.0; 2]));
    }

    #[test]
    fn a_grid_over_a_line_or_a_point_is_widened_and_stays_small() {
        for outline in [
            [10.0, 5.0, 900.0, 5.0],
            [10.0, 5.0, 10.0, 900.0],
            [10.0, 5.0, 10.0, 5.0],
            [-1e6, -1e6, 1e6, 1e6],
        ] {
            let window = Window::grid(outline, 1.25, 64).unwrap();
            let [columns, rows] = window.input();
            assert!((8..=64).contains(&rows) && (8..=257).contains(&columns));
            for corner in [[outline[0], outline[1]], [outline[2], outline[3]]] {
                let [x, y] = window.in_input(corner);
                assert!(x >= 0.0 && x <= columns as f64 && y >= 0.0 && y <= rows as f64);
            }
        }
        assert_eq!(Window::grid([0.0, 0.0, f64::NAN, 1.0], 1.25, 64), None);
        assert_eq!(Window::grid([5.0, 0.0, 1.0, 1.0], 1.25, 64), None);
        assert_eq!(Window::grid([f64::MIN, 0.0, f64::MAX, 1.0], 1.25, 64), None);
    }

    #[test]
    fn the_box_of_keypoints_is_of_those_that_were_found() {
        let at = |x, y, score| Some(Keypoint { at: [x, y], score });
        let all = [
            at(5.0, 9.0, 0.1),
            None,
            at(0.0, 0.0, 0.0),
            at(7.0, 2.0, 1.0),
        ];
        assert_eq!(outline(&all), Some([5.0, 2.0, 7.0, 9.0]));
        assert_eq!(outline(&all[1..3]), None);
    }
}
