//! Projective map from a plane to a picture.

use nalgebra::{Matrix3, Point2, SMatrix, SVector, Vector3};

/// A projective map of points, from a board (metres) to a picture (pixels) or between any two planes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Homography {
    matrix: Matrix3<f64>,
}

impl Homography {
    /// Returns the map that takes each first point near its second, with a weight for each pair. It uses the normalised direct linear
    /// transform (Hartley & Zisserman, *Multiple View Geometry*, 2nd ed., section 4.4).
    ///
    /// Returns `None` for fewer than four pairs, for pairs on a line and for numbers that are not finite.
    pub fn fit(
        pairs: impl Iterator<Item = (Point2<f64>, Point2<f64>, f64)> + Clone,
    ) -> Option<Self> {
        if pairs.clone().count() < 4 {
            return None;
        }
        let before = spread(pairs.clone().map(|(from, _, weight)| (from, weight)))?;
        let after = spread(pairs.clone().map(|(_, to, weight)| (to, weight)))?;
        let mut normal = SMatrix::<f64, 9, 9>::zeros();
        for (from, to, weight) in pairs {
            let [x, y] = moved(&before, from);
            let [u, v] = moved(&after, to);
            let rows = [
                [x, y, 1.0, 0.0, 0.0, 0.0, -u * x, -u * y, -u],
                [0.0, 0.0, 0.0, x, y, 1.0, -v * x, -v * y, -v],
            ];
            for row in rows {
                let row = SVector::<f64, 9>::from(row);
                normal += weight * row * row.transpose();
            }
        }
        let eigen = normal.symmetric_eigen();
        let mut order: Vec<usize> = (0..9).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        let [least, next, .., most] = order[..] else {
            return None;
        };
        // If two eigenvalues vanish, the points are on a line.
        let second = eigen.eigenvalues[next];
        if second.is_nan() || second <= 1e-11 * eigen.eigenvalues[most] {
            return None;
        }
        let h = eigen.eigenvectors.column(least);
        let matrix = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8]);
        let matrix = after.try_inverse()? * matrix * before;
        let largest = matrix.abs().max();
        (largest > 0.0 && matrix.iter().all(|value| value.is_finite())).then(|| Self {
            matrix: matrix / largest,
        })
    }

    /// Returns the map from the corners (0, 0), (1, 0), (1, 1), (0, 1) to four points.
    pub fn of_unit_square(to: [Point2<f64>; 4]) -> Option<Self> {
        let from = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Point2::from);
        Self::fit(from.into_iter().zip(to).map(|(from, to)| (from, to, 1.0)))
    }

    /// Returns the image of a point; `None` if it is at infinity.
    pub fn apply(&self, point: Point2<f64>) -> Option<Point2<f64>> {
        let mapped = self.matrix * Vector3::new(point.x, point.y, 1.0);
        let result = Point2::new(mapped.x / mapped.z, mapped.y / mapped.z);
        (mapped.z.abs() > 1e-12 && result.coords.iter().all(|coord| coord.is_finite()))
            .then_some(result)
    }

    /// Returns the matrix, which is defined up to scale.
    pub fn matrix(&self) -> &Matrix3<f64> {
        &self.matrix
    }
}

/// Returns the map that takes the centre of the points to the origin, and their mean distance to the square root of 2.
fn spread(points: impl Iterator<Item = (Point2<f64>, f64)> + Clone) -> Option<Matrix3<f64>> {
    let total: f64 = points.clone().map(|(_, weight)| weight).sum();
    let sum = points.clone().fold(nalgebra::Vector2::zeros(), |sum, (point, weight)| {
        sum + weight * point.coords
    });
    let middle = sum / total;
    let reach: f64 = points.map(|(point, weight)| weight * (point.coords - middle).norm()).sum();
    let scale = core::f64::consts::SQRT_2 * total / reach;
    scale.is_finite().then(|| {
        Matrix3::new(
            scale,
            0.0,
            -scale * middle.x,
            0.0,
            scale,
            -scale * middle.y,
            0.0,
            0.0,
            1.0,
        )
    })
}

fn moved(by: &Matrix3<f64>, point: Point2<f64>) -> [f64; 2] {
    [
        by[(0, 0)] * point.x + by[(0, 2)],
        by[(1, 1)] * point.y + by[(1, 2)],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_homography_of_four_points_is_exact_and_collinear_points_give_none() {
        let to = [[10.0, 12.0], [210.0, 5.0], [190.0, 160.0], [22.0, 140.0]].map(Point2::from);
        let map = Homography::of_unit_square(to).unwrap();
        assert!((map.apply(Point2::new(1.0, 1.0)).unwrap() - to[2]).norm() < 1e-9);
        let line = [[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0]].map(Point2::from);
        assert_eq!(Homography::of_unit_square(line), None);
    }
}
