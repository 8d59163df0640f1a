//! Creates a closed surface of triangles where the distances on a grid change sign.

use nalgebra::{Point3, Vector3};

use crate::shape::Grid;

/// Surface nets (Gibson 1998): there is one point in every cell that the surface intersects, at the mean of its intersections
/// with the cell's edges, and two triangles for every edge of the lattice that the surface intersects.
///
/// The border of the lattice must lie outside the body. Triangles are anticlockwise as seen from outside.
pub(super) fn surface(grid: &Grid) -> (Vec<Point3<f32>>, Vec<[u32; 3]>) {
    const NONE: u32 = u32::MAX;
    let mut at_cell = vec![NONE; grid.values.len()];
    let mut points = Vec::new();
    let [nx, ny, nz] = grid.size;
    for z in 0..nz - 1 {
        for y in 0..ny - 1 {
            for x in 0..nx - 1 {
                if let Some(point) = cut(grid, [x, y, z]) {
                    at_cell[grid.index([x, y, z])] = points.len() as u32;
                    points.push(point);
                }
            }
        }
    }
    let mut triangles = Vec::new();
    for z in 1..nz - 1 {
        for y in 1..ny - 1 {
            for x in 1..nx - 1 {
                let here = [x, y, z];
                for axis in 0..3 {
                    let mut next = here;
                    next[axis] += 1;
                    let inside = [here, next].map(|cell| grid.values[grid.index(cell)] < 0.0);
                    if inside[0] != inside[1] {
                        let around = around(here, axis).map(|cell| at_cell[grid.index(cell)]);
                        let [a, b, c, d] = around;
                        let turned = if inside[0] {
                            [a, b, c, d]
                        } else {
                            [d, c, b, a]
                        };
                        triangles.push([turned[0], turned[1], turned[2]]);
                        triangles.push([turned[0], turned[2], turned[3]]);
                    }
                }
            }
        }
    }
    (points, triangles)
}

/// Returns the four cells around an edge of the grid, anticlockwise as seen against the direction of the edge.
fn around(at: [usize; 3], axis: usize) -> [[usize; 3]; 4] {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    [[1, 1], [0, 1], [0, 0], [1, 0]].map(|[du, dv]| {
        let mut cell = at;
        cell[u] -= du;
        cell[v] -= dv;
        cell
    })
}

/// Returns the mean of the points where the surface intersects the edges of a cell.
fn cut(grid: &Grid, cell: [usize; 3]) -> Option<Point3<f32>> {
    let corner = |bits: usize| core::array::from_fn(|axis| cell[axis] + (bits >> axis & 1));
    let values: [f32; 8] = core::array::from_fn(|i| grid.values[grid.index(corner(i))]);
    let n_inside = values.iter().filter(|value| **value < 0.0).count();
    if n_inside == 0 || n_inside == 8 {
        return None;
    }
    let (mut sum, mut n) = (Vector3::zeros(), 0.0);
    for from in 0..8 {
        for axis in 0..3 {
            let to = from | 1 << axis;
            if to != from && (values[from] < 0.0) != (values[to] < 0.0) {
                let share = values[from] / (values[from] - values[to]);
                let [a, b] = [from, to].map(|i| grid.point(corner(i)));
                sum += a.coords + (b - a) * share;
                n += 1.0;
            }
        }
    }
    Some(Point3::from(sum / n))
}
