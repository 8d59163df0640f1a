//! The device (processor or GPU) that searches frames: its choice for a run, and the GPU of a process.

use std::sync::{Arc, Mutex, PoisonError};

use deployment::{Deployment, Device};
use failure::{ExitKind, Failure, OrFail as _};
use gpu::{Choice, Kind, OpenError};
use pipeline::ViewStep;

/// The GPU of this process; `None` until the first view requests it.
static OPENED: Mutex<Option<Arc<gpu::Device>>> = Mutex::new(None);

/// Returns a line with the device of a run and the reason for its choice. Returns `None` if there is only one possible device.
///
/// # Errors
///
/// Fails if the deployment requires a GPU, but none can be used.
pub fn device(deployment: &Deployment) -> Result<Option<String>, Failure> {
    let asked = deployment.device;
    if !gpu::IS_BUILT && matches!(asked, Device::Auto | Device::Cpu) {
        return Ok(None);
    }
    if deployment.has_maps() {
        return by_networks(deployment);
    }
    let best = gpu::adapters().into_iter().next();
    let usable = match (asked, best) {
        (Device::Cpu, _) => return Ok(Some("device: cpu, as set in the deployment".to_owned())),
        _ if !gpu::IS_BUILT => Err(OpenError::NotBuilt),
        (_, None) => Err(OpenError::NoAdapter),
        (Device::Auto | Device::Gpu, Some(adapter)) if adapter.kind == Kind::Software => {
            Err(OpenError::OnlySoftware { name: adapter.name })
        }
        (_, Some(adapter)) => Ok(adapter),
    };
    match usable {
        Ok(adapter) => Ok(Some(format!("device: gpu for the filters, {adapter}"))),
        Err(error) if asked == Device::Auto => Ok(Some(format!("device: cpu, because {error}"))),
        Err(error) => Err(error).or_fail(ExitKind::Config),
    }
}

/// Like [`device`], for a deployment whose frames are searched by networks.
fn by_networks(deployment: &Deployment) -> Result<Option<String>, Failure> {
    if deployment.network.onnx_runtime.is_none() && deployment.device == Device::Gpu {
        let message = "device = \"gpu\": networks need ONNX Runtime to run on a GPU: set `network.onnx_runtime`, or `device = \"auto\"`";
        return Err(Failure::new(ExitKind::Config, message));
    }
    Ok(None)
}

/// Returns the step, set up for the device of its deployment.
///
/// # Errors
///
/// Fails if the deployment requires a GPU, but no GPU can run the step.
pub(crate) fn on_device(step: ViewStep, asked: Device) -> Result<ViewStep, Failure> {
    let choice = match asked {
        Device::Cpu => return Ok(step),
        Device::Auto if !gpu::IS_BUILT => return Ok(step),
        Device::Auto | Device::Gpu => Choice::Hardware,
        Device::Software => Choice::Any,
    };
    let must = asked != Device::Auto;
    let device = match opened(choice) {
        Ok(device) => device,
        Err(error) if must => return Err(error).or_fail(ExitKind::Config),
        Err(error) => {
            tracing::info!(%error, "the processor searches");
            return Ok(step);
        }
    };
    match step.on_gpu(&device) {
        Ok(step) => Ok(step),
        Err((_, error)) if must => Err(error).or_fail(ExitKind::Config),
        Err((step, error)) => {
            tracing::warn!(adapter = %device.adapter(), %error, "the processor searches");
            Ok(*step)
        }
    }
}

/// Returns the GPU of this process, and opens it if necessary.
fn opened(choice: Choice) -> Result<Arc<gpu::Device>, OpenError> {
    let mut opened = OPENED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(device) = &*opened {
        return Ok(Arc::clone(device));
    }
    let device = Arc::new(gpu::Device::open(choice)?);
    *opened = Some(Arc::clone(&device));
    Ok(device)
}
