//! Conversion of boxes to the heat and the sides that the network should give.

use super::{Around, STRIDE};

/// Standard deviation of the heat around the middle of a box, as a share of the box's width and height.
const SPREAD: f32 = 0.08;
/// Minimum standard deviation, in cells.
const LEAST_SPREAD: f32 = 0.7;
/// Minimum heat of a cell that belongs to a box.
const BOXED: f32 = 0.4;
/// Cells in the central part of an ignored person's box do not count. This is the size of that part, as a share of the width and height of
/// the box.
const UNASKED: f32 = 0.7;

/// Heat and sides of every cell; see [`Truth`](crate::networks::finder::Truth).
pub(super) fn heat(people: &[Around], n: usize) -> (Vec<f32>, Vec<f32>) {
    let mut heat = vec![0.0_f32; n * n];
    let mut sides = vec![0.0; 4 * n * n];
    let half = 0.5 * (STRIDE - 1) as f32;
    let in_cells = |around: &Around| around.outline.map(|side| (side - half) / STRIDE as f32);
    let mut largest_first: Vec<&Around> = people.iter().filter(|person| person.counts).collect();
    largest_first.sort_by(|a, b| b.area().total_cmp(&a.area()));
    for person in largest_first {
        let outline = in_cells(person);
        let spread = [0, 1].map(|axis| {
            let side = outline[axis + 2] - outline[axis];
            (SPREAD * side).max(LEAST_SPREAD)
        });
        let middle = [0, 1].map(|axis| {
            let middle = f32::midpoint(outline[axis], outline[axis + 2]);
            middle.round().clamp(0.0, (n - 1) as f32)
        });
        for row in around(middle[1], spread[1], n) {
            for column in around(middle[0], spread[0], n) {
                let off = [column as f32 - middle[0], row as f32 - middle[1]];
                let [x, y] = [off[0] / spread[0], off[1] / spread[1]];
                let own = (-0.5 * (x * x + y * y)).exp();
                let at = row * n + column;
                if own <= heat[at] {
                    continue;
                }
                heat[at] = own;
                let [left, top, right, bottom] = outline;
                let [x, y] = [column as f32, row as f32];
                let own_sides = [x - left, y - top, right - x, bottom - y];
                let is_boxed = own >= BOXED && own_sides.iter().all(|side| *side > 0.05);
                for (side, value) in own_sides.into_iter().enumerate() {
                    sides[side * n * n + at] = if is_boxed { value } else { 0.0 };
                }
            }
        }
    }
    for person in people.iter().filter(|person| !person.counts) {
        let [left, top, right, bottom] = in_cells(person);
        let limits = |low: f32, high: f32| {
            let cut = 0.5 * (1.0 - UNASKED) * (high - low);
            let end = ((high - cut).ceil().max(0.0) as usize).min(n);
            ((low + cut).floor().max(0.0) as usize).min(end)..end
        };
        for row in limits(top, bottom) {
            for column in limits(left, right) {
                let heat = &mut heat[row * n + column];
                if *heat < BOXED {
                    *heat = -1.0;
                }
            }
        }
    }
    (heat, sides)
}

/// The range of cells within three standard deviations of the middle of a box, along one axis.
fn around(middle: f32, spread: f32, n: usize) -> core::ops::Range<usize> {
    let reach = 3.0 * spread;
    let low = (middle - reach).max(0.0) as usize;
    low..(((middle + reach) as usize) + 1).min(n)
}
