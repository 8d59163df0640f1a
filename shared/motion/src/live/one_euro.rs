//! The one-euro filter (Casiez, Roussel & Vogel 2012): a low-pass filter whose cutoff rises with the speed.

use core::f64::consts::PI;

use nalgebra::Vector3;

use crate::track::{Absent, Estimate, Measured, Smoothed, State, usable};

/// Its numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OneEuro {
    /// Cutoff at rest, Hz.
    pub min_cutoff_hz: f64,
    /// By how much the cutoff rises with the speed, Hz per m/s.
    pub beta: f64,
    /// Cutoff for the speed itself, Hz.
    pub speed_cutoff_hz: f64,
}

impl Default for OneEuro {
    /// The cutoffs are the authors'; with this `beta` a hand at 1 m/s is passed up to 5 Hz.
    fn default() -> Self {
        Self {
            min_cutoff_hz: 1.0,
            beta: 4.0,
            speed_cutoff_hz: 1.0,
        }
    }
}

/// The filter of one joint. The speed is that of the point in space, so that the result does not depend on the axes.
#[derive(Debug)]
pub(super) struct Filter {
    settings: OneEuro,
    last: Option<Last>,
}

#[derive(Debug, Clone, Copy)]
struct Last {
    time_s: f64,
    position: Vector3<f64>,
    velocity: Vector3<f64>,
}

impl Filter {
    pub(super) fn new(settings: OneEuro) -> Self {
        Self {
            settings,
            last: None,
        }
    }

    /// * Returns the position, held where nothing was measured; and the delay of slow movement, seconds.
    pub(super) fn step(
        &mut self,
        time_s: f64,
        measured: Option<&Measured>,
        fill_s: f64,
    ) -> (Smoothed, Option<f64>) {
        let Some((position, _)) = measured.and_then(usable) else {
            let held = self
                .last
                .filter(|it| (0.0..=fill_s).contains(&(time_s - it.time_s)));
            let estimate = |it: Last| estimate(it.position, State::Filled);
            return (held.map(estimate).ok_or(Absent::Gap), None);
        };
        let is_usable = |it: &Last| time_s > it.time_s && time_s - it.time_s <= fill_s.max(1.0);
        let Some(last) = self.last.filter(is_usable) else {
            let velocity = Vector3::zeros();
            self.last = Some(Last {
                time_s,
                position,
                velocity,
            });
            return (Ok(estimate(position, State::Measured)), None);
        };
        let dt = time_s - last.time_s;
        let raw = (position - last.position) / dt;
        let velocity = last
            .velocity
            .lerp(&raw, share(self.settings.speed_cutoff_hz, dt));
        let cutoff_hz = self.settings.min_cutoff_hz + self.settings.beta * velocity.norm();
        let share = share(cutoff_hz, dt);
        let position = last.position.lerp(&position, share);
        self.last = Some(Last {
            time_s,
            position,
            velocity,
        });
        let delay_s = dt * (1.0 - share) / share;
        (Ok(estimate(position, State::Measured)), Some(delay_s))
    }
}

/// The share of a new value in exponential smoothing with a cutoff.
fn share(cutoff_hz: f64, dt: f64) -> f64 {
    let tau = 1.0 / (2.0 * PI * cutoff_hz);
    1.0 / (1.0 + tau / dt)
}

fn estimate(position: Vector3<f64>, state: State) -> Estimate {
    Estimate {
        position,
        covariance: None,
        state,
    }
}
