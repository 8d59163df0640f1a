//! The box around a person whose joints are known.

/// Margin for hands, feet and hair beyond the joints, on each side, as a share of the longer side.
const BEYOND: f64 = 0.05;

/// The box around a person's joints, with a margin for hands, feet and hair: left, top, right, bottom, in the unit of the
/// points.
///
/// * Returns `None` if there is no point or the points have no extent.
pub fn outline_of(joints: impl IntoIterator<Item = [f64; 2]>) -> Option<[f64; 4]> {
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    for at in joints {
        for axis in 0..2 {
            low[axis] = low[axis].min(at[axis]);
            high[axis] = high[axis].max(at[axis]);
        }
    }
    let longer = (high[0] - low[0]).max(high[1] - low[1]);
    if !(longer.is_finite() && longer > 0.0) {
        return None;
    }
    let more = BEYOND * longer;
    Some([low[0] - more, low[1] - more, high[0] + more, high[1] + more])
}

/// The overlap of two boxes: intersection over union, 0 to 1.
pub fn overlap(a: [f64; 4], b: [f64; 4]) -> f64 {
    let side = |axis: usize| (a[axis + 2].min(b[axis + 2]) - a[axis].max(b[axis])).max(0.0);
    let area =
        |outline: [f64; 4]| (outline[2] - outline[0]).max(0.0) * (outline[3] - outline[1]).max(0.0);
    let both = side(0) * side(1);
    let either = area(a) + area(b) - both;
    if either > 0.0 { both / either } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_box_reaches_beyond_the_joints() {
        let joints = [[10.0, 20.0], [30.0, 120.0], [20.0, 70.0]];
        assert_eq!(outline_of(joints), Some([5.0, 15.0, 35.0, 125.0]));
        assert_eq!(outline_of([]), None);
        assert_eq!(outline_of([[1.0, 1.0]]), None, "no extent");
        assert_eq!(outline_of([[f64::NAN, 1.0]]), None);
    }

    #[test]
    fn the_overlap_of_boxes_is_their_common_area() {
        let a = [0.0, 0.0, 2.0, 2.0];
        assert_eq!(overlap(a, a), 1.0);
        assert_eq!(overlap(a, [1.0, 0.0, 3.0, 2.0]), 2.0 / 6.0);
        assert_eq!(overlap(a, [3.0, 0.0, 4.0, 2.0]), 0.0);
        assert_eq!(overlap([1.0; 4], [1.0; 4]), 0.0);
    }
}
