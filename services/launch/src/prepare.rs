//! Prepares the model, the views and the settings of a resolved deployment for its stages.

use std::path::PathBuf;
use std::sync::Arc;
use steps::{fuse, pose, quality, triangulate};

use deployment::Deployment;
use deployment::paper::Errors;
use failure::{ExitKind, Failure, OrFail as _};
use fmp::Model;
use geometry::{Framing, OutSize, Rig, upright_roll};
use multiview::ViewPlan;
use multiview::learned::Learned;
use nalgebra::UnitVector3;
use pipeline::{
    BodySettings, EstimatorSettings, SkeletonSettings, SpaceStepSettings, ViewSettings, WhoSettings,
};
use skeleton::JointSet;
use viewquality::Predictor;

use crate::padding;
use crate::resolved::Resolved;

/// A prepared view.
#[derive(Debug, Clone)]
pub struct View {
    /// Name of the camera.
    pub name: String,
    /// Mapping from the camera's footage to the frames of the pipeline.
    pub framing: Framing,
    /// Camera of the frames, and layout and cells of their pyramid.
    pub plan: Arc<ViewPlan>,
}

/// The model, views and settings of a deployment.
#[derive(Debug)]
pub struct Prepared {
    /// The model.
    pub model: Arc<Model>,
    /// The views, in the order of their numbers.
    pub views: Vec<View>,
    /// The pairs of views that are fused, in ascending order. If all views are solved at once, each view after the first is paired with the
    /// view before it, so that every view is in a pair, and each pair has one message.
    pub pairs: Vec<[usize; 2]>,
    /// Upward direction, if the rig gives it.
    pub up_in_world: Option<UnitVector3<f64>>,
    /// The settings of all stages.
    pub settings: EstimatorSettings,
    /// Warning, if a large part of the frames is padding.
    pub padding: Option<String>,
}

impl Prepared {
    /// Reads the model and the rig, and prepares the views.
    ///
    /// # Errors
    ///
    /// Fails if an input cannot be read, does not match the other inputs, or contradicts the deployment.
    pub fn new(resolved: &Resolved) -> Result<Self, Failure> {
        let deployment = &resolved.deployment;
        let model = inputs::model_or_shipped(deployment.paper.model.as_deref())?;
        let rig = inputs::rig_of(deployment)?;
        let (mut views, mut sizes) = (Vec::new(), Vec::new());
        let names = deployment.cameras.iter().map(|camera| camera.name.as_str());
        let framings =
            names.enumerate().map(|(index, name)| (name, framing(resolved, &rig, index)));
        let framings = inputs::advice::of_all(framings.collect())?;
        for (camera, framing) in deployment.cameras.iter().zip(framings) {
            sizes.extend(rig.camera(&camera.name).map(|camera| camera.intrinsics.size));
            let plan = pipeline::plan(&model, framing.camera()).or_fail(ExitKind::Input)?;
            views.push(View {
                name: camera.name.clone(),
                framing,
                plan,
            });
        }
        let settings = settings(deployment, &model, &views)?;
        let named = views.iter().map(|view| view.name.as_str()).zip(sizes);
        let named: Vec<_> = named.collect();
        let size = deployment.capture.size;
        let padding = size.and_then(|size| padding::warning(size, &named));
        Ok(Self {
            pairs: resolved.topology().pairs().to_vec(),
            up_in_world: rig.up_in_world(),
            padding,
            model,
            views,
            settings,
        })
    }

    /// Returns the predictor that reads the expected errors of a view from a table, if the deployment has a table.
    ///
    /// # Errors
    ///
    /// Fails if the table cannot be read, or does not contain the view.
    pub fn predictor(
        &self,
        resolved: &Resolved,
        view: usize,
    ) -> Result<Option<Predictor>, Failure> {
        let errors = resolved.deployment.paper.errors.as_ref();
        let Some(config) = errors.and_then(Errors::table) else {
            return Ok(None);
        };
        let file = &config.table;
        let table = inputs::quality_table(file, self.model.n_parts())?;
        let name = config.name_of(&resolved.deployment.cameras[view].name);
        let predictor = Predictor::from_table(&table, quality::selection(config), name);
        let predictor = predictor.map_err(|error| failure::in_file(file, &error))?;
        Ok(Some(predictor))
    }

    /// Checks that the networks can be loaded, and that the table of expected errors contains every view. Warns of views for which the
    /// table has no rows.
    ///
    /// # Errors
    ///
    /// Fails if a network or the table cannot be read, or does not match the model.
    pub fn check_predictions(&self, resolved: &Resolved) -> Result<(), Failure> {
        let deployment = &resolved.deployment;
        inputs::check_maps(deployment)?;
        let paper = &deployment.paper;
        let errors = paper.errors.as_ref();
        let is_shipped =
            |file: Option<&PathBuf>| file.is_some_and(|file| deployment::is_shipped(file));
        let has_other_model = paper.model.is_some() && !is_shipped(paper.model.as_ref());
        if has_other_model && is_shipped(errors.and_then(Errors::network)) {
            tracing::warn!(
                "paper.errors is the shipped network, which was trained on poses of the shipped model; it cannot predict the \
                 errors of another model"
            );
        }
        inputs::quality_network(errors, self.model.n_parts())?;
        let capture = &resolved.deployment.capture;
        for (view, footage) in resolved.footage.iter().enumerate() {
            let Some(predictor) = self.predictor(resolved, view)? else {
                return Ok(());
            };
            let frame = |nth: u64| capture.start_frame + nth * capture.frame_step;
            if !(0..footage.n_frames).any(|nth| predictor.sigma_px(frame(nth)).is_some()) {
                tracing::warn!(
                    view = self.views[view].name,
                    "the table of paper.errors has no row for any frame of this view: check its frame_offset \
                     and frame_step; all parts are treated as usable"
                );
            }
        }
        Ok(())
    }

    /// Returns the plans of all views.
    pub fn plans(&self) -> Vec<Arc<ViewPlan>> {
        self.views.iter().map(|view| Arc::clone(&view.plan)).collect()
    }
}

/// Returns the mapping from the footage of a camera to its frames.
///
/// * `index`: index of the camera in the deployment.
///
/// # Errors
///
/// Fails if the calibration does not contain the camera, or does not match the size of the footage.
pub(crate) fn framing(resolved: &Resolved, rig: &Rig, index: usize) -> Result<Framing, Failure> {
    let deployment = &resolved.deployment;
    let entry = &deployment.cameras[index];
    let camera = inputs::camera_of(rig, &entry.name, deployment)?;
    let out_size = match (deployment.capture.size, deployment.capture.scale) {
        (Some(size), _) => OutSize::Exact(size.map(|size| size as u32)),
        (None, Some(scale)) => OutSize::Scale(scale),
        (None, None) => {
            let chosen = resolved.search_size.as_ref();
            OutSize::Scale(chosen.map_or(1.0, |size| size.scale(&entry.name)))
        }
    };
    let roll = if deployment.capture.upright {
        upright_roll(camera, rig).unwrap_or(0.0)
    } else {
        0.0
    };
    let size = resolved.footage[index].size;
    Framing::new(camera, size, entry.source_offset_px, out_size, roll).map_err(|error| {
        let failure = Failure::new(
            ExitKind::Calibration,
            format!("camera {:?}: {error}", entry.name),
        );
        let [width, height] = camera.intrinsics.size;
        if size == [height, width] {
            return failure.with_hint(
                "the sizes agree if the pictures are rotated: set `rotate = 90` or `rotate = 270` (degrees to the right) in its [[camera]], or \
                 `rotate = \"tag\"` to rotate them as the file's tag says",
            );
        }
        failure.with_hint(
            "calibrate at the size of the footage; if the footage is a part of the \
             calibrated image, set its position: source_offset_px = [x, y] in its [[camera]], [0, 0] if only columns on the right or rows below are missing",
        )
    })
}

fn settings(
    deployment: &Deployment,
    model: &Model,
    views: &[View],
) -> Result<EstimatorSettings, Failure> {
    let scales = views.iter().map(|view| frame_scale(&view.framing));
    let frame_scale = scales.sum::<f64>() / views.len().max(1) as f64;
    let consistency = deployment.paper.consistency.as_ref();
    let learned = inputs::learned(consistency.map(|named| named.file().as_path()), model)?;
    let names: Vec<&str> = views.iter().map(|view| view.name.as_str()).collect();
    let tables = inputs::pair_tables(&deployment.paper, learned.as_ref(), model, &names)?;
    let mut config = deployment.paper.clone();
    if let deployment::paper::Tau::File(tau) = &config.tau {
        config.tau = deployment::paper::Tau::Given(inputs::tau(&tau.file, model.n_parts())?);
    }
    let n_thresholds = fuse::tau_px(&config.tau).len();
    if ![0, model.n_parts()].contains(&n_thresholds) {
        let message = format!(
            "`paper.tau` has {n_thresholds} thresholds, but the model has {} parts",
            model.n_parts()
        );
        return Err(Failure::new(ExitKind::Config, message));
    }
    Ok(EstimatorSettings {
        view: ViewSettings {
            orientation: if deployment.has_maps() {
                None
            } else {
                inputs::orientation(&deployment.paper.orientation, model)?
            },
            ..pose::settings(&deployment.paper)
        },
        fuse: fuse::settings(&config, frame_scale as f32, learned.as_ref()),
        tables,
        views: fuse::views(deployment.views()),
        follow: fuse::follow(deployment.person.follow),
        skeleton: skeleton_settings(deployment, learned.as_ref())?,
    })
}

fn skeleton_settings(
    deployment: &Deployment,
    learned: Option<&Learned>,
) -> Result<SkeletonSettings, Failure> {
    let defaults = SkeletonSettings::default();
    let config = &deployment.paper;
    let joints = JointSet::by_name(&deployment.person.joints).unwrap_or(defaults.joints);
    let joint_map = if deployment.has_maps() {
        // No mapping is needed, because the parts of the model are the joints.
        None
    } else {
        inputs::Joints::of(&config.joint_map, config.model.as_deref())?.map(learned, joints)
    };
    Ok(SkeletonSettings {
        joints,
        joint_map,
        combine: triangulate::combine(config.combine),
        body: if config.bodies {
            defaults.body
        } else {
            BodySettings::NONE
        },
        facing: config.facing,
        ..defaults
    })
}

/// Returns the settings for matching people between views and frames.
pub(crate) fn who_settings(resolved: &Resolved, prepared: &Prepared) -> WhoSettings {
    WhoSettings {
        follow: prepared.settings.follow,
        as_seen: resolved.sides_as_seen,
        least_heat: least_heat(&resolved.deployment),
        n_people: resolved.deployment.network.people,
        n_restarts: 0,
    }
}

/// Returns the settings of the step that computes 3D joints.
pub(crate) fn space_settings(resolved: &Resolved, prepared: &Prepared) -> SpaceStepSettings {
    let skeleton = &prepared.settings.skeleton;
    let least_heat = resolved.deployment.network.least_heat;
    let settings = SpaceStepSettings {
        joints: skeleton.joints,
        body: skeleton.body,
        ..SpaceStepSettings::for_views(least_heat, resolved.sides_as_seen)
    };
    let cameras = &resolved.deployment.cameras;
    if cameras.iter().all(|camera| camera.keypoints.is_some()) {
        settings.by_keypoints()
    } else {
        settings
    }
}

/// Returns the scale of the frames: pixels of the frame per pixel of the footage.
pub(crate) fn frame_scale(framing: &Framing) -> f64 {
    let [[a, b, _], [c, d, _]] = framing.source_from_output();
    1.0 / (a * d - b * c).abs().sqrt()
}

/// Returns the heat, from 0 to 1, that at least half of the joints must have for the view to count as seeing the person well.
pub(crate) fn least_heat(deployment: &Deployment) -> f64 {
    2.0 * deployment.network.least_heat
}
