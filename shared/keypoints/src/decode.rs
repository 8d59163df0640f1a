//! Decodes a network's output.

use crate::card::{Layout, ListField, ListUnit, Refine, Score};

/// A keypoint that a network found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Keypoint {
    /// Column and row, in pixels of the network's input.
    pub at: [f64; 2],
    /// Confidence of the network. It is from 0 to 1 if the network returns a probability or log-odds, otherwise in the network's own unit.
    pub score: f64,
}

/// Reason why an output cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OutputError {
    /// The output does not have the expected shape.
    #[error("the output is {got:?}, expected {expected}")]
    Shape {
        /// Shape of the output.
        got: Vec<usize>,
        /// Shape that the card requires.
        expected: String,
    },
    /// A value is not a finite number.
    #[error("value {index} of the output is {value}, which is not finite")]
    NotANumber {
        /// Index of the value.
        index: usize,
        /// Value in the output.
        value: f32,
    },
}

/// A map for every keypoint.
#[derive(Debug, Clone, Copy)]
pub struct HeatMaps<'a> {
    values: &'a [f32],
    layout: Layout,
    n: usize,
    /// Number of maps of the output: the maps of the keypoints, then other maps.
    channels: usize,
    rows: usize,
    columns: usize,
}

impl<'a> HeatMaps<'a> {
    /// Interprets an output as maps.
    ///
    /// * `shape`: shape of the output, for one picture.
    /// * `n`, `further`: number of keypoints of the card, and number of further maps, which are not read.
    ///
    /// # Errors
    ///
    /// Returns an [`OutputError`] on failure.
    pub fn new(
        values: &'a [f32],
        shape: &[usize],
        layout: Layout,
        [n, further]: [usize; 2],
    ) -> Result<Self, OutputError> {
        let channels = n + further;
        let sides = match (layout, shape) {
            (Layout::Planes, &[1, keypoints, rows, columns])
            | (Layout::Pixels, &[1, rows, columns, keypoints]) => Some([keypoints, rows, columns]),
            _ => None,
        };
        let fits = |[keypoints, rows, columns]: &[usize; 3]| {
            *keypoints == channels
                && *rows > 0
                && *columns > 0
                && values.len() == channels * rows * columns
        };
        let expected = || match layout {
            Layout::Planes => format!("[1, {channels}, rows, columns]"),
            Layout::Pixels => format!("[1, rows, columns, {channels}]"),
        };
        let Some([_, rows, columns]) = sides.filter(fits) else {
            return Err(OutputError::Shape {
                got: shape.to_vec(),
                expected: expected(),
            });
        };
        finite(values)?;
        Ok(Self {
            values,
            layout,
            n,
            channels,
            rows,
            columns,
        })
    }

    /// Returns the numbers of rows and columns of a map.
    pub fn size(&self) -> [usize; 2] {
        [self.rows, self.columns]
    }

    /// Returns the number of pixels of the input between two cells, across and down.
    ///
    /// * `input`: width and height of the network's input, in pixels.
    /// * `udp`: true if the corner cells are at the corner pixels. Otherwise, each cell covers an equal part of the input.
    pub fn step(&self, input: [usize; 2], udp: bool) -> [f64; 2] {
        let cells = [self.columns, self.rows];
        [0, 1].map(|axis| {
            let (pixels, cells) = (input[axis] as f64, cells[axis] as f64);
            if udp && cells > 1.0 {
                (pixels - 1.0) / (cells - 1.0)
            } else {
                pixels / cells
            }
        })
    }

    /// Returns an unchanged value of a map.
    ///
    /// # Panics
    ///
    /// Panics if the index is outside the maps.
    pub fn value(&self, keypoint: usize, row: usize, column: usize) -> f32 {
        assert!(row < self.rows && column < self.columns && keypoint < self.n);
        let cell = row * self.columns + column;
        self.values[match self.layout {
            Layout::Planes => keypoint * self.rows * self.columns + cell,
            Layout::Pixels => cell * self.channels + keypoint,
        }]
    }

    /// Returns the maximum of every map.
    ///
    /// * `input`: width and height of the network's input, in pixels.
    /// * `udp`: true if the corner cells are at the corner pixels. Otherwise, the first cell is at the first pixel, and each cell covers an
    ///   equal part of the input.
    pub fn keypoints(
        &self,
        input: [usize; 2],
        udp: bool,
        refine: Refine,
        score: Score,
    ) -> Vec<Keypoint> {
        let step = self.step(input, udp);
        let keypoint = |keypoint: usize| {
            let [row, column] = self.maximum(keypoint);
            let across = self.refined(keypoint, [row, column], [0, 1], (refine, score));
            let down = self.refined(keypoint, [row, column], [1, 0], (refine, score));
            Keypoint {
                at: [
                    (column as f64 + across) * step[0],
                    (row as f64 + down) * step[1],
                ],
                score: score.of(f64::from(self.value(keypoint, row, column))),
            }
        };
        (0..self.n).map(keypoint).collect()
    }

    fn maximum(&self, keypoint: usize) -> [usize; 2] {
        let mut best = ([0, 0], f32::NEG_INFINITY);
        for row in 0..self.rows {
            for column in 0..self.columns {
                let value = self.value(keypoint, row, column);
                if value > best.1 {
                    best = ([row, column], value);
                }
            }
        }
        best.0
    }

    /// Returns the number of cells by which refinement moves a maximum along one axis; 0 at the edge.
    fn refined(
        &self,
        keypoint: usize,
        [row, column]: [usize; 2],
        [down, across]: [usize; 2],
        (refine, score): (Refine, Score),
    ) -> f64 {
        let is_inside = row >= down
            && column >= across
            && row + down < self.rows
            && column + across < self.columns;
        if !is_inside {
            return 0.0;
        }
        let at = |row, column| score.of(f64::from(self.value(keypoint, row, column)));
        let before = at(row - down, column - across);
        let (here, after) = (at(row, column), at(row + down, column + across));
        match refine {
            Refine::None => 0.0,
            Refine::Quarter => {
                if before == after {
                    0.0
                } else {
                    0.25_f64.copysign(after - before)
                }
            }
            Refine::Parabola => {
                let [before, here, after] = [before, here, after].map(|value| value.max(1e-6).ln());
                let curve = before - 2.0 * here + after;
                if curve < 0.0 {
                    (0.5 * (before - after) / curve).clamp(-0.5, 0.5)
                } else {
                    0.0
                }
            }
        }
    }
}

/// For every keypoint, a distribution over columns and a distribution over rows.
#[derive(Debug, Clone, Copy)]
pub struct SimCc<'a> {
    axes: [&'a [f32]; 2],
    bins: [usize; 2],
    n: usize,
}

impl<'a> SimCc<'a> {
    /// Interprets outputs as distributions over columns and over rows.
    ///
    /// * `shapes`: shapes of the two outputs.
    /// * `bins`: number of bins for columns and for rows: the sides of the input times the card's bins per pixel.
    /// * `n`: number of keypoints of the card.
    ///
    /// # Errors
    ///
    /// Returns an [`OutputError`] on failure.
    pub fn new(
        axes: [&'a [f32]; 2],
        shapes: [&[usize]; 2],
        bins: [usize; 2],
        n: usize,
    ) -> Result<Self, OutputError> {
        for axis in 0..2 {
            let expected = [1, n, bins[axis]];
            let fits = shapes[axis] == expected && axes[axis].len() == n * bins[axis];
            if !fits || bins[axis] == 0 {
                return Err(OutputError::Shape {
                    got: shapes[axis].to_vec(),
                    expected: format!("{expected:?}"),
                });
            }
            finite(axes[axis])?;
        }
        Ok(Self { axes, bins, n })
    }

    /// Returns the values of a keypoint along an axis, where axis 0 is the axis of the columns.
    ///
    /// # Panics
    ///
    /// Panics if the index is outside the keypoints.
    pub fn axis(&self, keypoint: usize, axis: usize) -> &'a [f32] {
        let n = self.bins[axis];
        &self.axes[axis][keypoint * n..(keypoint + 1) * n]
    }

    /// Returns the maximum of every keypoint. Its score is the smaller of its two axes' scores, exactly as the network outputs them.
    pub fn keypoints(&self, bins_per_pixel: f64) -> Vec<Keypoint> {
        let keypoint = |keypoint: usize| {
            let best = [0, 1].map(|axis| {
                let values = self.axis(keypoint, axis).iter().enumerate();
                let first = (0, f32::NEG_INFINITY);
                values.fold(
                    first,
                    |best, (bin, it)| if *it > best.1 { (bin, *it) } else { best },
                )
            });
            Keypoint {
                at: best.map(|best| best.0 as f64 / bins_per_pixel),
                score: f64::from(best[0].1.min(best[1].1)),
            }
        };
        (0..self.n).map(keypoint).collect()
    }
}

/// Keypoints that are listed one by one.
#[derive(Debug, Clone, Copy)]
pub struct List<'a> {
    values: &'a [f32],
    fields: &'a [ListField],
}

impl<'a> List<'a> {
    /// Interprets an output of any shape as a list.
    ///
    /// * `n`: number of keypoints of the card.
    ///
    /// # Errors
    ///
    /// Returns an [`OutputError`] on failure.
    pub fn new(
        values: &'a [f32],
        shape: &[usize],
        fields: &'a [ListField],
        n: usize,
    ) -> Result<Self, OutputError> {
        if values.len() != n * fields.len() || shape.iter().product::<usize>() != values.len() {
            return Err(OutputError::Shape {
                got: shape.to_vec(),
                expected: format!("{n} keypoints of {} numbers", fields.len()),
            });
        }
        finite(values)?;
        Ok(Self { values, fields })
    }

    /// Returns the keypoints. The score is 1 for a list without scores.
    ///
    /// * `input`: width and height of the network's input, in pixels.
    pub fn keypoints(&self, input: [usize; 2], unit: ListUnit, score: Score) -> Vec<Keypoint> {
        let scale = match unit {
            ListUnit::Pixel => [1.0; 2],
            ListUnit::Share => input.map(|input| input as f64),
        };
        let keypoint = |values: &[f32]| {
            let get = |wanted: ListField| {
                let place = self.fields.iter().position(|field| *field == wanted)?;
                Some(f64::from(values[place]))
            };
            let [x, y] = [ListField::X, ListField::Y].map(|field| get(field).unwrap_or(0.0));
            Keypoint {
                at: [x * scale[0], y * scale[1]],
                score: get(ListField::Score).map_or(1.0, |value| score.of(value)),
            }
        };
        let each = self.values.chunks_exact(self.fields.len().max(1));
        each.map(keypoint).collect()
    }
}

pub(crate) fn finite(values: &[f32]) -> Result<(), OutputError> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(index) => Err(OutputError::NotANumber {
            index,
            value: values[index],
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a map of 12 by 16 cells with a peak at a point, and a flat map.
    fn bump([x, y]: [f64; 2], layout: Layout) -> Vec<f32> {
        let mut values = vec![0.0; 2 * 16 * 12];
        for row in 0..16 {
            for column in 0..12 {
                let squared = (column as f64 - x).powi(2) + (row as f64 - y).powi(2);
                let cell = row * 12 + column;
                let place = match layout {
                    Layout::Planes => cell,
                    Layout::Pixels => 2 * cell,
                };
                values[place] = (0.9 * (-squared / 2.0).exp()) as f32;
            }
        }
        values
    }

    fn shape(layout: Layout) -> [usize; 4] {
        match layout {
            Layout::Planes => [1, 2, 16, 12],
            Layout::Pixels => [1, 16, 12, 2],
        }
    }

    #[test]
    fn a_maximum_is_found_in_either_layout_and_refined_towards_the_truth() {
        let truth = [5.3, 9.8];
        for layout in [Layout::Planes, Layout::Pixels] {
            let values = bump(truth, layout);
            let maps = HeatMaps::new(&values, &shape(layout), layout, [2, 0]).unwrap();
            let found = |refine| maps.keypoints([48, 64], false, refine, Score::Share)[0];
            assert_eq!(found(Refine::None).at, [20.0, 40.0]);
            assert_eq!(found(Refine::Quarter).at, [21.0, 39.0]);
            let [x, y] = found(Refine::Parabola).at;
            // A parabola through the logarithms is exact for a Gaussian peak.
            assert!(
                (x - 21.2).abs() < 1e-4 && (y - 39.2).abs() < 1e-4,
                "{x} {y}"
            );
            assert!((found(Refine::None).score - 0.9 * (-0.065_f64).exp()).abs() < 1e-6);
        }
    }

    #[test]
    fn corner_cells_lie_on_corner_pixels_if_the_card_says_so() {
        let values = bump([11.0, 15.0], Layout::Planes);
        let maps = HeatMaps::new(&values, &[1, 2, 16, 12], Layout::Planes, [2, 0]).unwrap();
        let found = |udp| maps.keypoints([48, 64], udp, Refine::Quarter, Score::Share)[0].at;
        assert_eq!(found(false), [44.0, 60.0]);
        assert_eq!(found(true), [47.0, 63.0]);
    }

    #[test]
    fn maps_beyond_the_keypoints_are_counted_and_not_read() {
        let maps = |values, shape, layout| {
            let maps = HeatMaps::new(values, shape, layout, [1, 1]).unwrap();
            maps.keypoints([2, 1], false, Refine::None, Score::Share)
        };
        let expected = Keypoint {
            at: [1.0, 0.0],
            score: 0.5,
        };
        let planes = maps(&[0.25, 0.5, 9.0, 0.0], &[1, 2, 1, 2], Layout::Planes);
        assert_eq!(planes, [expected]);
        let pixels = maps(&[0.25, 9.0, 0.5, 0.0], &[1, 1, 2, 2], Layout::Pixels);
        assert_eq!(pixels, [expected]);
        let refused = HeatMaps::new(&[0.0; 2], &[1, 1, 1, 2], Layout::Planes, [1, 1]);
        let refused = refused.unwrap_err().to_string();
        assert!(
            refused.contains("expected [1, 2, rows, columns]"),
            "{refused}"
        );
    }

    #[test]
    fn log_odds_become_probabilities() {
        let maps = HeatMaps::new(&[0.0, 2.0], &[1, 1, 1, 2], Layout::Planes, [1, 0]).unwrap();
        let found = maps.keypoints([2, 1], false, Refine::None, Score::LogOdds)[0];
        assert!((found.score - 0.880_797).abs() < 1e-6);
    }

    #[test]
    fn maxima_of_column_and_row_bins_give_a_position() {
        let mut axes = [vec![0.0_f32; 2 * 8], vec![0.0; 2 * 12]];
        axes[0][8 + 5] = 0.7;
        axes[1][12 + 9] = 0.4;
        let [x, y] = [&axes[0][..], &axes[1][..]];
        let maps = SimCc::new([x, y], [&[1, 2, 8], &[1, 2, 12]], [8, 12], 2).unwrap();
        let found = maps.keypoints(2.0)[1];
        assert_eq!(found.at, [2.5, 4.5]);
        assert!((found.score - 0.4).abs() < 1e-6, "the smaller one");
        assert_eq!(maps.axis(1, 0)[5], 0.7);
    }

    #[test]
    fn a_list_of_keypoints_is_read_by_its_fields() {
        let fields = [
            ListField::Y,
            ListField::X,
            ListField::Skip,
            ListField::Score,
        ];
        let values = [0.5, 0.25, 9.0, 0.0, 1.0, 0.75, 9.0, 40.0];
        let list = List::new(&values, &[1, 1, 2, 4], &fields, 2).unwrap();
        let found = list.keypoints([192, 256], ListUnit::Share, Score::LogOdds);
        assert_eq!([found[0].at, found[1].at], [[48.0, 128.0], [144.0, 256.0]]);
        assert_eq!([found[0].score, found[1].score], [0.5, 1.0]);
        let bare = [ListField::X, ListField::Y];
        let found = List::new(&values, &[8], &bare, 4).unwrap();
        let found = found.keypoints([192, 256], ListUnit::Pixel, Score::Share);
        assert_eq!((found[1].at, found[1].score), ([9.0, 0.0], 1.0));
    }

    #[test]
    fn other_shapes_and_values_that_are_no_numbers_are_refused() {
        let values = [0.0_f32; 24];
        let wrong = [&[1, 3, 2, 4][..], &[1, 2, 3, 5], &[2, 3, 4], &[1, 2, 0, 4]];
        for shape in wrong {
            let refused = HeatMaps::new(&values, shape, Layout::Planes, [2, 0]).unwrap_err();
            assert!(
                refused.to_string().contains("expected [1, 2, rows, columns]"),
                "{refused}"
            );
        }
        let right = HeatMaps::new(&values, &[1, 3, 4, 2], Layout::Pixels, [2, 0]);
        assert_eq!(right.unwrap().size(), [3, 4]);
        let refused = SimCc::new([&values; 2], [&[1, 2, 12], &[1, 2, 11]], [12, 12], 2);
        assert!(refused.unwrap_err().to_string().contains("expected [1, 2, 12]"));
        let refused = List::new(&values, &[1, 24], &[ListField::X; 5], 5);
        assert!(refused.unwrap_err().to_string().contains("5 keypoints of 5 numbers"));
        let mut odd = values;
        odd[7] = f32::NAN;
        let refused = HeatMaps::new(&odd, &[1, 2, 3, 4], Layout::Planes, [2, 0]).unwrap_err();
        assert_eq!(
            refused.to_string(),
            "value 7 of the output is NaN, which is not finite"
        );
    }
}
