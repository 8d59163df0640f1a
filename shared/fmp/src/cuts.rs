//! The parts of the images of a chain of levels that are needed to compute the features of a scope.

use std::ops::Range;

use crate::source::Source;

/// A rectangle of the image of one level, in pixels of the level.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Cut {
    pub(crate) x: Range<usize>,
    pub(crate) y: Range<usize>,
}

/// Computes the cuts of the levels `first`, `first + interval` and so on up to the last one of the scope,
/// such that every cut has half the size of the one before it.
///
/// A cut begins and ends at cell borders of its level, or at the border of the image, so that its cells coincide with cells of the whole
/// image. Features depend on the pixels up to two cells away, less at least one pixel. Halving corrupts up to two pixels along the border
/// of a cut, so one more cell is added.
pub(crate) fn cuts(source: &Source<'_>, first: usize, cuts: &mut Vec<Cut>) {
    let end = usize::from(source.scope.levels().end);
    let levels = (first..end).step_by(source.interval);
    cuts.clear();
    let nothing = Cut { x: 0..0, y: 0..0 };
    cuts.resize(levels.len(), nothing);
    for (octave, level) in levels.enumerate().rev() {
        let of_axis = |axis: usize| {
            let below = cuts.get(octave + 1).map(|cut| cut.on(axis));
            // Number of cells that become one cell on the smallest level of the chain.
            let grid = source.cell_px << (cuts.len() - 1 - octave);
            let own = needed(source, level, axis);
            let twice = below.map(|below| {
                let begin = below.start.saturating_sub(source.cell_px);
                2 * begin..2 * (below.end + source.cell_px)
            });
            let both = match (own, twice) {
                (Some(a), Some(b)) => a.start.min(b.start)..a.end.max(b.end),
                (Some(it), None) | (None, Some(it)) => it,
                (None, None) => 0..grid,
            };
            let side = source.layout.levels[level].image_size[axis];
            both.start / grid * grid..both.end.next_multiple_of(grid).min(side)
        };
        cuts[octave] = Cut {
            x: of_axis(0),
            y: of_axis(1),
        };
    }
    // Compute the sizes after repeated halving of the first cut.
    for octave in 1..cuts.len() {
        let half = |range: Range<usize>| range.start / 2..range.end.div_ceil(2);
        cuts[octave] = Cut {
            x: half(cuts[octave - 1].x.clone()),
            y: half(cuts[octave - 1].y.clone()),
        };
    }
}

impl Cut {
    fn on(&self, axis: usize) -> Range<usize> {
        if axis == 0 {
            self.x.clone()
        } else {
            self.y.clone()
        }
    }
}

/// Returns the pixels of a level on which the features of its window depend, if the level is in the scope.
///
/// * `axis`: 0 along the rows, 1 down the columns.
fn needed(source: &Source<'_>, level: usize, axis: usize) -> Option<Range<usize>> {
    source.scope.levels().contains(&(level as u16)).then(|| {
        let it = &source.layout.levels[level];
        let window = source.layout.window(source.scope, level);
        let (begin, n) = [(window.left, window.cols), (window.top, window.rows)][axis];
        let [filter, pad, padded] = [
            [it.padded[1] - it.cols, source.layout.pad[1], it.padded[1]],
            [it.padded[0] - it.rows, source.layout.pad[0], it.padded[0]],
        ][axis];
        // Entry `at` of the padded features describes the cell `at - pad` of the image;
        // the first and the last cell of an image have no features.
        let last = padded - 2 * (pad + 1);
        let begin_cell = begin.saturating_sub(pad).clamp(1, last.max(1));
        let end_cell =
            (begin + n + filter).saturating_sub(pad).clamp(begin_cell + 1, last.max(1) + 1);
        let first_px = begin_cell.saturating_sub(2) * source.cell_px;
        let side = it.image_size[axis];
        let end = if end_cell + 2 > last + 1 {
            side
        } else {
            ((end_cell + 2) * source.cell_px).min(side)
        };
        first_px..end
    })
}
