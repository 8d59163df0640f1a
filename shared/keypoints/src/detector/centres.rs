//! Boxes of people, found by the cells that contain their middles.

use super::PersonBox;

/// Maximum absolute logarithm of a side. No network returns a larger logarithm for a picture of 2048 pixels.
const MOST_LOGARITHM: f64 = 8.0;

/// Returns the boxes of the cells that are higher than their neighbours, in pixels of the input. Among equal neighbours, only the first one
/// counts.
///
/// * `values`: log-odds, then logarithms of the distances to left, top, right and bottom, in cells, each of them `[rows, columns]`.
/// * `stride`: number of pixels per cell.
/// * `least`: minimum score of a box.
pub(super) fn boxes(
    values: &[f32],
    [columns, rows]: [usize; 2],
    (stride, least): (usize, f64),
) -> Vec<PersonBox> {
    let n_cells = columns * rows;
    let (heat, sides) = values.split_at(n_cells);
    let score = |at: usize| 1.0 / (1.0 + (-f64::from(heat[at])).exp());
    let is_highest = |at: usize| {
        let [column, row] = [at % columns, at / columns];
        let near = |middle: usize, n: usize| middle.saturating_sub(1)..(middle + 2).min(n);
        let mut others = near(row, rows)
            .flat_map(|row| near(column, columns).map(move |column| row * columns + column));
        others.all(|other| heat[at] > heat[other] || (heat[at] == heat[other] && at <= other))
    };
    let cells = (0..n_cells).filter(|at| score(*at) >= least && is_highest(*at));
    let one = |at: usize| {
        let stride = stride as f64;
        let middle = |cell: usize| (cell as f64 + 0.5) * stride - 0.5;
        let [x, y] = [middle(at % columns), middle(at / columns)];
        let away = [0, 1, 2, 3].map(|side| {
            let logarithm = f64::from(sides[side * n_cells + at]);
            stride * logarithm.clamp(-MOST_LOGARITHM, MOST_LOGARITHM).exp()
        });
        PersonBox {
            outline: [x - away[0], y - away[1], x + away[2], y + away[3]],
            score: score(at),
        }
    };
    cells.map(one).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const SIZE: [usize; 2] = [12, 8];

    /// Returns log-odds of -9 except in the given cells, each of which has a box with these sides, in cells.
    fn values(cells: &[([usize; 2], f32, [f32; 4])]) -> Vec<f32> {
        let n = SIZE[0] * SIZE[1];
        let mut values = vec![-9.0; n];
        values.resize(5 * n, 0.0);
        for ([column, row], heat, sides) in cells {
            let at = row * SIZE[0] + column;
            values[at] = *heat;
            for (side, length) in sides.iter().enumerate() {
                values[(side + 1) * n + at] = length.ln();
            }
        }
        values
    }

    #[test]
    fn a_maximum_gives_one_box_around_its_cell() {
        let around = [1.0, 2.0, 1.5, 4.0];
        let cells = [
            ([3, 2], 2.0, around),
            ([4, 2], 1.0, around),
            ([9, 6], -3.0, around),
        ];
        let found = boxes(&values(&cells), SIZE, (4, 0.3));
        assert_eq!(found.len(), 1, "{found:?}");
        let expected = [13.5 - 4.0, 9.5 - 8.0, 13.5 + 6.0, 9.5 + 16.0];
        let off = (0..4).map(|side| (found[0].outline[side] - expected[side]).abs());
        assert!(off.fold(0.0, f64::max) < 1e-4, "{found:?}");
        assert!((found[0].score - 0.8808).abs() < 1e-4);
    }

    #[test]
    fn two_people_in_front_of_each_other_give_two_boxes() {
        let around = [3.0; 4];
        let found = boxes(
            &values(&[([4, 3], 1.0, around), ([6, 3], 2.0, around)]),
            SIZE,
            (4, 0.3),
        );
        assert_eq!(found.len(), 2);
        let flat = boxes(
            &values(&[([4, 3], 1.0, around), ([5, 3], 1.0, around)]),
            SIZE,
            (4, 0.3),
        );
        assert_eq!(flat.len(), 1, "of equal neighbours the first");
    }

    proptest! {
        /// Checks that no two boxes come from cells that touch, that all scores are high enough, and that every side is finite.
        #[test]
        fn boxes_are_finite_and_from_separate_cells(
            heat in prop::collection::vec(-3.0_f32..3.0, 96),
            sides in prop::collection::vec(-100.0_f32..100.0, 4 * 96),
        ) {
            let values: Vec<f32> = heat.iter().chain(&sides).copied().collect();
            let found = boxes(&values, SIZE, (4, 0.5));
            prop_assert!(found.len() <= 24, "one of four cells at most");
            for found in &found {
                prop_assert!(found.score >= 0.5);
                let [left, top, right, bottom] = found.outline;
                prop_assert!(left < right && top < bottom && (right - left).is_finite());
            }
            prop_assert!(heat.iter().all(|heat| *heat < 0.0) || !found.is_empty());
        }
    }
}
