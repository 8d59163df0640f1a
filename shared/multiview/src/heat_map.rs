//! The authors' heat map: how close every cell is to a rasterised epipolar line, from 0 to 1.
//!
//! It follows the description of the released program. A line one pixel wide is drawn on an image of the original size, and the image is
//! reduced by area averaging to the size of the response map. Every cell whose average differs from the background is on the line. A 3x3
//! chamfer distance transform measures the distance `d` of all cells from the line, and `1 - sqrt(d / d_max)` is the heat. As in the
//! program, the map also covers the padding cells, so the line is off by up to a cell towards the borders.

/// Weights of the 3x3 chamfer mask.
const STRAIGHT: f32 = 0.955;
const DIAGONAL: f32 = 1.3693;

/// Returns the heat of an epipolar line, as in the released program: 1 on the line, 0 in the farthest cell.
///
/// The heat is `1 - sqrt(d / d_max)`, where `d` is the chamfer distance of a cell from the line and `d_max` is the largest distance in the
/// map. All values are zero if the line misses the image. The terms of [`EnergyKind::Released`](crate::EnergyKind::Released) use this
/// function. It is public so that it can be compared with the program.
///
/// * `ends`: the line's intersections with the image's border, `[x, y]` as the program counts
///   pixels (from 1); rounded half to even, then used as if counted from 0.
/// * `image_size`: `[width, height]`, in pixels.
/// * `rows`, `cols`: size of the response map; returns one value per cell, row major.
pub fn heat_map(ends: [[f64; 2]; 2], image_size: [usize; 2], rows: usize, cols: usize) -> Vec<f32> {
    let covered = coverage(ends, image_size, rows, cols);
    // Averages have eight bits: white (255) becomes 254 if the line takes more than half a grey level.
    let on_line = |covered: f64| covered > 0.5 / 255.0;
    let distance = |covered: f64| if on_line(covered) { 0.0 } else { f32::INFINITY };
    let mut map: Vec<f32> = covered.into_iter().map(distance).collect();
    chamfer(&mut map, cols);
    let largest = map.iter().copied().fold(0.0, f32::max);
    if largest.is_finite() && largest > 0.0 {
        for heat in &mut map {
            *heat = 1.0 - (*heat / largest).sqrt();
        }
    } else {
        map.fill(0.0);
    }
    map
}

/// Returns the fraction of every cell that the line covers.
fn coverage(ends: [[f64; 2]; 2], size: [usize; 2], rows: usize, cols: usize) -> Vec<f64> {
    let [width, height] = size;
    let cell = [width as f64 / cols as f64, height as f64 / rows as f64];
    let mut covered = vec![0.0; rows * cols];
    let ends = ends.map(|end| end.map(|side| side.round_ties_even() as i64));
    let Some([from, to]) = clip(ends, [width as i64 - 1, height as i64 - 1]) else {
        return covered;
    };
    for [x, y] in line_pixels(from, to) {
        let (x, y) = (x as f64, y as f64);
        for row in overlapped(y, cell[1], rows) {
            let tall = overlap(row, cell[1], y);
            for col in overlapped(x, cell[0], cols) {
                covered[row * cols + col] += tall * overlap(col, cell[0], x) / (cell[0] * cell[1]);
            }
        }
    }
    covered
}

/// Cells that the pixel from `at` to `at + 1` touches.
fn overlapped(at: f64, cell: f64, count: usize) -> std::ops::Range<usize> {
    let first = (at / cell) as usize;
    let last = (((at + 1.0) / cell) as usize + 1).min(count);
    first..last.max(first)
}

fn overlap(index: usize, cell: f64, pixel: f64) -> f64 {
    let (lo, hi) = (index as f64 * cell, (index + 1) as f64 * cell);
    (hi.min(pixel + 1.0) - lo.max(pixel)).max(0.0)
}

/// Bits that show on which sides of the image a point outside it lies; left is 1 and right is 2.
const ABOVE: i64 = 0b0100;
const BELOW: i64 = 0b1000;
const VERTICAL: i64 = ABOVE | BELOW;

/// Clips a line to `[0, right] x [0, bottom]` (Cohen & Sutherland); integers are truncated towards
/// zero.
fn clip(ends: [[i64; 2]; 2], [right, bottom]: [i64; 2]) -> Option<[[i64; 2]; 2]> {
    let [[mut x1, mut y1], [mut x2, mut y2]] = ends;
    let side = |x: i64| i64::from(x < 0) + 2 * i64::from(x > right);
    let code = |x: i64, y: i64| side(x) + ABOVE * i64::from(y < 0) + BELOW * i64::from(y > bottom);
    let (mut c1, mut c2) = (code(x1, y1), code(x2, y2));
    if c1 & c2 == 0 && (c1 | c2) != 0 {
        if c1 & VERTICAL != 0 {
            let edge = if c1 < BELOW { 0 } else { bottom };
            x1 += (edge - y1) * (x2 - x1) / (y2 - y1);
            y1 = edge;
            c1 = side(x1);
        }
        if c2 & VERTICAL != 0 {
            let edge = if c2 < BELOW { 0 } else { bottom };
            x2 += (edge - y2) * (x2 - x1) / (y2 - y1);
            y2 = edge;
            c2 = side(x2);
        }
        if c1 & c2 == 0 && (c1 | c2) != 0 {
            if c1 != 0 {
                let edge = if c1 == 1 { 0 } else { right };
                y1 += (edge - x1) * (y2 - y1) / (x2 - x1);
                x1 = edge;
                c1 = 0;
            }
            if c2 != 0 {
                let edge = if c2 == 1 { 0 } else { right };
                y2 += (edge - x2) * (y2 - y1) / (x2 - x1);
                x2 = edge;
                c2 = 0;
            }
        }
    }
    (c1 | c2 == 0).then_some([[x1, y1], [x2, y2]])
}

/// Pixels of an 8-connected line (Bresenham), drawn from left to right.
fn line_pixels(from: [i64; 2], to: [i64; 2]) -> impl Iterator<Item = [i64; 2]> {
    let ([x1, y1], [x2, y2]) = if to[0] < from[0] {
        (to, from)
    } else {
        (from, to)
    };
    let (dx, dy, down) = (x2 - x1, (y2 - y1).abs(), if y2 < y1 { -1 } else { 1 });
    let steep = dy > dx;
    let (long, short) = if steep { (dy, dx) } else { (dx, dy) };
    let (mut at, mut error) = ([x1, y1], long - 2 * short);
    (0..=long).map(move |_| {
        let pixel = at;
        let sideways = error < 0;
        error += if sideways { 2 * long } else { 0 } - 2 * short;
        at[0] += i64::from(!steep || sideways);
        at[1] += if steep || sideways { down } else { 0 };
        pixel
    })
}

/// The 3x3 chamfer distance transform, in place: a pass down and to the right, then one up and to
/// the left.
fn chamfer(distance: &mut [f32], cols: usize) {
    let along_row = |before: f32, here: &mut f32| {
        *here = here.min(before + STRAIGHT);
        *here
    };
    let mut rows: Vec<&mut [f32]> = distance.chunks_exact_mut(cols.max(1)).collect();
    for row in 0..rows.len() {
        if let [.., above, here] = &mut rows[..=row] {
            across_rows(above, here);
        }
        rows[row].iter_mut().fold(f32::INFINITY, along_row);
    }
    for row in (0..rows.len()).rev() {
        if let [here, below, ..] = &mut rows[row..] {
            across_rows(below, here);
        }
        rows[row].iter_mut().rev().fold(f32::INFINITY, along_row);
    }
}

/// Propagates distances from one row to the next, straight and diagonally.
fn across_rows(from: &[f32], here: &mut [f32]) {
    let step = |from: &[f32], here: &mut [f32], length: f32| {
        for (from, here) in from.iter().zip(here) {
            *here = here.min(from + length);
        }
    };
    step(from, here, STRAIGHT);
    step(from, &mut here[1..], DIAGONAL);
    step(&from[1..], here, DIAGONAL);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_line_outside_the_image_gives_zero_heat() {
        let missed = heat_map([[-1.0, -1.0]; 2], [64, 48], 6, 8);
        assert_eq!(missed, vec![0.0; 48]);
    }

    #[test]
    fn the_heat_is_highest_on_the_line_and_lowest_in_the_farthest_cell() {
        let map = heat_map([[0.5, 24.0], [64.5, 24.0]], [64, 48], 12, 16);
        let row = |row: usize| map[row * 16];
        assert_eq!(row(6), 1.0);
        assert_eq!(row(0), 0.0);
        assert!(row(5) > row(4) && row(4) > row(3), "cools with distance");
        assert!((row(4) - (1.0 - (2.0_f32 / 6.0).sqrt())).abs() < 1e-6);
    }

    #[test]
    fn line_ends_between_two_pixels_are_rounded_to_the_even_pixel() {
        for (y, row) in [(10.5, 10), (11.5, 12)] {
            let map = heat_map([[0.5, y], [64.5, y]], [64, 48], 48, 64);
            assert_eq!(map[row * 64 + 5], 1.0);
            assert!(map[11 * 64 + 5] < 1.0);
        }
    }

    #[test]
    fn a_vertical_line_is_drawn() {
        let map = heat_map([[32.0, 0.5], [32.0, 48.5]], [64, 48], 12, 16);
        for row in 0..12 {
            assert_eq!(map[row * 16 + 8], 1.0, "row {row}");
        }
    }

    #[test]
    fn the_direction_of_the_line_makes_no_difference() {
        let there = heat_map([[3.0, 40.0], [60.0, 5.0]], [64, 48], 12, 16);
        let back = heat_map([[60.0, 5.0], [3.0, 40.0]], [64, 48], 12, 16);
        assert_eq!(there, back);
    }

    #[test]
    fn a_line_far_outside_is_clipped_away() {
        assert!(clip([[-50, -5], [-20, 90]], [63, 47]).is_none());
        assert_eq!(
            clip([[-10, 10], [70, 10]], [63, 47]),
            Some([[0, 10], [63, 10]])
        );
    }

    proptest! {
        /// There are no obstacles, so the shortest path is diagonal first, then straight.
        #[test]
        fn the_chamfer_distance_is_the_length_of_the_shortest_path(
            sources in prop::collection::vec((0..7_usize, 0..9_usize), 1..4),
        ) {
            let mut distance = [f32::INFINITY; 7 * 9];
            for (row, col) in &sources {
                distance[row * 9 + col] = 0.0;
            }
            chamfer(&mut distance, 9);
            for (cell, got) in distance.iter().enumerate() {
                let path = |(row, col): &(usize, usize)| {
                    let (down, right) = (row.abs_diff(cell / 9), col.abs_diff(cell % 9));
                    let diagonal = down.min(right);
                    DIAGONAL * diagonal as f32 + STRAIGHT * (down.max(right) - diagonal) as f32
                };
                let expect = sources.iter().map(path).fold(f32::INFINITY, f32::min);
                prop_assert!((got - expect).abs() < 1e-4, "{got} {expect}");
            }
        }

        #[test]
        fn any_line_and_any_map_give_heat_between_0_and_1(
            ends in prop::array::uniform2(prop::array::uniform2(-1e4..1e4_f64)),
            (rows, cols) in (0..12_usize, 0..12_usize),
        ) {
            let map = heat_map(ends, [64, 48], rows, cols);
            prop_assert_eq!(map.len(), rows * cols);
            prop_assert!(map.iter().all(|value| (0.0..=1.0).contains(value)));
        }
    }
}
