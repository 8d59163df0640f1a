//! Assignment of a camera's frames to common instants.

use serde::{Deserialize, Serialize};

use crate::Deployment;

/// Clock and frame rate of one camera's footage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OwnClock {
    /// Frames per second, by the camera's own clock.
    pub rate_hz: f64,
    /// Offset to add to the camera's time at its first frame, in seconds.
    pub offset_s: f64,
    /// Amount by which a second of the camera's clock is too long, as a fraction.
    pub drift: f64,
}

/// Assignment of a camera's frames to common instants: each instant is assigned the frame nearest in time.
///
/// Instants are counted from 0. Instant 0 is the time of the first frame of the footage that begins last. The interval between instants
/// equals the interval between frames of the slowest camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Timeline {
    /// Frames per second, by the camera's own clock.
    rate_hz: f64,
    /// Instants per second.
    instants_hz: f64,
    /// Time of instant 0 by the camera's own clock, in seconds.
    first_s: f64,
    /// Seconds of the camera's clock per second of the common clock.
    pace: f64,
}

impl Timeline {
    /// Returns the timelines of all cameras.
    pub fn all(clocks: &[OwnClock]) -> Vec<Self> {
        let begin = clocks.iter().map(|clock| clock.offset_s);
        let begin = begin.fold(f64::NEG_INFINITY, f64::max);
        let rates = clocks.iter().map(|clock| clock.rate_hz / (1.0 + clock.drift));
        let instants_hz = rates.fold(f64::INFINITY, f64::min);
        let of_camera = |own_clock: &OwnClock| Self {
            rate_hz: own_clock.rate_hz,
            instants_hz,
            first_s: (begin - own_clock.offset_s) / (1.0 + own_clock.drift),
            pace: 1.0 / (1.0 + own_clock.drift),
        };
        clocks.iter().map(of_camera).collect()
    }

    /// Returns the number of instants per second.
    pub fn instants_hz(&self) -> f64 {
        self.instants_hz
    }

    /// Returns the frame of the footage that is nearest to an instant.
    pub fn frame(&self, instant: u64) -> u64 {
        // The frame is never negative, because instant 0 is at the first frame or after it.
        (self.own_s(instant) * self.rate_hz).round().max(0.0) as u64
    }

    /// Returns the time from the instant to its nearest frame, in nanoseconds; negative if the frame is earlier.
    pub fn rest_nanos(&self, instant: u64) -> i64 {
        let taken_s = self.frame(instant) as f64 / self.rate_hz;
        ((taken_s - self.own_s(instant)) / self.pace * 1e9).round() as i64
    }

    /// Returns the number of instants in footage with a given number of frames.
    pub fn n_instants(&self, n_frames: u64) -> u64 {
        let end_s = n_frames as f64 / self.rate_hz - self.first_s;
        let mut n = (end_s / self.pace * self.instants_hz).ceil().max(0.0) as u64;
        while n > 0 && self.frame(n - 1) >= n_frames {
            n -= 1;
        }
        while self.frame(n) < n_frames && n < n_frames {
            n += 1;
        }
        n
    }

    fn own_s(&self, instant: u64) -> f64 {
        self.first_s + self.pace * instant as f64 / self.instants_hz
    }
}

impl Deployment {
    /// Returns true if the footage of any camera has an offset or a drift, so that frames must be assigned to common instants.
    pub fn has_clocks(&self) -> bool {
        let mut cameras = self.cameras.iter();
        cameras.any(|camera| {
            camera.offset_ms.is_some() || camera.drift_ppm.is_some_and(|drift_ppm| drift_ppm != 0.0)
        })
    }

    /// Returns the clock of a camera's footage.
    ///
    /// * `rate_hz`: frames per second of the footage.
    pub fn clock(&self, camera: usize, rate_hz: f64) -> OwnClock {
        let it = &self.cameras[camera];
        OwnClock {
            rate_hz,
            offset_s: it.offset_ms.unwrap_or(0.0) * 1e-3,
            drift: it.drift_ppm.unwrap_or(0.0) * 1e-6,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clock(rate_hz: f64, offset_s: f64, drift: f64) -> OwnClock {
        OwnClock {
            rate_hz,
            offset_s,
            drift,
        }
    }

    #[test]
    fn synchronised_cameras_keep_their_frames() {
        for it in Timeline::all(&[clock(30.0, 0.0, 0.0), clock(30.0, 0.0, 0.0)]) {
            for instant in [0, 1, 29, 100_000] {
                assert_eq!((it.frame(instant), it.rest_nanos(instant)), (instant, 0));
            }
            assert_eq!(it.n_instants(70), 70);
        }
    }

    #[test]
    fn the_camera_that_started_first_skips_its_first_frames() {
        // The second camera started 0.34 s after the first: 10.2 frames.
        let all = Timeline::all(&[clock(30.0, 0.0, 0.0), clock(30.0, 0.34, 0.0)]);
        let [first, second] = [all[0], all[1]];
        assert_eq!((second.frame(0), second.rest_nanos(0)), (0, 0));
        assert_eq!((first.frame(0), first.rest_nanos(0)), (10, -6_666_667));
        assert_eq!([100, 5].map(|i| first.n_instants(i)), [90, 0]);
        assert_eq!(second.n_instants(100), 100);
    }

    #[test]
    fn every_instant_gets_the_nearest_frame_even_with_drift_and_different_rates() {
        let clocks = [
            clock(25.0, 0.0, 0.0),
            clock(30.0, -1.234, 2e-4),
            clock(60.0, 0.02, -1e-3),
        ];
        for (it, clock) in Timeline::all(&clocks).iter().zip(&clocks) {
            assert!((it.instants_hz() - 25.0).abs() < 1e-9);
            let half = 0.5e9 / clock.rate_hz * (1.0 + clock.drift) + 1.0;
            for instant in 0..5000 {
                let common_s = 0.02 + instant as f64 / 25.0;
                let own_s = it.frame(instant) as f64 / clock.rate_hz;
                let taken_s = own_s * (1.0 + clock.drift) + clock.offset_s;
                let rest = (taken_s - common_s) * 1e9;
                assert!((rest - it.rest_nanos(instant) as f64).abs() < 2.0);
                assert!(rest.abs() <= half, "{rest} of {half}");
            }
            let n = it.n_instants(3000);
            assert!(it.frame(n - 1) < 3000 && it.frame(n) >= 3000);
        }
    }
}
