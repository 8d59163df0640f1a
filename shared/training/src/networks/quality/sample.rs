//! Training samples: a person in a picture, the evidence of the search, and the errors of the parts.

use serde::{Deserialize, Serialize};
use skeleton::MIRROR;
use viewquality::TileShape;

/// Width in pixels of the margin around a tile that a sample stores, so that the tile can be moved.
pub const MARGIN: usize = 16;

/// One person in one picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// The person or sequence that the sample shows. A group is never split between training and validation.
    pub group: String,
    /// Origin of the sample, as text.
    pub source: String,
    /// The tile with a margin of [`MARGIN`] pixels on every side, `rows x cols x 3`, in red, green and blue.
    pub picture: Vec<u8>,
    /// See [`viewquality::evidence()`].
    pub evidence: Vec<f32>,
    /// Height of the area that the tile shows, in pixels of the picture.
    pub height_px: f32,
    /// Distance of every part's centre from its true position, in pixels of the picture.
    pub errors_px: Vec<f32>,
}

/// Height and width of the picture that is stored in a sample: the tile with its margin.
pub fn picture_size(tile: TileShape) -> [usize; 2] {
    [tile.height, tile.width].map(|side| side + 2 * MARGIN)
}

/// Distance of every part from the truth.
///
/// A single view does not show reliably whether a person is seen from behind, and the model names parts by their side in the picture. Both
/// assignments of left and right are therefore tried, and the one with the smaller errors is used. In the pipeline, left and right are
/// decided from all views together.
pub fn part_errors(centres: &[[f64; 2]], truth: &[[f64; 2]]) -> Vec<f64> {
    let errors = |of: &dyn Fn(usize) -> usize| -> Vec<f64> {
        let error = |(part, at): (usize, &[f64; 2])| {
            let truth = truth[of(part)];
            (at[0] - truth[0]).hypot(at[1] - truth[1])
        };
        centres.iter().enumerate().map(error).collect()
    };
    let plain = errors(&|part| part);
    let exchanged = errors(&|part| MIRROR[part]);
    if exchanged.iter().sum::<f64>() < plain.iter().sum() {
        exchanged
    } else {
        plain
    }
}

#[cfg(test)]
mod tests {
    use skeleton::N_PARTS;

    use super::*;

    #[test]
    fn the_better_assignment_of_left_and_right_counts() {
        let truth: Vec<[f64; 2]> = (0..N_PARTS).map(|part| [part as f64 * 10.0, 5.0]).collect();
        let exchanged: Vec<[f64; 2]> = MIRROR.iter().map(|part| truth[*part]).collect();
        assert_eq!(part_errors(&truth, &truth), [0.0; N_PARTS]);
        assert_eq!(part_errors(&exchanged, &truth), [0.0; N_PARTS]);
        let mut off = exchanged;
        off[6][1] += 7.0;
        let errors = part_errors(&off, &truth);
        assert_eq!(errors[6], 7.0);
        assert_eq!(errors.iter().sum::<f64>(), 7.0);
    }
}
