//! The network that finds joints in the pictures of a camera.

use std::path::Path;

use deployment::{Deployment, SHIPPED};
use failure::{ExitKind, Failure, OrFail as _, in_file};
use footage::{FrameView, Size};
use inputs::library::Library;
use kernels::Rgb8View;
use keypoints::{Keypoint, Sides};
use pipeline::{NetworkMemory, NetworkSettings, NetworkStep};
use posenetwork::{Detector, JointMaps, PoseNetwork};

use crate::find_every::FindEvery;

/// The network that finds the joints, and the detector that finds the boxes.
pub(super) struct Eyes {
    joints: PoseNetwork,
    detector: Detector,
    n_people: usize,
}

/// The keypoints of one person, in pixels of the picture.
pub(super) type Found = Vec<Option<Keypoint>>;

impl Eyes {
    /// Opens the networks of a camera. With the paper's method, opens the shipped networks.
    pub(super) fn open(deployment: &Deployment, camera: usize) -> Result<Self, Failure> {
        let joints = match inputs::pose_network(deployment, camera)? {
            Some(joints) => joints,
            None => {
                inputs::open_network((Path::new(SHIPPED), None), &Library::BuiltIn)?.fitted()?
            }
        };
        Ok(Self {
            joints,
            detector: inputs::detector(deployment)?,
            n_people: deployment.network.people.max(4),
        })
    }

    /// Returns the names of the keypoints that the network finds.
    pub(super) fn names(&self) -> &[String] {
        self.joints.names()
    }

    /// Returns true if the network names left and right as seen in the picture.
    pub(super) fn as_seen(&self) -> bool {
        self.joints.card().keypoints.sides == Sides::Seen
    }

    pub(super) fn text(&self) -> String {
        let [joints, boxes] = [&self.joints.card().name, &self.detector.card().name];
        format!("network {joints}, boxes by {boxes}")
    }

    /// Starts to follow people through the pictures of a film, all of which must have the same size.
    ///
    /// * `rate_hz`: rate of the pictures that are used.
    pub(super) fn watch(self, deployment: &Deployment, size: Size, rate_hz: f64) -> Watch {
        let n_keypoints = self.names().len();
        let find_every = FindEvery::new(&deployment.network, Some(rate_hz));
        let settings = NetworkSettings {
            n_people: self.n_people,
            find_every: find_every.alone,
            find_every_of_several: find_every.several,
            least_heat: deployment.network.least_heat,
            ..NetworkSettings::default()
        };
        let eyes = pipeline::Eyes::Network(Box::new(self.joints), Box::new(self.detector));
        Watch {
            step: NetworkStep::new(eyes, [size.width, size.height], settings),
            n_keypoints,
            memory: NetworkMemory::default(),
        }
    }
}

/// Follows people from picture to picture, as a run does.
pub(super) struct Watch {
    step: NetworkStep,
    n_keypoints: usize,
    memory: NetworkMemory,
}

impl Watch {
    /// Returns the people in the next picture.
    pub(super) fn people(
        &mut self,
        camera: &str,
        frame: &FrameView<'_>,
        size: Size,
    ) -> Result<Vec<Found>, Failure> {
        let image = Rgb8View::new(size.width, size.height, frame.rgb).or_fail(ExitKind::Input)?;
        let looked = self.step.look(image, &mut self.memory);
        looked.map_err(|error| in_file(camera.as_ref(), &error))?;
        // Predicts the boxes for the next picture.
        self.step.sightings(&mut self.memory);
        let found = |maps: &JointMaps| {
            let each = (0..self.n_keypoints).map(|i| maps.keypoint(i).map(|found| found.0));
            each.collect()
        };
        Ok(self.memory.maps().map(found).collect())
    }
}
