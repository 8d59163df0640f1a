//! The square picture of a person that is stored for the training.

use kernels::Rgb8View;
use training::networks::pose::{FILL, MARGIN, SIDE, Shape, WINDOW};

/// Position of the square in a picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crop {
    /// Centre of the square, in pixels of the picture.
    centre: [f64; 2],
    /// Pixels of the picture per pixel of the square.
    step: f64,
    /// Cosine and sine of the rotation of the picture.
    turn: [f64; 2],
}

impl Crop {
    /// Returns the square around the joints with finite positions. It has the size of the network's window, plus a margin. Returns `None`
    /// if all joints are at the same point.
    ///
    /// * `angle`: clockwise rotation of the picture before cropping, in radians.
    pub(super) fn around(joints: &[[f64; 2]], angle: f64) -> Option<Self> {
        let turn = [angle.cos(), angle.sin()];
        let known = joints.iter().filter(|joint| joint.iter().all(|value| value.is_finite()));
        let turned = known.map(|[x, y]| [turn[0] * x - turn[1] * y, turn[1] * x + turn[0] * y]);
        let [left, top, right, bottom] = posenetwork::outline_of(turned)?;
        let shape = Shape::default();
        let aspect = shape.height as f64 / shape.width as f64;
        let height = (bottom - top).max((right - left) * aspect) * f64::from(MARGIN);
        let [x, y] = [f64::midpoint(left, right), f64::midpoint(top, bottom)];
        Some(Self {
            centre: [turn[0] * x + turn[1] * y, -turn[1] * x + turn[0] * y],
            step: height / WINDOW,
            turn,
        })
    }

    /// Converts a point of the picture to a point of the square.
    pub(super) fn inside(&self, at: [f64; 2]) -> [f64; 2] {
        let [x, y] = [0, 1].map(|axis| (at[axis] - self.centre[axis]) / self.step);
        let [cosine, sine] = self.turn;
        let middle = 0.5 * (SIDE - 1) as f64;
        [
            cosine * x - sine * y + middle,
            sine * x + cosine * y + middle,
        ]
    }

    /// Converts a point of the square to a point of the picture.
    pub(super) fn outside(&self, at: [f64; 2]) -> [f64; 2] {
        let [x, y] = at.map(|at| (at - 0.5 * (SIDE - 1) as f64) * self.step);
        let [cosine, sine] = self.turn;
        [
            cosine * x + sine * y + self.centre[0],
            -sine * x + cosine * y + self.centre[1],
        ]
    }

    /// Returns the pixels of the square per pixel of the picture.
    pub(super) fn enlarges(&self) -> f64 {
        1.0 / self.step
    }

    /// Returns the square as RGB. Each pixel is the mean of several points, which are so close that no pixel of the picture is skipped.
    pub(super) fn rgb(&self, picture: Rgb8View<'_>) -> Vec<u8> {
        let n = (self.step.ceil() as usize).clamp(1, 8);
        let mut rgb = Vec::with_capacity(3 * SIDE * SIDE);
        for row in 0..SIDE {
            for column in 0..SIDE {
                let mut sum = [0.0; 3];
                for part in 0..n * n {
                    let within = |value: usize| (value as f64 + 0.5) / n as f64 - 0.5;
                    let at = [
                        column as f64 + within(part % n),
                        row as f64 + within(part / n),
                    ];
                    let colour = colour(picture, self.outside(at));
                    for (sum, colour) in sum.iter_mut().zip(colour) {
                        *sum += colour / (n * n) as f64;
                    }
                }
                rgb.extend(sum.map(|sum| sum.round().clamp(0.0, 255.0) as u8));
            }
        }
        rgb
    }
}

/// Interpolates the colour between four pixels; [`FILL`] outside the picture.
fn colour(picture: Rgb8View<'_>, [x, y]: [f64; 2]) -> [f64; 3] {
    let (left, top) = (x.floor(), y.floor());
    let [right, below] = [x - left, y - top];
    let [width, height] = [picture.width() as i64, picture.height() as i64];
    let mut sum = [0.0; 3];
    for (dy, of_row) in [(0, 1.0 - below), (1, below)] {
        for (dx, of_column) in [(0, 1.0 - right), (1, right)] {
            let [column, row] = [left as i64 + dx, top as i64 + dy];
            let is_inside = (0..width).contains(&column) && (0..height).contains(&row);
            let at = 3 * (row.max(0) * width + column.max(0)) as usize;
            for (channel, sum) in sum.iter_mut().enumerate() {
                let value = if is_inside {
                    f64::from(picture.data()[at + channel])
                } else {
                    f64::from(FILL)
                };
                *sum += of_row * of_column * value;
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crop_coordinates_are_invertible_and_the_crop_shows_the_right_pixels() {
        let joints = [[40.0, 20.0], [60.0, 90.0]];
        let crop = Crop::around(&joints, 0.7).unwrap();
        let at = crop.inside([47.0, 66.0]);
        let back = crop.outside(at);
        assert!((back[0] - 47.0).abs() < 1e-9 && (back[1] - 66.0).abs() < 1e-9);

        let mut data = vec![0u8; 3 * 100 * 120];
        data[3 * (66 * 100 + 47)] = 255;
        let picture = Rgb8View::new(100, 120, &data).unwrap();
        let rgb = crop.rgb(picture);
        let brightest = (0..SIDE * SIDE)
            .max_by_key(|i| rgb[3 * i])
            .map(|i| [(i % SIDE) as f64, (i / SIDE) as f64])
            .unwrap();
        assert!((brightest[0] - at[0]).abs() < 1.0 && (brightest[1] - at[1]).abs() < 1.0);
    }
}
