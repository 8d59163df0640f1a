//! The maps of the skeleton's joints, as logarithms: the evidence from a network.

mod sides;

use keypoints::{Codec, Keypoint, Way, Window, joint_rows};
use skeleton::PARSE14;

use crate::expected::expected_error;
use crate::found::{likelihood, score_of, scored, weighted};
use crate::network::{LookError, Read, Sight};
use crate::person_maps::{MapGrid, MapKind, Peak, PersonMaps};

/// Number of joints; each has a map.
pub(crate) const N_JOINTS: usize = PARSE14.joints.len();

/// Heat below which [`MapSettings::of_heat`] counts it as zero.
const LEAST_HEAT: f64 = 1e-5;

/// Conversion of a map to evidence: `ln(max(h, 0) + eps)`, where `h` is the heat from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapSettings {
    /// Heat assumed where the network sees nothing. Because of this floor, one view cannot rule out a joint that other views see.
    pub eps: f64,
    /// Standard deviation of the position of a keypoint without a map, as a share of the height of the input.
    pub point_sigma: f64,
}

impl MapSettings {
    /// The evidence where the network sees nothing.
    pub fn floor(&self) -> f32 {
        self.eps.ln() as f32
    }

    /// The heat, 0 to 1, that corresponds to a value of evidence.
    pub fn heat(&self, evidence: f32) -> f64 {
        (f64::from(evidence).exp() - self.eps).clamp(0.0, 1.0)
    }

    /// The evidence for a heat. A heat below [`LEAST_HEAT`] counts as zero, which saves the logarithm for most cells.
    ///
    /// * `floor`: [`Self::floor`].
    pub(crate) fn of_heat(&self, heat: f64, floor: f32) -> f32 {
        if heat < LEAST_HEAT {
            return floor;
        }
        (heat + self.eps).ln() as f32
    }
}

impl Default for MapSettings {
    fn default() -> Self {
        Self {
            eps: 0.02,
            point_sigma: 0.02,
        }
    }
}

/// Maps of the joints in a window of a picture, on the grid of the network's own maps.
#[derive(Debug, Clone, Default)]
pub struct JointMaps {
    /// Weighted logarithms by cell, or peaks.
    values: Vec<f32>,
    kind: MapKind,
    rows: usize,
    columns: usize,
    /// Interval between the kept rows and columns of the network's own maps.
    every: usize,
    /// Pixels of the input between two cells, across and down; the first cell is at the first pixel.
    step: [f64; 2],
    floor: f32,
    window: Option<Window>,
    /// Peak of each joint's map, in pixels of the picture, with its heat from 0 to 1.
    peaks: Vec<Option<Keypoint>>,
    /// All keypoints, in pixels of the picture; their scores have the same meaning as the scores of the peaks.
    keypoints: Vec<Option<Keypoint>>,
    /// The expected error of each joint according to the network, in pixels of the picture; empty if the network does not give it.
    told: Vec<Option<f64>>,
    /// The expected error of each keypoint.
    errors: Vec<f64>,
    /// Standard deviation of a keypoint with score 1 on the maps themselves; `None` if it is computed from the heat.
    sigma_px: Option<f64>,
    /// Working memory: a Gaussian along the columns.
    across: Vec<f64>,
}

/// Maximum number of cells of a map. Larger maps are kept at lower resolution.
pub const MOST_CELLS: usize = 1 << 15;

/// Spacing of the cells to keep, chosen so that at most [`MOST_CELLS`] are kept.
fn coarseness([rows, columns]: [usize; 2]) -> usize {
    let area = |every: &usize| rows.div_ceil(*every) * columns.div_ceil(*every);
    let most = rows.max(columns).max(1);
    (1..=most).find(|every| area(every) <= MOST_CELLS).unwrap_or(most)
}

/// Pixels between neighbouring columns or rows of a grid, for a network or program that gives keypoints without maps.
const GRID_PX: f64 = 2.0;
/// Factor by which the box around another program's keypoints is enlarged for the grid.
const BOX_MARGIN: f64 = 1.25;
/// Maximum number of rows of a grid for keypoints without maps.
const MOST_ROWS: usize = 64;
/// Minimum standard deviation of a keypoint without a map, in cells: at least one pixel.
const LEAST_SIGMA: f64 = 1.0;

/// The standard deviation along one axis of a normal distribution in the plane whose mean distance is 1: sqrt(2 / pi).
const ALONG_AN_AXIS: f64 = 0.797_884_56;

impl JointMaps {
    /// Reads the output of a network.
    ///
    /// # Errors
    ///
    /// Fails with [`LookError::Output`]; this cannot happen if the network has run successfully.
    pub fn read(&mut self, sight: &Sight<'_>, settings: &MapSettings) -> Result<(), LookError> {
        let keypoints = sight.keypoints()?;
        let rows = joint_rows(sight.network().names());
        let read = sight.read()?;
        let size = sight.window().input();
        let window = sight.maps_window()?;
        self.window = Some(window);
        self.floor = settings.floor();
        self.kind = MapKind::Cells;
        (self.rows, self.columns, self.step) = if let Read::Maps(maps) = &read {
            let [rows, columns] = maps.size();
            let udp = matches!(
                sight.network().card().output,
                Codec::HeatMap { udp: true, .. }
            );
            self.every = coarseness([rows, columns]);
            let step = maps.step(size, udp).map(|step| step * self.every as f64);
            let sides = [rows, columns].map(|side| side.div_ceil(self.every));
            (sides[0], sides[1], step)
        } else {
            let [columns, rows] = size.map(|side| (side as f64 / GRID_PX) as usize);
            let coarser = coarseness([rows, columns]);
            let [columns, rows] = [columns, rows].map(|side| side.div_ceil(coarser));
            let step = [
                size[0] as f64 / columns as f64,
                size[1] as f64 / rows as f64,
            ];
            (rows, columns, step)
        };
        self.values.clear();
        self.values.resize(N_JOINTS * self.rows * self.columns, self.floor);
        self.peaks.clear();
        self.keypoints.clear();
        self.sigma_px = None;
        self.told.clear();
        self.errors.clear();
        if let Some(errors) = sight.errors() {
            self.errors.extend(errors);
            let of_row = |row: &Vec<(usize, f64)>| {
                row.iter().map(|(source, share)| share.abs() * self.errors[*source]).sum()
            };
            self.told.extend(rows.iter().map(|row| row.as_ref().map(of_row)));
        }
        let each = keypoints.iter().enumerate();
        self.keypoints
            .extend(each.map(|(nth, it)| Some(scored(nth, *it, (&read, sight)))));
        for (joint, row) in rows.iter().enumerate() {
            let found = |i: usize| self.keypoints[i];
            let peak = row.as_ref().and_then(|row| weighted(row, found));
            self.peaks.push(peak);
            if let (Some(row), Some(mut peak)) = (row, peak) {
                peak.at = window.in_input(peak.at);
                self.fill_joint(joint, (row, peak), (&read, sight), settings);
            }
        }
        Ok(())
    }

    /// Makes maps from the keypoints of a person found by another program ([`MapKind::Peaks`]). Each joint becomes a Gaussian as high as
    /// its score, above the floor. If no person was found, no joint has a peak.
    ///
    /// * `keypoints`: positions in pixels of the picture; `None`, or a score of 0, for keypoints that were not found.
    /// * `ways`: for each joint, the alternative sums of keypoints from which it can be computed ([`joint_ways`](keypoints::joint_ways) of
    ///   the keypoints' names). The first alternative whose keypoints were all found gives the joint's peak; without one, the joint has no
    ///   peak.
    /// * `settings`: conversion of heat to evidence. The field `point_sigma` is not used.
    /// * `sigma`: standard deviation, as a share of the height of the enlarged box, like [`MapSettings::point_sigma`].
    /// * Returns true if a person was found.
    ///
    /// # Panics
    ///
    /// Panics if one of `ways` refers to a keypoint beyond the list.
    pub fn of_keypoints(
        &mut self,
        keypoints: &[Option<Keypoint>],
        ways: &[Vec<Way>],
        settings: &MapSettings,
        sigma: f64,
    ) -> bool {
        self.floor = settings.floor();
        self.kind = MapKind::Peaks;
        self.step = [1.0; 2];
        self.window = keypoints::outline(keypoints)
            .and_then(|outline| Window::grid(outline, BOX_MARGIN, MOST_ROWS));
        [self.columns, self.rows] = self.window.map_or([0, 0], |window| window.input());
        self.values.clear();
        self.values.extend([[0.0, 0.0, self.floor, 1.0]; N_JOINTS].as_flattened());
        self.peaks.clear();
        self.peaks.resize(N_JOINTS, None);
        self.told.clear();
        self.errors.clear();
        self.keypoints.clear();
        self.keypoints.extend_from_slice(keypoints);
        let Some(window) = self.window else {
            return false;
        };
        let [_, top, _, bottom] = self.extent();
        let height = bottom - top;
        self.sigma_px = Some(sigma * height);
        self.told.resize(N_JOINTS, None);
        let values = self.values.as_chunks_mut::<{ Peak::LENGTH }>().0;
        for ((joint, ways), value) in ways.iter().enumerate().zip(values) {
            let found = |at: usize| keypoints[at].filter(|keypoint| keypoint.score > 0.0);
            let seen = |way: &Way| Some((weighted(&way.row, found)?, way.spread));
            let Some((peak, spread)) = ways.iter().find_map(seen) else {
                continue;
            };
            self.peaks[joint] = Some(peak);
            if spread > 0.0 {
                let error = expected_error(peak.score).hypot(spread) * height;
                self.told[joint] = Some(error / ALONG_AN_AXIS);
            }
            let sigma = (sigma.hypot(spread) * self.rows as f64).max(LEAST_SIGMA);
            let [column, row] = window.in_input(peak.at).map(|side| side as f32);
            let evidence = settings.of_heat(peak.score.clamp(0.0, 1.0), self.floor);
            *value = [column, row, evidence, sigma as f32];
        }
        true
    }

    /// Fills the map of one joint with a Gaussian; its cells must be at the floor. The Gaussian is the product of one along each axis, so
    /// that every row and column needs only one exponential function.
    ///
    /// * `at`, `sigma`: in pixels of the input.
    fn fill_bump(
        &mut self,
        joint: usize,
        (at, score): ([f64; 2], f64),
        sigma: f64,
        settings: &MapSettings,
    ) {
        let (area, columns, step) = (self.rows * self.columns, self.columns, self.step);
        let floor = self.floor;
        let along = |axis: usize, cell: usize| {
            let distance = (cell as f64 * step[axis] - at[axis]) / sigma;
            (-0.5 * distance * distance).exp()
        };
        self.across.clear();
        self.across.extend((0..columns).map(|column| along(0, column)));
        let cells = &mut self.values[joint * area..(joint + 1) * area];
        for (row, line) in cells.chunks_exact_mut(columns.max(1)).enumerate() {
            let most = score.clamp(0.0, 1.0) * along(1, row);
            if most < LEAST_HEAT {
                continue;
            }
            for (value, across) in line.iter_mut().zip(&self.across) {
                *value = settings.of_heat(most * across, floor);
            }
        }
    }

    /// Fills the map of one joint, which is a weighted sum of keypoints.
    ///
    /// * `peak`: in the coordinates of the maps.
    fn fill_joint(
        &mut self,
        joint: usize,
        (row, peak): (&[(usize, f64)], Keypoint),
        (read, sight): (&Read<'_>, &Sight<'_>),
        settings: &MapSettings,
    ) {
        let (area, columns, step) = (self.rows * self.columns, self.columns, self.step);
        let size = sight.window().input();
        let floor = self.floor;
        let heat = |value: f64| settings.of_heat(value, floor);
        let lines = self.values[joint * area..(joint + 1) * area].chunks_exact_mut(columns);
        let lines = lines.enumerate();
        match (read, row) {
            (Read::Maps(maps), [(keypoint, _)]) => {
                let score = score_of(sight);
                for (row, line) in lines {
                    for (column, value) in line.iter_mut().enumerate() {
                        let [row, column] = [row, column].map(|cell| cell * self.every);
                        *value = heat(score.of(f64::from(maps.value(*keypoint, row, column))));
                    }
                }
            }
            (Read::SimCc(simcc), [(keypoint, _)]) => {
                let of_cells = |axis: usize, n: usize| -> Vec<f64> {
                    let bins = likelihood(simcc.axis(*keypoint, axis), axis, sight);
                    let of_pixel = bins.len() as f64 / size[axis] as f64;
                    let bin = |cell: usize| (cell as f64 * step[axis] * of_pixel).round() as usize;
                    let cells = 0..n;
                    cells.map(|cell| bins[bin(cell).min(bins.len() - 1)]).collect()
                };
                let (across, down) = (of_cells(0, columns), of_cells(1, self.rows));
                for ((_, line), down) in lines.zip(down) {
                    for (value, across) in line.iter_mut().zip(&across) {
                        *value = heat(across * down);
                    }
                }
            }
            _ => {
                let sigma = settings.point_sigma * sight.network().size()[1] as f64;
                self.fill_bump(joint, (peak.at, peak.score), sigma, settings);
            }
        }
    }

    /// Returns a keypoint as found by the network or the other program, and the standard deviation of its position along one axis. Both are
    /// in pixels of the picture. The standard deviation comes from the `sigma` of [`Self::of_keypoints`], from the network, or from the
    /// score ([`expected_error`]). Returns `None` if the keypoint was not found or no picture has been read.
    ///
    /// * `keypoint`: index of the keypoint, in the order of the card or of the file.
    pub fn keypoint(&self, keypoint: usize) -> Option<(Keypoint, f64)> {
        let found = self.keypoints.get(keypoint).copied().flatten()?;
        self.window?;
        let [_, top, _, bottom] = self.extent();
        let by_heat = || expected_error(found.score) * (bottom - top);
        let told = self.errors.get(keypoint).map(|error| error * ALONG_AN_AXIS);
        Some((found, self.sigma_px.or(told).unwrap_or_else(by_heat)))
    }

    /// Expected error of a joint's peak: the standard deviation along one axis, in pixels of the picture. It comes from the network if the
    /// network gives it, otherwise from the heat at the peak ([`expected_error`]). Returns `None` for a joint without a peak.
    pub fn expected_px(&self, joint: usize) -> Option<f64> {
        let peak = self.peaks.get(joint).copied().flatten()?;
        let told = self.told.get(joint).copied().flatten();
        let [_, top, _, bottom] = self.extent();
        let by_heat = || expected_error(peak.score) * (bottom - top);
        Some(told.map_or_else(by_heat, |value| value * ALONG_AN_AXIS))
    }

    /// Positions of the 14 joints according to the network, in pixels of the picture, with scores from 0 to 1. `None` for a joint that
    /// cannot be derived from the keypoints.
    pub fn peaks(&self) -> &[Option<Keypoint>] {
        &self.peaks
    }

    /// The evidence for a joint at a point of the picture ([`PersonMaps::at`]); the floor before the first picture.
    pub fn at(&self, joint: usize, point: [f64; 2]) -> f32 {
        self.evidence().map_or(self.floor, |maps| maps.at(joint, point))
    }

    /// The highest maxima of a joint's map ([`PersonMaps::maxima`]).
    ///
    /// * `n`: maximum number of maxima.
    pub fn maxima(&self, joint: usize, n: usize) -> Vec<([f64; 2], f32)> {
        self.evidence().map_or_else(Vec::new, |maps| maps.maxima(joint, n, |_| true))
    }

    /// The evidence for a joint at positions where the network sees nothing.
    pub fn floor(&self) -> f32 {
        self.floor
    }

    /// Moves the maps and all keypoints by an offset in pixels of the picture.
    pub fn shift(&mut self, by: [f64; 2]) {
        self.window = self.window.map(|window| window.shifted(by));
        let keypoints = self.keypoints.iter_mut();
        for peak in self.peaks.iter_mut().chain(keypoints).flatten() {
            peak.at = [peak.at[0] + by[0], peak.at[1] + by[1]];
        }
    }

    /// The rectangle of the picture that the maps cover: left, top, right, bottom, pixels; zeros before the first picture.
    pub fn extent(&self) -> [f64; 4] {
        let Some(window) = &self.window else {
            return [0.0; 4];
        };
        let last = [
            self.columns as f64 * self.step[0],
            self.rows as f64 * self.step[1],
        ];
        let ([left, top], [right, bottom]) = (window.in_picture([0.0; 2]), window.in_picture(last));
        [left, top, right, bottom]
    }

    /// The maps with their position in the picture; `None` before the first picture.
    pub fn evidence(&self) -> Option<PersonMaps<'_>> {
        let window = self.window.as_ref()?;
        let at = |cell: f64| window.in_picture(self.step.map(|step| cell * step));
        let ([x0, y0], [x1, y1]) = (at(0.0), at(1.0));
        let grid = MapGrid {
            first_px: [x0, y0],
            cell_px: [x1 - x0, y1 - y0],
            size: [self.columns, self.rows],
            kind: self.kind,
        };
        Some(PersonMaps::new(grid, &self.values, self.floor))
    }
}

#[cfg(test)]
mod tests;
