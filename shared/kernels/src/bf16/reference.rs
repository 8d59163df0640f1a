//! Readable, bit-exact emulation of the matrix unit.

use super::{Bf16Level, Bf16Map, Panel};
use crate::N_CHANNELS;
use crate::dispatch::{Body, dispatch};
use crate::isa::Isa;
use crate::tiles::SIDE;

/// All responses; see [`super::Bf16Bank::correlate`].
#[expect(
    single_use_lifetimes,
    reason = "an argument of type `impl Trait` cannot do without a name"
)]
pub(super) fn correlate<'a>(
    isa: Isa,
    panels: &[Panel],
    levels: impl Iterator<Item = Bf16Level<'a>>,
    mut out: &mut [f32],
) {
    for Bf16Level { map, size } in levels {
        for panel in panels {
            for lane in 0..panel.filters.len() {
                let Some(plane) = out.split_off_mut(..size[0] * size[1]) else {
                    return;
                };
                let filter = (panel, lane);
                dispatch(
                    isa,
                    Plane {
                        map,
                        filter,
                        cols: size[1],
                        responses: plane,
                    },
                );
            }
        }
    }
}

/// The response map of one filter.
struct Plane<'a> {
    map: &'a Bf16Map,
    /// A panel, and which filter of it.
    filter: (&'a Panel, usize),
    cols: usize,
    responses: &'a mut [f32],
}

impl Body for Plane<'_> {
    #[inline(always)]
    fn run(self) {
        for (at, response) in self.responses.iter_mut().enumerate() {
            let place = [at / self.cols, at % self.cols];
            *response = sum(self.map, place, self.filter);
        }
    }
}

#[inline(always)]
fn sum(map: &Bf16Map, [y, x]: [usize; 2], (panel, lane): (&Panel, usize)) -> f32 {
    let mut sum = 0.0_f32;
    for (at, weights) in panel.weights.iter().enumerate() {
        let [r, c] = [at / panel.filter[1], at % panel.filter[1]];
        let cell = &map.cells[(y + r) * map.cols + x + c];
        // Of the products of even channels, and of odd ones.
        let mut sums = [0.0_f32; 2];
        for k in 0..N_CHANNELS {
            let weight = weights.0[lane / SIDE][k / 2][lane % SIDE][k % 2];
            let [cell, weight] = [cell.0[k], weight].map(single);
            sums[k % 2] = flushed(cell.mul_add(weight, sums[k % 2]));
        }
        sum = flushed(sum + flushed(sums[0] + sums[1]));
    }
    sum
}

/// The value of a bfloat16, or zero if it is closer to that than `2^-126`.
#[inline(always)]
fn single(value: u16) -> f32 {
    flushed(f32::from_bits(u32::from(value) << 16))
}

/// Zero of the same sign for what is closer to it than `2^-126`.
#[inline(always)]
fn flushed(value: f32) -> f32 {
    if value.abs() < f32::MIN_POSITIVE {
        0.0_f32.copysign(value)
    } else {
        value
    }
}
