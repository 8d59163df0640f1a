//! Networks that find the boxes of people: their cards, and the decoding of their outputs.

use serde::{Deserialize, Serialize};

use crate::card::{CardError, DETECTOR_FORMAT, Input, Layout, check_head, check_input, demand};
use crate::decode::OutputError;
use crate::decode::finite;
use crate::window::sample;

mod centres;

/// The card of a network that finds the boxes of people.
///
/// The whole picture is resized to fit into the input, with its top-left corner in the top-left corner of the input. The rest of the input
/// is filled with one colour.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectorCard {
    /// Name of the format: `parallax-detector`.
    pub format: String,
    /// Version of the format: 1.
    pub version: u32,
    /// Name of the network.
    pub name: String,
    /// Source of the weights.
    #[serde(default)]
    pub weights: String,
    /// Licence of the weights.
    #[serde(default)]
    pub licence: String,
    /// Input of the network.
    pub input: Input,
    /// Colour outside the picture, 0 to 255.
    #[serde(default = "grey")]
    pub fill: u8,
    /// Output of the network.
    pub output: Boxes,
    /// Minimum score of a box. Boxes with a lower score are dropped.
    #[serde(default = "least_score")]
    pub least_score: f64,
    /// Maximum overlap of two boxes, as a fraction of the area of their union. If two boxes overlap more, the one with the lower score is
    /// dropped.
    #[serde(default = "most_overlap")]
    pub most_overlap: f64,
}

/// Output of a detector, and how it is read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "codec", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Boxes {
    /// The grids of YOLOX (Ge et al. 2021), `[1, cells, 5 + classes]`: middle, size, objectness, and classes. Positions are relative to the
    /// cell, in cells. Sizes are natural logarithms of the size in cells.
    Yolox {
        /// Name of the output; may be left out if there is only one output.
        grids: Option<String>,
        /// Number of pixels of the input per cell of each grid.
        #[serde(default = "strides")]
        strides: Vec<usize>,
        /// Number of the class of people.
        #[serde(default)]
        person: usize,
        /// True if positions and sizes are already in pixels of the input.
        #[serde(default)]
        decoded: bool,
    },
    /// Boxes of people only, `[1, n, 5]`: left, top, right, bottom, in pixels of the input, and score (`RTMDet` as exported by mmdeploy).
    List {
        /// Name of the output.
        boxes: String,
    },
    /// A grid over the picture, `[1, 5, rows, columns]`. For each cell, the values are the log-odds that the middle of a person's box is in
    /// the cell, and the natural logarithms of the distances (in cells) from the middle of the cell to the left, top, right and bottom of
    /// the box. Every cell whose log-odds are higher than those of its eight neighbours is a person (`parallax-lab train finder`).
    Centres {
        /// Name of the output; may be left out if there is only one output.
        boxes: Option<String>,
        /// Number of pixels of the input per cell.
        stride: usize,
    },
}

fn grey() -> u8 {
    114
}

fn least_score() -> f64 {
    0.3
}

fn most_overlap() -> f64 {
    0.65
}

fn strides() -> Vec<usize> {
    vec![8, 16, 32]
}

/// A box around a person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PersonBox {
    /// Left, top, right, bottom, in pixels.
    pub outline: [f64; 4],
    /// Confidence of the network, 0 to 1.
    pub score: f64,
}

impl DetectorCard {
    /// Parses a card.
    ///
    /// # Errors
    ///
    /// Returns a [`CardError`], which names the key.
    pub fn parse(text: &str) -> Result<Self, CardError> {
        check_head(text, DETECTOR_FORMAT)?;
        let card: Self = toml::from_str(text)?;
        check_input(&card.input)?;
        for (key, share) in [
            ("least_score", card.least_score),
            ("most_overlap", card.most_overlap),
        ] {
            let fits = (0.0..=1.0).contains(&share);
            demand(fits, key, &share, || "0 to 1".to_owned())?;
        }
        if let Boxes::Yolox {
            strides, person, ..
        } = &card.output
        {
            let fits = (1..=8).contains(&strides.len())
                && strides.iter().all(|stride| (1..=256).contains(stride));
            demand(fits, "output.strides", &format!("{strides:?}"), || {
                "one to eight numbers from 1 to 256".to_owned()
            })?;
            demand(*person < 10_000, "output.person", person, || {
                "a number below 10000".to_owned()
            })?;
        }
        if let Boxes::Centres { stride, .. } = &card.output {
            demand((1..=256).contains(stride), "output.stride", stride, || {
                "1 to 256".to_owned()
            })?;
        }
        Ok(card)
    }

    /// Returns the boxes of people in pixels of the input, highest score first.
    ///
    /// # Errors
    ///
    /// Returns an [`OutputError`] if the output has another shape, or if a value is not finite.
    pub fn boxes(&self, values: &[f32], shape: &[usize]) -> Result<Vec<PersonBox>, OutputError> {
        finite(values)?;
        let mut found = match &self.output {
            Boxes::Yolox {
                strides,
                person,
                decoded,
                ..
            } => self.of_grids((values, shape), strides, *person, *decoded)?,
            Boxes::Centres { stride, .. } => self.of_centres((values, shape), *stride)?,
            Boxes::List { .. } => {
                let &[1, n, 5] = shape else {
                    return Err(other(shape, "[1, n, 5]".to_owned()));
                };
                if values.len() != 5 * n {
                    return Err(other(shape, "[1, n, 5]".to_owned()));
                }
                let one = |values: &[f32]| PersonBox {
                    outline: [0, 1, 2, 3].map(|side| f64::from(values[side])),
                    score: f64::from(values[4]),
                };
                values.chunks_exact(5).map(one).collect()
            }
        };
        found.retain(|candidate| {
            candidate.score >= self.least_score && area(&candidate.outline) > 0.0
        });
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
        let mut kept: Vec<PersonBox> = Vec::new();
        for it in found {
            let is_new =
                |other: &PersonBox| overlap(&it.outline, &other.outline) <= self.most_overlap;
            if kept.iter().all(is_new) {
                kept.push(it);
            }
        }
        Ok(kept)
    }

    /// Returns the number of boxes of the grids with these strides.
    ///
    /// * `strides`: number of pixels of the input per cell of each grid, at least 1.
    pub fn n_cells(&self, strides: &[usize]) -> usize {
        let [width, height] = [self.input.width, self.input.height];
        strides.iter().map(|stride| (width / stride) * (height / stride)).sum()
    }

    fn of_centres(
        &self,
        (values, shape): (&[f32], &[usize]),
        stride: usize,
    ) -> Result<Vec<PersonBox>, OutputError> {
        let [columns, rows] = [self.input.width, self.input.height].map(|side| side / stride);
        let n_cells = columns * rows;
        if shape != [1, 5, rows, columns] || values.len() != 5 * n_cells {
            return Err(other(shape, format!("[1, 5, {rows}, {columns}]")));
        }
        Ok(centres::boxes(
            values,
            [columns, rows],
            (stride, self.least_score),
        ))
    }

    fn of_grids(
        &self,
        (values, shape): (&[f32], &[usize]),
        strides: &[usize],
        person: usize,
        decoded: bool,
    ) -> Result<Vec<PersonBox>, OutputError> {
        let [width, height] = [self.input.width, self.input.height];
        let cells = self.n_cells(strides);
        let n = match *shape {
            [1, rows, n] if rows == cells && n > 5 + person && values.len() == rows * n => n,
            _ => {
                let least = 6 + person;
                return Err(other(shape, format!("[1, {cells}, {least} or more]")));
            }
        };
        let grids = strides.iter().flat_map(|stride| {
            let columns = (width / stride).max(1);
            let n_cells = (width / stride) * (height / stride);
            (0..n_cells).map(move |cell| (*stride, cell % columns, cell / columns))
        });
        let one = |((stride, column, row), it): ((usize, usize, usize), &[f32])| {
            let raw = |at: usize| f64::from(it[at]);
            let (middle, size) = if decoded {
                ([raw(0), raw(1)], [raw(2), raw(3)])
            } else {
                let stride = stride as f64;
                let middle = [raw(0) + column as f64, raw(1) + row as f64];
                (
                    middle.map(|middle| middle * stride),
                    [raw(2), raw(3)].map(|value| value.exp() * stride),
                )
            };
            PersonBox {
                outline: [
                    middle[0] - size[0] / 2.0,
                    middle[1] - size[1] / 2.0,
                    middle[0] + size[0] / 2.0,
                    middle[1] + size[1] / 2.0,
                ],
                score: raw(4) * raw(5 + person),
            }
        };
        Ok(grids.zip(values.chunks_exact(n)).map(one).collect())
    }

    /// Writes the input of the network. Returns the number of pixels of the picture between two pixels of the input.
    ///
    /// * `rgb`: the picture, row major, red first; `size` is its width and height.
    /// * `values`: three values for every pixel of the input, all of which are written.
    ///
    /// # Panics
    ///
    /// Panics if the picture or the values have another length.
    pub fn fill(&self, rgb: &[u8], size: [usize; 2], values: &mut [f32]) -> f64 {
        let [width, height] = [self.input.width, self.input.height];
        assert_eq!(rgb.len(), 3 * size[0] * size[1], "the picture is RGB");
        assert_eq!(
            values.len(),
            3 * width * height,
            "there must be three values for each pixel"
        );
        let step = (size[0] as f64 / width as f64).max(size[1] as f64 / height as f64);
        for row in 0..height {
            for column in 0..width {
                let colour = self.cell(rgb, size, ([column, row], step));
                let pixel = row * width + column;
                for (channel, value) in self.input.prepared(colour).into_iter().enumerate() {
                    values[match self.input.layout {
                        Layout::Planes => channel * width * height + pixel,
                        Layout::Pixels => 3 * pixel + channel,
                    }] = value;
                }
            }
        }
        step
    }

    /// Returns the mean colour of the pixels of the picture that a pixel of the input covers. If the picture is enlarged, the colour is
    /// interpolated bilinearly.
    fn cell(&self, rgb: &[u8], size: [usize; 2], (at, step): ([usize; 2], f64)) -> [f32; 3] {
        let span = [0, 1].map(|axis| {
            let begin = (at[axis] as f64 * step) as usize;
            let end = ((at[axis] + 1) as f64 * step) as usize;
            begin..end.max(begin + 1).min(size[axis])
        });
        let [columns, rows] = span;
        if columns.is_empty() || rows.is_empty() {
            return [f32::from(self.fill); 3];
        }
        if step < 1.0 {
            let place = |axis: usize| {
                let place = (at[axis] as f64 + 0.5) * step - 0.5;
                place.clamp(0.0, size[axis] as f64 - 1.0)
            };
            return sample(rgb, size, [place(0), place(1)], f32::from(self.fill));
        }
        let n = (columns.len() * rows.len()) as f32;
        let mut sum = [0_u32; 3];
        for row in rows {
            let line = &rgb[3 * (row * size[0] + columns.start)..3 * (row * size[0] + columns.end)];
            for pixel in line.chunks_exact(3) {
                for channel in 0..3 {
                    sum[channel] += u32::from(pixel[channel]);
                }
            }
        }
        sum.map(|sum| sum as f32 / n)
    }
}

fn other(shape: &[usize], expected: String) -> OutputError {
    OutputError::Shape {
        got: shape.to_vec(),
        expected,
    }
}

fn area([left, top, right, bottom]: &[f64; 4]) -> f64 {
    (right - left).max(0.0) * (bottom - top).max(0.0)
}

/// Returns the area of the intersection of two boxes as a fraction of the area of their union.
fn overlap(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    let shared = area(&[
        a[0].max(b[0]),
        a[1].max(b[1]),
        a[2].min(b[2]),
        a[3].min(b[3]),
    ]);
    shared / (area(a) + area(b) - shared)
}

#[cfg(test)]
mod tests {
    use super::*;

    const YOLOX: &str = r#"
format = "parallax-detector"
version = 1
name = "a small one"
input = { width = 64, height = 32, colour = "bgr" }
output = { codec = "yolox", strides = [16, 32] }
"#;

    #[test]
    fn boxes_of_a_grid_follow_from_their_cells_and_the_best_of_overlapping_boxes_is_kept() {
        let card = DetectorCard::parse(YOLOX).unwrap();
        // The output has grids of 4 by 2 and of 2 by 1 cells, and two classes.
        let mut values = vec![0.0_f32; 10 * 7];
        let mut set =
            |cell: usize, it: [f32; 7]| values[7 * cell..7 * cell + 7].copy_from_slice(&it);
        set(5, [0.5, 0.5, 0.0, 2.0_f32.ln(), 0.9, 0.8, 0.0]);
        set(6, [-0.5, 0.5, 0.0, 2.0_f32.ln(), 0.9, 0.7, 0.0]);
        set(9, [0.5, 0.5, 0.0, 0.0, 0.5, 0.9, 0.0]);
        set(2, [0.5, 0.5, 0.0, 0.0, 0.9, 0.1, 0.9]);
        let found = card.boxes(&values, &[1, 10, 7]).unwrap();
        let outlines: Vec<[f64; 4]> = found.iter().map(|candidate| candidate.outline).collect();
        assert_eq!(found.len(), 2, "{found:?}");
        let near = |a: [f64; 4], b: [f64; 4]| (0..4).all(|i| (a[i] - b[i]).abs() < 1e-4);
        assert!(near(outlines[0], [16.0, 8.0, 32.0, 40.0]), "{outlines:?}");
        assert!(near(outlines[1], [32.0, 0.0, 64.0, 32.0]), "{outlines:?}");
        assert!((found[0].score - 0.72).abs() < 1e-6);
    }

    #[test]
    fn listed_boxes_are_used_unchanged() {
        let text = YOLOX.replace(
            r#"codec = "yolox", strides = [16, 32]"#,
            r#"codec = "list", boxes = "dets""#,
        );
        let card = DetectorCard::parse(&text).unwrap();
        let values = [
            1.0, 2.0, 11.0, 22.0, 0.9, 0.0, 0.0, 0.0, 0.0, 0.8, 5.0, 5.0, 9.0, 9.0, 0.1,
        ];
        let found = card.boxes(&values, &[1, 3, 5]).unwrap();
        assert_eq!(found.len(), 1, "an empty one and one below the least score");
        assert_eq!(found[0].outline, [1.0, 2.0, 11.0, 22.0]);
    }

    #[test]
    fn other_shapes_and_values_that_are_no_numbers_are_refused() {
        let card = DetectorCard::parse(YOLOX).unwrap();
        let mut values = vec![0.0_f32; 70];
        let refused = card.boxes(&values, &[1, 7, 10]).unwrap_err().to_string();
        assert!(refused.contains("expected [1, 10, 6 or more]"), "{refused}");
        values[3] = f32::NAN;
        card.boxes(&values, &[1, 10, 7]).unwrap_err();
        for (from, to) in [
            ("width = 64", "width = 3"),
            ("strides = [16, 32]", "strides = []"),
            ("strides = [16, 32]", "strides = [0]"),
            ("version = 1", "version = 1\nleast_score = 7"),
            ("version = 1", "version = 2"),
        ] {
            assert!(
                DetectorCard::parse(&YOLOX.replace(from, to)).is_err(),
                "{to}"
            );
        }
    }

    #[test]
    fn the_included_cards_are_valid() {
        for (text, name) in [
            (
                include_str!("../../../configs/detectors/yolox.toml"),
                "YOLOX",
            ),
            (
                include_str!("../../../configs/detectors/rtmdet-person.toml"),
                "RTMDet",
            ),
        ] {
            let card = DetectorCard::parse(text).unwrap();
            assert!(
                card.name.starts_with(name) && card.licence == "Apache-2.0",
                "{name}"
            );
        }
    }

    #[test]
    fn an_enlarged_picture_is_interpolated_bilinearly() {
        let card = DetectorCard::parse(YOLOX).unwrap();
        // Two by one pixels are enlarged to 64 by 32 pixels, so that the distance between their centres is half the input's width.
        let mut values = vec![f32::NAN; 3 * 64 * 32];
        let step = card.fill(&[0, 0, 0, 64, 64, 64], [2, 1], &mut values);
        assert_eq!(step, 1.0 / 32.0);
        let line: Vec<f32> = [0, 15, 16, 31, 32, 48, 63].map(|i| values[i]).to_vec();
        assert_eq!(line, [0.0, 0.0, 1.0, 31.0, 33.0, 64.0, 64.0]);
    }

    #[test]
    fn a_picture_keeps_its_aspect_ratio_and_is_padded_with_grey() {
        let card = DetectorCard::parse(YOLOX).unwrap();
        let rgb: Vec<u8> = [10, 20, 30].repeat(64 * 64);
        let mut values = vec![f32::NAN; 3 * 64 * 32];
        let step = card.fill(&rgb, [64, 64], &mut values);
        assert_eq!(step, 2.0);
        let plane = 64 * 32;
        assert_eq!(
            [values[0], values[plane], values[2 * plane]],
            [30.0, 20.0, 10.0]
        );
        assert_eq!(values[32], 114.0, "right of the picture");
    }
}
