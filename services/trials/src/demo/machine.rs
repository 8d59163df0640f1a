//! What this machine can do now: frames are made and solved in this process before the cameras begin, and again
//! when they are through.

use std::sync::Arc;
use std::time::{Duration, Instant};

use geometry::Camera;
use kernels::Rgb8View;
use launch::{Prepared, Resolved};
use pipeline::Estimator;
use rayon::prelude::*;
use runtime::{ExitKind, Failure, OrFail as _};
use scene::{Scene, View};
use serde_json::{Value, json};
use statistics::Sorted;

use crate::trial::stage::Stage;

/// Frames a second on a machine that is fast enough.
pub(super) const FULL_RATE_HZ: f64 = 5.0;

/// The slowest that the cameras become, frames a second.
const LEAST_RATE_HZ: f64 = 0.25;

/// The part of a frame's time that its computing may take: the rest is for what processes cost besides, and for a
/// load that is not always the same.
const SHARE: f64 = 0.5;

/// How long is measured: two frames at least.
const SPAN: Duration = Duration::from_secs(2);

/// Makes and solves frames of all cameras, as the processes will.
pub(super) struct Gauge {
    views: Vec<View>,
    pictures: Vec<Vec<u8>>,
    estimator: Estimator,
}

impl Gauge {
    /// Puts the scene together.
    pub(super) fn new(stage: &Stage, resolved: &Resolved) -> Result<Self, Failure> {
        let scene = Arc::new(Scene::new(&stage.settings).or_fail(ExitKind::Run)?);
        let views: Result<Vec<View>, _> = (0..stage.rig.cameras().len())
            .map(|camera| View::new(&scene, camera))
            .collect();
        let views = views.or_fail(ExitKind::Run)?;
        let prepared = Prepared::new(resolved)?;
        let cameras = prepared.views.iter().map(|it| it.framing.camera().clone());
        let cameras: Vec<Camera> = cameras.collect();
        let (up, settings) = (prepared.up_in_world, &prepared.settings);
        let estimator = Estimator::new(&prepared.model, &cameras, up, settings);
        Ok(Self {
            pictures: views
                .iter()
                .map(|it| vec![0; it.size().rgb_bytes()])
                .collect(),
            views,
            estimator: estimator.or_fail(ExitKind::Run)?,
        })
    }

    /// Measures, for about two seconds.
    pub(super) fn measure(&mut self) -> Result<Machine, Failure> {
        let load = load();
        let begin = Instant::now();
        let mut spans = Vec::new();
        // The first only makes room.
        while spans.len() < 2 || begin.elapsed() < SPAN {
            let nth = Instant::now();
            self.frame(spans.len() as u64)?;
            spans.push(nth.elapsed().as_secs_f64());
        }
        let frame_s = Sorted::new(&spans[1..])
            .interpolated(0.5)
            .unwrap_or(f64::INFINITY);
        Ok(Machine {
            load,
            n_cores: std::thread::available_parallelism().map_or(1, usize::from),
            n_cameras: self.views.len(),
            frame_s,
        })
    }

    fn frame(&mut self, number: u64) -> Result<(), Failure> {
        let views = self.views.par_iter_mut().zip(&mut self.pictures);
        views.for_each(|(view, rgb)| {
            view.picture(number, rgb);
        });
        let images = self.views.iter().zip(&self.pictures);
        let images: Result<Vec<_>, _> = images
            .map(|(it, rgb)| Rgb8View::new(it.size().width, it.size().height, rgb).map(Some))
            .collect();
        let images = images.or_fail(ExitKind::Run)?;
        self.estimator.estimate(&images, &vec![None; images.len()]);
        Ok(())
    }
}

/// What a measurement says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Machine {
    /// Processes that wanted to run, on average over the last minute, before anything was measured.
    load: Option<f64>,
    n_cores: usize,
    n_cameras: usize,
    /// How long a frame of all cameras takes on all cores: the median.
    frame_s: f64,
}

impl Machine {
    /// Frames a second that the cameras take: those of a fast machine, or as many as leave half of the time.
    pub(super) fn rate_hz(&self) -> f64 {
        let most = SHARE / self.frame_s;
        // Two decimals are enough to be read.
        let rounded = (100.0 * most).floor() / 100.0;
        rounded.clamp(LEAST_RATE_HZ, FULL_RATE_HZ)
    }

    /// How many times as long as on a machine that is fast enough everything takes here; 1 at least.
    pub(super) fn slowness(&self) -> f64 {
        (FULL_RATE_HZ * self.frame_s / SHARE).max(1.0)
    }

    /// How many times as far apart frames are as on a machine that is fast enough; 20 at most.
    pub(super) fn spread(&self) -> f64 {
        FULL_RATE_HZ / self.rate_hz()
    }

    /// The slower one of two.
    pub(super) fn slower(self, other: Self) -> Self {
        if other.frame_s > self.frame_s {
            other
        } else {
            self
        }
    }

    /// For people.
    pub(super) fn text(&self) -> String {
        let Self {
            n_cores, n_cameras, ..
        } = self;
        let busy = match self.load {
            Some(load) if load > *n_cores as f64 => {
                format!("this machine is busy (load {load:.1} on {n_cores} cores): ")
            }
            _ => String::new(),
        };
        let frame_ms = 1000.0 * self.frame_s;
        let text = format!(
            "{busy}a frame of {n_cameras} cameras takes {frame_ms:.0} ms of the {n_cores} cores together"
        );
        if self.slowness() <= 1.0 {
            return text;
        }
        format!(
            "{text}, so the cameras take {} frames a second instead of {FULL_RATE_HZ}, the killed camera has {:.1} \
             times as long to come back, and a pause may be {:.1} times as long",
            self.rate_hz(),
            self.spread(),
            self.slowness()
        )
    }

    /// For programs.
    pub(super) fn json(&self) -> Value {
        json!({
            "load": self.load,
            "cores": self.n_cores,
            "frame_ms": 1000.0 * self.frame_s,
            "rate_hz": self.rate_hz(),
            "slowness": self.slowness(),
            "spread": self.spread(),
        })
    }
}

/// Processes that want to run, on average over the last minute.
fn load() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/loadavg").ok()?;
    text.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn machine(load: f64, frame_s: f64) -> Machine {
        Machine {
            load: Some(load),
            n_cores: 2,
            n_cameras: 4,
            frame_s,
        }
    }

    #[test]
    fn half_of_the_time_is_left_and_the_clock_is_judged_by_as_much_more() {
        for (frame_s, rate_hz, slowness) in [
            (0.02, 5.0, 1.0),
            (0.1, 5.0, 1.0),
            (0.2, 2.5, 2.0),
            (0.3, 1.66, 3.0),
            (1.0, 0.5, 10.0),
            (4.0, 0.25, 40.0),
        ] {
            let it = machine(0.0, frame_s);
            assert_eq!(it.rate_hz(), rate_hz, "{frame_s}");
            assert!((it.slowness() - slowness).abs() < 1e-9, "{frame_s}");
        }
    }

    #[test]
    fn a_busy_machine_is_called_so_with_its_numbers() {
        let text = machine(9.25, 1.0).text();
        for words in [
            "busy (load 9.2 on 2 cores)",
            "1000 ms",
            "0.5 frames",
            "10.0 times",
        ] {
            assert!(text.contains(words), "{words}: {text}");
        }
        let text = machine(0.5, 0.05).text();
        assert!(
            !text.contains("busy") && !text.contains("instead"),
            "{text}"
        );
    }

    #[test]
    fn the_slower_of_two_measurements_counts() {
        let (fast, slow) = (machine(0.0, 0.1), machine(3.0, 0.4));
        assert_eq!(fast.slower(slow), slow);
        assert_eq!(slow.slower(fast), slow);
    }
}
