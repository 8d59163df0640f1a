//! Description of a view's joint maps by a few Gaussians (joints with their uncertainty) instead of all cells.

use nalgebra::{Matrix6, Vector6};

use crate::MapSettings;
use crate::maps::N_JOINTS;
use crate::person_maps::{Peak, PersonMaps};

/// Minimum residual heat to which another Gaussian is fitted; lower residuals are ignored.
const LEAST_HEAT: f64 = 0.03;
/// Minimum height of a Gaussian. Its height is not reduced further, even if its neighbours describe all of its heat.
const LEAST_HEIGHT: f64 = 0.002;
/// Number of times that all heights are fitted again after a Gaussian is added.
const SWEEPS: usize = 6;
/// Maximum number of Gaussians for one joint's map.
pub const MOST_OF_A_JOINT: usize = 8;
/// Number of cells on each side of a maximum to which a Gaussian is fitted.
const REACH: i64 = 2;
/// A Gaussian is fitted to the cells whose value is at least this share of the maximum.
const SHARE: f64 = 0.5;
/// Smallest and largest standard deviation along any axis, in cells.
const SIGMAS: [f64; 2] = [0.4, 12.0];
/// Value at which a Gaussian is cut off: [`MapSettings::of_heat`] counts it as zero.
const NOTHING: f64 = 1e-5;

/// A Gaussian that describes part of the heat in a joint's map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bump {
    /// Index of the joint in `skeleton::PARSE14`.
    pub joint: usize,
    /// Position of the maximum: column and row, in cells of the maps.
    pub at: [f32; 2],
    /// Heat at the maximum, above 0 and at most 1.
    pub heat: f32,
    /// Inverse of the covariance, per square cell: the xx, xy and yy entries.
    pub precision: [f32; 3],
}

impl Bump {
    /// Returns true if [`bumps`] can produce this Gaussian: finite, positive definite, and within its limits of width.
    pub fn is_sound(&self) -> bool {
        let [xx, xy, yy] = self.precision.map(f64::from);
        let numbers = [self.at[0], self.at[1], self.heat];
        let [low, high] = precisions();
        let (trace, determinant) = (xx + yy, xx * yy - xy * xy);
        let spread = (trace * trace / 4.0 - determinant).max(0.0).sqrt();
        self.joint < N_JOINTS
            && numbers.iter().all(|number| number.is_finite())
            && self.at.iter().all(|value| value.abs() <= 65_536.0)
            && self.heat > 0.0
            && self.heat <= 1.0
            && [xx, xy, yy].iter().all(|value| value.is_finite())
            && trace / 2.0 - spread >= 0.9 * low
            && trace / 2.0 + spread <= 1.1 * high
    }

    /// Heat at a cell.
    fn heat_at(&self, [column, row]: [f64; 2]) -> f64 {
        let [xx, xy, yy] = self.precision.map(f64::from);
        let [x, y] = [column - f64::from(self.at[0]), row - f64::from(self.at[1])];
        f64::from(self.heat) * (-0.5 * (xx * x * x + 2.0 * xy * x * y + yy * y * y)).exp()
    }

    /// Range of cells where the Gaussian is not cut off, for columns and for rows: the first cell, and the cell after the last.
    ///
    /// * `size`: number of columns and rows.
    fn extent(&self, size: [usize; 2]) -> [[usize; 2]; 2] {
        let [xx, xy, yy] = self.precision.map(f64::from);
        let reach = (2.0 * (f64::from(self.heat) / NOTHING).ln().max(0.0)).sqrt();
        let determinant = xx * yy - xy * xy;
        let sigma = [(yy / determinant).sqrt(), (xx / determinant).sqrt()];
        [0, 1].map(|axis| {
            let middle = f64::from(self.at[axis]);
            let within = |cell: f64| cell.clamp(0.0, size[axis] as f64) as usize;
            let away = reach * sigma[axis];
            [
                within((middle - away).floor()),
                within((middle + away).ceil() + 1.0),
            ]
        })
    }
}

/// Smallest and largest eigenvalue that a precision may have.
fn precisions() -> [f64; 2] {
    let [narrow, wide] = SIGMAS;
    [1.0 / (wide * wide), 1.0 / (narrow * narrow)]
}

/// Describes the maps of all joints as sums of Gaussians. The highest Gaussian is fitted first, and each further Gaussian is fitted to the
/// residual of the earlier ones.
pub fn bumps(maps: &PersonMaps<'_>, settings: &MapSettings) -> Vec<Bump> {
    if let Some(peaks) = maps.peaks() {
        return peaks
            .enumerate()
            .filter_map(|(joint, peak)| of_peak(joint, &peak, settings))
            .collect();
    }
    let size = maps.grid().size;
    let floor = settings.floor();
    let mut found = Vec::new();
    let mut heats = Vec::new();
    for joint in 0..N_JOINTS {
        heats.clear();
        let heat = |value: &f32| {
            if *value > floor {
                settings.heat(*value)
            } else {
                0.0
            }
        };
        heats.extend(maps.cells(joint).iter().map(heat));
        let first = found.len();
        while found.len() < first + MOST_OF_A_JOINT
            && let Some(bump) = highest(joint, &heats, size)
        {
            for_each_cell(&bump, size, |cell, heat| heats[cell] -= heat);
            found.push(bump);
            fit_heights(&mut found[first..], &mut heats, size);
        }
    }
    found
}

fn of_peak(joint: usize, peak: &Peak, settings: &MapSettings) -> Option<Bump> {
    let [low, high] = precisions();
    let precision = f64::from(peak.sigma).powi(-2).clamp(low, high) as f32;
    let bump = Bump {
        joint,
        at: peak.cell,
        heat: settings.heat(peak.evidence) as f32,
        precision: [precision, 0.0, precision],
    };
    bump.is_sound().then_some(bump)
}

/// Fills maps from Gaussians. Cells that no Gaussian reaches are set to the floor.
///
/// * `bumps`: Gaussians for which [`Bump::is_sound`] is true.
/// * `size`: number of columns and rows of a map.
/// * `values`: `[joint][row][column]`, overwritten.
pub fn fill_from_bumps(
    bumps: &[Bump],
    size: [usize; 2],
    settings: &MapSettings,
    values: &mut [f32],
) {
    let floor = settings.floor();
    let area = (size[0] * size[1]).max(1);
    values.fill(0.0);
    for bump in bumps {
        if let Some(map) = values.chunks_exact_mut(area).nth(bump.joint) {
            for_each_cell(bump, size, |cell, heat| map[cell] += heat as f32);
        }
    }
    for value in values {
        *value = settings.of_heat(f64::from(value.clamp(0.0, 1.0)), floor);
    }
}

fn for_each_cell(bump: &Bump, size: [usize; 2], mut cell: impl FnMut(usize, f64)) {
    let [[left, right], [top, bottom]] = bump.extent(size);
    for row in top..bottom {
        for column in left..right {
            let heat = bump.heat_at([column as f64, row as f64]);
            cell(row * size[0] + column, heat);
        }
    }
}

/// Fits the heights of all Gaussians of a map by least squares, one Gaussian after the other. In this way, neighbouring Gaussians share the
/// heat between them.
///
/// * `left`: residual of the map.
fn fit_heights(bumps: &mut [Bump], left: &mut [f64], size: [usize; 2]) {
    for _ in 0..SWEEPS {
        for bump in &mut *bumps {
            let (mut along, mut square) = (0.0, 0.0);
            for_each_cell(bump, size, |cell, heat| {
                along += left[cell] * heat;
                square += heat * heat;
            });
            let height = f64::from(bump.heat);
            let wanted = height * (1.0 + along / square.max(f64::MIN_POSITIVE));
            let next = wanted.clamp(LEAST_HEIGHT, 1.0) as f32;
            let change = f64::from(next) / height - 1.0;
            for_each_cell(bump, size, |cell, heat| left[cell] -= change * heat);
            bump.heat = next;
        }
    }
}

/// Fits a Gaussian at the highest cell of a map.
fn highest(joint: usize, heats: &[f64], [columns, rows]: [usize; 2]) -> Option<Bump> {
    let (cell, top) = heats.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
    if *top < LEAST_HEAT {
        return None;
    }
    let [column, row] = [cell % columns, cell / columns];
    let around = |across: i64, down: i64| {
        let at = [column as i64 + across, row as i64 + down];
        let is_inside = (0..columns as i64).contains(&at[0]) && (0..rows as i64).contains(&at[1]);
        is_inside.then(|| heats[at[1] as usize * columns + at[0] as usize])
    };
    let fitted = fit(&around, *top);
    // If no Gaussian can be fitted, a Gaussian as wide as a cell describes the maximum.
    let (away, heat, precision) = fitted.unwrap_or(([0.0; 2], *top, [1.0, 0.0, 1.0]));
    Some(Bump {
        joint,
        at: [
            (column as f64 + away[0]) as f32,
            (row as f64 + away[1]) as f32,
        ],
        heat: heat as f32,
        precision: precision.map(|precision| precision as f32),
    })
}

/// Fits a Gaussian around a maximum; returns its offset from the maximum, its height and its precision. A quadratic is fitted to the
/// logarithms of the heats, weighted by the squares of the heats. To first order, this is a least-squares fit of the heats.
fn fit(around: &impl Fn(i64, i64) -> Option<f64>, top: f64) -> Option<([f64; 2], f64, [f64; 3])> {
    let mut left = Matrix6::<f64>::zeros();
    let mut right = Vector6::<f64>::zeros();
    for down in -REACH..=REACH {
        for across in -REACH..=REACH {
            let Some(heat) = around(across, down).filter(|value| *value >= SHARE * top) else {
                continue;
            };
            let [x, y] = [across as f64, down as f64];
            let row = Vector6::new(1.0, x, y, -0.5 * x * x, -x * y, -0.5 * y * y);
            left += heat * heat * row * row.transpose();
            right += heat * heat * heat.ln() * row;
        }
    }
    let it = left.cholesky()?.solve(&right);
    let (height, slope, bend) = (it[0], [it[1], it[2]], [it[3], it[4], it[5]]);
    let precision = bounded(bend)?;
    let [xx, xy, yy] = precision;
    let determinant = xx * yy - xy * xy;
    let away = [
        (yy * slope[0] - xy * slope[1]) / determinant,
        (xx * slope[1] - xy * slope[0]) / determinant,
    ];
    if !away.iter().all(|value| value.abs() <= 1.5) {
        return None;
    }
    let heat = (height + 0.5 * (slope[0] * away[0] + slope[1] * away[1])).exp();
    let is_near = heat >= 0.5 * top && heat <= 2.0 * top;
    is_near.then_some((away, heat.min(1.0), precision))
}

/// Returns the nearest precision whose eigenvalues are within the limits of width.
fn bounded([xx, xy, yy]: [f64; 3]) -> Option<[f64; 3]> {
    if ![xx, xy, yy].iter().all(|value| value.is_finite()) {
        return None;
    }
    let eigen = nalgebra::Matrix2::new(xx, xy, xy, yy).symmetric_eigen();
    let [low, high] = precisions();
    let values = eigen.eigenvalues.map(|eigenvalue| eigenvalue.clamp(low, high));
    let it = eigen.eigenvectors
        * nalgebra::Matrix2::from_diagonal(&values)
        * eigen.eigenvectors.transpose();
    Some([it[(0, 0)], it[(0, 1)], it[(1, 1)]])
}

#[cfg(test)]
mod tests;
