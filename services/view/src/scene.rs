//! Cameras and joints of a run, which give the numbers their meaning.

use failure::Failure;
use geometry::Camera;
use geometry::epipolar::epipolar_curve;
use launch::{Prepared, Resolved};
use nalgebra::Point2;
use serde_json::{Value, json};
use skeleton::{JointSet, PARSE14};

/// Number of points in an epipolar line.
const N_POINTS: usize = 40;

/// The cameras and joints of a run.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    /// Name of the deployment.
    pub name: String,
    /// Views, in the order of their numbers in messages.
    pub views: Vec<View>,
    /// Joints of the result.
    pub joints: &'static JointSet,
    /// Upward direction in the world, a unit vector.
    pub up: [f64; 3],
    /// Frames per second of the footage; `None` if unknown.
    pub frame_rate_hz: Option<f64>,
    /// True if results state which views see the person from behind. Only results of the filters do.
    pub tells_facing: bool,
    /// Reason why the cameras are unknown; `None` if they are known.
    pub problem: Option<String>,
}

/// One view.
#[derive(Debug, Clone)]
pub(crate) struct View {
    /// Name of the camera.
    pub name: String,
    /// Width and height of the pictures that coordinates refer to, in pixels.
    pub size: [u32; 2],
    /// Camera with the calibration of those pictures; `None` if unknown.
    pub camera: Option<Camera>,
}

impl Scene {
    /// Creates the scene of a run, in pixels of its frames.
    ///
    /// # Errors
    ///
    /// Fails if the model or the calibration cannot be read or used.
    pub(crate) fn of_frames(resolved: &Resolved) -> Result<Self, Failure> {
        let prepared = Prepared::new(resolved)?;
        let views = prepared.views.iter().map(|view| {
            let camera = view.framing.camera();
            View {
                name: view.name.clone(),
                size: camera.intrinsics.size,
                camera: Some(camera.clone()),
            }
        });
        let up = prepared.up_in_world.map(|up_in_world| up_in_world.into_inner().into());
        Ok(Self {
            name: resolved.deployment.name.clone(),
            views: views.collect(),
            joints: prepared.settings.skeleton.joints,
            up: up.unwrap_or([0.0, 0.0, 1.0]),
            frame_rate_hz: resolved.frame_rate_hz(),
            tells_facing: !resolved.deployment.has_maps(),
            problem: None,
        })
    }

    /// Creates the same scene as `of_frames`, but without cameras if the calibration cannot be read. The run can then still be shown.
    pub(crate) fn of_finished(resolved: &Resolved) -> Self {
        Self::of_frames(resolved).unwrap_or_else(|why| {
            let cameras = resolved.deployment.cameras.iter().zip(&resolved.footage);
            let views = cameras.map(|(camera, footage)| View {
                name: camera.name.clone(),
                size: footage.size,
                camera: None,
            });
            Self {
                name: resolved.deployment.name.clone(),
                views: views.collect(),
                joints: JointSet::by_name(&resolved.deployment.person.joints).unwrap_or(&PARSE14),
                up: resolved.deployment.up.unwrap_or([0.0, 0.0, 1.0]),
                frame_rate_hz: resolved.frame_rate_hz(),
                tells_facing: !resolved.deployment.has_maps(),
                problem: Some(format!("the cameras are not shown: {why}")),
            }
        })
    }

    /// Returns the data about the scene that the page needs.
    pub(crate) fn json(&self) -> Value {
        let joints = self.joints.joints.iter().map(|joint| joint.name);
        let views = self.views.iter().map(|view| {
            let camera = view.camera.as_ref();
            let at = camera.map(|camera| <[f64; 3]>::from(camera.centre_in_world().coords));
            let axis = camera.map(|camera| <[f64; 3]>::from(camera.axis_in_world().into_inner()));
            json!({ "name": view.name, "size": view.size, "at": at, "axis": axis })
        });
        json!({
            "name": self.name,
            "joints": joints.collect::<Vec<_>>(),
            "limbs": self.joints.limbs,
            "up": self.up,
            "views": views.collect::<Vec<_>>(),
            "rate": self.frame_rate_hz,
            "problem": self.problem,
        })
    }

    /// Returns the joints of a pose in a view; `None` if the pose has too few parts.
    ///
    /// * `centres`: centres of the parts, in pixels.
    pub(crate) fn joints_of(&self, centres: &[[f64; 2]]) -> Option<Vec<[f64; 2]>> {
        let last = self.joints.joints.iter().flat_map(|joint| joint.parts).max()?;
        (centres.len() > *last).then(|| self.joints.from_parts(centres))
    }

    /// Returns the epipolar lines of points in all other views: `[view of the point, other view, pixels along the line]`.
    ///
    /// * `points`: a view and a pixel in this view; points in views that do not exist are ignored.
    pub(crate) fn epipolar_lines(
        &self,
        points: &[(usize, [f64; 2])],
    ) -> Vec<(usize, usize, Vec<[f64; 2]>)> {
        let mut lines = Vec::new();
        for (view, point) in points {
            let from = self.views.get(*view).and_then(|view| view.camera.as_ref());
            let Some(from) = from.filter(|_| point.iter().all(|value| value.is_finite())) else {
                continue;
            };
            for (other, it) in self.views.iter().enumerate() {
                let Some(to) = it.camera.as_ref().filter(|_| other != *view) else {
                    continue;
                };
                let curve = epipolar_curve(from, to, &Point2::from(*point), N_POINTS);
                let tenths = |value: f64| (10.0 * value).round() / 10.0;
                let curve = curve.iter().map(|curve| [tenths(curve.x), tenths(curve.y)]);
                lines.push((*view, other, curve.collect()));
            }
        }
        lines
    }
}
