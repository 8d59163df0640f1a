//! Painting over parts of a picture before the network runs on it.

use keypoints::{Card, Layout, Window};

/// A body part as a bar with round ends, in pixels of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bar {
    /// Both ends of the bar's axis.
    pub ends: [[f64; 2]; 2],
    /// Half the width of the bar.
    pub radius: f64,
}

impl Bar {
    /// Returns true if a point is inside the bar.
    pub(crate) fn holds(&self, at: [f64; 2]) -> bool {
        let [from, to] = self.ends;
        let along = [to[0] - from[0], to[1] - from[1]];
        let off = [at[0] - from[0], at[1] - from[1]];
        let squared = along[0] * along[0] + along[1] * along[1];
        let share = if squared > 0.0 {
            ((off[0] * along[0] + off[1] * along[1]) / squared).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let [x, y] = [0, 1].map(|axis| off[axis] - share * along[axis]);
        x * x + y * y <= self.radius * self.radius
    }
}

/// Paints bars over the input of a network, in the colour that the input has outside the picture.
///
/// * `values`: the input in the window.
pub(crate) fn paint(bars: &[Bar], window: &Window, card: &Card, values: &mut [f32]) {
    let [width, height] = window.input();
    let plane = width * height;
    let colour = card.input.prepared([f32::from(card.crop.fill); 3]);
    let step = window.step();
    for bar in bars {
        let ends = bar.ends.map(|end| window.in_input(end));
        let [columns, rows] = [(0, width), (1, height)].map(|(axis, n)| {
            let reach = bar.radius / step[axis];
            let low = ends[0][axis].min(ends[1][axis]) - reach;
            let high = ends[0][axis].max(ends[1][axis]) + reach;
            let side = |at: f64| at.clamp(0.0, n as f64) as usize;
            side(low.ceil())..side(high.floor() + 1.0)
        });
        for row in rows {
            for column in columns.clone() {
                if !bar.holds(window.in_picture([column as f64, row as f64])) {
                    continue;
                }
                let pixel = row * width + column;
                for (channel, value) in colour.into_iter().enumerate() {
                    values[match card.input.layout {
                        Layout::Planes => channel * plane + pixel,
                        Layout::Pixels => 3 * pixel + channel,
                    }] = value;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_has_round_ends() {
        let bar = Bar {
            ends: [[10.0, 10.0], [30.0, 10.0]],
            radius: 4.0,
        };
        for (at, is_held) in [
            ([20.0, 13.9], true),
            ([20.0, 14.1], false),
            ([6.1, 10.0], true),
            ([33.0, 13.0], false),
        ] {
            assert_eq!(bar.holds(at), is_held, "{at:?}");
        }
        let point = Bar {
            ends: [[5.0, 5.0]; 2],
            radius: 1.0,
        };
        assert!(point.holds([5.5, 5.5]) && !point.holds([f64::NAN, 5.0]));
    }

    #[test]
    fn painted_areas_have_the_border_colour_and_other_pixels_are_unchanged() {
        let card = Card::parse(
            "format = \"parallax-keypoint-network\"\nversion = 1\nname = \"n\"\n\
             [input]\nwidth = 32\nheight = 40\nmean = [110.0, 110.0, 110.0]\nstd = [60.0, 60.0, 60.0]\n\
             [crop]\nmargin = 1.25\nfill = 20\n[output]\ncodec = \"heat-map\"\n[keypoints]\nset = \"lsp-14\"\n",
        )
        .unwrap();
        let outline = [100.0, 50.0, 150.0, 130.0];
        let window = Window::new(&card, outline).unwrap();
        let [width, height] = window.input();
        let mut values = vec![f32::MAX; 3 * width * height];
        let middle = [125.0, 90.0];
        let bar = Bar {
            ends: [[125.0, 60.0], [125.0, 120.0]],
            radius: 5.0,
        };
        paint(&[bar], &window, &card, &mut values);
        let painted = card.input.prepared([f32::from(card.crop.fill); 3]);
        let [column, row] = window.in_input(middle).map(|side| side.round() as usize);
        let at = |channel: usize, column: usize| values[(channel * height + row) * width + column];
        for (channel, expected) in painted.into_iter().enumerate() {
            assert_eq!((at(channel, column), at(channel, 0)), (expected, f32::MAX));
        }
    }
}
