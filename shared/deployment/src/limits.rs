//! Checks that every number of a deployment file is in its range, and reports doubtful numbers.

use crate::complaint::{Complaint, between, demand, whole};
use crate::{Deployment, Runtime, capture, paper};

/// Checks every number against the range of its key.
pub(super) fn check(it: &Deployment) -> Result<(), Complaint> {
    if let Some([x, y, z]) = it.up {
        let length = (x * x + y * y + z * z).sqrt();
        demand(
            length.is_finite() && length > 1e-9,
            "up",
            &format!("[{x}, {y}, {z}]"),
            "a direction, which is three numbers that are not all 0",
        )?;
    }
    for camera in &it.cameras {
        between("camera.offset_ms", camera.offset_ms.unwrap_or(0.0))?;
        between("camera.drift_ppm", camera.drift_ppm.unwrap_or(0.0))?;
    }
    capture(&it.capture)?;
    between("network.least_heat", it.network.least_heat)?;
    between("network.looks", it.network.looks.unwrap_or(1.0))?;
    supervise(it)
}

/// Checks the numbers of the energy between views.
pub(super) fn energy(config: &paper::Config) -> Result<(), Complaint> {
    between("paper.alpha", config.alpha.unwrap_or(0.0))?;
    between("paper.beta", config.beta.unwrap_or(0.0))?;
    for &tau in config.tau.given() {
        between("paper.tau", f64::from(tau))?;
    }
    Ok(())
}

fn capture(it: &capture::Config) -> Result<(), Complaint> {
    if let Some(scale) = it.scale {
        between("capture.scale", scale)?;
    }
    if let Some(rate) = it.frame_rate_hz {
        between("capture.frame_rate_hz", rate)?;
    }
    whole("capture.start_frame", it.start_frame)?;
    whole("capture.frame_step", it.frame_step)?;
    let n_frames = it.n_frames.unwrap_or(1);
    whole("capture.n_frames", n_frames)
}

fn supervise(deployment: &Deployment) -> Result<(), Complaint> {
    let it = &deployment.supervise;
    let deadline = it.deadline_ms.unwrap_or(1);
    whole("supervise.deadline_ms", deadline)?;
    let hang = it.hang_limit_s.unwrap_or(1);
    whole("supervise.hang_limit_s", hang)?;
    whole("supervise.max_restarts", it.max_restarts)?;
    if let Some(budget) = it.latency_budget_ms {
        between("supervise.latency_budget_ms", budget)?;
    }
    Ok(())
}

impl Deployment {
    /// Returns warnings about settings that are allowed but probably not intended, each with its value and a suggestion.
    ///
    /// * `n_cores`: number of cores of the machine, if known.
    pub fn doubts(&self, n_cores: Option<usize>) -> Vec<String> {
        let mut doubts = Vec::new();
        let is_lossless = self.capture.mode.is_lossless();
        let deadline_ms = self.deadline_ms();
        if is_lossless && deadline_ms < 1000 {
            doubts.push(format!(
                "`supervise.deadline_ms` is {deadline_ms}, although `capture.mode` is \"lossless\": a view whose frame takes longer is \
                 left out of the result; the usual value \
                 is 10000"
            ));
        }
        let hang_limit_s = self.hang_limit_s();
        if is_lossless && hang_limit_s < 10 {
            doubts.push(format!(
                "`supervise.hang_limit_s` is {hang_limit_s}: a process that spends more time on one frame is killed; 120 is usual"
            ));
        }
        if let Some(rate) = self
            .capture
            .frame_rate_hz
            .filter(|frame_rate_hz| !(1.0..=1000.0).contains(frame_rate_hz))
        {
            doubts.push(format!(
                "`capture.frame_rate_hz` is {rate} frames per second, but cameras usually have 1 to 1000"
            ));
        }
        let threads = self.runtime.threads;
        let cores = n_cores.unwrap_or(usize::MAX);
        if threads > cores.saturating_mul(4) {
            doubts.push(format!(
                "`runtime.threads` is {threads} for every pose process, but the machine has only {cores} cores"
            ));
        }
        doubts.extend(self.runtime.doubts());
        doubts
    }
}

impl Runtime {
    fn doubts(&self) -> Vec<String> {
        let high = self.priority.iter().filter(|priority| *priority.1 == 99);
        let said = high.map(|(name, _)| {
            format!(
                "`runtime.priority` of {name} is 99, which is above the priority of the system's own threads; use at most 98"
            )
        });
        said.collect()
    }
}

#[cfg(test)]
mod tests;
