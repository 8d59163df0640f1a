//! Search for pixels that are darker than their surroundings.

use crate::boards::Picture;

/// Minimum amount by which a dark pixel is darker than the mean around it, in grey values.
const DARKER: i64 = 7;

/// Returns true for every pixel that is darker than the mean of the square around it whose side is `2 radius + 1` pixels.
pub(crate) fn dark(picture: &Picture, radius: usize) -> Vec<bool> {
    let (width, height) = (picture.width(), picture.height());
    let sums = Sums::new(picture);
    let mut mask = Vec::with_capacity(width * height);
    for y in 0..height {
        let (top, bottom) = (y.saturating_sub(radius), (y + radius + 1).min(height));
        for x in 0..width {
            let (left, right) = (x.saturating_sub(radius), (x + radius + 1).min(width));
            let count = ((right - left) * (bottom - top)) as i64;
            let sum = sums.of_box([left, right], [top, bottom]);
            let value = i64::from(picture.pixels()[y * width + x]);
            mask.push((value + DARKER) * count < sum);
        }
    }
    mask
}

/// Sums over rectangles of pixels.
struct Sums {
    stride: usize,
    sums: Vec<i64>,
}

impl Sums {
    fn new(picture: &Picture) -> Self {
        let stride = picture.width() + 1;
        let mut sums = vec![0; stride * (picture.height() + 1)];
        for (y, row) in picture.pixels().chunks_exact(picture.width()).enumerate() {
            let mut along = 0;
            for (x, value) in row.iter().enumerate() {
                along += i64::from(*value);
                sums[(y + 1) * stride + x + 1] = sums[y * stride + x + 1] + along;
            }
        }
        Self { stride, sums }
    }

    fn of_box(&self, [left, right]: [usize; 2], [top, bottom]: [usize; 2]) -> i64 {
        let at = |x: usize, y: usize| self.sums[y * self.stride + x];
        at(right, bottom) - at(left, bottom) - at(right, top) + at(left, top)
    }
}
