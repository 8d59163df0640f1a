//! A picture in the form in which it is stored: reduced to the necessary size.

use kernels::Rgb8View;
use training::networks::finder::{Around, Picture, SIDE};

/// A box around a person, in pixels, and whether this person should be found.
pub(super) type Box4 = ([f64; 4], bool);

/// Reduces a picture and its boxes until the longer side is at most [`SIDE`]; every pixel is the mean of the pixels that it covers.
pub(super) fn reduced(name: String, picture: Rgb8View<'_>, people: &[Box4]) -> Picture {
    let whole = [picture.width(), picture.height()];
    let step = (whole[0].max(whole[1]) as f64 / SIDE as f64).max(1.0);
    let size = whole.map(|side| ((side as f64 / step).round() as usize).clamp(1, SIDE));
    let steps = [0, 1].map(|axis| whole[axis] as f64 / size[axis] as f64);
    let span = |axis: usize, at: usize| {
        let begin = (at as f64 * steps[axis]) as usize;
        let end = ((at + 1) as f64 * steps[axis]) as usize;
        begin..end.clamp(begin + 1, whole[axis])
    };
    let mut rgb = Vec::with_capacity(3 * size[0] * size[1]);
    for row in 0..size[1] {
        for column in 0..size[0] {
            let mut sum = [0_usize; 3];
            let [columns, rows] = [span(0, column), span(1, row)];
            for y in rows.clone() {
                for x in columns.clone() {
                    let at = 3 * (y * whole[0] + x);
                    for (sum, value) in sum.iter_mut().zip(&picture.data()[at..at + 3]) {
                        *sum += usize::from(*value);
                    }
                }
            }
            let n = rows.len() * columns.len();
            rgb.extend(sum.map(|sum| (sum / n) as u8));
        }
    }
    let limits = [-0.5, -0.5, size[0] as f32 - 0.5, size[1] as f32 - 0.5];
    let around = |(outline, counts): &Box4| {
        let outline: [f64; 4] =
            core::array::from_fn(|side| (outline[side] + 0.5) / steps[side % 2] - 0.5);
        let around = Around {
            outline: outline.map(|side| side as f32),
            counts: *counts,
        };
        around.cut(limits)
    };
    let people = people.iter().map(around);
    Picture {
        name,
        size,
        rgb,
        people: people.filter(|person| person.area() > 0.0).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_in_a_shrunk_picture_keep_their_content() {
        let [width, height] = [4 * SIDE, 2 * SIDE];
        let mut rgb = vec![0; 3 * width * height];
        for row in 40..80 {
            rgb[3 * (row * width + 100)..][..3 * 20].fill(255);
        }
        let picture = Rgb8View::new(width, height, &rgb).unwrap();
        let people = [
            ([99.5, 39.5, 119.5, 79.5], true),
            ([-9.0, -9.0, -1.0, -1.0], true),
        ];
        let small = reduced(String::new(), picture, &people);
        assert!(small.is_whole() && small.size == [SIDE, SIDE / 2]);
        assert_eq!(small.people.len(), 1, "one lies outside");
        assert_eq!(small.people[0].outline, [24.5, 9.5, 29.5, 19.5]);
        let light: u32 = small.rgb.iter().map(|value| u32::from(*value)).sum();
        assert_eq!(light, 255 * 3 * 5 * 10);
    }
}
