//! Deployments of several hosts: chooses the host of this machine, computes the fingerprint that all hosts must share, and prepares the
//! settings of the bridge.

use std::path::{Path, PathBuf};

use bridge::hosts::Fingerprint;
use bridge::{Address, KeyFiles, NearHost, ViewMaps};
use deployment::hosts::{Carry, Host};
use deployment::paper::Errors;
use deployment::{Deployment, network};
use failure::{ExitKind, Failure, OrFail as _};
use messages::topic;

use crate::prepare::{Prepared, View};
use crate::resolved::Resolved;

/// Uncertainty of another host's clock above which a warning is logged, as a fraction of the time between two frames.
const MAX_CLOCK_SHARE: f64 = 0.1;

/// Returns the host that runs on this machine: the host named by the user, or the host with the name of the machine. Returns `None` for a
/// deployment without hosts.
///
/// * `machine`: the name of the machine.
///
/// # Errors
///
/// Fails if there is no such host, or this build does not support hosts.
pub fn choose<'a>(
    deployment: &'a Deployment,
    named: Option<&str>,
    machine: &str,
) -> Result<Option<&'a Host>, Failure> {
    if deployment.hosts.is_empty() {
        return match named {
            None => Ok(None),
            Some(name) => {
                let message = format!("--host {name}: the deployment has no [[host]]");
                Err(Failure::new(ExitKind::Usage, message))
            }
        };
    }
    let known: Vec<&str> = deployment.hosts.iter().map(|host| host.name.as_str()).collect();
    let short = machine.split('.').next().unwrap_or(machine);
    let name = named.unwrap_or(short);
    let Some(host) = deployment.host(name) else {
        let message = format!(
            "{name:?} is not one of the hosts of the deployment: {}",
            known.join(", ")
        );
        let failure = Failure::new(ExitKind::Usage, message);
        return Err(failure.with_hint("pass --host NAME to say which host this machine is"));
    };
    let has_keypoints = deployment.cameras.iter().find(|camera| camera.keypoints.is_some());
    if let Some(camera) = has_keypoints {
        let message = format!(
            "camera {:?} has `keypoints`, which a deployment with hosts cannot use: keypoint files only work on one machine",
            camera.name
        );
        return Err(Failure::new(ExitKind::Config, message));
    }
    if !bridge::HAS_LINK {
        let failure = Failure::new(ExitKind::Usage, "this build does not support hosts");
        return Err(failure.with_hint("build it with `cargo build --release --features hosts`"));
    }
    Ok(Some(host))
}

/// Returns the address to which a host connects, or on which it listens, with the host's key.
///
/// # Errors
///
/// Fails if a key is missing.
pub fn address(deployment: &Deployment, host: &Host) -> Result<Address, Failure> {
    let fusing = deployment.fusing_host().and_then(|fusing_host| fusing_host.address.clone());
    let keys = match &deployment.link.keys {
        Some(folder) if !deployment.link.insecure => {
            Some(KeyFiles::find(folder, &host.name).map_err(|error| {
                let failure = Failure::new(ExitKind::Input, error);
                failure.with_hint("`parallax hosts keys FILE` creates the keys; every host needs ca.pem and its own two files")
            })?)
        }
        _ => None,
    };
    Ok(Address {
        deployment: deployment.name.clone(),
        host: host.name.clone(),
        hosts: deployment.hosts.iter().map(|host| host.name.clone()).collect(),
        address: fusing.unwrap_or_default(),
        listens: host.fuses,
        keys,
    })
}

/// Returns the fingerprint that must be the same on all hosts. It covers the files and settings on which results depend.
///
/// # Errors
///
/// Fails if a file cannot be read.
pub fn fingerprint(deployment: &Deployment) -> Result<Fingerprint, Failure> {
    let mut all = Fingerprint::default();
    all.add_text("version of Parallax", env!("CARGO_PKG_VERSION"));
    all.add("rig", &read(&deployment.rig)?);
    let config = &deployment.network;
    let mut files: Vec<(&str, &Path)> = Vec::new();
    let settings = if deployment.has_maps() {
        let networks = deployment.pose_networks().into_iter();
        files.extend(networks.map(|file| ("network.file", file)));
        files.push(("network.detector", &config.detector));
        serde_json::to_vec(&without_files(config))
    } else {
        let paper = &deployment.paper;
        all.add("paper.model", &inputs::model_bytes(paper.model.as_deref())?);
        let errors = paper.errors.as_ref();
        let network = errors.and_then(Errors::network);
        files.extend(network.map(|file| ("paper.errors", file.as_path())));
        serde_json::to_vec(&(paper.search, paper.candidates))
    };
    for (what, file) in files {
        if deployment::is_shipped(file) {
            all.add_text(what, "shipped");
            continue;
        }
        all.add(what, &read(file)?);
        if let Some(card) = inputs::card_beside(file) {
            all.add(&format!("the card of {what}"), &read(&card)?);
        }
    }
    all.add_text("method", deployment.method.name());
    if deployment.link.carry == Carry::Poses {
        all.add(deployment.method.name(), &settings.or_fail(ExitKind::Run)?);
    }
    let hosts = deployment.hosts.iter();
    let views: Vec<String> =
        hosts.map(|host| format!("{}: {}", host.name, host.views.join(" "))).collect();
    all.add("views of hosts", views.join("\n").as_bytes());
    let settings = serde_json::to_vec(&(
        &deployment.capture,
        &deployment.link.carry,
        &deployment.unit,
        deployment.up,
        deployment.cameras.iter().map(|camera| &camera.name).collect::<Vec<_>>(),
    ));
    all.add("capture", &settings.or_fail(ExitKind::Run)?);
    Ok(all)
}

/// Returns the settings on which the joints of a view depend, without file names, which may differ between hosts.
fn without_files(config: &network::Config) -> network::Config {
    network::Config {
        file: PathBuf::new(),
        detector: PathBuf::new(),
        onnx_runtime: None,
        ..config.clone()
    }
}

fn read(file: &Path) -> Result<Vec<u8>, Failure> {
    files::read(file, files::SETTINGS).map_err(|error| failure::in_file(file, &error))
}

/// Returns the part of a deployment that a host runs. A host with cameras gets its own name and output folder, so that it can run beside
/// other hosts on one machine.
pub fn part(deployment: &Deployment, host: &Host) -> Deployment {
    let mut part = deployment.clone();
    if !host.fuses {
        part.output = deployment.output.join(&host.name);
    }
    part
}

/// Returns the namespace of the shared memory of a host's processes.
pub(crate) fn namespace(resolved: &Resolved) -> String {
    let deployment = &resolved.deployment;
    match resolved.own_host().filter(|own_host| !own_host.fuses) {
        Some(host) => deployment.name_on(host),
        None => deployment.name.clone(),
    }
}

/// Returns the settings of the bridge.
pub(crate) fn job(resolved: &Resolved) -> Result<bridge::Job, Failure> {
    let deployment = &resolved.deployment;
    let host = resolved
        .own_host()
        .ok_or("the deployment has no host with this name")
        .or_fail(ExitKind::Config)?;
    let prepared = Prepared::new(resolved)?;
    let capture = &deployment.capture;
    let step = capture.frame_step.max(1);
    let rate_hz = capture.frame_rate_hz.unwrap_or(1.0) / step as f64;
    let sizes = prepared.views.iter().map(|view| view.framing.out_size());
    let role = if host.fuses {
        let topology = resolved.topology();
        let others = deployment.hosts.iter().filter(|host| !host.fuses);
        let topic = |view: usize| match deployment.link.carry {
            Carry::Frames => topic::frame(view),
            Carry::Poses => topic::sightings(view),
        };
        let views = 0..prepared.views.len();
        bridge::Role::Near(bridge::Near {
            hosts: others
                .map(|other| NearHost {
                    name: other.name.clone(),
                    views: deployment.views_of(other),
                })
                .collect(),
            n_frames: resolved.n_frames(),
            n_receivers: views.map(|view| topology.receivers_of(&topic(view))).collect(),
            patience: resolved.patience(),
            max_clock_share: MAX_CLOCK_SHARE,
            file: deployment.output.join("hosts.json"),
        })
    } else {
        bridge::Role::Far(bridge::Far {
            views: deployment.views_of(host),
            jpeg_quality: deployment.link.jpeg_quality,
        })
    };
    Ok(bridge::Job {
        address: address(deployment, host)?,
        fingerprint: fingerprint(deployment)?,
        carry: deployment.link.carry,
        has_quality: deployment.has_quality(),
        maps: if deployment.maps_cross() {
            let view_maps = |view: &View| ViewMaps {
                size: view.framing.out_size().map(|side| side as usize),
                longest: pipeline::most_values(deployment.network.people),
            };
            prepared.views.iter().map(view_maps).collect()
        } else {
            Vec::new()
        },
        sizes: sizes.collect(),
        lead_nanos: crate::cameras::lead_nanos(deployment),
        period_nanos: 1e9 / rate_hz,
        start_frame: capture.start_frame,
        frame_step: step,
        role,
    })
}

#[cfg(test)]
mod tests {
    use deployment::{AnyMachine, Loaded};

    use super::*;

    fn deployment(hosts: &str) -> Deployment {
        let text = format!(
            "name = 'a'\nrig = 'r'\noutput = '/o'\n\
             [[camera]]\nname = 'c0'\nsource = 's'\n[[camera]]\nname = 'c1'\nsource = 's'\n\
             [capture]\nmode = 'realtime'\nframe_rate_hz = 5.0\n{hosts}"
        );
        let loaded = Loaded::parse(&text, Path::new("d.toml"), &[], &AnyMachine);
        loaded.unwrap().deployment
    }

    const HOSTS: &str = "[link]\ninsecure = true\n\
        [[host]]\nname = 'desk'\nfuses = true\naddress = 'x:1'\nviews = ['c0']\n[[host]]\nname = 'far'\nviews = ['c1']\n";

    #[test]
    fn a_deployment_without_hosts_ignores_the_name_of_the_machine() {
        let it = deployment("");
        assert_eq!(choose(&it, None, "far").unwrap(), None);
        let error = choose(&it, Some("far"), "far").unwrap_err();
        assert!(error.to_string().contains("no [[host]]"), "{error}");
    }

    #[test]
    fn the_host_is_the_named_one_or_this_machine() {
        let it = deployment(HOSTS);
        if bridge::HAS_LINK {
            let chosen =
                |named, machine| choose(&it, named, machine).unwrap().unwrap().name.clone();
            assert_eq!(chosen(None, "far.example.org"), "far");
            assert_eq!(chosen(Some("desk"), "far"), "desk");
        } else {
            let error = choose(&it, Some("desk"), "far").unwrap_err();
            assert!(
                error.to_string().contains("does not support hosts"),
                "{error}"
            );
        }
        let error = choose(&it, None, "laptop").unwrap_err();
        assert!(error.to_string().contains("desk, far"), "{error}");
    }

    #[test]
    fn a_host_with_cameras_has_its_own_folder() {
        let it = deployment(HOSTS);
        assert_eq!(part(&it, &it.hosts[0]), it);
        assert_eq!(part(&it, &it.hosts[1]).output, Path::new("/o/far"));
    }
}
