//! Runs one process of a deployment: creates the settings of its service from the resolved deployment.

mod cores;
mod live;
pub(crate) mod view_step;

use core::num::NonZero;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use steps::{fuse, pose, quality, triangulate};

use deployment::Stage;
use failure::{ExitKind, Failure, OrFail as _};
use footage::SourceSpec;
use geometry::Framing;
use messages::topic;
use pipeline::{ExtrasStep, FuseStep, SkeletonStep, SpaceStep};
use rayon::ThreadPoolBuilder;
use runtime::Service;
use viewquality::Forecaster;

use crate::find_every::FOLLOWED_S;
use crate::hosts;
use crate::prepare::{Prepared, frame_scale, framing, least_heat, space_settings, who_settings};
use crate::recorded;
use crate::resolved::Resolved;

pub use view_step::network_step;

/// The processes of a deployment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Name {
    /// One per view: turns footage into frames.
    Capture,
    /// One per view: finds candidates and evidence in frames.
    Pose,
    /// One per view: predicts expected errors.
    Quality,
    /// One per worker: fuses pairs of views.
    Fuse,
    /// Triangulates joints in the world.
    Triangulate,
    /// Writes the files in the output folder.
    Results,
    /// Records every message in one file.
    Record,
    /// Sends the recorded messages of another process.
    Replay,
    /// Transfers messages between hosts.
    Bridge,
}

impl Name {
    /// All processes, in pipeline order.
    pub const ALL: [Self; 9] = [
        Self::Capture,
        Self::Pose,
        Self::Quality,
        Self::Fuse,
        Self::Triangulate,
        Self::Results,
        Self::Record,
        Self::Bridge,
        Self::Replay,
    ];

    /// Returns the name on the command line: the service of [`deployment::Process`], or `replay`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Capture => Stage::Capture.name(),
            Self::Pose => Stage::Pose.name(),
            Self::Quality => Stage::Quality.name(),
            Self::Fuse => Stage::Fuse.name(),
            Self::Triangulate => Stage::Triangulate.name(),
            Self::Results => "results",
            Self::Record => "record",
            Self::Replay => "replay",
            Self::Bridge => "bridge",
        }
    }

    /// Returns the process with the given name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|process| process.name() == name)
    }

    /// Returns the description for the help of the command line.
    pub fn help(self) -> &'static str {
        match self {
            Self::Capture => "One per view: turns footage into frames",
            Self::Pose => "One per view: finds candidates and evidence in frames",
            Self::Quality => "One per view: predicts expected errors",
            Self::Fuse => "One per worker: fuses pairs of views",
            Self::Triangulate => "Triangulates joints in the world",
            Self::Results => "Writes the output folder",
            Self::Record => "Records every message in one file",
            Self::Replay => "Sends the recorded messages of another process",
            Self::Bridge => "Transfers messages between hosts",
        }
    }
}

/// Arguments of a process. The deployment itself is read from standard input.
#[derive(Debug, Clone)]
pub struct ProcessArguments {
    /// File of the resolved deployment, read if standard input is empty.
    pub plan: PathBuf,
    /// Index of the view or worker, counted from 0.
    pub index: usize,
    /// The stage that a replay process replaces.
    pub stage: Option<Stage>,
    /// For tests: enter an endless loop in epoch 0, after a message about a frame later than this has been sent.
    pub spin_after: Option<u64>,
}

/// Runs the process until its inputs end or a stop is requested.
///
/// # Errors
///
/// Fails if the resolved deployment cannot be read or used, if it has no such process, or if the service fails.
pub fn run(service: &Service, name: Name, arguments: &ProcessArguments) -> Result<(), Failure> {
    let resolved = Resolved::read(&arguments.plan)?;
    let n_views = resolved.deployment.cameras.len();
    let per_view = matches!(name, Name::Capture | Name::Pose | Name::Quality);
    if per_view && arguments.index >= n_views {
        let message = format!("there is no view {}, only {n_views} views", arguments.index);
        return Err(Failure::new(ExitKind::Usage, message));
    }
    if per_view {
        let camera = &resolved.deployment.cameras[arguments.index].name;
        service.health().belongs_to(arguments.index, camera);
    }
    if let Some(frame) = arguments.spin_after.filter(|_| service.epoch() == 0) {
        service.health().spin_after(frame);
    }
    let n_threads = match name {
        Name::Pose => resolved.deployment.runtime.threads,
        // One person for each thread.
        Name::Triangulate => thread::available_parallelism().map_or(1, NonZero::get),
        _ => 1,
    };
    pool(n_threads).build_global().or_fail(ExitKind::Run)?;
    match name {
        Name::Capture => capture(service, &resolved, arguments.index),
        Name::Pose => pose(service, &resolved, arguments.index),
        Name::Quality => quality(service, &resolved, arguments.index),
        Name::Fuse => fuse(service, &resolved, arguments.index),
        Name::Triangulate => triangulate(service, &resolved),
        Name::Results => results(service, &resolved),
        Name::Record => record(service, &resolved),
        Name::Replay => replay(service, &resolved, arguments),
        Name::Bridge => bridge::run(service, &hosts::job(&resolved)?),
    }
}

/// Returns a builder for the thread pool of a process. If the pool has several threads, the calling thread is one of them. Otherwise, work
/// that is started outside the pool would not use its threads.
fn pool(n_threads: usize) -> ThreadPoolBuilder {
    let pool = ThreadPoolBuilder::new().num_threads(n_threads);
    if n_threads > 1 {
        pool.use_current_thread()
    } else {
        pool
    }
}

fn capture(service: &Service, resolved: &Resolved, view: usize) -> Result<(), Failure> {
    let deployment = &resolved.deployment;
    let rig = inputs::rig_of(deployment)?;
    let framing = framing(resolved, &rig, view)?;
    let topology = resolved.topology();
    let most_shrink = most_shrink(&framing);
    let job = capture::Job {
        view,
        source: SourceSpec {
            most_shrink,
            threads: cores::each(&topology, Stage::Capture).map(|cores| cores.max(1.0) as usize),
            ..crate::cameras::source(&deployment.cameras[view], &deployment.capture)
        },
        timeline: resolved.footage[view].timeline,
        live: live::job(resolved, view, most_shrink),
        lead_nanos: crate::cameras::lead_nanos(deployment),
        faults: deployment.cameras[view].fault.clone(),
        frozen_after: deployment.capture.frozen_after,
        skew_nanos: live::skew_nanos(resolved, view),
        framing,
        mode: deployment.capture.mode,
        pace: deployment.capture.mode.pace(),
        n_consumers: topology.receivers_of(&topic::frame(view)),
        patience: resolved.patience(),
    };
    capture::run(service, &job)
}

/// Difference from a whole factor that is ignored when a decoder shrinks pictures. The two focal lengths of a lens differ by less, so that
/// a picture that is rotated afterwards is shrunk as far as a level one.
const SCALE_TOLERANCE: f64 = 0.05;

/// Returns the factor by which a decoder may shrink pictures that are scaled down to smaller frames.
fn most_shrink(framing: &Framing) -> usize {
    let [[a, _, _], [c, _, _]] = framing.source_from_output();
    (a.hypot(c) + SCALE_TOLERANCE) as usize
}

fn pose(service: &Service, resolved: &Resolved, view: usize) -> Result<(), Failure> {
    let prepared = Prepared::new(resolved)?;
    let topology = resolved.topology();
    let job = pose::Job {
        view,
        step: view_step::of_view(resolved, &prepared, view)?,
        n_extras: resolved.extra_keypoints.len(),
        n_pose_consumers: topology.receivers_of(&topic::sightings(view)),
        n_evidence_consumers: topology.receivers_of(&topic::evidence(view)),
        start_frame: resolved.deployment.capture.start_frame,
        frame_step: resolved.deployment.capture.frame_step,
        frame_rate_hz: resolved.frame_rate_hz(),
        most_apart: most_apart(resolved),
        looks: cores::looks(resolved, &topology),
        patience: resolved.patience(),
    };
    pose::run(service, &job)
}

/// Returns the largest number of frames between two frames in which the same person can be followed. With any `frame_step`, it is large
/// enough to follow people from one used frame to the next.
pub(crate) fn most_apart(resolved: &Resolved) -> Option<f64> {
    let step = resolved.deployment.capture.frame_step as f64;
    let rate_hz = resolved.frame_rate_hz()?;
    Some((rate_hz * FOLLOWED_S).max(step / pipeline::LOST))
}

fn quality(service: &Service, resolved: &Resolved, view: usize) -> Result<(), Failure> {
    let prepared = Prepared::new(resolved)?;
    let network = inputs::quality_network(
        resolved.deployment.paper.errors.as_ref(),
        prepared.model.n_parts(),
    )?;
    let source = match network {
        Some(network) => quality::Source::Network(Box::new(quality::NetworkSource {
            forecaster: Forecaster::new(network),
            model: Arc::clone(&prepared.model),
            layout: Arc::new(prepared.views[view].plan.layout().clone()),
        })),
        None => quality::Source::Table(
            prepared
                .predictor(resolved, view)?
                .ok_or("paper.errors is not set")
                .or_fail(ExitKind::Config)?,
        ),
    };
    let mut job = quality::Job {
        view,
        source,
        frame_step: resolved.deployment.capture.frame_step,
        frame_scale: frame_scale(&prepared.views[view].framing) as f32,
        n_consumers: resolved.topology().receivers_of(&topic::view_quality(view)),
        patience: resolved.patience(),
    };
    quality::run(service, &mut job)
}

fn fuse(service: &Service, resolved: &Resolved, worker: usize) -> Result<(), Failure> {
    let prepared = Prepared::new(resolved)?;
    let topology = resolved.topology();
    let plans = prepared.plans();
    if topology.has_maps() {
        let job = fuse::WhoJob {
            cameras: plans.iter().map(|plan| plan.camera().clone()).collect(),
            settings: who_settings(resolved, &prepared),
            frame_rate_hz: resolved.frame_rate_hz(),
            frame_step: resolved.deployment.capture.frame_step.max(1),
            n_consumers: topology.receivers_of(&topic::people()),
            patience: resolved.patience(),
        };
        return fuse::run_who(service, &job);
    }
    let job = fuse::Job {
        worker,
        views: prepared.settings.views,
        follow: prepared.settings.follow,
        pairs: topology.pairs_of(worker),
        step: Arc::new(FuseStep::new(
            prepared.model,
            prepared.settings.fuse,
            plans.clone(),
            prepared.settings.tables,
        )),
        plans,
        has_quality: resolved.deployment.has_quality(),
        quality_deadline: deployment::paper::ERRORS_DEADLINE,
        quality_max_age: deployment::paper::ERRORS_MAX_AGE,
        frame_step: resolved.deployment.capture.frame_step.max(1),
        n_consumers: topology.receivers_of(&topic::pair_pose(worker)),
        patience: resolved.patience(),
    };
    fuse::run(service, &job)
}

fn triangulate(service: &Service, resolved: &Resolved) -> Result<(), Failure> {
    let prepared = Prepared::new(resolved)?;
    let topology = resolved.topology();
    let plans = prepared.plans();
    // The preceding process already waits for late views, so this process waits twice as long.
    let patience = 2 * resolved.patience();
    let n_consumers = topology.receivers_of(&topic::skeletons());
    if topology.has_maps() {
        let settings = space_settings(resolved, &prepared);
        let step = SpaceStep::new(plans.clone(), prepared.up_in_world, settings);
        let extras = ExtrasStep::new(
            &resolved.extra_keypoints,
            plans.iter().map(|plan| plan.camera().clone()).collect(),
            prepared.settings.skeleton.triangulation,
        );
        let job = triangulate::SpaceJob {
            plans,
            extras,
            frame_rate_hz: resolved.frame_rate_hz(),
            frame_step: resolved.deployment.capture.frame_step.max(1),
            n_consumers,
            patience,
        };
        return triangulate::run_in_space(service, &job, step);
    }
    let step = SkeletonStep::new(
        plans.clone(),
        prepared.up_in_world,
        prepared.settings.skeleton,
    );
    let job = triangulate::Job {
        plans,
        frame_rate_hz: resolved.frame_rate_hz(),
        views: prepared.settings.views,
        n_workers: topology.n_workers(),
        n_consumers,
        pairs: prepared.pairs,
        patience,
    };
    triangulate::run(service, &job, step)
}

fn results(service: &Service, resolved: &Resolved) -> Result<(), Failure> {
    let prepared = Prepared::new(resolved)?;
    let topology = resolved.topology();
    let deployment = &resolved.deployment;
    let views = prepared.views.iter().map(|view| results::View {
        name: view.name.clone(),
        framing: view.framing.clone(),
        layout: Arc::new(view.plan.layout().clone()),
    });
    let scene = results::Scene {
        views: views.collect(),
        model: prepared.model,
        has_maps: deployment.has_maps(),
        least_heat: least_heat(deployment),
        joints: prepared.settings.skeleton.joints,
        extra_keypoints: resolved.extra_keypoints.clone(),
        frame_rate_hz: resolved.frame_rate_hz(),
        frame_step: deployment.capture.frame_step,
        follow: deployment.person.follow,
        up_in_world: prepared.up_in_world,
    };
    let job = results::Job {
        scene,
        config: deployment.results.clone(),
        output: deployment.output.clone(),
        start_frame: deployment.capture.start_frame,
        n_workers: topology.n_workers(),
        has_quality: resolved.deployment.has_quality(),
    };
    results::run(service, job)
}

fn record(service: &Service, resolved: &Resolved) -> Result<(), Failure> {
    let prepared = Prepared::new(resolved)?;
    let topology = resolved.topology();
    let plan = resolved.recording.as_ref();
    let plan = plan
        .ok_or("the deployment has no recording to write")
        .or_fail(ExitKind::Config)?;
    let job = record::Job {
        file: plan.file.clone(),
        about: recorded::about(resolved, plan)?,
        topics: record::Topics {
            n_views: prepared.views.len(),
            fused: topology.fused(),
            has_quality: resolved.deployment.has_quality(),
            pictures: plan.pictures.clone(),
            processes: topology.processes().iter().map(|process| process.name.clone()).collect(),
            elsewhere: topology.topics_elsewhere(),
        },
        queue_bytes: plan.queue_mb.saturating_mul(1_000_000),
        foxglove: (!plan.without_foxglove).then(|| recorded::stage(&prepared)),
    };
    record::run(service, job)
}

fn replay(
    service: &Service,
    resolved: &Resolved,
    arguments: &ProcessArguments,
) -> Result<(), Failure> {
    let recording = resolved.replay.as_ref().zip(arguments.stage);
    let (plan, stage) = recording
        .ok_or("there is no recording, or no --stage")
        .or_fail(ExitKind::Config)?;
    let topology = resolved.topology();
    let mut processes = topology.processes().iter();
    let replayed = processes.find(|process| {
        let index = process.index.unwrap_or(0);
        process.service == stage.name() && index == arguments.index
    });
    let replayed = replayed
        .ok_or("there is no such process in this deployment")
        .or_fail(ExitKind::Usage)?;
    let output = |topic: &String| record::replay::Output {
        topic: topic.clone(),
        n_receivers: topology.receivers_of(topic),
    };
    let job = record::replay::Job {
        file: plan.file.clone(),
        outputs: replayed.outputs.iter().map(output).collect(),
        pace: plan.speed.map_or(record::replay::Pace::Max, record::replay::Pace::Times),
        frame_step: resolved.deployment.capture.frame_step.max(1),
        patience: resolved.patience(),
    };
    record::replay::run(service, &job)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use deployment::{AnyMachine, Loaded, RecordingPlan, Topology};
    use geometry::OutSize;

    use super::*;

    #[test]
    fn every_process_of_a_deployment_has_a_name() {
        let text = "name = 'a'\nrig = 'r'\noutput = 'o'\nmethod = 'paper'\n[paper]\nerrors = 'shipped'\n\
            [[camera]]\nname = 'b'\nsource = 's'\n[[camera]]\nname = 'c'\nsource = 's'\n";
        let loaded = Loaded::parse(text, Path::new("d.toml"), &[], &AnyMachine).unwrap();
        let recording = RecordingPlan {
            file: PathBuf::new(),
            without_pixels: false,
            without_evidence: false,
            queue_mb: 1,
            pictures: Vec::new(),
            without_foxglove: true,
        };
        let topology = Topology::new(&loaded.deployment, Some(&recording), None);
        let services = topology.processes().iter().map(|process| process.service);
        let mut found: Vec<Name> =
            services.map(|service| Name::of_name(service).unwrap()).collect();
        found.dedup();
        let mut all = Name::ALL.to_vec();
        assert_eq!(all.pop(), Some(Name::Replay), "no process of its own");
        assert_eq!(all.pop(), Some(Name::Bridge), "with hosts alone");
        assert_eq!(found.len(), all.len());
        assert!(all.iter().all(|name| found.contains(name)), "{found:?}");
    }

    #[test]
    fn a_lens_with_two_focal_lengths_does_not_change_how_far_pictures_are_shrunk() {
        let rig = scene::RigChoice::parse("ring:2").unwrap().rig().unwrap();
        let mut camera = rig.cameras()[0].clone();
        let size = camera.intrinsics.size;
        for share in [0.997, 1.0, 1.003] {
            camera.intrinsics.fx = share * camera.intrinsics.fy;
            let framing = Framing::new(&camera, size, None, OutSize::Scale(0.25), 0.03);
            assert_eq!(most_shrink(&framing.unwrap()), 4, "{share}");
        }
    }

    #[test]
    fn a_pool_of_several_threads_contains_the_calling_thread() {
        let threads_of = |n| {
            let inside = move || {
                let _pool = pool(n).build();
                rayon::current_thread_index().map(|_| rayon::current_num_threads())
            };
            let thread = thread::Builder::new().name("caller".to_owned());
            let caller = thread.spawn(inside).ok()?;
            caller.join().ok().flatten()
        };
        assert_eq!([threads_of(1), threads_of(2)], [None, Some(2)]);
    }
}
