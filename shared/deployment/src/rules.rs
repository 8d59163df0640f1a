//! Conditions that a deployment must meet before anything starts.

use crate::complaint::{Complaint, demand, not_negative, positive, whole};
use crate::method::MOST_AT_ONCE;
use crate::topology::{process_name, services};
use crate::{Deployment, Views, capture, hosts, limits, network, paper, slips};

/// Checks the values that the types alone do not check.
pub(super) fn check(it: &Deployment) -> Result<(), Complaint> {
    name(&it.name)?;
    if let Some(unit) = &it.unit {
        demand(
            unit.parse::<geometry::files::Unit>().is_ok(),
            "unit",
            &format!("{unit:?}"),
            "\"m\", \"cm\", \"mm\", \"ft\", \"in\", or a length such as \"30mm\" (the side of a square of the board)",
        )?;
    }
    for (key, path) in [("rig", &it.rig), ("output", &it.output)] {
        is_path(key, &path.to_string_lossy())?;
    }
    cameras(it)?;
    capture(&it.capture)?;
    network(&it.network)?;
    paper(it)?;
    let joints = &it.person.joints;
    let known = skeleton::JointSet::ALL.map(|set| set.name).join(", ");
    demand(
        skeleton::JointSet::by_name(joints).is_some(),
        "person.joints",
        joints,
        &format!("one of {known}"),
    )?;
    if let Some(budget) = it.supervise.latency_budget_ms {
        positive("supervise.latency_budget_ms", budget)?;
    }
    whole("supervise.missed_beats", it.supervise.missed_beats)?;
    whole("runtime.threads", it.runtime.threads)?;
    runtime(it)?;
    hosts::check(it)?;
    limits::check(it)
}

fn name(name: &str) -> Result<(), Complaint> {
    let good =
        |letter: char| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '-';
    demand(
        (1..=32).contains(&name.len()) && name.chars().all(good),
        "name",
        &format!("{name:?}"),
        "a name of 1 to 32 lower-case letters, digits and hyphens",
    )
}

fn cameras(it: &Deployment) -> Result<(), Complaint> {
    let n = it.cameras.len();
    whole("camera", n)?;
    for (index, camera) in it.cameras.iter().enumerate() {
        let twin = it.cameras[..index].iter().any(|other| other.name == camera.name);
        demand(
            !twin,
            "camera",
            &format!("twice {:?}", camera.name),
            "a different name for each camera",
        )?;
        demand(
            geometry::is_plain_name(&camera.name),
            "camera.name",
            &format!("{:?}", camera.name),
            geometry::PLAIN_NAME,
        )?;
        pictures(camera)?;
        eyes(camera)?;
        let skew_ms = camera.skew_ms.unwrap_or(0.0);
        demand(
            (-1000.0..=1000.0).contains(&skew_ms),
            "camera.skew_ms",
            &skew_ms.to_string(),
            "-1000 to 1000 ms; usual values are at most half the time between two frames",
        )?;
    }
    Ok(())
}

/// Checks that a path has no control characters, which a backslash produces in double quotes.
fn is_path(key: &str, path: &str) -> Result<(), Complaint> {
    demand(
        !path.chars().any(char::is_control),
        key,
        &format!("{path:?}"),
        &format!("a path without special characters: {}", slips::ESCAPE),
    )
}

/// Checks the input of a camera: footage, keypoints, or both.
fn pictures(camera: &capture::Camera) -> Result<(), Complaint> {
    demand(
        !camera.source.is_empty() || camera.keypoints.is_some(),
        "camera.source",
        &format!("missing for camera {:?}", camera.name),
        "footage, because every [[camera]] needs a `source`, or `keypoints` from another program",
    )?;
    is_path("camera.source", &camera.source)?;
    if let Some(capture::Rotate::Degrees(degrees)) = camera.rotate {
        demand(
            degrees % 90 == 0 && degrees < 360,
            "camera.rotate",
            &degrees.to_string(),
            "a rotation to the right of 0, 90, 180 or 270 degrees, or \"tag\"",
        )?;
    }
    if let Some([_, step]) = camera.numbers {
        let expected = "[first, step], where the step is at least 1";
        demand(step > 0, "camera.numbers", &step.to_string(), expected)?;
    }
    let Some(names) = &camera.keypoint_names else {
        return Ok(());
    };
    demand(
        camera.keypoints.is_some(),
        "camera.keypoint_names",
        &format!("given for camera {:?}", camera.name),
        "no value, because this camera has no `keypoints`",
    )?;
    let known = keypoints::files::NameSet::known_sets();
    demand(
        known.contains(&names.as_str()),
        "camera.keypoint_names",
        &format!("{names:?}"),
        &format!("one of {}", known.join(", ")),
    )
}

fn capture(it: &capture::Config) -> Result<(), Complaint> {
    demand(
        it.size.is_none() || it.scale.is_none(),
        "capture.scale",
        "given together with `capture.size`",
        "only one of `capture.scale` and `capture.size`",
    )?;
    if let Some([width, height]) = it.size {
        whole("capture.size", width)?;
        whole("capture.size", height)?;
    }
    if let Some(scale) = it.scale {
        positive("capture.scale", scale)?;
        demand(
            scale <= 8.0,
            "capture.scale",
            &scale.to_string(),
            "at most 8",
        )?;
    }
    if let Some(rate) = it.frame_rate_hz {
        positive("capture.frame_rate_hz", rate)?;
    }
    demand(it.frame_step > 0, "capture.frame_step", "0", "at least 1")
}

fn network(config: &network::Config) -> Result<(), Complaint> {
    if let Some(n) = config.find_every {
        whole("network.find_every", n)?;
    }
    whole("network.people", config.people)
}

/// Checks that a camera does not have both a network of its own and keypoints.
fn eyes(camera: &capture::Camera) -> Result<(), Complaint> {
    demand(
        camera.network.is_none() || camera.keypoints.is_none(),
        "camera.network",
        &format!("given for {:?} together with `keypoints`", camera.name),
        "only one of `network` and `keypoints`",
    )
}

/// Checks the numbers of the energy between views. An evaluation also reads them from a file of its own.
///
/// # Errors
///
/// Returns a complaint about the first number that is not allowed.
pub fn energy_numbers(config: &paper::Config) -> Result<(), Complaint> {
    whole("paper.workers", config.workers)?;
    not_negative("paper.alpha", config.alpha.unwrap_or(0.0))?;
    not_negative("paper.beta", config.beta.unwrap_or(0.0))?;
    for &tau in config.tau.given() {
        not_negative("paper.tau", f64::from(tau))?;
    }
    limits::energy(config)
}

fn paper(deployment: &Deployment) -> Result<(), Complaint> {
    let config = &deployment.paper;
    whole("paper.candidates", config.candidates)?;
    energy_numbers(config)?;
    errors(deployment)?;
    all_views(deployment)?;
    let needs_file = config.tau == paper::Tau::Named(paper::TauName::Learned);
    demand(
        !needs_file || config.consistency.is_some(),
        "paper.tau",
        "\"learned\"",
        "numbers as thresholds, or a file with thresholds in `paper.consistency`",
    )?;
    let tables = config.compatibility.iter();
    let tables = tables.map(|tables| ("paper.compatibility", &tables.views));
    let pairs = config.pairs.iter().map(|pair| ("paper.pairs", pair));
    for (key, names) in tables.chain(pairs) {
        for name in names {
            camera_named(deployment, key, name)?;
        }
        demand(
            names[0] != names[1],
            key,
            &format!("{:?} twice", names[0]),
            "two different cameras",
        )?;
    }
    Ok(())
}

fn camera_named(deployment: &Deployment, key: &str, name: &str) -> Result<(), Complaint> {
    demand(
        deployment.cameras.iter().any(|camera| camera.name == name),
        key,
        &format!("{name:?}"),
        "the name of a [[camera]] of this file",
    )
}

fn errors(deployment: &Deployment) -> Result<(), Complaint> {
    const MOST_FRAMES: i64 = 1_000_000_000_000;
    let errors = deployment.paper.errors.as_ref();
    let Some(table) = errors.and_then(paper::Errors::table) else {
        return Ok(());
    };
    for name in table.views.keys() {
        camera_named(deployment, "paper.errors.views", name)?;
    }
    demand(
        (-MOST_FRAMES..=MOST_FRAMES).contains(&table.frame_offset),
        "paper.errors.frame_offset",
        &table.frame_offset.to_string(),
        &format!("-{MOST_FRAMES} to {MOST_FRAMES}"),
    )?;
    demand(
        (1..=1_000_000).contains(&table.frame_step),
        "paper.errors.frame_step",
        &table.frame_step.to_string(),
        "1 to 1000000",
    )
}

/// Refuses settings that have no meaning if all views are solved at once.
fn all_views(deployment: &Deployment) -> Result<(), Complaint> {
    let config = &deployment.paper;
    if deployment.views() != Views::All {
        return Ok(());
    }
    let n_views = deployment.cameras.len();
    demand(
        n_views <= MOST_AT_ONCE,
        "paper.views",
        &format!("\"all\" of {n_views} cameras"),
        &format!("\"pairs\", or at most {MOST_AT_ONCE} cameras for \"all\""),
    )?;
    demand(
        config.energy == paper::Energy::Paper,
        "paper.energy",
        "\"released\"",
        "\"paper\", because `paper.views = \"all\"` works only with this energy",
    )?;
    demand(
        config.pairs.is_empty(),
        "paper.pairs",
        "given",
        "no pairs, because `paper.views` is \"all\"",
    )?;
    demand(
        config.combine == paper::Combine::Mean,
        "paper.combine",
        "\"consensus\"",
        "\"mean\", because if `paper.views` is \"all\", there are no results of pairs to combine",
    )
}

fn runtime(deployment: &Deployment) -> Result<(), Complaint> {
    let it = &deployment.runtime;
    for (name, cores) in &it.cores {
        is_process(deployment, "runtime.cores", name)?;
        demand(
            !cores.is_empty(),
            "runtime.cores",
            &format!("empty for {name:?}"),
            "at least one core",
        )?;
        for &core in cores {
            whole("runtime.cores", core)?;
        }
    }
    for (name, &priority) in &it.priority {
        is_process(deployment, "runtime.priority", name)?;
        whole("runtime.priority", priority)?;
    }
    Ok(())
}

/// Checks that a name is the name of a service or of a process of the deployment.
fn is_process(deployment: &Deployment, key: &str, name: &str) -> Result<(), Complaint> {
    let services = services(deployment);
    let is_one = services.iter().any(|&(service, n)| {
        name == service || (0..n).any(|index| name == process_name(service, Some(index)))
    });
    let names: Vec<&str> = services.iter().map(|service| service.0).collect();
    let names = names.join(", ");
    let expected = format!("one of {names}, or a single process, such as pose-0");
    demand(is_one, key, &format!("{name:?}"), &expected)
}
