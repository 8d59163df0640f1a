//! Search for dark quadrilaterals, which may be markers.

use nalgebra::{Matrix2, Point2, Vector2};

use crate::boards::Picture;
use crate::boards::threshold::dark;

/// Radii of the neighbourhoods with which pixels are compared.
const RADII: [usize; 3] = [6, 13, 28];
/// Shortest side of a quadrilateral, in pixels.
const SHORTEST_SIDE: f64 = 6.0;
/// Largest deviation of an outline from a side, as a fraction of its perimeter.
const STRAY: f64 = 0.035;

/// Returns the dark quadrilaterals of a picture, with corners clockwise and accurate to about half a pixel.
///
/// The method is that of `OpenCV` for `ArUco` markers: a threshold relative to the neighbourhood, then outlines, then polygons of four
/// corners.
pub(crate) fn quads(picture: &Picture) -> Vec<[Point2<f64>; 4]> {
    let mut found = Vec::new();
    for radius in RADII {
        let mask = dark(picture, radius);
        for outline in outlines(&mask, picture.width(), picture.height()) {
            found.extend(four_corners(&outline));
        }
    }
    found
}

type Pixel = [i32; 2];

/// Returns the outer outlines of connected dark regions that do not touch the edge, clockwise.
fn outlines(mask: &[bool], width: usize, height: usize) -> Vec<Vec<Pixel>> {
    let mut seen = vec![false; mask.len()];
    let mut stack = Vec::new();
    let mut result = Vec::new();
    for first in 0..mask.len() {
        if !mask[first] || seen[first] {
            continue;
        }
        let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
        seen[first] = true;
        stack.push(first);
        while let Some(index) = stack.pop() {
            let at = [index % width, index / width];
            for axis in 0..2 {
                low[axis] = low[axis].min(at[axis]);
                high[axis] = high[axis].max(at[axis]);
            }
            let columns = at[0].saturating_sub(1)..=(at[0] + 1).min(width - 1);
            for y in at[1].saturating_sub(1)..=(at[1] + 1).min(height - 1) {
                for x in columns.clone() {
                    let next = y * width + x;
                    if mask[next] && !seen[next] {
                        seen[next] = true;
                        stack.push(next);
                    }
                }
            }
        }
        let is_inside = low[0] > 0 && low[1] > 0 && high[0] + 1 < width && high[1] + 1 < height;
        let sides = [high[0] - low[0], high[1] - low[1]].map(|value| value as f64);
        if is_inside && sides[0].max(sides[1]) >= SHORTEST_SIDE && sides[0].min(sides[1]) >= 4.0 {
            let start = [(first % width) as i32, (first / width) as i32];
            result.push(trace(mask, width, start));
        }
    }
    result
}

/// Offsets to the eight neighbours, clockwise from the left one, with y down.
const AROUND: [Pixel; 8] = [
    [-1, 0],
    [-1, -1],
    [0, -1],
    [1, -1],
    [1, 0],
    [1, 1],
    [0, 1],
    [-1, 1],
];

/// Traces a region with Moore's neighbour tracing, from its first pixel in reading order. The region must not touch the edge.
fn trace(mask: &[bool], width: usize, start: Pixel) -> Vec<Pixel> {
    let is_dark = |at: Pixel| mask[at[1] as usize * width + at[0] as usize];
    let mut outline = vec![start];
    let (mut at, mut from) = (start, 0);
    let mut first_step = None;
    // An outline visits no pixel more than four times.
    for _ in 0..4 * mask.len() {
        let next = (1..=8).map(|turn| (from + turn) % 8).find(|&direction| {
            let step = AROUND[direction];
            is_dark([at[0] + step[0], at[1] + step[1]])
        });
        let Some(direction) = next else {
            break;
        };
        if at == start {
            if first_step == Some(direction) {
                break;
            }
            first_step = first_step.or(Some(direction));
        }
        at = [at[0] + AROUND[direction][0], at[1] + AROUND[direction][1]];
        outline.push(at);
        // The search continues from the pixel before this one.
        from = (direction + 4) % 8;
    }
    outline.pop();
    outline
}

/// Returns the corners of an outline if it is a convex quadrilateral.
fn four_corners(outline: &[Pixel]) -> Option<[Point2<f64>; 4]> {
    let n = outline.len();
    if n < 16 {
        return None;
    }
    let length: f64 =
        (0..n).map(|i| (point(outline[(i + 1) % n]) - point(outline[i])).norm()).sum();
    let first = furthest(outline, |value| (value - point(outline[0])).norm())?.0;
    let second = furthest(outline, |value| (value - point(outline[first])).norm())?.0;
    let (a, b) = (first.min(second), first.max(second));
    let mut corners = vec![a];
    split(outline, [a, b], STRAY * length, &mut corners);
    corners.push(b);
    split(outline, [b, a + n], STRAY * length, &mut corners);
    let corners: [usize; 4] = corners.try_into().ok()?;
    let places = corners.map(|index| point(outline[index % n]));
    let is_convex = (0..4).all(|i| {
        let [a, b, c] = [0, 1, 2].map(|step| places[(i + step) % 4]);
        (b - a).norm() >= SHORTEST_SIDE && (b - a).perp(&(c - b)) > 0.0
    });
    is_convex.then(|| sharpened(outline, corners).unwrap_or(places))
}

fn point(pixel: Pixel) -> Point2<f64> {
    Point2::new(f64::from(pixel[0]), f64::from(pixel[1]))
}

fn furthest(outline: &[Pixel], distance: impl Fn(Point2<f64>) -> f64) -> Option<(usize, f64)> {
    let distances = outline.iter().map(|outline| distance(point(*outline))).enumerate();
    distances.max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Adds the Douglas-Peucker corners between two points of a closed outline, in order.
fn split(outline: &[Pixel], [a, b]: [usize; 2], stray: f64, corners: &mut Vec<usize>) {
    let n = outline.len();
    let (from, to) = (point(outline[a % n]), point(outline[b % n]));
    let along = to - from;
    let off = |index: usize| {
        let offset = point(outline[index % n]) - from;
        along.perp(&offset).abs() / along.norm().max(1e-9)
    };
    let worst = (a + 1..b).max_by(|&i, &j| off(i).total_cmp(&off(j)));
    // A polygon with more than four corners is not a quadrilateral, so the search can stop.
    if let Some(worst) = worst.filter(|&index| off(index) > stray && corners.len() < 8) {
        split(outline, [a, worst], stray, corners);
        corners.push(worst % n);
        split(outline, [worst, b], stray, corners);
    }
}

/// Returns the intersections of lines through the sides, half a pixel outside the pixels of the outline.
fn sharpened(outline: &[Pixel], corners: [usize; 4]) -> Option<[Point2<f64>; 4]> {
    let n = outline.len();
    let mut lines = Vec::new();
    for i in 0..4 {
        let from = corners[i];
        let to = corners[(i + 1) % 4];
        let count = (to + n - from) % n;
        let margin = (count / 8).max(1);
        let places: Vec<Point2<f64>> = (margin..=count.checked_sub(margin)?)
            .map(|step| point(outline[(from + step) % n]))
            .collect();
        lines.push(line(&places)?);
    }
    let mut result = [Point2::origin(); 4];
    for (i, corner) in result.iter_mut().enumerate() {
        let [(p, n), (q, m)] = [lines[(i + 3) % 4], lines[i]];
        let normals = Matrix2::new(n.x, n.y, m.x, m.y);
        let offsets = Vector2::new(n.dot(&p.coords) + 0.5, m.dot(&q.coords) + 0.5);
        *corner = Point2::from(normals.try_inverse()? * offsets);
        // A corner far from the outline does not belong to it.
        if (*corner - point(outline[corners[i]])).norm() > 4.0 + 0.05 * n_sides(outline) {
            return None;
        }
    }
    Some(result)
}

fn n_sides(outline: &[Pixel]) -> f64 {
    outline.len() as f64 / 4.0
}

/// Returns the line through points in clockwise order: a point on it, and its normal to the outside (y down).
fn line(places: &[Point2<f64>]) -> Option<(Point2<f64>, Vector2<f64>)> {
    let (first, last) = (places.first()?, places.last()?);
    let sum = places.iter().fold(Vector2::zeros(), |sum, it| sum + it.coords);
    let middle = sum / places.len() as f64;
    let mut scatter = Matrix2::zeros();
    for place in places {
        let offset = place.coords - middle;
        scatter += offset * offset.transpose();
    }
    let eigen = scatter.symmetric_eigen();
    let least = usize::from(eigen.eigenvalues[1] < eigen.eigenvalues[0]);
    let normal: Vector2<f64> = eigen.eigenvectors.column(least).into_owned();
    let along = last - first;
    // In clockwise order with y down, the outside is to the left of the direction, which is (along.y, -along.x).
    let outside = Vector2::new(along.y, -along.x);
    let turned = if normal.dot(&outside) < 0.0 {
        -normal
    } else {
        normal
    };
    (along.norm() > 0.0).then(|| (Point2::from(middle), turned))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dark_quadrilateral_is_found_to_half_a_pixel() {
        let (width, height) = (120, 100);
        let truth = [[30.0, 20.0], [90.0, 28.0], [84.0, 80.0], [25.0, 70.0]].map(Point2::from);
        let is_inside = |at: Point2<f64>| {
            (0..4).all(|i| (truth[(i + 1) % 4] - truth[i]).perp(&(at - truth[i])) > 0.0)
        };
        let pixels = (0..width * height).map(|i| {
            let at = Point2::new((i % width) as f64, (i / width) as f64);
            if is_inside(at) { 40 } else { 200 }
        });
        let picture = Picture::new(width, height, pixels.collect()).unwrap();
        let found = quads(&picture);
        assert!(!found.is_empty());
        for corner in truth {
            let nearest = found[0].iter().map(|value| (value - corner).norm());
            assert!(nearest.fold(f64::MAX, f64::min) < 0.7, "{found:?}");
        }
    }
}
