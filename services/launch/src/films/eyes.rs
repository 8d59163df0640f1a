//! Who finds the joints in the pictures of a camera: a network, or the filters.

use deployment::Deployment;
use fmp::{CandidateSettings, Search};
use footage::{FrameView, Size, Turn};
use keypoints::{Keypoint, Sides};
use offline::pictures::{BOXES_PX, Picture, Searched};
use offline::{detector, network};
use posenetwork::{Detector, PoseNetwork, Workspace};
use runtime::{ExitKind, Failure, OrFail as _};
use skeleton::PARSE14;

use crate::inputs;

/// Detections of the filters: the lowest score, and how much of a better one's boxes a worse one may cover.
const THRESHOLD: f32 = -0.5;
const OVERLAP: f64 = 0.1;

/// Who finds the joints.
pub(super) struct Eyes {
    /// A network; the filters without it.
    network: Option<PoseNetwork>,
    /// Who finds the boxes of the network; the filters without it.
    detector: Option<Detector>,
    search: Option<Search>,
    n_people: usize,
}

/// Memory that is used again.
#[derive(Default)]
pub(super) struct Memory {
    workspace: Workspace,
    values: Vec<f32>,
}

/// The keypoints of one person, pixels of the picture.
pub(super) type Found = Vec<Option<Keypoint>>;

impl Eyes {
    pub(super) fn open(deployment: &Deployment, camera: usize) -> Result<Self, Failure> {
        let network = inputs::pose_network(deployment, camera)?;
        let detector = match &network {
            Some(_) => inputs::detector(&deployment.pose)?,
            None => None,
        };
        let search = if detector.is_some() {
            None
        } else {
            let model = inputs::model_or_shipped(deployment.model.as_deref())?;
            if network.is_none() && model.n_parts() != skeleton::N_PARTS {
                let message = format!(
                    "the model has {} parts: only of {} is it known where the joints are",
                    model.n_parts(),
                    skeleton::N_PARTS
                );
                return Err(Failure::new(ExitKind::Input, message));
            }
            Some(Search::new(model))
        };
        Ok(Self {
            network,
            detector,
            search,
            n_people: deployment.pose.people.max(4),
        })
    }

    /// The names of what is found.
    pub(super) fn names(&self) -> Vec<String> {
        if let Some(network) = &self.network {
            return network.names().to_vec();
        }
        let named = |name: &str| if name == "head" { "head top" } else { name }.to_owned();
        PARSE14.joints.iter().map(|it| named(it.name)).collect()
    }

    /// Whether sides follow the picture.
    pub(super) fn as_seen(&self) -> bool {
        let network = self.network.as_ref();
        network.is_none_or(|it| it.card().keypoints.sides == Sides::Seen)
    }

    pub(super) fn text(&self) -> String {
        let boxes = match &self.detector {
            Some(detector) => format!(", boxes by {}", detector.card().name),
            None if self.network.is_some() => ", boxes by the filters".to_owned(),
            None => String::new(),
        };
        match &self.network {
            Some(network) => format!("network {}{boxes}", network.card().name),
            None => "filters".to_owned(),
        }
    }

    /// The people of a picture.
    pub(super) fn people(
        &self,
        camera: &str,
        frame: &FrameView<'_>,
        size: Size,
        memory: &mut Memory,
    ) -> Result<Vec<Found>, Failure> {
        let picture = Picture {
            path: camera.into(),
            frame: Some(frame.index),
            turn: Turn::default(),
            size,
            rgb: frame.rgb.to_vec(),
        };
        let Some(network) = &self.network else {
            return Ok(self
                .by_filters(&picture)?
                .into_iter()
                .map(|it| it.1)
                .collect());
        };
        let outlines = match &self.detector {
            Some(boxes) => {
                let mut found = detector::people(boxes, &picture, &mut memory.values)?;
                found.truncate(self.n_people);
                found.into_iter().map(|it| it.outline).collect()
            }
            None => self
                .by_filters(&picture)?
                .into_iter()
                .map(|it| it.0)
                .collect::<Vec<_>>(),
        };
        let look = |outline: [f64; 4]| {
            let sight = network::look(network, &picture, outline, &mut memory.workspace)?;
            let found = sight.keypoints().or_fail(ExitKind::Input)?;
            Ok(found.into_iter().map(Some).collect())
        };
        outlines.into_iter().map(look).collect()
    }

    /// The boxes around people, widened, and their joints, by the filters.
    fn by_filters(&self, picture: &Picture) -> Result<Vec<([f64; 4], Found)>, Failure> {
        let Some(search) = &self.search else {
            return Ok(Vec::new());
        };
        let searched = Searched::new(picture, Some(BOXES_PX), search)?;
        let layout = searched.layout();
        let settings = CandidateSettings {
            threshold: THRESHOLD,
            overlap: OVERLAP,
            max: self.n_people,
        };
        let image = searched.image(picture)?;
        let found = search.on(image, layout, |it| search.solver.candidates(it, &settings));
        let person = |pose: &fmp::Pose| {
            let outline = searched.outline(&search.model, pose);
            let centres = pose.centres(&search.model, layout);
            let joints = if centres.len() == skeleton::N_PARTS {
                PARSE14.from_parts(&centres)
            } else {
                Vec::new()
            };
            let joint = |it: [f64; 2]| {
                Some(Keypoint {
                    at: searched.in_picture(it),
                    score: 1.0,
                })
            };
            (outline, joints.into_iter().map(joint).collect())
        };
        Ok(found.iter().map(person).collect())
    }
}
