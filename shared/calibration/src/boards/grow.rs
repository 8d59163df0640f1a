//! Search for all visible corners of a board, from a few known positions.

use nalgebra::{Point2, Vector2};

use crate::boards::corner::refine;
use crate::boards::fit::map_near;
use crate::boards::{Board, Corner, Kind, Layout, Picture};

/// Largest half-width of the window around a corner, in pixels.
const WIDEST_WINDOW: f64 = 9.0;
const NARROWEST_WINDOW: f64 = 2.0;
/// Largest distance of a corner from the position predicted by its neighbours, in squares, with a minimum in pixels.
const OFF_SQUARES: f64 = 0.06;
const OFF_PX: f64 = 1.2;
/// Minimum difference between white and black at a crossing, in grey values.
const LEAST_CONTRAST: f64 = 8.0;

/// A known point of the board: its position on the board in metres, its position in the picture in pixels, and its weight.
pub(crate) type Known = (Point2<f64>, Point2<f64>, f64);

/// Returns every visible corner of the layout, found from known positions.
///
/// In `picture`, the black squares of the board must be dark.
pub(crate) fn grow(
    picture: &Picture,
    board: &Board,
    layout: &Layout,
    first: &[Known],
) -> Vec<Corner> {
    let side = board.square_metres;
    let mut known = first.to_vec();
    let mut found: Vec<Option<Corner>> = vec![None; layout.points.len()];
    // Corners near known positions are searched first; they then help to find corners further away.
    for reach in [1.2, 1.8, 3.0, 100.0] {
        for (id, point) in layout.points.iter().enumerate() {
            let is_near = known.iter().any(|known| (known.0 - point).norm() < reach * side);
            if found[id].is_some() || !is_near {
                continue;
            }
            if let Some(at) = look(picture, board, layout, id, &known) {
                found[id] = Some(Corner { id, at });
                known.push((*point, at, 4.0));
            }
        }
    }
    let mut corners: Vec<Corner> = found.into_iter().flatten().collect();
    while let Some(worst) = worst_off(layout, side, &corners) {
        corners.remove(worst);
    }
    corners
}

/// Returns one corner with sub-pixel precision, if it is visible.
fn look(
    picture: &Picture,
    board: &Board,
    layout: &Layout,
    id: usize,
    known: &[Known],
) -> Option<Point2<f64>> {
    let point = layout.points[id];
    let side = board.square_metres;
    let map = map_near(known, point, 1.5 * side)?;
    let start = map.apply(point)?;
    let square_px = narrow_px(&map, point, side)?;
    let window = window_px(&map, board, point)?;
    if square_px < 5.0 || !picture.holds(start, window + 2.0) {
        return None;
    }
    let at = refine(
        picture,
        start,
        window.max(0.12 * square_px).min(WIDEST_WINDOW),
    )
    .and_then(|at| refine(picture, at, window))?;
    let limit = (0.2 * square_px).max(2.0);
    let is_there = (at - start).norm() <= limit
        && match board.kind {
            Kind::Grid => true,
            Kind::Chessboard | Kind::Charuco => {
                let moved = at - start;
                is_crossing(layout.is_black_before[id], board, |offset| {
                    Some(picture.between(map.apply(point + side * offset)? + moved))
                })
            }
        };
    is_there.then_some(at)
}

/// Returns true if the black and white squares around a corner are arranged as on the board; `value` gives the grey value at an offset in
/// squares.
fn is_crossing(
    is_black_before: bool,
    board: &Board,
    value: impl Fn(Vector2<f64>) -> Option<f64>,
) -> bool {
    let white = match board.kind {
        Kind::Charuco => 0.25 * (1.0 - board.ratio),
        Kind::Chessboard | Kind::Grid => 0.2,
    };
    let turn = if is_black_before { 1.0 } else { -1.0 };
    let pair = |away: f64, across: f64| {
        let one = value(Vector2::new(away, away * across))?;
        Some([one, value(Vector2::new(-away, -away * across))?])
    };
    let (Some(black), Some(white)) = (pair(0.2, turn), pair(white.max(0.03), -turn)) else {
        return false;
    };
    let apart = white[0].min(white[1]) - black[0].max(black[1]);
    let mean = 0.5 * (white[0] + white[1] - black[0] - black[1]);
    apart > LEAST_CONTRAST && apart > 0.25 * mean
}

/// Returns the length in the picture of a length on the board, in pixels: the shorter of those along the two axes of the board.
fn narrow_px(map: &crate::boards::Homography, point: Point2<f64>, metres: f64) -> Option<f64> {
    let at = map.apply(point)?;
    let mut least = f64::MAX;
    for axis in [[1.0, 0.0], [0.0, 1.0], [0.71, 0.71], [0.71, -0.71]] {
        let end = map.apply(point + metres * Vector2::from(axis))?;
        least = least.min((end - at).norm());
    }
    Some(least)
}

/// Returns half the side of the window around a corner, chosen so that the window contains no part of a marker.
fn window_px(map: &crate::boards::Homography, board: &Board, point: Point2<f64>) -> Option<f64> {
    let free = match board.kind {
        Kind::Chessboard => 0.35,
        Kind::Charuco => 0.5 * (1.0 - board.ratio) * 1.15,
        Kind::Grid => 0.45 * board.ratio,
    };
    let free_px = narrow_px(map, point, free * board.square_metres)?;
    Some(free_px.clamp(NARROWEST_WINDOW, WIDEST_WINDOW))
}

/// Returns the corner that is furthest from its predicted position, if that distance is too large.
fn worst_off(layout: &Layout, side: f64, corners: &[Corner]) -> Option<usize> {
    if corners.len() < 6 {
        return None;
    }
    let known: Vec<Known> = corners
        .iter()
        .map(|corner| (layout.points[corner.id], corner.at, 1.0))
        .collect();
    let mut worst = (1.0, None);
    for (nth, corner) in corners.iter().enumerate() {
        let point = layout.points[corner.id];
        let mut others = known.clone();
        others.swap_remove(nth);
        let Some(map) = map_near(&others, point, 1.5 * side) else {
            continue;
        };
        let (Some(expected), Some(square_px)) = (map.apply(point), narrow_px(&map, point, side))
        else {
            continue;
        };
        // At the border of the board, the prediction from the other corners is less accurate.
        let around = others.iter().filter(|other| (other.0 - point).norm() < 1.6 * side);
        let slack = if around.count() >= 5 { 1.0 } else { 2.0 };
        let off = (expected - corner.at).norm() / (slack * (OFF_SQUARES * square_px).max(OFF_PX));
        if off > worst.0 {
            worst = (off, Some(nth));
        }
    }
    worst.1
}
