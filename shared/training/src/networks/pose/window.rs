//! The window of a picture that becomes an input of the network.

use super::Shape;
use super::person::{Person, SIDE};

/// Factor by which the box around the joints is enlarged. The network's card gives this factor to programs that use the network.
pub const MARGIN: f32 = 1.25;
/// Margin for hands, feet and hair beyond the joints, on each side, as a share of the longer side.
const BEYOND: f32 = 0.05;
/// Colour outside the picture.
pub const FILL: f32 = 110.0;

/// Mapping of a picture to the input: it is rotated, moved, scaled, and possibly mirrored.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    /// Cosine and sine of the angle by which the picture is rotated.
    pub(super) turn: [f32; 2],
    /// Centre of the window in the rotated picture, in pixels. The origin is the centre of the picture.
    centre: [f32; 2],
    /// Pixels of the picture per pixel of the input.
    pub(super) step: f32,
    /// Width and height of the input.
    pub(super) size: [usize; 2],
    /// True if the input is the mirror image.
    pub(super) is_mirrored: bool,
}

impl View {
    fn turned(&self, at: [f32; 2]) -> [f32; 2] {
        turned(at, self.turn)
    }

    /// Converts a point of the picture to the input.
    pub(super) fn in_input(&self, at: [f32; 2]) -> [f32; 2] {
        let at = self.turned(at);
        let [x, y] = [0, 1]
            .map(|axis| (at[axis] - self.centre[axis]) / self.step + 0.5 * self.size[axis] as f32);
        if self.is_mirrored {
            [(self.size[0] - 1) as f32 - x, y]
        } else {
            [x, y]
        }
    }

    /// Converts a point of the input to the picture.
    pub(super) fn in_picture(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let x = if self.is_mirrored {
            (self.size[0] - 1) as f32 - x
        } else {
            x
        };
        let at = [x, y];
        let [x, y] = [0, 1]
            .map(|axis| self.centre[axis] + (at[axis] - 0.5 * self.size[axis] as f32) * self.step);
        let [cosine, sine] = self.turn;
        let middle = middle();
        [
            cosine * x + sine * y + middle,
            -sine * x + cosine * y + middle,
        ]
    }
}

fn middle() -> f32 {
    0.5 * (SIDE - 1) as f32
}

/// Rotates a point of the picture about the picture's centre, which becomes the origin.
fn turned(at: [f32; 2], [cosine, sine]: [f32; 2]) -> [f32; 2] {
    let [x, y] = at.map(|side| side - middle());
    [cosine * x - sine * y, sine * x + cosine * y]
}

/// The window around the joints; `None` if the joints are almost at the same point.
pub(super) fn view(
    person: &Person,
    shape: &Shape,
    turn: [f32; 2],
    (scale, shift, is_mirrored): (f32, [f32; 2], bool),
) -> Option<View> {
    let mut low = [f32::INFINITY; 2];
    let mut high = [f32::NEG_INFINITY; 2];
    for at in person.places() {
        let at = turned(at, turn);
        for axis in 0..2 {
            low[axis] = low[axis].min(at[axis]);
            high[axis] = high[axis].max(at[axis]);
        }
    }
    let longer = (high[0] - low[0]).max(high[1] - low[1]);
    if !(longer.is_finite() && longer > 8.0) {
        return None;
    }
    let size = [shape.width, shape.height];
    let sides = [0, 1].map(|axis| (high[axis] - low[axis] + 2.0 * BEYOND * longer) * MARGIN);
    let steps = [0, 1].map(|axis| sides[axis] / size[axis] as f32);
    let step = steps[0].max(steps[1]) * scale;
    let height = step * size[1] as f32;
    let centre = [0, 1].map(|axis| f32::midpoint(low[axis], high[axis]) + shift[axis] * height);
    Some(View {
        turn,
        centre,
        step,
        size,
        is_mirrored,
    })
}

/// The pixels of the window, interpolated: `[height][width]`, red first, 0 to 255.
pub(super) fn pixels(person: &Person, view: &View) -> Vec<[f32; 3]> {
    let [width, height] = view.size;
    let mut all = Vec::with_capacity(width * height);
    for row in 0..height {
        for column in 0..width {
            let at = view.in_picture([column as f32, row as f32]);
            all.push(colour(&person.rgb, at));
        }
    }
    all
}

/// Interpolates the colour between four pixels.
pub(super) fn colour(rgb: &[u8], [x, y]: [f32; 2]) -> [f32; 3] {
    let (left, top) = (x.floor(), y.floor());
    let [right, below] = [x - left, y - top];
    let mut sum = [0.0; 3];
    for (dy, of_row) in [(0, 1.0 - below), (1, below)] {
        for (dx, of_column) in [(0, 1.0 - right), (1, right)] {
            let [column, row] = [left as i32 + dx, top as i32 + dy];
            let weight = of_row * of_column;
            let side = 0..SIDE as i32;
            let is_inside = side.contains(&column) && side.contains(&row);
            let at = 3 * (row.max(0) as usize * SIDE + column.max(0) as usize);
            for (channel, sum) in sum.iter_mut().enumerate() {
                let value = if is_inside {
                    f32::from(rgb[at + channel])
                } else {
                    FILL
                };
                *sum += weight * value;
            }
        }
    }
    sum
}
