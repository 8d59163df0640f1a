//! Extent of points in an image.

/// Returns the longer side of the upright rectangle around points, in the unit of the points; `None` if there are no points.
pub fn longer_side(points: impl Iterator<Item = [f64; 2]>) -> Option<f64> {
    let corners = points.map(|point| [point; 2]).reduce(|[low, high], [point, _]| {
        let of = |pick: fn(f64, f64) -> f64, corner: [f64; 2]| {
            [0, 1].map(|axis| pick(corner[axis], point[axis]))
        };
        [of(f64::min, low), of(f64::max, high)]
    });
    corners.map(|[low, high]| (high[0] - low[0]).max(high[1] - low[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extent_is_the_longer_of_width_and_height() {
        let side = |points: &[[f64; 2]]| longer_side(points.iter().copied());
        assert_eq!(side(&[[1.0, 5.0], [4.0, 6.0], [2.0, -3.0]]), Some(9.0));
        assert_eq!(side(&[[1.0, 5.0], [14.0, 6.0]]), Some(13.0));
        assert_eq!(side(&[[1.0, 5.0]]), Some(0.0));
        assert_eq!(side(&[]), None);
    }
}
