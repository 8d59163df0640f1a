//! The whole estimation of offsets and drifts.

mod doubts;

use geometry::Camera;

use crate::synchronisation::curve::{Curve, Grid};
use crate::synchronisation::doubt::Doubt;
use crate::synchronisation::film::{Film, FilmError};
use crate::synchronisation::pair::Epipolar;
use crate::synchronisation::refine::{Clock, Fit, Problem};
use crate::synchronisation::search::{peak, search, second};
use crate::synchronisation::track::{Track, tracks};

/// Standard deviation of the kernel that smooths positions over time, in intervals between pictures and in seconds.
const SMOOTHING: [f64; 2] = [0.75, 0.015];
/// Length of the part of the footage in which all offsets are tried, in seconds. It is the part with most movement. The rest is used for
/// the drift only.
const SEARCHED_S: f64 = 60.0;
/// Minimum time for which a person must be followed in a camera, in seconds.
const LEAST_SEEN_S: f64 = 0.5;
/// Minimum length of footage to refine drifts, in seconds.
const LEAST_DRIFT_S: f64 = 10.0;
/// Largest accepted error of a drift, accumulated over the footage, in seconds.
const MOST_DRIFT_ERROR_S: f64 = 0.005;
/// A drift is used only if it is at least this number of standard errors.
const SURE_DRIFT: f64 = 4.0;

/// Settings of the estimation of clocks.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Index of the camera whose clock is the common one.
    pub reference: usize,
    /// Largest offset between two cameras to search, in both directions, in seconds.
    pub window_s: f64,
    /// For each joint, the index of the corresponding joint on the other side of the body; `None` if the joint detector never swaps left
    /// and right.
    pub mirror: Option<Vec<usize>>,
    /// Number of joints of a person.
    pub n_joints: usize,
}

/// Clock of one camera.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraClock {
    /// Offset to add to the camera's times to get common times, at the camera's time 0, in seconds.
    pub offset_s: f64,
    /// Standard error of the offset in the middle of the footage, in seconds; infinite if the offset is unknown.
    pub error_s: f64,
    /// Amount by which a second of the camera's clock is longer than a second of the common clock; 1e-6 is one part per million. It is 0 if
    /// it is not determined, or cannot be distinguished from 0.
    pub drift: f64,
    /// Standard error of the drift; `None` if the footage is too short to determine it.
    pub drift_error: Option<f64>,
    /// Number of joints that the camera sees together with other cameras.
    pub n: usize,
    /// Median residual without offsets, in pixels; NaN if the films do not overlap.
    pub before_px: f64,
    /// Median residual with offsets, in pixels.
    pub after_px: f64,
}

/// Result for one pair of cameras, without the others.
#[derive(Debug, Clone, PartialEq)]
pub struct PairReport {
    /// Indices of the two cameras.
    pub cameras: [usize; 2],
    /// Offset of the pair in the common solution, in seconds: the offset of the first camera minus the offset of the second.
    pub offset_s: f64,
    /// Best offset of the pair alone, in seconds.
    pub best_s: f64,
    /// Second-best offset of the pair alone, in seconds.
    pub second_s: f64,
    /// Gain of the second-best offset (for sounds, its cosine) as a fraction of the best.
    pub ratio: f64,
    /// Number of samples at the best offset.
    pub n: usize,
}

/// Result of a synchronisation.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Clocks of the cameras, in order.
    pub cameras: Vec<CameraClock>,
    /// Results for each pair that was searched.
    pub pairs: Vec<PairReport>,
    /// Cost by offset, for each pair that was searched.
    pub curves: Vec<Curve>,
    /// Gain of the second-best offset (for sounds, its cosine) as a fraction of the best, for the group of cameras whose offset is most
    /// doubtful.
    pub second_best: f64,
    /// Every reason not to use the result; if empty, the result can be used.
    pub doubts: Vec<Doubt>,
    /// Length of the common footage in which people are seen, in seconds.
    pub length_s: f64,
}

/// Estimates the clocks.
///
/// * `films`: films of the cameras, in the order of `cameras`.
///
/// # Errors
///
/// Fails with [`FilmError`] if the films cannot be used at all. Usable footage that determines too little gives an [`Outcome`] with doubts.
pub fn estimate(
    cameras: &[Camera],
    films: &[Film],
    settings: &Settings,
) -> Result<Outcome, FilmError> {
    check(cameras, films, settings)?;
    let interval_s = films.iter().filter_map(Film::interval_s).fold(0.0, f64::max);
    let sigma_s = (SMOOTHING[0] * interval_s).max(SMOOTHING[1]);
    let of_camera = |(film, camera)| tracks(film, camera, settings.n_joints, sigma_s);
    let tracks: Vec<Vec<Track>> = films.iter().zip(cameras).map(of_camera).collect();
    let seen: Vec<f64> = tracks.iter().map(|track| seen_s(track)).collect();
    let mut doubts = Vec::new();
    for (camera, &seen_s) in seen.iter().enumerate() {
        if seen_s < LEAST_SEEN_S {
            let least_s = LEAST_SEEN_S;
            doubts.push(Doubt::NoPeople {
                camera,
                seen_s,
                least_s,
            });
        }
    }
    let mut active: Vec<usize> = (0..cameras.len()).filter(|i| seen[*i] >= LEAST_SEEN_S).collect();
    active.sort_by_key(|camera| *camera != settings.reference);
    let study = Study {
        cameras,
        tracks: &tracks,
        settings,
        interval_s,
        active: &active,
    };
    Ok(study.outcome(doubts))
}

fn check(cameras: &[Camera], films: &[Film], settings: &Settings) -> Result<(), FilmError> {
    let (n, reference, window_s) = (cameras.len(), settings.reference, settings.window_s);
    if films.len() != n {
        return Err(FilmError::Number {
            films: films.len(),
            cameras: n,
        });
    }
    check_settings(n, reference, window_s)?;
    let mut each = films.iter().enumerate();
    each.try_for_each(|(camera, it)| it.check(camera))
}

/// Returns an error for settings with which no clocks can be compared.
pub(crate) fn check_settings(n: usize, reference: usize, window_s: f64) -> Result<(), FilmError> {
    if n < 2 {
        return Err(FilmError::OneCamera { cameras: n });
    }
    if reference >= n {
        return Err(FilmError::Reference {
            reference,
            cameras: n,
        });
    }
    if !(0.1..=60.0).contains(&window_s) {
        return Err(FilmError::Window { window_s });
    }
    Ok(())
}

/// Returns the time for which a person is followed, in seconds.
fn seen_s(tracks: &[Track]) -> f64 {
    let mut spans: Vec<[f64; 2]> = tracks.iter().map(|track| track.span).collect();
    spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let (mut sum, mut upto) = (0.0, f64::NEG_INFINITY);
    for [from, to] in spans {
        sum += (to - from.max(upto)).max(0.0);
        upto = upto.max(to);
    }
    sum
}

struct Study<'a> {
    cameras: &'a [Camera],
    tracks: &'a [Vec<Track>],
    settings: &'a Settings,
    interval_s: f64,
    active: &'a [usize],
}

impl Study<'_> {
    fn outcome(&self, mut doubts: Vec<Doubt>) -> Outcome {
        let curves = self.curves();
        let found = search(self.cameras.len(), self.active, &curves);
        let start: Vec<Clock> = found
            .offsets_s
            .iter()
            .map(|&offset_s| Clock {
                offset_s,
                ..Clock::default()
            })
            .collect();
        let problem = self.problem();
        let span = self.span(&start);
        let (fit, drift_errors) = self.fit(&problem, &start, span);
        let before = vec![Clock::default(); self.cameras.len()];
        let before = problem.residuals(&before, span);
        let camera = |i: usize| CameraClock {
            offset_s: fit.clocks[i].at_zero_s(),
            error_s: fit.errors[i][0],
            drift: fit.clocks[i].drift,
            drift_error: drift_errors.as_ref().map(|all| all[i]),
            n: fit.residuals[i].n,
            before_px: before[i].median_px,
            after_px: fit.residuals[i].median_px,
        };
        self.doubt_search(&found, &curves, &mut doubts);
        self.doubt_fit(&problem, &fit, span, &mut doubts);
        let pairs = curves.iter().map(|curve| pair_report(curve, &fit.clocks)).collect();
        Outcome {
            cameras: (0..self.cameras.len()).map(camera).collect(),
            pairs,
            second_best: found.rivals.first().map_or(0.0, |rival| rival.ratio),
            curves,
            doubts,
            length_s: span[1] - span[0],
        }
    }

    /// Returns the costs of all pairs.
    fn curves(&self) -> Vec<Curve> {
        let window_s = self.settings.window_s;
        let searched = self.searched();
        let wide = [searched[0] - window_s, searched[1] + window_s];
        let n_joints = self.settings.n_joints;
        let grids = |span: [f64; 2]| -> Vec<Grid> {
            let each = self.tracks.iter();
            each.map(|tracks| Grid::new(tracks, n_joints, span)).collect()
        };
        let (firsts, seconds) = (grids(searched), grids(wide));
        let mirror = self.settings.mirror.as_deref();
        let mut curves = Vec::new();
        for (nth, &a) in self.active.iter().enumerate() {
            for &b in &self.active[nth + 1..] {
                let of_pair = [&self.cameras[a], &self.cameras[b]];
                let grids = [&firsts[a], &seconds[b]];
                curves.extend(Curve::search([a, b], of_pair, grids, window_s, mirror));
            }
        }
        curves
    }

    /// Returns the part of the footage with most movement, by the clocks of the cameras; all of it if it is short.
    fn searched(&self) -> [f64; 2] {
        let spans = self.active.iter().flat_map(|i| &self.tracks[*i]);
        let ends =
            spans.map(|span| span.span).fold([f64::INFINITY, f64::NEG_INFINITY], |all, it| {
                [all[0].min(it[0]), all[1].max(it[1])]
            });
        if ends[1] - ends[0] <= SEARCHED_S || ends[1] < ends[0] {
            return if ends[1] < ends[0] { [0.0, 0.0] } else { ends };
        }
        let n = ((ends[1] - ends[0] - SEARCHED_S) / 10.0).floor() as usize;
        let starts = (0..=n).map(|i| ends[0] + 10.0 * i as f64);
        let movement = |from: f64| -> f64 {
            let times = (0..120).map(|i| from + 0.5 * f64::from(i));
            times.map(|time| self.movement(time)).sum()
        };
        let best = starts.max_by(|a, b| movement(*a).total_cmp(&movement(*b)));
        let from = best.unwrap_or(ends[0]);
        [from, from + SEARCHED_S]
    }

    /// Returns the speed of people at a time, in sizes of a person per second, over all cameras.
    fn movement(&self, time_s: f64) -> f64 {
        let all = self.active.iter().flat_map(|i| &self.tracks[*i]);
        let alive = all.filter(|track| track.span[0] <= time_s && time_s <= track.span[1]);
        let of_track = |track: &Track| -> f64 {
            let joints = (0..self.settings.n_joints).filter_map(|joint| track.place(joint, time_s));
            let speeds = joints.map(|place| place.speed[0].hypot(place.speed[1]) / track.size);
            speeds.map(|speed| speed.min(2.0)).sum()
        };
        alive.map(of_track).sum()
    }

    fn problem(&self) -> Problem<'_> {
        let mut pairs = Vec::new();
        for &a in self.active {
            for &b in self.active.iter().filter(|active| **active != a) {
                let epipolar = Epipolar::new(&self.cameras[a], &self.cameras[b]);
                pairs.extend(epipolar.map(|epipolar| ([a, b], epipolar)));
            }
        }
        Problem {
            tracks: self.tracks,
            pairs,
            reference: self.active.first().copied().unwrap_or(self.settings.reference),
            mirror: self.settings.mirror.as_deref(),
            n_joints: self.settings.n_joints,
        }
    }

    /// Returns the first and last time on the common clock at which at least two cameras see people.
    fn span(&self, clocks: &[Clock]) -> [f64; 2] {
        let (mut starts, mut ends) = (Vec::new(), Vec::new());
        for &camera in self.active {
            let tracks = self.tracks[camera].iter();
            let spans = tracks.map(|track| track.span.map(|end| clocks[camera].common(end)));
            let [from, to] = spans.fold([f64::INFINITY, f64::NEG_INFINITY], |all, it| {
                [all[0].min(it[0]), all[1].max(it[1])]
            });
            starts.push(from);
            ends.push(to);
        }
        starts.sort_by(f64::total_cmp);
        ends.sort_by(|a, b| b.total_cmp(a));
        match (starts.get(1), ends.get(1)) {
            (Some(&from), Some(&to)) if to > from => [from, to],
            _ => [0.0, 0.0],
        }
    }

    /// Returns the fit, and the errors of the drifts if they are determined.
    fn fit(
        &self,
        problem: &Problem<'_>,
        start: &[Clock],
        span: [f64; 2],
    ) -> (Fit, Option<Vec<f64>>) {
        let searched = self.searched();
        let length_s = span[1] - span[0];
        let mut part = [searched[0].max(span[0]), searched[1].min(span[1])];
        if part[1] - part[0] < 1.0 {
            part = span;
        }
        let all = vec![true; start.len()];
        let mut none = vec![false; start.len()];
        let plain = problem.refine(start, part, &none).clocks;
        if length_s < LEAST_DRIFT_S {
            return (problem.refine(&plain, span, &none), None);
        }
        let mut fit = problem.refine(&plain, part, &all);
        while part[0] > span[0] || part[1] < span[1] {
            let more_s = part[1] - part[0];
            part = [
                (part[0] - more_s).max(span[0]),
                (part[1] + more_s).min(span[1]),
            ];
            fit = problem.refine(&fit.clocks, part, &all);
        }
        let errors: Vec<f64> = fit.errors.iter().map(|error| error[1]).collect();
        let others = self.active.iter().filter(|active| **active != problem.reference);
        let is_known = |i: &usize| errors[*i] * length_s < MOST_DRIFT_ERROR_S;
        let all_known = others.clone().all(is_known);
        for &it in others {
            let drift = fit.clocks[it].drift.abs();
            none[it] = all_known && drift > SURE_DRIFT * errors[it];
        }
        let drifting = none;
        if !drifting.contains(&true) {
            return (
                problem.refine(&plain, span, &drifting),
                all_known.then_some(errors),
            );
        }
        let start = fit.clocks.iter().zip(&drifting).map(|(clock, drifts)| Clock {
            drift: if *drifts { clock.drift } else { 0.0 },
            ..*clock
        });
        let start: Vec<Clock> = start.collect();
        (problem.refine(&start, span, &drifting), Some(errors))
    }
}

fn pair_report(curve: &Curve, clocks: &[Clock]) -> PairReport {
    let [a, b] = curve.cameras;
    let (best, _) = peak(curve);
    let (other, ratio) = second(curve).unwrap_or((best, 1.0));
    PairReport {
        cameras: curve.cameras,
        offset_s: clocks[a].offset_s - clocks[b].offset_s,
        best_s: curve.offset_s(best),
        second_s: curve.offset_s(other),
        ratio,
        n: curve.n[best] as usize,
    }
}
