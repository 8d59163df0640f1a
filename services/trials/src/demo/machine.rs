//! Measures the speed of this machine before and after the run: renders and processes frames in this process.

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

use crate::trial::synthetic::SyntheticDeployment;

/// Frames per second on a machine that is fast enough.
pub(super) const FULL_RATE_HZ: f64 = 5.0;

/// The least frame rate, frames per second.
const MIN_RATE_HZ: f64 = 0.25;

/// The share of the interval between two frames that computing may take. The rest is for the overhead of processes and
/// for changes of the load.
const SHARE: f64 = 0.5;

/// The duration of a measurement, which takes at least two frames.
const SPAN: Duration = Duration::from_secs(2);

/// Renders and processes frames of all cameras, as the processes of the run do.
pub(super) struct Gauge {
    views: Vec<View>,
    pictures: Vec<Vec<u8>>,
    estimator: Estimator,
}

impl Gauge {
    /// Prepares the scene and the estimator.
    pub(super) fn new(
        synthetic: &SyntheticDeployment,
        resolved: &Resolved,
    ) -> Result<Self, Failure> {
        let scene = Arc::new(Scene::new(&synthetic.settings).or_fail(ExitKind::Run)?);
        let views: Result<Vec<View>, _> = (0..synthetic.rig.cameras().len())
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

    /// Measures for about two seconds.
    pub(super) fn measure(&mut self) -> Result<Machine, Failure> {
        let load = load();
        let begin = Instant::now();
        let mut spans = Vec::new();
        // The first frame is a warm-up.
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

/// The measured speed of this machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Machine {
    /// The load average of the last minute, before the measurement.
    load: Option<f64>,
    n_cores: usize,
    n_cameras: usize,
    /// Median time for one frame of all cameras on all cores, seconds.
    frame_s: f64,
}

impl Machine {
    /// The frame rate of the cameras: at most `FULL_RATE_HZ`, and such that computing takes at most `SHARE` of the time.
    pub(super) fn rate_hz(&self) -> f64 {
        let most = SHARE / self.frame_s;
        // Rounded to two decimals, for display.
        let rounded = (100.0 * most).floor() / 100.0;
        rounded.clamp(MIN_RATE_HZ, FULL_RATE_HZ)
    }

    /// Computing time relative to a machine that is fast enough; at least 1.
    pub(super) fn slowness(&self) -> f64 {
        (FULL_RATE_HZ * self.frame_s / SHARE).max(1.0)
    }

    /// Interval of frames relative to a machine that is fast enough; 1 to 20.
    pub(super) fn spread(&self) -> f64 {
        FULL_RATE_HZ / self.rate_hz()
    }

    /// The slower of two measurements.
    pub(super) fn slower(self, other: Self) -> Self {
        if other.frame_s > self.frame_s {
            other
        } else {
            self
        }
    }

    /// The measurement and its consequences as text.
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

    /// The measurement as JSON.
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

/// The load average of the last minute.
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
    fn the_frame_rate_leaves_half_of_the_time() {
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
    fn a_busy_machine_is_reported_with_its_numbers() {
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
