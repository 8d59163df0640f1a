//! Reading of markers from quadrilaterals.

use nalgebra::Point2;

use crate::boards::{Homography, Picture};

/// Minimum difference between black and white in a marker, in grey values.
const LEAST_CONTRAST: f64 = 12.0;
/// Largest fraction of the cells in a marker's black frame that may look white.
const WHITE_FRAME: f64 = 0.15;
/// Maximum number of wrong bits that are tolerated, even if the codes of the dictionary differ by many more bits.
const MOST_WRONG_BITS: u32 = 3;

/// The codes of a board's markers.
#[derive(Debug, Clone)]
pub(crate) struct Codes {
    /// Number of cells along a side, without the frame.
    side: usize,
    bits: Vec<u64>,
    /// Number of bits that may be wrong.
    tolerance: u32,
}

/// A marker in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sighting {
    pub(crate) id: usize,
    /// Corners in the order of the board: clockwise from the marker's upper left corner.
    pub(crate) corners: [Point2<f64>; 4],
    pub(crate) is_mirrored: bool,
    /// Number of bits that differ from the code.
    pub(crate) n_wrong: u32,
}

impl Sighting {
    pub(crate) fn centre(&self) -> Point2<f64> {
        let sum = self.corners.iter().map(|corner| corner.coords);
        Point2::from(sum.sum::<nalgebra::Vector2<f64>>() / 4.0)
    }

    /// Returns the mean length of the marker's sides, in pixels.
    pub(crate) fn side_px(&self) -> f64 {
        let sides = (0..4).map(|i| (self.corners[(i + 1) % 4] - self.corners[i]).norm());
        sides.sum::<f64>() / 4.0
    }
}

impl Codes {
    /// Creates a dictionary from codes; bit `y * side + x` is set if a cell is black.
    pub(crate) fn new(side: usize, codes: &[u64]) -> Self {
        let mut least = side * side;
        for (i, code) in codes.iter().enumerate() {
            let turns = turns(*code, side);
            for turned in &turns[1..] {
                least = least.min((code ^ turned).count_ones() as usize);
            }
            for other in &codes[i + 1..] {
                for turned in turns {
                    least = least.min((other ^ turned).count_ones() as usize);
                }
            }
        }
        Self {
            side,
            bits: codes.to_vec(),
            tolerance: (least.saturating_sub(1) as u32 / 2).min(MOST_WRONG_BITS),
        }
    }

    /// Returns every marker with these codes among the quadrilaterals; `frames` are the widths of the black frame to try, in cells.
    pub(crate) fn read(
        &self,
        picture: &Picture,
        quads: &[[Point2<f64>; 4]],
        frames: &[usize],
    ) -> Vec<Sighting> {
        let mut found: Vec<Sighting> = Vec::new();
        for quad in quads {
            for &frame in frames {
                let Some(bits) = cells(picture, *quad, self.side, frame) else {
                    continue;
                };
                let Some(sighting) = self.best(bits, *quad) else {
                    continue;
                };
                let is_same = |known: &&mut Sighting| {
                    known.id == sighting.id
                        && (known.centre() - sighting.centre()).norm() < 0.25 * sighting.side_px()
                };
                match found.iter_mut().find(is_same) {
                    Some(known) if sighting.n_wrong < known.n_wrong => *known = sighting,
                    Some(_) => {}
                    None => found.push(sighting),
                }
            }
        }
        found
    }

    fn best(&self, bits: u64, quad: [Point2<f64>; 4]) -> Option<Sighting> {
        let mut best: Option<Sighting> = None;
        for is_mirrored in [false, true] {
            let seen = if is_mirrored {
                transposed(bits, self.side)
            } else {
                bits
            };
            for (turn, seen) in turns(seen, self.side).into_iter().enumerate() {
                for (id, code) in self.bits.iter().enumerate() {
                    let n_wrong = (code ^ seen).count_ones();
                    if n_wrong <= self.tolerance && best.is_none_or(|best| n_wrong < best.n_wrong) {
                        let corners = [0, 1, 2, 3].map(|nth| {
                            let along = (turn + nth) % 4;
                            // In a mirror image, the order of the corners is reversed.
                            quad[if is_mirrored { (4 - along) % 4 } else { along }]
                        });
                        best = Some(Sighting {
                            id,
                            corners,
                            is_mirrored,
                            n_wrong,
                        });
                    }
                }
            }
        }
        best
    }
}

/// Returns the four readings of a code; each takes a different corner of the marker as the first.
fn turns(code: u64, side: usize) -> [u64; 4] {
    let mut turns = [code; 4];
    for i in 1..4 {
        turns[i] = rearranged(turns[i - 1], side, |x, y| [side - 1 - y, x]);
    }
    turns
}

fn transposed(code: u64, side: usize) -> u64 {
    rearranged(code, side, |x, y| [y, x])
}

fn rearranged(code: u64, side: usize, source: impl Fn(usize, usize) -> [usize; 2]) -> u64 {
    let mut result = 0;
    for y in 0..side {
        for x in 0..side {
            let [from_x, from_y] = source(x, y);
            result |= ((code >> (from_y * side + from_x)) & 1) << (y * side + x);
        }
    }
    result
}

/// Returns the inner cells of a quadrilateral as bits, set if black; `None` if it has no black frame.
fn cells(picture: &Picture, quad: [Point2<f64>; 4], side: usize, frame: usize) -> Option<u64> {
    let total = side + 2 * frame;
    let map = Homography::of_unit_square(quad)?;
    let mut values = Vec::with_capacity(total * total);
    for row in 0..total {
        for column in 0..total {
            let mut sum = 0.0;
            for v in [0.3, 0.5, 0.7] {
                for u in [0.3, 0.5, 0.7] {
                    let at = Point2::new(column as f64 + u, row as f64 + v) / total as f64;
                    sum += picture.between(map.apply(at)?);
                }
            }
            values.push(sum / 9.0);
        }
    }
    let threshold = between_two_groups(&values)?;
    let is_frame = |index: usize| {
        let at = [index % total, index / total];
        at.iter().any(|value| *value < frame || *value >= total - frame)
    };
    let in_frame = (0..values.len()).filter(|index| is_frame(*index));
    let n_white = in_frame.clone().filter(|index| values[*index] > threshold);
    if n_white.count() as f64 > WHITE_FRAME * in_frame.count() as f64 {
        return None;
    }
    let inner = (0..values.len()).filter(|index| !is_frame(*index));
    Some(inner.enumerate().fold(0, |bits, (nth, index)| {
        bits | (u64::from(values[index] <= threshold) << nth)
    }))
}

/// Returns the threshold that best separates values into two groups (Otsu 1979); `None` if all values are equal.
fn between_two_groups(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let total: f64 = sorted.iter().sum();
    let n = sorted.len() as f64;
    let mut below = 0.0;
    let mut best = (0.0, None);
    for (i, pair) in sorted.windows(2).enumerate() {
        below += pair[0];
        let (n_below, n_above) = ((i + 1) as f64, n - (i + 1) as f64);
        let apart = (total - below) / n_above - below / n_below;
        let between = n_below * n_above * apart * apart;
        if between > best.0 && apart > LEAST_CONTRAST {
            best = (between, Some(0.5 * (pair[0] + pair[1])));
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_quarter_turns_and_two_mirrors_give_the_same_marker() {
        let code = 0b1011_0010_0111_0001;
        let turned = turns(turns(code, 4)[3], 4)[1];
        assert_eq!(turned, code);
        assert_eq!(transposed(transposed(code, 4), 4), code);
    }
}
