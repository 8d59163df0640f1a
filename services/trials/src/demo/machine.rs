//! Measures the speed of this machine before and after the run, by rendering and processing frames in this process.

use std::sync::Arc;
use std::time::{Duration, Instant};

use failure::{ExitKind, Failure, OrFail as _};
use kernels::Rgb8View;
use launch::{FOLLOWED_S, Resolved, process};
use pipeline::{NetworkMemory, NetworkStep};
use rayon::prelude::*;
use scene::{Scene, View};
use serde_json::{Value, json};

use crate::trial::synthetic::SyntheticDeployment;

/// Frames per second on a machine that is fast enough.
pub(super) const FULL_RATE_HZ: f64 = 5.0;

/// Lowest frame rate, frames per second.
const MIN_RATE_HZ: f64 = 0.25;

/// Fraction of the interval between two frames that computing may use. The rest is left for the overhead of processes and for changes of
/// the load.
const SHARE: f64 = 0.5;

/// Number of times that the network is applied to a frame if the person was last seen long ago: to three boxes, and then to a box that fits
/// more closely. Otherwise, it is applied once.
const LOOKS: f64 = 4.0;

/// Duration of a measurement.
const SPAN: Duration = Duration::from_secs(2);

/// Smallest number of measured frames. It is so large that every camera searches for the person once.
const LEAST_FRAMES: u64 = 10;

/// Renders frames of all cameras and finds the person in them, like the processes of the run.
pub(super) struct Gauge {
    views: Vec<GaugedView>,
}

/// One camera.
struct GaugedView {
    view: View,
    picture: Vec<u8>,
    step: NetworkStep,
    memory: NetworkMemory,
}

impl Gauge {
    /// Prepares the scene and the network.
    ///
    /// * `resolved`: the deployment at [`FULL_RATE_HZ`].
    pub(super) fn new(
        synthetic: &SyntheticDeployment,
        resolved: &Resolved,
    ) -> Result<Self, Failure> {
        let scene = Arc::new(Scene::new(&synthetic.settings).or_fail(ExitKind::Run)?);
        let view = |camera: usize| {
            let view = View::new(&scene, camera).or_fail(ExitKind::Run)?;
            let step = process::network_step(resolved, camera)?
                .ok_or("the speed for the demo can only be measured with a network")
                .or_fail(ExitKind::Run)?;
            Ok(GaugedView {
                picture: vec![0; view.size().rgb_bytes()],
                view,
                step,
                memory: NetworkMemory::default(),
            })
        };
        let views = (0..synthetic.rig.cameras().len()).map(view);
        Ok(Self {
            views: views.collect::<Result<_, Failure>>()?,
        })
    }

    /// Measures the speed of this machine for about two seconds.
    pub(super) fn measure(&mut self) -> Result<Machine, Failure> {
        let load = load();
        // After a warm-up, the person is searched for again.
        self.frame(0)?;
        for view in &mut self.views {
            view.memory = NetworkMemory::default();
        }
        let searched = Instant::now();
        self.frame(1)?;
        let followed = Instant::now();
        let mut n_frames = 0;
        while n_frames < LEAST_FRAMES || followed.elapsed() < SPAN {
            n_frames += 1;
            self.frame(1 + n_frames)?;
        }
        Ok(Machine {
            load,
            n_cores: std::thread::available_parallelism().map_or(1, usize::from),
            n_cameras: self.views.len(),
            search_s: (followed - searched).as_secs_f64(),
            followed_s: followed.elapsed().as_secs_f64() / n_frames as f64,
        })
    }

    fn frame(&mut self, number: u64) -> Result<(), Failure> {
        let views = self.views.par_iter_mut();
        views.map(|view| view.frame(number)).collect()
    }
}

impl GaugedView {
    fn frame(&mut self, number: u64) -> Result<(), Failure> {
        self.view.picture(number, &mut self.picture);
        let size = self.view.size();
        let image = Rgb8View::new(size.width, size.height, &self.picture);
        let image = image.or_fail(ExitKind::Run)?;
        let looked = self.step.look(image, &mut self.memory);
        looked.or_fail(ExitKind::Run)?;
        self.step.sightings(&mut self.memory);
        Ok(())
    }
}

/// Measured speed of this machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Machine {
    /// Load average of the last minute, before the measurement.
    load: Option<f64>,
    n_cores: usize,
    n_cameras: usize,
    /// Time for a frame in which the person is searched for in the whole pictures of all cameras, on all cores, in seconds.
    search_s: f64,
    /// Mean time for one frame in which the person is followed from the previous frame, in seconds.
    followed_s: f64,
}

impl Machine {
    /// Returns the mean time for one frame of all cameras on all cores, in seconds. On a machine that is too slow to follow the person from
    /// frame to frame, the network is applied to more boxes in each frame: to boxes around the last one, and to a box that fits more
    /// closely.
    fn frame_s(&self) -> f64 {
        if self.followed_s <= SHARE * FOLLOWED_S {
            self.followed_s
        } else {
            self.search_s.clamp(self.followed_s, LOOKS * self.followed_s)
        }
    }

    /// Returns the frame rate of the cameras. It is at most `FULL_RATE_HZ`, and so low that computing takes at most the fraction `SHARE` of
    /// the time.
    pub(super) fn rate_hz(&self) -> f64 {
        let most = SHARE / self.frame_s();
        // Rounded to two decimals, for display.
        let rounded = (100.0 * most).floor() / 100.0;
        rounded.clamp(MIN_RATE_HZ, FULL_RATE_HZ)
    }

    /// Returns the computing time relative to a machine that is fast enough; at least 1.
    pub(super) fn slowness(&self) -> f64 {
        (FULL_RATE_HZ * self.frame_s() / SHARE).max(1.0)
    }

    /// Returns the interval between frames relative to a machine that is fast enough; 1 to 20.
    pub(super) fn spread(&self) -> f64 {
        FULL_RATE_HZ / self.rate_hz()
    }

    /// Returns the slower of two measurements.
    pub(super) fn slower(self, other: Self) -> Self {
        if other.frame_s() > self.frame_s() {
            other
        } else {
            self
        }
    }

    /// Describes the measurement and its consequences as text.
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
        let frame_ms = 1000.0 * self.frame_s();
        let text = format!(
            "{busy}a frame of {n_cameras} cameras takes {frame_ms:.0} ms on all {n_cores} cores"
        );
        if self.slowness() <= 1.0 {
            return text;
        }
        format!(
            "{text}, so the cameras take {} frames per second instead of {FULL_RATE_HZ}, the killed camera has {:.1} \
             times as long to come back, and a pause may be {:.1} times as long",
            self.rate_hz(),
            self.spread(),
            self.slowness()
        )
    }

    /// Returns the measurement as JSON.
    pub(super) fn json(&self) -> Value {
        json!({
            "load": self.load,
            "cores": self.n_cores,
            "frame_ms": 1000.0 * self.frame_s(),
            "rate_hz": self.rate_hz(),
            "slowness": self.slowness(),
            "spread": self.spread(),
        })
    }
}

/// Returns the load average of the last minute.
fn load() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/loadavg").ok()?;
    text.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn machine(load: f64, followed_s: f64) -> Machine {
        Machine {
            load: Some(load),
            n_cores: 2,
            n_cameras: 4,
            search_s: 3.0 * followed_s,
            followed_s,
        }
    }

    #[test]
    fn the_frame_rate_leaves_half_of_the_time() {
        for (followed_s, rate_hz, slowness) in [
            (0.02, 5.0, 1.0),
            (0.1, 5.0, 1.0),
            (0.2, 2.5, 2.0),
            // At this rate, the person can no longer be followed from frame to frame.
            (0.3, 0.55, 9.0),
            (0.5, 0.33, 15.0),
            (4.0, 0.25, 120.0),
        ] {
            let it = machine(0.0, followed_s);
            assert_eq!(it.rate_hz(), rate_hz, "{followed_s}");
            assert!((it.slowness() - slowness).abs() < 1e-9, "{followed_s}");
        }
    }

    #[test]
    fn a_busy_machine_is_reported_with_its_numbers() {
        let text = machine(9.25, 1.0 / 3.0).text();
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
