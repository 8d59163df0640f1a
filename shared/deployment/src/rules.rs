//! What must hold of a deployment before anything is started.

use crate::complaint::{Complaint, demand, not_negative, positive, whole};
use crate::topology::{process_name, services};
use crate::{
    Deployment, capture, fuse, hosts, is_shipped, limits, pose, quality, slips, triangulate,
};

/// Checks the values that the types alone do not.
pub(super) fn check(it: &Deployment) -> Result<(), Complaint> {
    name(&it.name)?;
    if let Some(unit) = &it.unit {
        demand(
            unit.parse::<geometry::files::Unit>().is_ok(),
            "unit",
            &format!("{unit:?}"),
            "\"m\", \"cm\", \"mm\", \"ft\", \"in\", or a length such as \"30mm\", the squares of the board",
        )?;
    }
    for (key, path) in [("rig", &it.rig), ("output", &it.output)] {
        is_path(key, &path.to_string_lossy())?;
    }
    cameras(it)?;
    capture(&it.capture)?;
    pose(&it.pose)?;
    maps(it)?;
    quality(it)?;
    fuse(it)?;
    if let Some(budget) = it.supervise.latency_budget_ms {
        positive("supervise.latency_budget_ms", budget)?;
    }
    whole("supervise.missed_beats", it.supervise.missed_beats)?;
    runtime(it)?;
    hosts::check(it)?;
    limits::check(it)?;
    let joints = &it.triangulate.joints;
    let known = skeleton::JointSet::ALL.map(|it| it.name).join(", ");
    demand(
        skeleton::JointSet::by_name(joints).is_some(),
        "triangulate.joints",
        joints,
        &format!("one of {known}"),
    )?;
    positive("triangulate.loss_px", it.triangulate.loss_px)?;
    let weight = it.triangulate.error_weight;
    demand(
        weight.is_finite() && weight >= 0.0,
        "triangulate.error_weight",
        &weight.to_string(),
        "a number of at least 0",
    )
}

fn name(name: &str) -> Result<(), Complaint> {
    let good = |it: char| it.is_ascii_lowercase() || it.is_ascii_digit() || it == '-';
    demand(
        (1..=32).contains(&name.len()) && name.chars().all(good),
        "name",
        &format!("{name:?}"),
        "1 to 32 lower-case letters, digits and hyphens",
    )
}

fn cameras(it: &Deployment) -> Result<(), Complaint> {
    let n = it.cameras.len();
    whole("camera", n)?;
    for (index, camera) in it.cameras.iter().enumerate() {
        let twin = it.cameras[..index]
            .iter()
            .any(|other| other.name == camera.name);
        demand(
            !twin,
            "camera",
            &format!("twice {:?}", camera.name),
            "every camera once",
        )?;
        demand(
            geometry::is_plain_name(&camera.name),
            "camera.name",
            &format!("{:?}", camera.name),
            geometry::PLAIN_NAME,
        )?;
        pictures(camera)?;
        let skew_ms = camera.skew_ms.unwrap_or(0.0);
        demand(
            (-1000.0..=1000.0).contains(&skew_ms),
            "camera.skew_ms",
            &skew_ms.to_string(),
            "-1000 to 1000: at most half the time between two frames is usual",
        )?;
    }
    Ok(())
}

/// A path without what a backslash makes in double quotes.
fn is_path(key: &str, path: &str) -> Result<(), Complaint> {
    demand(
        !path.chars().any(char::is_control),
        key,
        &format!("{path:?}"),
        &format!("a path without special characters: {}", slips::ESCAPE),
    )
}

/// What a camera sees: footage, keypoints, or both.
fn pictures(camera: &capture::Camera) -> Result<(), Complaint> {
    demand(
        !camera.source.is_empty() || camera.keypoints.is_some(),
        "camera.source",
        &format!("left out of camera {:?}", camera.name),
        "its footage: every [[camera]] needs that, or `keypoints` that another program found in it",
    )?;
    is_path("camera.source", &camera.source)?;
    if let Some(capture::Rotate::Degrees(degrees)) = camera.rotate {
        demand(
            degrees % 90 == 0 && degrees < 360,
            "camera.rotate",
            &degrees.to_string(),
            "0, 90, 180 or 270 degrees to the right, or \"tag\"",
        )?;
    }
    if let Some([_, step]) = camera.numbers {
        let expected = "[first, step], the step at least 1";
        demand(step > 0, "camera.numbers", &step.to_string(), expected)?;
    }
    let Some(names) = &camera.keypoint_names else {
        return Ok(());
    };
    demand(
        camera.keypoints.is_some(),
        "camera.keypoint_names",
        &format!("given for camera {:?}", camera.name),
        "none without `keypoints`",
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
        "given together with size",
        "either of the two",
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

fn pose(it: &pose::Config) -> Result<(), Complaint> {
    whole("pose.candidates", it.candidates)?;
    if let Some(n) = it.find_every {
        whole("pose.find_every", n)?;
    }
    whole("pose.people", it.people)?;
    whole("pose.threads", it.threads)?;
    not_negative("pose.tracked_margin", it.tracked_margin)?;
    not_negative("pose.tracked_max_drop", f64::from(it.tracked_max_drop))?;
    not_negative("pose.tracked_speed", it.tracked_speed)?;
    not_negative("pose.tracked_max_gap_ms", it.tracked_max_gap_ms)?;
    not_negative("pose.tracked_full_every_ms", it.tracked_full_every_ms)?;
    not_negative("pose.min_separation", it.min_separation)
}

/// Checks what goes with a network that finds keypoints, and what does not.
fn maps(deployment: &Deployment) -> Result<(), Complaint> {
    let it = &deployment.pose;
    let mut cameras = 0..deployment.cameras.len();
    let has_network = cameras.any(|it| deployment.pose_network(it).is_some());
    let beside = [
        (
            "pose.network_card",
            it.network_card.is_some(),
            it.network.is_some(),
        ),
        ("pose.detector", it.detector.is_some(), has_network),
        ("pose.mirror", it.mirror, has_network),
        ("pose.onnx_runtime", it.onnx_runtime.is_some(), has_network),
    ];
    for (key, is_given, has_network) in beside {
        demand(
            !is_given || has_network,
            key,
            "given",
            "none without `pose.network`",
        )?;
    }
    demand(
        it.network_card.is_none() || !it.network.as_deref().is_some_and(is_shipped),
        "pose.network_card",
        "given",
        "none with the network that ships, whose card is built in",
    )?;
    demand(
        it.detector_card.is_none() || it.detector.is_some(),
        "pose.detector_card",
        "given",
        "none without `pose.detector`",
    )?;
    maps_of_cameras(deployment)?;
    let of_filters = [
        ("quality.network", deployment.quality.network.is_some()),
        ("quality.table", deployment.quality.table.is_some()),
        ("fuse.consistency", deployment.fuse.consistency.is_some()),
        (
            "fuse.compatibility",
            !deployment.fuse.compatibility.is_empty(),
        ),
    ];
    for (key, is_given) in of_filters {
        demand(
            !is_given || !deployment.has_maps(),
            key,
            "given",
            "none with networks or keypoints: it is about poses that the filters find",
        )?;
    }
    Ok(())
}

/// Every camera has maps, or none has.
fn maps_of_cameras(deployment: &Deployment) -> Result<(), Complaint> {
    for (nth, camera) in deployment.cameras.iter().enumerate() {
        demand(
            camera.network_card.is_none() || camera.network.is_some(),
            "camera.network_card",
            &format!("given for {:?}", camera.name),
            "none without `network` of this camera",
        )?;
        demand(
            camera.network.is_none() || camera.keypoints.is_none(),
            "camera.network",
            &format!("given for {:?}, besides `keypoints`", camera.name),
            "one of the two",
        )?;
        let has_maps = camera.keypoints.is_some() || deployment.pose_network(nth).is_some();
        demand(
            has_maps || !deployment.has_maps(),
            "camera.network",
            &format!("not given for {:?}", camera.name),
            "`pose.network`, or a network or keypoints for every camera: maps and filters do not go together",
        )?;
    }
    Ok(())
}

fn quality(deployment: &Deployment) -> Result<(), Complaint> {
    let it = &deployment.quality;
    for name in it.views.keys() {
        demand(
            deployment.cameras.iter().any(|it| it.name == *name),
            "quality.views",
            &format!("{name:?}"),
            "the name of a [[camera]] of this file",
        )?;
    }
    demand(
        it.table.is_none() || it.network.is_none(),
        "quality.network",
        "given besides `quality.table`",
        "one of the two",
    )?;
    demand(
        it.onnx_runtime.is_none() || it.network.is_some(),
        "quality.onnx_runtime",
        "given",
        "none without `quality.network`",
    )?;
    demand(
        it.device == quality::Device::Cpu || it.onnx_runtime.is_some(),
        "quality.device",
        "\"cuda\"",
        "\"cpu\" without `quality.onnx_runtime`",
    )?;
    demand(it.frame_step > 0, "quality.frame_step", "0", "at least 1")
}

/// Checks the numbers of a section `[fuse]`, which stands in files of its own, too.
///
/// # Errors
///
/// The first number that cannot be.
pub fn fuse_numbers(it: &fuse::Config) -> Result<(), Complaint> {
    whole("fuse.workers", it.workers)?;
    whole("fuse.max_iterations", it.max_iterations)?;
    not_negative("fuse.alpha", it.alpha.unwrap_or(0.0))?;
    not_negative("fuse.beta", it.beta.unwrap_or(0.0))?;
    not_negative("fuse.epsilon_px", it.epsilon_px)?;
    if let Some(cells) = it.max_distance_cells {
        positive("fuse.max_distance_cells", cells)?;
    }
    for &tau in it.tau.given() {
        not_negative("fuse.tau", f64::from(tau))?;
    }
    limits::fuse(it)
}

fn fuse(deployment: &Deployment) -> Result<(), Complaint> {
    let it = &deployment.fuse;
    fuse_numbers(it)?;
    all_views(deployment)?;
    let needs_file = it.tau == fuse::Tau::Named(fuse::TauName::Learned);
    demand(
        !needs_file || it.consistency.is_some(),
        "fuse.tau",
        "\"learned\"",
        "thresholds, or `fuse.consistency` to name the file that has them",
    )?;
    let tables = it
        .compatibility
        .iter()
        .map(|it| ("fuse.compatibility", &it.views));
    let pairs = it.pairs.iter().map(|it| ("fuse.pairs", it));
    for (key, names) in tables.chain(pairs) {
        for name in names {
            demand(
                deployment.cameras.iter().any(|it| it.name == *name),
                key,
                &format!("{name:?}"),
                "the name of a [[camera]] of this file",
            )?;
        }
        demand(
            names[0] != names[1],
            key,
            &format!("{:?} twice", names[0]),
            "two cameras",
        )?;
    }
    Ok(())
}

/// What has no meaning where all views are solved at once.
fn all_views(deployment: &Deployment) -> Result<(), Complaint> {
    let it = &deployment.fuse;
    if deployment.views() == fuse::Views::Pairs {
        return Ok(());
    }
    let n_views = deployment.cameras.len();
    let in_space = deployment.views() == fuse::Views::Space;
    demand(
        !in_space || deployment.has_maps(),
        "fuse.views",
        "\"space\"",
        "\"all\" or \"pairs\" without `pose.network` or keypoints: filters give no maps of joints",
    )?;
    demand(
        in_space || n_views <= fuse::MOST_AT_ONCE,
        "fuse.views",
        &format!("\"all\" of {n_views} cameras"),
        &format!(
            "at most {} cameras at once, or \"pairs\"",
            fuse::MOST_AT_ONCE
        ),
    )?;
    demand(
        it.energy == fuse::Energy::Paper,
        "fuse.energy",
        "\"released\"",
        "\"paper\", the only one that all views at once have",
    )?;
    demand(
        it.pairs.is_empty(),
        "fuse.pairs",
        "given",
        "none, as `fuse.views` is \"all\"",
    )?;
    demand(
        deployment.triangulate.combine == triangulate::Combine::Mean,
        "triangulate.combine",
        "\"consensus\"",
        "\"mean\": where `fuse.views` is \"all\", there is nothing to combine",
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

/// Whether a name is that of a service, or of a process of the deployment.
fn is_process(deployment: &Deployment, key: &str, name: &str) -> Result<(), Complaint> {
    let services = services(deployment);
    let is_one = services.iter().any(|&(service, n)| {
        name == service || (0..n).any(|index| name == process_name(service, Some(index)))
    });
    let names: Vec<&str> = services.iter().map(|it| it.0).collect();
    let names = names.join(", ");
    let expected = format!("{names}, or one process of these, such as pose-0");
    demand(is_one, key, &format!("{name:?}"), &expected)
}
