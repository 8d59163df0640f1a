//! The rasteriser: finds the nearest triangle at every sample, with four samples per pixel.

#[cfg(test)]
mod reference;

use nalgebra::{Point2, Point3, Vector3};

/// Number of samples along the side of a pixel.
pub(crate) const SUB: usize = 2;

/// A projected corner: its position in pixels, and 1 / depth, which is 0 if the corner is behind the camera.
pub(crate) type Corner = Vector3<f32>;

/// Index that means no triangle.
pub(crate) const NOTHING: u32 = u32::MAX;

/// The z-buffer: the nearest triangle of every sample and its distance.
#[derive(Debug, Clone, Default)]
pub(crate) struct Samples {
    /// Number of samples per row.
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// 1 / depth of the nearest surface, in 1 / metres.
    pub(crate) near: Vec<f32>,
    pub(crate) triangle: Vec<u32>,
    /// Range of columns and rows of the samples covered by triangles: `[x1, y1, x2, y2]`, where x2 and y2 are excluded.
    pub(crate) touched: [usize; 4],
}

impl Samples {
    /// Begins a picture. `behind` is the background: 1 / depth of every sample.
    pub(crate) fn begin(&mut self, width: usize, height: usize, behind: &[f32]) {
        (self.width, self.height) = (width, height);
        self.near.clear();
        self.near.extend_from_slice(behind);
        self.triangle.clear();
        self.triangle.resize(width * height, NOTHING);
        self.touched = [width, height, 0, 0];
    }

    /// Returns the position of a sample in the picture, in pixels.
    pub(crate) fn place(column: usize, row: usize) -> Point2<f32> {
        let at = |value: usize| (value as f32 + 0.5) / SUB as f32 - 0.5;
        Point2::new(at(column), at(row))
    }

    /// Draws one triangle, seen from its front (clockwise in the picture, whose rows point down).
    pub(crate) fn draw(&mut self, index: u32, corners: [&Corner; 3]) {
        if corners.iter().any(|corner| corner.z <= 0.0) {
            return;
        }
        // Converts pixels to samples: the centre of sample i is at i.
        let grown = |value: f32| (value + 0.5) * SUB as f32 - 0.5;
        let [a, b, c] = corners.map(|corner| Point2::new(grown(corner.x), grown(corner.y)));
        let area = (b - a).perp(&(c - a));
        if area >= -1e-9 {
            return;
        }
        let range = |values: [f32; 3], n: usize| {
            let low = values[0].min(values[1]).min(values[2]).ceil().max(0.0);
            let high = values[0].max(values[1]).max(values[2]).floor();
            let end = (high + 1.0).clamp(0.0, n as f32) as usize;
            (low as usize).min(end)..end
        };
        let columns = range([a.x, b.x, c.x], self.width);
        let rows = range([a.y, b.y, c.y], self.height);
        if columns.is_empty() || rows.is_empty() {
            return;
        }
        let [x1, y1, x2, y2] = self.touched;
        self.touched = [
            x1.min(columns.start),
            y1.min(rows.start),
            x2.max(columns.end),
            y2.max(rows.end),
        ];
        let over = 1.0 / area;
        for row in rows {
            let line = row * self.width;
            for column in columns.clone() {
                let p = Point2::new(column as f32, row as f32);
                let [u, v] = [(c - b).perp(&(p - b)) * over, (a - c).perp(&(p - c)) * over];
                let w = 1.0 - u - v;
                if u < -EDGE || v < -EDGE || w < -EDGE {
                    continue;
                }
                let near = u * corners[0].z + v * corners[1].z + w * corners[2].z;
                if near > self.near[line + column] {
                    self.near[line + column] = near;
                    self.triangle[line + column] = index;
                }
            }
        }
    }
}

/// Tolerance at edges: samples on an edge belong to both triangles, so that rounding leaves no gaps.
const EDGE: f32 = 1e-5;

/// Returns the weights of the corners at a point of the picture, corrected for depth; they sum to 1.
pub(crate) fn shares(corners: [&Corner; 3], at: Point2<f32>) -> [f32; 3] {
    let [a, b, c] = corners.map(|corner| Point2::new(corner.x, corner.y));
    let area = (b - a).perp(&(c - a));
    if area.abs() < 1e-12 {
        return [1.0, 0.0, 0.0];
    }
    let u = (c - b).perp(&(at - b)) / area;
    let v = (a - c).perp(&(at - c)) / area;
    let w = 1.0 - u - v;
    let weighted = [u * corners[0].z, v * corners[1].z, w * corners[2].z];
    let sum: f32 = weighted.iter().sum();
    if sum.abs() < 1e-12 {
        return [u, v, w];
    }
    weighted.map(|weighted| weighted / sum)
}

/// Interpolates between the values of the corners.
pub(crate) fn between(values: [&Vector3<f32>; 3], shares: [f32; 3]) -> Vector3<f32> {
    values[0] * shares[0] + values[1] * shares[1] + values[2] * shares[2]
}

/// Like [`between`], for points.
pub(crate) fn point_between(values: [&Point3<f32>; 3], shares: [f32; 3]) -> Point3<f32> {
    Point3::from(between(values.map(|value| &value.coords), shares))
}
