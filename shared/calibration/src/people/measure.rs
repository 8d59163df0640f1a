//! Quality of the fit of joints, and their distribution over the picture.
use statistics::Sorted;

use super::adjust::Adjustment;
use super::bias::share_of;

/// A joint has an expected error of its own if there are at least this many residuals of the joint. Otherwise, the expected error of all
/// joints is used.
const LEAST: usize = 30;
/// Smallest expected error, in pixels.
const LEAST_PX: f64 = 0.3;
/// Median length of a residual in the plane, in standard deviations of one axis.
const MEDIAN: f64 = 1.1774;
/// Factor that corrects residuals for the fact that the same joints were used in the fit. It is computed for four views, whose eight
/// numbers determine three coordinates.
const FITTED: f64 = 1.25;
/// Number of cells of a picture along each axis.
pub(crate) const CELLS: usize = 8;

/// Returns the expected errors from the residuals, by camera and joint.
///
/// Each joint has one error relative to the size of the person, estimated from all cameras together. If each camera had its own expected
/// errors, a single camera could dominate the result.
///
/// * `sizes_px`: size of the person in each camera.
pub(crate) fn sigmas(problem: &Adjustment, sizes_px: &[f64], n_joints: usize) -> Vec<Vec<f64>> {
    let mut all = vec![Vec::new(); n_joints];
    problem.residuals(&mut |residual| {
        all[residual.joint].push(residual.own.norm() / sizes_px[residual.camera]);
    });
    let whole = Sorted::new(all.concat()).upper_median().unwrap_or(1.0);
    let share = |residuals: &Vec<f64>| {
        let own = Sorted::new(residuals.clone())
            .upper_median()
            .filter(|_| residuals.len() >= LEAST);
        FITTED * own.unwrap_or(whole) / MEDIAN
    };
    let shares: Vec<f64> = all.iter().map(share).collect();
    let of_camera = |size: &f64| shares.iter().map(|share| (share * size).max(LEAST_PX)).collect();
    sizes_px.iter().map(of_camera).collect()
}

/// Returns the constant error of joints by camera, in pixels; `None` if it is negligible.
pub(crate) fn biases(problem: &Adjustment, sizes_px: &[f64], n_joints: usize) -> Option<Vec<f64>> {
    let mut all = vec![Vec::new(); n_joints * sizes_px.len()];
    problem.residuals(&mut |residual| {
        all[residual.camera * n_joints + residual.joint]
            .push(residual.whole / sizes_px[residual.camera]);
    });
    let share = share_of(&all)?;
    Some(sizes_px.iter().map(|sizes_px| share * sizes_px).collect())
}

/// Quality of the fit of a camera's joints.
#[derive(Debug, Clone, Default)]
pub(crate) struct Fit {
    /// Number of joints that were used.
    pub(crate) n: usize,
    /// Median residual, pixels.
    pub(crate) median_px: f64,
    /// Fraction of joints within three times their expected error.
    pub(crate) inliers: f64,
    /// Number of joints in each cell of the picture, row by row.
    pub(crate) cells: Vec<usize>,
}

/// Returns the fit of every camera.
pub(crate) fn fits(problem: &Adjustment, sigmas_px: &[Vec<f64>]) -> Vec<Fit> {
    let cameras = problem.cameras().cameras();
    let mut lengths = vec![Vec::new(); cameras.len()];
    let mut good = vec![0_usize; cameras.len()];
    let mut cells = vec![vec![0_usize; CELLS * CELLS]; cameras.len()];
    problem.residuals(&mut |residual| {
        let (camera, at) = (residual.camera, residual.at);
        lengths[camera].push(residual.whole.norm());
        good[camera] += usize::from(residual.own.norm() < 3.0 * sigmas_px[camera][residual.joint]);
        let [width, height] = cameras[camera].intrinsics.size.map(f64::from);
        let share = [(at.x + 0.5) / width, (at.y + 0.5) / height];
        let cell = share
            .map(|share| (share * CELLS as f64).floor().clamp(0.0, CELLS as f64 - 1.0) as usize);
        cells[camera][cell[1] * CELLS + cell[0]] += 1;
    });
    let each = lengths.into_iter().zip(good).zip(cells);
    each.map(|((lengths, good), cells)| Fit {
        n: lengths.len(),
        inliers: good as f64 / lengths.len().max(1) as f64,
        median_px: Sorted::new(lengths).upper_median().unwrap_or(f64::NAN),
        cells,
    })
    .collect()
}
