//! Networks that find keypoints, and detectors of people.

use std::path::Path;

use crate::library::Library;
use crate::network::NetworkFile;
use deployment::network::Config;
use deployment::{Deployment, Device, is_shipped};
use failure::{ExitKind, Failure};
use inference::{Place, Provider, RunBy};
use keypoints::Card;
use posenetwork::{Detector, PoseNetwork};

use crate::shipped::Shipped;

/// Loads the network of a camera, if it has one, and runs it once as a test.
///
/// # Errors
///
/// Fails if a file cannot be read, is not a runnable network or not a card, or if the two do not fit.
pub fn pose_network(
    deployment: &Deployment,
    camera: usize,
) -> Result<Option<PoseNetwork>, Failure> {
    let Some(file) = deployment.pose_network(camera) else {
        return Ok(None);
    };
    let library = library(&deployment.network, deployment.device)?;
    let network = open_network((file, None), &library)?;
    match network.run_by() {
        RunBy::OnnxRuntime(place @ Place::ProcessorForCuda(_)) => {
            tracing::warn!(network = %file.display(), "ONNX Runtime runs the network on {place}");
        }
        by => tracing::info!(network = %file.display(), "the network is run by {by}"),
    }
    let network = network.fitted()?;
    if deployment.network.mirror {
        return mirrored(network, "network.mirror").map(Some);
    }
    Ok(Some(network))
}

/// Returns the same network, changed to also use mirror images.
///
/// * `asked`: the setting or option that requests mirror images.
///
/// # Errors
///
/// Fails with [`ExitKind::Config`] if the network cannot use mirror images.
pub fn mirrored(network: PoseNetwork, asked: &str) -> Result<PoseNetwork, Failure> {
    let name = network.card().name.clone();
    network.mirrored().map_err(|error| {
        let message = format!("{asked}: {name}: {error}");
        Failure::new(ExitKind::Config, message)
    })
}

/// Reads a network that finds keypoints, and its card; `shipped` means the shipped network.
///
/// * `card`: file of the card, if it is not beside the network.
///
/// # Errors
///
/// Fails if a file cannot be read, is not a runnable network, or is not a card.
pub fn open_network(
    (file, card): (&Path, Option<&Path>),
    library: &Library,
) -> Result<NetworkFile, Failure> {
    if is_shipped(file) {
        let shipped = Shipped::PoseNetwork;
        return NetworkFile::built_in(&shipped.name(), shipped.bytes(), library);
    }
    NetworkFile::open_with(file, card, library)
}

/// Returns the card of a camera's network; `None` if there is no network or no card.
///
/// # Errors
///
/// Fails if the network or its card cannot be read.
pub fn network_card(deployment: &Deployment, camera: usize) -> Result<Option<Card>, Failure> {
    let Some(file) = deployment.pose_network(camera) else {
        return Ok(None);
    };
    let network = open_network(
        (file, None),
        &library(&deployment.network, deployment.device)?,
    )?;
    Ok(network.card().map(|card| card.0.clone()))
}

/// Loads the detector of a deployment, and runs it once as a test.
///
/// # Errors
///
/// Fails like [`pose_network`].
pub fn detector(deployment: &Deployment) -> Result<Detector, Failure> {
    let config = &deployment.network;
    let library = library(config, deployment.device)?;
    crate::detector::open_with(&config.detector, None, &library)
}

/// Loads every network of a deployment once, to check that each network matches its card.
///
/// # Errors
///
/// Fails like [`pose_network`].
pub fn check_maps(deployment: &Deployment) -> Result<(), Failure> {
    let mut known = Vec::new();
    for camera in 0..deployment.cameras.len() {
        let named = deployment.pose_network(camera);
        if named.is_some() && !known.contains(&named) {
            pose_network(deployment, camera)?;
            known.push(named);
        }
    }
    if !known.is_empty() {
        detector(deployment)?;
    }
    Ok(())
}

fn library(config: &Config, device: Device) -> Result<Library, Failure> {
    let provider = match device {
        Device::Auto => Provider::CudaIfItStarts,
        Device::Gpu => Provider::Cuda,
        Device::Cpu | Device::Software => Provider::Processor,
    };
    let file = config.onnx_runtime.as_deref();
    file.map_or(Ok(Library::BuiltIn), |file| Library::load(file, provider))
}
