//! Positions of the points and markers of a board.

use nalgebra::Point2;

use crate::boards::{Board, Kind};

/// A marker of a board.
#[derive(Debug, Clone, PartialEq)]
pub struct Marker {
    /// Number of the marker in the dictionary.
    pub id: usize,
    /// Corners in metres, clockwise from the upper left one.
    pub corners: [Point2<f64>; 4],
}

impl Marker {
    /// Returns the centre of the marker, in metres.
    pub fn centre(&self) -> Point2<f64> {
        let [a, .., d] = self.corners;
        let [_, b, c, _] = self.corners;
        Point2::from((a.coords + b.coords + c.coords + d.coords) / 4.0)
    }
}

/// The points that are measured, and the markers that identify them.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Points in metres; the index of a point is its number. For a chessboard or `ChArUco` board, these are the inner corners row by row
    /// from the upper left. For a grid, they are the four corners of each marker, clockwise.
    pub points: Vec<Point2<f64>>,
    /// The markers, by number.
    pub markers: Vec<Marker>,
    /// True if the square to the upper left of a point is black, for points between squares.
    pub is_black_before: Vec<bool>,
}

impl Layout {
    /// Returns the layout of a board as printed.
    pub fn of(board: &Board) -> Self {
        match board.kind {
            Kind::Chessboard => chessboard(board.columns, board.rows, board),
            Kind::Charuco => charuco(board),
            Kind::Grid => grid(board),
        }
    }

    /// Returns the marker with a given number in the dictionary.
    pub fn marker(&self, id: usize) -> Option<&Marker> {
        self.markers.get(id)
    }
}

/// Returns true if a square is black; columns and rows are counted from 0 at the upper left.
pub(crate) fn is_black(board: &Board, column: usize, row: usize) -> bool {
    let is_white_first =
        board.kind == Kind::Charuco && board.is_legacy && board.rows.is_multiple_of(2);
    (column + row).is_multiple_of(2) != is_white_first
}

fn chessboard(columns: usize, rows: usize, board: &Board) -> Layout {
    let side = board.square_metres;
    let mut points = Vec::new();
    let mut is_black_before = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            points.push(Point2::new(
                (column + 1) as f64 * side,
                (row + 1) as f64 * side,
            ));
            is_black_before.push(is_black(board, column, row));
        }
    }
    Layout {
        points,
        markers: Vec::new(),
        is_black_before,
    }
}

fn charuco(board: &Board) -> Layout {
    let side = board.square_metres;
    let margin = 0.5 * side * (1.0 - board.ratio);
    let mut layout = chessboard(board.columns - 1, board.rows - 1, board);
    for row in 0..board.rows {
        for column in 0..board.columns {
            if is_black(board, column, row) {
                continue;
            }
            let at = [column as f64 * side + margin, row as f64 * side + margin];
            layout.markers.push(marker(layout.markers.len(), at, side * board.ratio));
        }
    }
    layout
}

fn grid(board: &Board) -> Layout {
    let side = board.square_metres;
    let gap = side * board.ratio;
    let mut layout = Layout {
        points: Vec::new(),
        markers: Vec::new(),
        is_black_before: Vec::new(),
    };
    for row in 0..board.rows {
        for column in 0..board.columns {
            let at = [column, row].map(|value| gap + value as f64 * (side + gap));
            let marker = marker(layout.markers.len(), at, side);
            layout.points.extend(marker.corners);
            layout.markers.push(marker);
        }
    }
    layout
}

fn marker(id: usize, [x, y]: [f64; 2], side: f64) -> Marker {
    let corners = [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side]];
    Marker {
        id,
        corners: corners.map(|[dx, dy]| Point2::new(x + dx, y + dy)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_charuco_board_equals_that_of_opencv() {
        let board: Board = "charuco:4x5:54mm".parse().unwrap();
        let layout = Layout::of(&board);
        assert_eq!((layout.points.len(), layout.markers.len()), (12, 10));
        assert!((layout.points[2] - Point2::new(0.162, 0.054)).norm() < 1e-12);
        // The upper left square is black, and the first marker is in the second square.
        assert!((layout.markers[0].centre() - Point2::new(0.081, 0.027)).norm() < 1e-12);
        let legacy: Board = "charuco:5x4:54mm:legacy".parse().unwrap();
        let layout = Layout::of(&legacy);
        assert!((layout.markers[0].centre() - Point2::new(0.027, 0.027)).norm() < 1e-12);
        assert_eq!(layout.markers.len(), legacy.n_markers());
    }
}
