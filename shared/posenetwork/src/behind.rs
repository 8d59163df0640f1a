//! Bars that cover the body parts of a known person. They are painted over the picture, so that a network sees the person behind.

use skeleton::PARSE14;

use crate::cover::Bar;
use crate::maps::JointMaps;

/// Minimum heat, 0 to 1, of both end joints of a part that is painted over.
const SURE: f64 = 0.2;
/// Half the width of a limb, as a share of the longer side of the box around the person.
const HALF_WIDTH: f64 = 0.0375;
/// Half the width of the head, as a share of the longer side of the box around the person. The bar of the head reaches from the neck to the
/// top of the head.
const HALF_HEAD: f64 = 0.06;
/// The edges and diagonals of the trunk. Hips and shoulders are given by their indices in [`PARSE14`].
const TRUNK: [(usize, usize); 6] = [(2, 8), (3, 9), (8, 9), (2, 3), (2, 9), (3, 8)];
/// Indices of the neck and the top of the head.
const HEAD: (usize, usize) = (12, 13);

impl JointMaps {
    /// Adds a bar for each part of the person whose two joints are seen.
    pub fn add_bars(&self, bars: &mut Vec<Bar>) {
        let Some([left, top, right, bottom]) = self.around() else {
            return;
        };
        let longer = (right - left).max(bottom - top);
        let sure = |joint: usize| self.peaks().get(joint)?.filter(|peak| peak.score >= SURE);
        let limbs = PARSE14.limbs.iter().chain(&TRUNK);
        bars.extend(limbs.filter_map(|&(from, to)| {
            let half = if (from, to) == HEAD {
                HALF_HEAD
            } else {
                HALF_WIDTH
            };
            Some(Bar {
                ends: [sure(from)?.at, sure(to)?.at],
                radius: half * longer,
            })
        }));
    }

    /// Number of joints that are seen outside the given bars.
    pub fn n_outside(&self, bars: &[Bar]) -> usize {
        let seen = self.peaks().iter().flatten();
        seen.filter(|peak| peak.score >= SURE && !bars.iter().any(|bar| bar.holds(peak.at)))
            .count()
    }
}
