//! Doubts about the result.

use super::Study;
use crate::synchronisation::curve::Curve;
use crate::synchronisation::doubt::Doubt;
use crate::synchronisation::refine::{Fit, Problem};
use crate::synchronisation::search::{Found, Rival, peak, second};

/// Minimum number of joints that a camera must see together with other cameras, in both directions.
const LEAST_JOINTS: usize = 200;
/// Limits for the second-best offset: its gain as a fraction of the best gain, and the difference of the gains in standard errors.
const MOST_RATIO: f64 = 0.8;
/// A second-best offset whose gain is below this fraction of the best gain is never a rival, even in short footage.
const NO_RIVAL: f64 = 0.3;
const LEAST_T: f64 = 4.0;
/// Largest standard error of an offset, in seconds and in intervals between pictures.
const MOST_ERROR: [f64; 2] = [0.006, 0.2];
/// Minimum decrease of the cost at the best offset, relative to the mean cost of all offsets, as a fraction.
const LEAST_GAIN: f64 = 0.08;
/// Largest median residual, in expected errors.
const MOST_RESIDUAL: f64 = 3.0;
/// A pair of cameras has a clear offset if the gain of its second-best offset is below the first value, as a fraction of its best gain. It
/// agrees with the common offset if the gain at that offset reaches the second value.
const SURE_PAIR: [f64; 2] = [0.6, 0.5];
/// Largest difference between offsets of parts of the footage, in seconds and in standard errors.
const MOST_APART: [f64; 2] = [0.02, 4.0];
/// Largest drift of a clock.
const MOST_DRIFT: f64 = 0.01;

impl Study<'_> {
    pub(super) fn doubt_search(&self, found: &Found, curves: &[Curve], doubts: &mut Vec<Doubt>) {
        let window_s = self.settings.window_s;
        for it in found.rivals.iter().filter(|rival| is_close(rival)) {
            let Rival {
                group,
                away_s,
                ratio,
                t,
            } = it.clone();
            let known = doubts.iter().flat_map(Doubt::cameras).collect::<Vec<_>>();
            if group.iter().all(|camera| known.contains(camera)) {
                continue;
            }
            doubts.push(Doubt::Ambiguous {
                cameras: group,
                away_s,
                ratio,
                most_ratio: MOST_RATIO,
                t,
                least_t: LEAST_T,
            });
        }
        for &camera in self.active {
            let offset_s = found.offsets_s[camera];
            if offset_s.abs() > window_s - 0.05 {
                doubts.push(Doubt::Edge {
                    camera,
                    offset_s,
                    window_s,
                });
            }
        }
        for &camera in self.active {
            let (mut gain, mut mean) = (0.0, 0.0);
            for curve in curves.iter().filter(|curve| curve.cameras.contains(&camera)) {
                let [a, b] = curve.cameras;
                if let Some(nth) = curve.index(found.offsets_s[a] - found.offsets_s[b])
                    && curve.n[nth] > 0.0
                {
                    gain += curve.gain[nth];
                    mean += curve.gain[nth] + curve.cost[nth] * curve.n[nth];
                }
            }
            let gain = if mean > 0.0 { gain / mean } else { 0.0 };
            if gain < LEAST_GAIN {
                let least = LEAST_GAIN;
                doubts.push(Doubt::Still {
                    camera,
                    gain,
                    least,
                });
            }
        }
        for curve in curves {
            doubts.extend(doubt_pair(curve, &found.offsets_s));
        }
    }

    pub(super) fn doubt_fit(
        &self,
        problem: &Problem<'_>,
        fit: &Fit,
        span: [f64; 2],
        doubts: &mut Vec<Doubt>,
    ) {
        let most_s = (MOST_ERROR[1] * self.interval_s).max(MOST_ERROR[0]);
        for &camera in self.active {
            let residuals = fit.residuals[camera];
            if residuals.n < LEAST_JOINTS {
                let (n, least) = (residuals.n, LEAST_JOINTS);
                doubts.push(Doubt::Unconnected { camera, n, least });
                continue;
            }
            let error_s = fit.errors[camera][0];
            if error_s.is_nan() || error_s > most_s {
                doubts.push(Doubt::Flat {
                    camera,
                    error_s,
                    most_s,
                });
            }
            if residuals.median > MOST_RESIDUAL {
                doubts.push(Doubt::Misfit {
                    camera,
                    percent: residuals.median,
                    most: MOST_RESIDUAL,
                });
            }
            let drift = fit.clocks[camera].drift;
            if drift.abs() > MOST_DRIFT {
                doubts.push(Doubt::Speed {
                    camera,
                    drift,
                    most: MOST_DRIFT,
                });
            }
        }
        self.doubt_parts(problem, fit, span, doubts);
    }

    /// Adds a doubt if the halves of the footage differ.
    fn doubt_parts(
        &self,
        problem: &Problem<'_>,
        fit: &Fit,
        span: [f64; 2],
        doubts: &mut Vec<Doubt>,
    ) {
        let middle_s = f64::midpoint(span[0], span[1]);
        let halves = [[span[0], middle_s], [middle_s, span[1]]];
        let as_they_are = vec![false; fit.clocks.len()];
        let [first, second] = halves.map(|half| problem.refine(&fit.clocks, half, &as_they_are));
        for &camera in self.active {
            let errors = [&first, &second].map(|fit| fit.errors[camera][0]);
            let at_middle = [&first, &second].map(|fit| fit.clocks[camera].common(middle_s));
            let away_s = (at_middle[0] - at_middle[1]).abs();
            let most_s = MOST_APART[0].max(0.5 * self.interval_s)
                + MOST_APART[1] * errors[0].hypot(errors[1]);
            if away_s > most_s {
                doubts.push(Doubt::Parts {
                    camera,
                    away_s,
                    most_s,
                });
            }
        }
    }
}

fn is_close(rival: &Rival) -> bool {
    let Rival { ratio, t, .. } = rival;
    ratio.is_nan() || *ratio > MOST_RATIO || (*ratio > NO_RIVAL && (t.is_nan() || *t < LEAST_T))
}

/// Returns a doubt if a pair with a clear offset contradicts the common offsets.
fn doubt_pair(curve: &Curve, offsets_s: &[f64]) -> Option<Doubt> {
    let [a, b] = curve.cameras;
    let (best, value) = peak(curve);
    let (_, ratio) = second(curve)?;
    let nth = curve.index(offsets_s[a] - offsets_s[b])?;
    let share = curve.gain[nth] / curve.gain[best];
    if value <= 0.0 || ratio > SURE_PAIR[0] || share > SURE_PAIR[1] {
        return None;
    }
    Some(Doubt::Pair {
        cameras: curve.cameras,
        away_s: curve.offset_s(best) - curve.offset_s(nth),
        share,
        least_share: SURE_PAIR[1],
    })
}
