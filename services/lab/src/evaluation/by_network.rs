//! Solution of one frame from the keypoints of a network, by each of the compared methods.

use geometry::Camera;
use multiview::{
    FrontEvidence, JointEvidence, SeenPerson, SpaceSettings, SpaceView, front_log_ratio_of,
    solve_person,
};
use nalgebra::Point3;
use posenetwork::JointMaps;
use statistics::score::Point;

use crate::evaluation::plain::{Sighting, dropping, linear};

/// Number of joints of `skeleton::PARSE14`.
const N: usize = 14;
/// Number of maxima in a joint's map that are candidates for the joint.
const N_MAXIMA: usize = 3;

/// A method that computes 3D joints from the views.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Plain triangulation of the maxima ([`linear`]).
    Linear,
    /// Triangulation that leaves out cameras ([`dropping`]).
    Dropping,
    /// The 3D solution over the maps of the network, without springs between joints.
    Maps,
    /// The 3D solution over the maps of the network, with springs between joints ([`solve_person`]).
    Space,
}

impl Method {
    /// All methods, in the order of the table.
    pub const ALL: [Self; 4] = [Self::Linear, Self::Dropping, Self::Maps, Self::Space];

    /// Returns the name of the method in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "triangulated",
            Self::Dropping => "cameras dropped",
            Self::Maps => "maps",
            Self::Space => "maps and bones",
        }
    }
}

/// A network's evidence about a person in a view.
#[derive(Debug, Clone)]
pub struct NetworkView {
    maps: JointMaps,
    maxima: Vec<Vec<([f64; 2], f32)>>,
    /// Evidence about the direction in which the person faces.
    front: Option<FrontEvidence>,
}

impl NetworkView {
    /// Creates the evidence from the maps of a view.
    pub fn new(maps: JointMaps) -> Self {
        let maxima = |joint: usize| {
            let mut found = maps.maxima(joint, N_MAXIMA);
            if let Some(peak) = maps.peaks()[joint] {
                found.insert(0, (peak.at, maps.at(joint, peak.at)));
            }
            found
        };
        Self {
            maxima: (0..N).map(maxima).collect(),
            maps,
            front: None,
        }
    }

    /// Adds the network's evidence about the direction in which the person faces.
    #[must_use]
    pub fn with_front(self, front: Option<FrontEvidence>) -> Self {
        Self { front, ..self }
    }

    /// Returns the evidence about the direction in which the person faces.
    pub fn front(&self) -> Option<FrontEvidence> {
        self.front
    }

    /// Returns the maps.
    pub fn maps(&self) -> &JointMaps {
        &self.maps
    }

    fn exchange_sides(&mut self) {
        let mut maps = core::mem::take(&mut self.maps);
        maps.exchange_sides();
        *self = Self::new(maps).with_front(self.front);
    }

    /// Returns the data by which the same person is found in other views.
    ///
    /// * `height`: height of the box, as a fraction of the picture's height.
    pub fn person(&self, height: f64) -> SeenPerson {
        let joint = |keypoint: &Option<keypoints::Keypoint>| {
            keypoint.map(|keypoint| (keypoint.at, keypoint.score))
        };
        SeenPerson {
            joints: self.maps.peaks().iter().map(joint).collect(),
            height,
        }
    }
}

impl JointEvidence for NetworkView {
    fn at(&self, joint: usize, point: [f64; 2]) -> f32 {
        self.maps.at(joint, point)
    }

    fn maxima(&self, joint: usize) -> &[([f64; 2], f32)] {
        &self.maxima[joint]
    }

    fn floor(&self) -> f32 {
        self.maps.floor()
    }
}

/// Converts left and right from sides of the picture to sides of the body, in this frame alone. First, the 3D solution shows in which views
/// left and right are swapped relative to the other views. Then the evidence about the direction in which the person faces decides whether
/// to swap left and right in all views.
///
/// * Returns the log-likelihood ratio between the chosen assignment and its opposite, in nats; 0 without a solution.
pub fn name_sides(views: &mut [(Camera, NetworkView)]) -> f64 {
    let settings = SpaceSettings {
        as_seen: true,
        ..SpaceSettings::default()
    };
    let each = views.iter().map(|(camera, view)| SpaceView {
        camera,
        evidence: view,
        exchanged: [false; 2],
        front: view.front.unwrap_or_default(),
    });
    let each: Vec<SpaceView<'_>> = each.collect();
    let Some(found) = solve_person(&each, &settings) else {
        return 0.0;
    };
    for ((_, view), used) in views.iter_mut().zip(&found.views) {
        if used.is_some_and(|[arms, _]| arms) {
            view.exchange_sides();
        }
    }
    let said = views.iter();
    let said = said.filter_map(|(camera, view)| Some((camera, view.front?)));
    let said: Vec<(&Camera, FrontEvidence)> = said.collect();
    let ratio = front_log_ratio_of(&found.pose.joints, &said);
    if ratio < 0.0 {
        for (_, view) in views {
            view.exchange_sides();
        }
    }
    ratio.abs()
}

/// Returns the 3D joints of `skeleton::PARSE14`, in metres.
///
/// * `limit_px`: reprojection error above which [`dropping`] leaves out cameras, in pixels.
pub fn joints_by(
    method: Method,
    views: &[(&Camera, &NetworkView)],
    limit_px: f64,
) -> Vec<Option<Point>> {
    let as_point = |point: Point3<f64>| [point.x, point.y, point.z];
    let seen = |joint: usize| sightings(views, joint);
    match method {
        Method::Linear => (0..N).map(|i| linear(&seen(i)).map(as_point)).collect(),
        Method::Dropping => {
            let of_joint = |joint: usize| dropping(&seen(joint), limit_px).map(as_point);
            (0..N).map(of_joint).collect()
        }
        Method::Maps | Method::Space => {
            let each = views.iter().map(|(camera, view)| SpaceView {
                camera,
                evidence: *view,
                exchanged: [false; 2],
                front: view.front.unwrap_or_default(),
            });
            let each: Vec<SpaceView<'_>> = each.collect();
            let mut settings = SpaceSettings::default();
            if method == Method::Maps {
                settings.springs = 0.0;
            }
            match solve_person(&each, &settings) {
                Some(found) => found.pose.joints.map(|joint| joint.map(as_point)).to_vec(),
                None => vec![None; N],
            }
        }
    }
}

/// Returns the positions of a joint in the views. Views with a score near 0 are included, because they still contribute a direction.
fn sightings<'a>(views: &[(&'a Camera, &NetworkView)], joint: usize) -> Vec<Sighting<'a>> {
    let peak = |view: &NetworkView| view.maps.peaks()[joint];
    views
        .iter()
        .filter_map(|(camera, view)| Some((*camera, peak(view)?)))
        .map(|(camera, it)| (camera, it.at, it.score.max(1e-3)))
        .collect()
}
