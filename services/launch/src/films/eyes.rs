//! Who finds the joints in the pictures of a camera: a network, or the filters.

use deployment::Deployment;
use failure::{ExitKind, Failure, OrFail as _, in_file};
use fmp::{CandidateSettings, Search};
use footage::{FrameView, Size, Turn};
use inputs::pictures::{BOXES_PX, Picture, Searched};
use kernels::Rgb8View;
use keypoints::{Keypoint, Sides};
use pipeline::{Boxes, NetworkMemory, NetworkSettings, NetworkStep};
use posenetwork::{Detector, JointMaps, LookError, PoseNetwork};
use skeleton::PARSE14;

use crate::find_every::{find_every, find_every_of_several};

/// Detections of the filters: the lowest score, and how much of a better one's boxes a worse one may cover.
const THRESHOLD: f32 = -0.5;
const OVERLAP: f64 = 0.1;

/// Who finds the joints.
pub(super) struct Eyes {
    network: Option<Network>,
    /// The filters, where there is no network, or nothing else that finds its boxes.
    search: Option<Search>,
    n_people: usize,
}

/// A network, and what it needs to follow people.
struct Network {
    joints: PoseNetwork,
    /// Who finds the boxes; the filters without it.
    detector: Option<Detector>,
}

/// The keypoints of one person, pixels of the picture.
pub(super) type Found = Vec<Option<Keypoint>>;

impl Eyes {
    pub(super) fn open(deployment: &Deployment, camera: usize) -> Result<Self, Failure> {
        let network = match inputs::pose_network(deployment, camera)? {
            Some(joints) => Some(Network {
                joints,
                detector: inputs::detector(deployment)?,
            }),
            None => None,
        };
        let search = if network.as_ref().is_some_and(|it| it.detector.is_some()) {
            None
        } else {
            let model = inputs::model_or_shipped(deployment.paper.model.as_deref())?;
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
            search,
            n_people: deployment.network.people.max(4),
        })
    }

    /// The names of what is found.
    pub(super) fn names(&self) -> Vec<String> {
        if let Some(network) = &self.network {
            return network.joints.names().to_vec();
        }
        let named = |name: &str| if name == "head" { "head top" } else { name }.to_owned();
        PARSE14.joints.iter().map(|it| named(it.name)).collect()
    }

    /// Whether sides follow the picture.
    pub(super) fn as_seen(&self) -> bool {
        let network = self.network.as_ref();
        network.is_none_or(|it| it.joints.card().keypoints.sides == Sides::Seen)
    }

    pub(super) fn text(&self) -> String {
        let Some(it) = &self.network else {
            return "filters".to_owned();
        };
        let boxes = it.detector.as_ref().map(|it| it.card().name.as_str());
        let name = &it.joints.card().name;
        format!(
            "network {name}, boxes by {}",
            boxes.unwrap_or("the filters")
        )
    }

    /// Begins to watch the pictures of a film, of one size.
    ///
    /// * `rate_hz`: of those that are looked at.
    pub(super) fn watch(
        self,
        deployment: &Deployment,
        size: Size,
        rate_hz: f64,
    ) -> Result<Watch, Failure> {
        let n_keypoints = self.names().len();
        let Self {
            network,
            search,
            n_people,
        } = self;
        let search = search.map(|search| Filters { search, n_people });
        let Some(network) = network else {
            let search = search
                .ok_or("neither network nor filters")
                .or_fail(ExitKind::Config)?;
            return Ok(Watch::Filters(Box::new(search)));
        };
        let boxes = match network.detector {
            Some(it) => Boxes::Detector(Box::new(it)),
            None => Boxes::Caller,
        };
        let settings = NetworkSettings {
            n_people,
            find_every: find_every(&deployment.network, Some(rate_hz)),
            find_every_of_several: find_every_of_several(&deployment.network, Some(rate_hz)),
            least_heat: deployment.network.least_heat,
            ..NetworkSettings::default()
        };
        let eyes = pipeline::Eyes::Network(Box::new(network.joints), boxes);
        Ok(Watch::Network(Box::new(Follower {
            step: NetworkStep::new(eyes, [size.width, size.height], settings),
            search,
            n_keypoints,
            memory: NetworkMemory::default(),
        })))
    }
}

/// Finds the people of one picture after another.
pub(super) enum Watch {
    Filters(Box<Filters>),
    Network(Box<Follower>),
}

impl Watch {
    /// The people of the next picture.
    pub(super) fn people(
        &mut self,
        camera: &str,
        frame: &FrameView<'_>,
        size: Size,
    ) -> Result<Vec<Found>, Failure> {
        let picture = || Picture {
            path: camera.into(),
            frame: Some(frame.index),
            turn: Turn::default(),
            size,
            rgb: frame.rgb.to_vec(),
        };
        match self {
            Self::Filters(search) => {
                let found = search.people(&picture())?;
                Ok(found.into_iter().map(|it| it.1).collect())
            }
            Self::Network(it) => it.people(camera, frame, (size, &picture)),
        }
    }
}

/// The network, which follows people as it does in a run.
pub(super) struct Follower {
    step: NetworkStep,
    /// Who finds the boxes, where no detector does.
    search: Option<Filters>,
    n_keypoints: usize,
    memory: NetworkMemory,
}

/// Why a picture was not looked at.
enum Trouble {
    Look(LookError),
    Boxes(Failure),
}

impl From<LookError> for Trouble {
    fn from(error: LookError) -> Self {
        Self::Look(error)
    }
}

impl Follower {
    fn people(
        &mut self,
        camera: &str,
        frame: &FrameView<'_>,
        (size, picture): (Size, &dyn Fn() -> Picture),
    ) -> Result<Vec<Found>, Failure> {
        let image = Rgb8View::new(size.width, size.height, frame.rgb).or_fail(ExitKind::Input)?;
        let looked = match &self.search {
            None => self
                .step
                .look(image, &mut self.memory)
                .map_err(Trouble::from),
            Some(search) => {
                let mut find = |_: &mut Vec<f32>| {
                    let found = search.people(&picture()).map_err(Trouble::Boxes)?;
                    Ok(found.into_iter().map(|it| it.0).collect())
                };
                self.step.look_by(image, &mut find, &mut self.memory)
            }
        };
        looked.map_err(|trouble| match trouble {
            Trouble::Look(error) => in_file(camera.as_ref(), &error),
            Trouble::Boxes(failure) => failure,
        })?;
        // Tells the boxes of the next picture.
        self.step.sightings(&mut self.memory);
        let found = |maps: &JointMaps| {
            let each = (0..self.n_keypoints).map(|it| maps.keypoint(it).map(|it| it.0));
            each.collect()
        };
        Ok(self.memory.maps().map(found).collect())
    }
}

/// The filters, which look at every picture by itself.
pub(super) struct Filters {
    search: Search,
    n_people: usize,
}

impl Filters {
    /// The boxes around people, widened, and their joints.
    fn people(&self, picture: &Picture) -> Result<Vec<([f64; 4], Found)>, Failure> {
        let search = &self.search;
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
