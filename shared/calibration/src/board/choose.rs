//! Choice of frames that cover the pictures, distances and tilts.

use std::collections::BTreeMap;

use crate::boards::Homography;
use nalgebra::Point2;
use statistics::Sorted;

use super::Sight;

/// Number of cells of a picture along each side.
const CELLS: [usize; 2] = [8, 6];
/// Number of classes of the board's apparent size, each 1.5 times as large as the one before, and number of classes of its tilt.
const SIZES: usize = 8;
const TILTS: usize = 6;
/// Returns the frames of `sights` with the best coverage, at most `most`, in their original order.
///
/// Frames are chosen one by one. Each time, the frame is chosen that adds most to the features that have been covered least: cells of each
/// camera's picture, sizes and tilts of the board, and pairs of cameras that see the board together.
pub(crate) fn frames(sights: &[Sight], sizes: &[[u32; 2]], most: usize) -> Vec<usize> {
    let mut all: Vec<usize> = sights.iter().map(|sight| sight.frame).collect();
    all.sort_unstable();
    all.dedup();
    if all.len() <= most {
        return all;
    }
    let n_cameras = sizes.len();
    let per_camera = CELLS[0] * CELLS[1] + SIZES + TILTS * TILTS;
    let n_features = n_cameras * per_camera + n_cameras * n_cameras;
    let features: Vec<Vec<usize>> = all
        .iter()
        .map(|frame| {
            let own: Vec<&Sight> = sights.iter().filter(|sight| sight.frame == *frame).collect();
            let mut list: Vec<usize> = own
                .iter()
                .flat_map(|sight| {
                    let size = sizes[sight.camera].map(f64::from);
                    features_of(sight, size).map(move |feature| sight.camera * per_camera + feature)
                })
                .collect();
            for a in &own {
                for b in &own {
                    if a.camera < b.camera {
                        let pair = a.camera * n_cameras + b.camera;
                        // Pairs of cameras count several times, because they connect the cameras of the rig.
                        list.extend([n_cameras * per_camera + pair; 6]);
                    }
                }
            }
            list
        })
        .collect();
    let mut times = vec![0_u32; n_features];
    let mut is_taken = vec![false; all.len()];
    for _ in 0..most {
        let gain = |nth: usize| -> f64 {
            let each = features[nth].iter().map(|feature| 1.0 / f64::from(1 + times[*feature]));
            each.sum()
        };
        let open = (0..all.len()).filter(|nth| !is_taken[*nth]);
        let Some(best) = open.max_by(|a, b| gain(*a).total_cmp(&gain(*b)).then(b.cmp(a))) else {
            break;
        };
        is_taken[best] = true;
        for feature in &features[best] {
            times[*feature] += 1;
        }
    }
    let taken = all.iter().zip(&is_taken).filter(|(_, is_taken)| **is_taken);
    taken.map(|(frame, _)| *frame).collect()
}

/// Returns the speed of the board's corners in the picture, in pixels per frame, by camera and frame. It is the larger of the speeds since
/// the previous picture with the board and to the next one.
pub(crate) fn speeds(sights: &[Sight], n_cameras: usize) -> BTreeMap<(usize, usize), f64> {
    let mut speeds = BTreeMap::new();
    for camera in 0..n_cameras {
        let mut own: Vec<&Sight> = sights.iter().filter(|sight| sight.camera == camera).collect();
        own.sort_by_key(|sight| sight.frame);
        for (nth, sight) in own.iter().enumerate() {
            let before = nth.checked_sub(1).and_then(|difference| own.get(difference));
            let near = [before, own.get(nth + 1)].into_iter().flatten();
            let each = near.filter_map(|other| speed(sight, other));
            let fastest = each.fold(f64::NAN, f64::max);
            if fastest.is_finite() {
                speeds.insert((camera, sight.frame), fastest);
            }
        }
    }
    speeds
}

/// Returns the sights of frames that several cameras see and in which the board moves least: half of these frames, but at least `least`.
pub(crate) fn slow(
    sights: &[Sight],
    speeds: &BTreeMap<(usize, usize), f64>,
    least: usize,
) -> Vec<Sight> {
    let mut by_frame: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for sight in sights {
        let speed = speeds.get(&(sight.camera, sight.frame));
        let own = by_frame.entry(sight.frame).or_default();
        own.push(*speed.unwrap_or(&f64::INFINITY));
    }
    by_frame.retain(|_, own| own.len() > 1);
    let mut order: Vec<(f64, usize)> = by_frame
        .into_iter()
        .map(|(frame, own)| (own.into_iter().fold(0.0, f64::max), frame))
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    order.truncate((order.len() / 2).max(least));
    let is_slow = |sight: &&Sight| order.iter().any(|frame| frame.1 == sight.frame);
    sights.iter().filter(is_slow).cloned().collect()
}

/// Returns the median movement of corners between two pictures, in pixels per frame.
fn speed(a: &Sight, b: &Sight) -> Option<f64> {
    let moved = a.points.iter().filter_map(|(id, at)| {
        let other = b.points.iter().find(|point| point.0 == *id)?;
        Some((other.1 - at).norm())
    });
    let moved = Sorted::new(moved.collect::<Vec<f64>>()).median()?;
    Some(moved / a.frame.abs_diff(b.frame).max(1) as f64)
}

/// Returns the features that a sight of a board covers: cells, the board's size, and its tilt in both directions.
fn features_of(sight: &Sight, size: [f64; 2]) -> impl Iterator<Item = usize> {
    let mut cells: Vec<usize> = sight.points.iter().map(|(_, at)| cell(*at, size)).collect();
    cells.sort_unstable();
    cells.dedup();
    let n_cells = CELLS[0] * CELLS[1];
    let side = spread(sight) / size[0].max(size[1]);
    let step = (-side.max(1e-3).ln() / 1.5_f64.ln()).clamp(0.0, (SIZES - 1) as f64) as usize;
    cells.push(n_cells + step);
    if let Some([u, v]) = tilt(sight) {
        let bin = |value: f64| {
            ((value + 0.75) / 1.5 * TILTS as f64).clamp(0.0, (TILTS - 1) as f64) as usize
        };
        cells.push(n_cells + SIZES + bin(v) * TILTS + bin(u));
    }
    cells.into_iter()
}

/// Returns the cell of a position in a picture.
fn cell(at: Point2<f64>, size: [f64; 2]) -> usize {
    let along = |axis: usize| {
        let share = (at[axis] + 0.5) / size[axis];
        (share * CELLS[axis] as f64).clamp(0.0, (CELLS[axis] - 1) as f64) as usize
    };
    along(1) * CELLS[0] + along(0)
}

/// Returns the fraction of a picture's cells that contain points, from 0 to 1.
pub(crate) fn coverage(points: impl Iterator<Item = Point2<f64>>, size: [u32; 2]) -> f64 {
    let mut is_seen = [false; CELLS[0] * CELLS[1]];
    for at in points {
        is_seen[cell(at, size.map(f64::from))] = true;
    }
    is_seen.iter().filter(|is_seen| **is_seen).count() as f64 / is_seen.len() as f64
}

/// Returns the root mean square distance of points from their centre, in pixels.
fn spread(sight: &Sight) -> f64 {
    let n = sight.points.len().max(1) as f64;
    let middle = sight.points.iter().map(|point| point.1.coords);
    let middle = middle.sum::<nalgebra::Vector2<f64>>() / n;
    let square = sight.points.iter().map(|point| (point.1.coords - middle).norm_squared());
    (square.sum::<f64>() / n).sqrt()
}

/// Returns how much smaller the far side of a board is than the near one, along its two axes.
fn tilt(sight: &Sight) -> Option<[f64; 2]> {
    let map =
        Homography::fit(sight.on_board.iter().zip(&sight.points).map(|(on, at)| (*on, at.1, 1.0)))?;
    let n = sight.on_board.len() as f64;
    let middle = sight
        .on_board
        .iter()
        .map(|on_board| on_board.coords)
        .sum::<nalgebra::Vector2<f64>>()
        / n;
    let reach = sight
        .on_board
        .iter()
        .map(|on_board| (on_board.coords - middle).norm())
        .fold(0.0, f64::max);
    let row = map.matrix().row(2).into_owned();
    let depth = row[0] * middle.x + row[1] * middle.y + row[2];
    let share = [row[0] * reach / depth, row[1] * reach / depth];
    share.iter().all(|value| value.is_finite()).then_some(share)
}
