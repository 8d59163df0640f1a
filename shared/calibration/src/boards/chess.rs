//! Detection of chessboards without markers, by `calib-targets`.

use calib_targets_chessboard::{
    ChessboardDetector, ChessboardParams, GrayImageView, default_chess_config, detect_corners,
};
use nalgebra::Point2;

use crate::boards::grow::{Known, grow};
use crate::boards::{Board, Corner, Layout, Nothing, Picture};

/// Minimum fraction of a board's corners that the first search must find.
const LEAST_SEEN: f64 = 0.7;

/// Minimum side of a picture; the detector does not support smaller ones.
const SMALLEST: usize = 32;

/// Corners of a grid, by column and row.
struct Grid {
    columns: usize,
    rows: usize,
    corners: Vec<([usize; 2], Point2<f64>)>,
}

/// Finds the corners of a chessboard.
///
/// The first corner is the upper left one, next to a black square. If corners at both ends are next to a black square, the first corner is
/// the one further up or left in the picture.
///
/// # Errors
///
/// Fails with [`Nothing`], which states what was seen instead.
pub(crate) fn find(
    picture: &Picture,
    board: &Board,
    layout: &Layout,
) -> Result<Vec<Corner>, Nothing> {
    let mut seen = Nothing::NoGrid;
    if picture.width().min(picture.height()) < SMALLEST {
        return Err(seen);
    }
    for (scaled, scale) in scales(picture) {
        for grid in grids(&scaled, scale) {
            match placed(picture, board, layout, &grid) {
                Ok(corners) => return Ok(corners),
                Err(nothing) => seen = seen.or(nothing),
            }
        }
    }
    Err(seen)
}

fn scales(picture: &Picture) -> impl Iterator<Item = (Picture, f64)> {
    let same = Some((picture.clone(), 1.0));
    let half = picture.halved().filter(|halved| halved.width().min(halved.height()) >= 200);
    let half = half.map(|half| (half, 0.5));
    let twice = (picture.width().max(picture.height()) <= 1400).then(|| (picture.doubled(), 2.0));
    [same, half, twice].into_iter().flatten()
}

fn grids(picture: &Picture, scale: f64) -> Vec<Grid> {
    let view = GrayImageView {
        width: picture.width(),
        height: picture.height(),
        data: picture.pixels(),
    };
    let corners = detect_corners(&view, &default_chess_config());
    let Ok(detector) = ChessboardDetector::new(ChessboardParams::default()) else {
        return Vec::new();
    };
    let grid = |found: calib_targets_chessboard::ChessboardDetection| {
        let places = found.corners.iter().map(|corner| {
            let at = Point2::new(f64::from(corner.position.x), f64::from(corner.position.y));
            // Position of the pixel centre after scaling.
            let at = at.map(|at| (at + 0.5) / scale - 0.5);
            (
                [corner.grid.u.max(0) as usize, corner.grid.v.max(0) as usize],
                at,
            )
        });
        let corners: Vec<([usize; 2], Point2<f64>)> = places.collect();
        let extent =
            |axis: usize| corners.iter().map(|corner| corner.0[axis] + 1).max().unwrap_or(0);
        Grid {
            columns: extent(0),
            rows: extent(1),
            corners,
        }
    };
    detector.detect_all(&corners).into_iter().map(grid).collect()
}

/// Matches a grid to the board: finds the first corner, then refines every corner to sub-pixel precision.
fn placed(
    picture: &Picture,
    board: &Board,
    layout: &Layout,
    grid: &Grid,
) -> Result<Vec<Corner>, Nothing> {
    let (columns, rows) = (board.columns, board.rows);
    let is_turned = match [grid.columns, grid.rows] {
        shape if shape == [columns, rows] => false,
        shape if shape == [rows, columns] => true,
        [columns, rows] => return Err(Nothing::OtherGrid { columns, rows }),
    };
    if (grid.corners.len() as f64) < LEAST_SEEN * (columns * rows) as f64 {
        return Err(Nothing::NoGrid);
    }
    let orders: &[[bool; 3]] = match (is_turned, columns == rows) {
        (false, false) => &[[false, false, false], [false, true, true]],
        (true, false) => &[[true, true, false], [true, false, true]],
        (_, true) => &[
            [false, false, false],
            [true, true, false],
            [true, false, true],
            [false, true, true],
        ],
    };
    let mut best: Vec<Corner> = Vec::new();
    for order in orders {
        let known: Vec<Known> = grid
            .corners
            .iter()
            .map(|(at, place)| {
                let id = number(*at, *order, [columns, rows]);
                (layout.points[id], *place, 1.0)
            })
            .collect();
        let corners = grow(picture, board, layout, &known);
        if corners.len() > best.len() {
            best = corners;
        }
    }
    if (best.len() as f64) < LEAST_SEEN * (columns * rows) as f64 {
        return Err(Nothing::NoGrid);
    }
    Ok(best)
}

/// Returns the number of a corner of the board, for a grid whose axes may be swapped or whose corners may be counted from the other end.
fn number(
    at: [usize; 2],
    [turn, flip_column, flip_row]: [bool; 3],
    [columns, rows]: [usize; 2],
) -> usize {
    let [column, row] = if turn { [at[1], at[0]] } else { at };
    let column = if flip_column {
        columns - 1 - column
    } else {
        column
    };
    let row = if flip_row { rows - 1 - row } else { row };
    row * columns + column
}

/// Returns the rotations after which a chessboard looks the same; for each, the number that every corner then has.
pub(crate) fn look_alikes(board: &Board) -> Vec<Vec<usize>> {
    let size = [board.columns, board.rows];
    let mut turns: Vec<[bool; 3]> = Vec::new();
    let is_even = |count: usize| count.is_multiple_of(2);
    // A rotation by 180 degrees keeps the colours if the numbers of columns and rows are both odd or both even.
    if is_even(board.columns) == is_even(board.rows) {
        turns.push([false, true, true]);
    }
    if board.columns == board.rows && is_even(board.columns) {
        turns.extend([[true, true, false], [true, false, true]]);
    }
    let renumbered = |turn: [bool; 3]| {
        let all = (0..size[0] * size[1]).map(|id| number([id % size[0], id / size[0]], turn, size));
        all.collect()
    };
    turns.into_iter().map(renumbered).collect()
}
