//! Tells whether the picture of a person has changed since the network last ran on it.

use kernels::Rgb8View;

const COLUMNS: usize = 12;
const ROWS: usize = 16;
/// Largest change of a block's mean brightness that counts as noise, of 255. In compressed video, blocks of things at rest changed by up to
/// 3 in half a second, and some block of a person who stood in one place by more than 10 in most pairs of frames.
const NOISE: u8 = 4;

/// Mean brightness of the blocks of a box in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Thumbnail {
    outline: [f64; 4],
    blocks: [[u8; COLUMNS]; ROWS],
}

impl Thumbnail {
    /// Returns the blocks of a box; `None` if less than one pixel of a block is inside the picture.
    ///
    /// * `outline`: left, top, right, bottom, in pixels.
    pub(crate) fn new(image: Rgb8View<'_>, outline: [f64; 4]) -> Option<Self> {
        let [left, top, right, bottom] = outline;
        let within = |side: f64, most: usize| side.clamp(0.0, most as f64) as usize;
        let columns = [left, right].map(|side| within(side, image.width()));
        let rows = [top, bottom].map(|side| within(side, image.height()));
        if columns[0] + COLUMNS > columns[1] || rows[0] + ROWS > rows[1] {
            return None;
        }
        let edge = |[from, to]: [usize; 2], nth: usize, n: usize| from + (to - from) * nth / n;
        let edges: [usize; COLUMNS + 1] = core::array::from_fn(|nth| edge(columns, nth, COLUMNS));
        let mut blocks = [[0; COLUMNS]; ROWS];
        for (nth, blocks) in blocks.iter_mut().enumerate() {
            let [first, end] = [nth, nth + 1].map(|nth| edge(rows, nth, ROWS));
            let mut sums = [0_u32; COLUMNS];
            for row in first..end {
                let line = &image.data()[3 * row * image.width()..][..3 * image.width()];
                for (sum, sides) in sums.iter_mut().zip(edges.windows(2)) {
                    // Green is most of the brightness.
                    let pixels = line[3 * sides[0]..3 * sides[1]].iter().skip(1).step_by(3);
                    *sum += pixels.map(|green| u32::from(*green)).sum::<u32>();
                }
            }
            for (nth, (block, sum)) in blocks.iter_mut().zip(sums).enumerate() {
                let n_pixels = (end - first) * (edges[nth + 1] - edges[nth]);
                *block = (sum / n_pixels as u32) as u8;
            }
        }
        Some(Self { outline, blocks })
    }

    /// Returns true if no block of the box differs by more than noise in another picture.
    pub(crate) fn is_unchanged(&self, image: Rgb8View<'_>) -> bool {
        Self::new(image, self.outline).is_some_and(|now| {
            let blocks = self.blocks.as_flattened().iter().zip(now.blocks.as_flattened());
            blocks.into_iter().all(|(before, now)| before.abs_diff(*now) <= NOISE)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [60, 50];
    const BOX: [f64; 4] = [10.0, 5.0, 40.0, 45.0];

    fn picture(value: impl Fn(usize, usize) -> u8) -> Vec<u8> {
        let pixels = (0..SIZE[0] * SIZE[1]).map(|nth| value(nth % SIZE[0], nth / SIZE[0]));
        pixels.flat_map(|value| [value; 3]).collect()
    }

    fn image(rgb: &[u8]) -> Rgb8View<'_> {
        Rgb8View::new(SIZE[0], SIZE[1], rgb).unwrap()
    }

    #[test]
    fn noise_and_changes_outside_the_box_are_ignored_and_a_moved_hand_is_seen() {
        let before = picture(|x, y| (3 * x + y) as u8);
        let noisy = picture(|x, y| (3 * x + y + (7 * x + 11 * y) % 5) as u8);
        let beside = picture(|x, y| if x >= 41 { 255 } else { (3 * x + y) as u8 });
        let hand = |x: usize, y: usize| (20..23).contains(&x) && (30..33).contains(&y);
        let moved = picture(|x, y| if hand(x, y) { 250 } else { (3 * x + y) as u8 });
        let thumbnail = Thumbnail::new(image(&before), BOX).unwrap();
        for (rgb, is_unchanged) in [(&noisy, true), (&beside, true), (&moved, false)] {
            assert_eq!(thumbnail.is_unchanged(image(rgb)), is_unchanged);
        }
    }

    #[test]
    fn boxes_that_are_too_small_or_outside_the_picture_have_no_thumbnail() {
        let rgb = picture(|_, _| 9);
        for outline in [
            [10.0, 5.0, 21.0, 45.0],
            [10.0, 5.0, 40.0, 20.0],
            [55.0, 5.0, 90.0, 45.0],
            [40.0, 45.0, 10.0, 5.0],
            [f64::NAN; 4],
        ] {
            assert_eq!(Thumbnail::new(image(&rgb), outline), None, "{outline:?}");
        }
        assert!(Thumbnail::new(image(&rgb), [-500.0, -500.0, 1e9, 1e9]).is_some());
    }
}
