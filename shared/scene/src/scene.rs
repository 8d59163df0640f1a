//! A scene, and the pictures and ground truth of each of its cameras.

use std::sync::Arc;

use footage::{FootageError, Size};
use geometry::{Camera, Rig, RigError};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::backdrop::Backdrop;
use crate::body::{Bones, CHEST, N_BONES, N_EXTRAS, PELVIS};
use crate::bystander::Bystander;
use crate::mesh;
use crate::motion::Motion;
use crate::painter::{self, Figure, Painter, Person};
use crate::performance::{Course, Performance};
use crate::photo::{Photo, photos_in};
use crate::random::Random;
use crate::raster::SUB;
use crate::recorded::{Recorded, Recording};
use crate::rigs::{self, RigChoiceError};
use crate::room::Room;
use crate::settings::{Address, Settings};
use crate::subject::Subject;
use crate::truth::{Header, N_JOINTS, View as ViewTruth};
use crate::wear::Wear;

/// Reason why a scene could not be created.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The rig cannot be loaded.
    #[error("the rig of the scene is not usable")]
    Rig(#[from] RigChoiceError),
    /// A photograph for the background cannot be read.
    #[error("a background cannot be used")]
    Backdrop(#[from] FootageError),
    /// With the requested calibration error, the cameras do not form a valid rig.
    #[error("the rig is not valid with the calibration error")]
    Calibration(#[from] RigError),
    /// The rig has no such camera.
    #[error("there is no camera {name:?}, only {}", known.join(", "))]
    NoCamera {
        /// Requested name.
        name: String,
        /// Names of the cameras of the rig.
        known: Vec<String>,
    },
}

/// A person, a performance, a room and a rig.
#[derive(Debug)]
pub struct Scene {
    settings: Settings,
    rig: Rig,
    world_from_stage: Isometry3<f64>,
    performance: Performance,
    figure: Figure,
    others: Vec<Bystander>,
    room: Room,
    random: Random,
}

/// Thickness of the body around each joint, in metres for a person of 1.75 m, in the order of `skeleton::PARSE14`. A surface that is nearer
/// to the camera than the joint by more than this thickness hides the joint.
const TISSUE: [f64; N_JOINTS] = [
    0.07, 0.085, 0.16, 0.16, 0.085, 0.07, 0.055, 0.07, 0.10, 0.10, 0.07, 0.055, 0.10, 0.13,
];

impl Scene {
    /// Creates a scene, including the surface of the person and the room.
    ///
    /// # Errors
    ///
    /// [`SceneError::Rig`].
    pub fn new(settings: &Settings) -> Result<Self, SceneError> {
        let subject = Subject::new(settings.subject);
        let motion = Motion::new(&subject, settings.action, settings.seed);
        let performance = Performance {
            bones: motion.bones.clone(),
            height: motion.height(),
            name: settings.action.name().to_owned(),
            course: Course::Acted(Box::new(motion)),
        };
        Self::build(settings, &subject, performance)
    }

    /// Creates a scene from a recording. In the middle of the room, the subject repeats the recorded motion, scaled to the subject's size.
    /// The action of the settings is ignored.
    ///
    /// # Errors
    ///
    /// [`SceneError::Rig`].
    ///
    /// # Panics
    ///
    /// If the recording has no postures.
    pub fn of_recording(settings: &Settings, recording: &Recording) -> Result<Self, SceneError> {
        assert!(!recording.postures.is_empty(), "a recording of nothing");
        let subject = Subject::new(settings.subject);
        let bones = Bones::new(&subject.proportions);
        let height = subject.proportions.height;
        let performance = Performance {
            course: Course::Recorded(Box::new(Recorded::new(recording, &bones, height))),
            bones,
            height,
            name: recording.name.clone(),
        };
        Self::build(settings, &subject, performance)
    }

    fn build(
        settings: &Settings,
        subject: &Subject,
        performance: Performance,
    ) -> Result<Self, SceneError> {
        let rig = settings.rig.rig()?;
        let world_from_stage = rigs::world_from_stage(&rig)?;
        let (shape, mesh) = mesh::of(subject, &performance.bones);
        let wear = Wear::new(subject, &shape);
        let random = Random::new(settings.seed)
            .fork("scene")
            .nth(settings.subject)
            .fork(&performance.name);
        let others = others(settings, &performance);
        let stage_from_world = world_from_stage.inverse();
        let eyes = rig
            .cameras()
            .iter()
            .map(|camera| (stage_from_world * camera.centre_in_world()).cast());
        let eyes: Vec<Point3<f32>> = eyes.collect();
        let room = Room::new(random, &eyes, performance.furniture());
        Ok(Self {
            settings: settings.clone(),
            rig,
            world_from_stage,
            performance,
            figure: Figure { mesh, wear },
            others,
            room,
            random,
        })
    }

    /// Returns the settings of the scene.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns the name of the person's action, or of the recording.
    pub fn action(&self) -> &str {
        &self.performance.name
    }

    /// Returns the cameras that take the pictures.
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// Returns the cameras as they are written to the rig file, with the requested calibration error.
    ///
    /// # Errors
    ///
    /// [`RigError`] if the error is so large that the rig becomes invalid.
    pub fn written_rig(&self) -> Result<Rig, RigError> {
        self.settings.flaws.written(&self.rig, self.random)
    }

    /// Returns the first line of the file of ground truth.
    pub fn header(&self) -> Header {
        let up = self.world_from_stage.rotation * Vector3::z();
        Header {
            frame_rate_hz: self.settings.rate_hz,
            up: up.into(),
            cameras: self.rig.cameras().iter().map(|camera| camera.name.clone()).collect(),
            ..Header::new(self.settings.subject, self.action(), self.settings.seed)
        }
    }

    /// Nominal time of a frame, in seconds.
    pub fn seconds(&self, frame: u64) -> f64 {
        frame as f64 / self.settings.rate_hz
    }

    /// Returns the joints of `skeleton::PARSE14` at a time, in metres in the world.
    pub fn joints(&self, seconds: f64) -> [[f64; 3]; N_JOINTS] {
        let frames = self.performance.frames(seconds);
        let joints = self.performance.bones.joints(&frames);
        joints.map(|joint| (self.world_from_stage * joint).coords.into())
    }

    /// Returns the joints of every other person at a time, in metres in the world.
    pub fn other_joints(&self, seconds: f64) -> Vec<[[f64; 3]; N_JOINTS]> {
        let in_world = |joints: [Point3<f64>; N_JOINTS]| {
            joints.map(|joint| (self.world_from_stage * joint).coords.into())
        };
        let others = self.others.iter();
        others.map(|other| in_world(other.joints(seconds))).collect()
    }

    /// Returns the nose, the heels (left, right) and the big toes (left, right) at a time, in metres in the world.
    pub fn extras(&self, seconds: f64) -> [[f64; 3]; N_EXTRAS] {
        let frames = self.performance.frames(seconds);
        let extras = self.performance.bones.extras(&frames);
        extras.map(|extra| (self.world_from_stage * extra).coords.into())
    }

    /// Returns the same points of every other person, in the order of [`other_joints`](Self::other_joints).
    pub fn other_extras(&self, seconds: f64) -> Vec<[[f64; 3]; N_EXTRAS]> {
        let in_world = |extras: [Point3<f64>; N_EXTRAS]| {
            extras.map(|extra| (self.world_from_stage * extra).coords.into())
        };
        let others = self.others.iter();
        others.map(|other| in_world(other.extras(seconds))).collect()
    }

    /// Returns the index of a camera, given its name in the rig or its index.
    ///
    /// # Errors
    ///
    /// [`SceneError::NoCamera`].
    pub fn camera(&self, name: &str) -> Result<usize, SceneError> {
        camera_of(&self.rig, name)
    }

    /// Returns the time at which a camera took the picture of a frame, and whether the picture repeats an earlier one.
    fn taken(&self, camera: usize, frame: u64) -> (f64, bool) {
        let flaws = &self.settings.flaws;
        let mut shown = frame;
        while flaws.drops(self.random, camera, shown) {
            shown -= 1;
        }
        let late = flaws.late_s(self.random, camera);
        let skew = self.settings.skews_ms.get(camera).map_or(0.0, |skews_ms| skews_ms * 1e-3);
        (self.seconds(shown) + skew + late, shown != frame)
    }
}

/// Returns the other people: first those who stand, then those who walk past.
fn others(settings: &Settings, performance: &Performance) -> Vec<Bystander> {
    let standing = 0..settings.others;
    let mut others: Vec<Bystander> =
        standing.map(|nth| Bystander::standing(settings, nth)).collect();
    for nth in 0..settings.passers {
        let trunk = |frames: [Isometry3<f64>; N_BONES]| frames[PELVIS].translation.vector;
        let trunks = |seconds: f64| {
            let others = others.iter().map(|other| trunk(other.frames(seconds)));
            let all = core::iter::once(trunk(performance.frames(seconds))).chain(others);
            all.collect()
        };
        let passer = Bystander::passing(settings, nth, &trunks);
        others.push(passer);
    }
    others
}

/// Returns the index of a camera of a rig, given its name or its index, counted from 0.
///
/// # Errors
///
/// [`SceneError::NoCamera`].
pub fn camera_of(rig: &Rig, name: &str) -> Result<usize, SceneError> {
    let cameras = rig.cameras();
    let by_name = cameras.iter().position(|camera| camera.name == name);
    let by_number = || name.parse().ok().filter(|value| *value < cameras.len());
    by_name.or_else(by_number).ok_or_else(|| SceneError::NoCamera {
        name: name.to_owned(),
        known: cameras.iter().map(|camera| camera.name.clone()).collect(),
    })
}

/// Returns the time from the instants of the frames to the pictures of the camera in an address, in milliseconds; 0 if the rig has no such
/// camera.
pub fn skew_ms_of(address: &Address) -> f64 {
    let Settings { rig, skews_ms, .. } = &address.settings;
    let rig = (!skews_ms.is_empty()).then(|| rig.rig().ok()).flatten();
    let nth = rig.and_then(|rig| camera_of(&rig, &address.camera).ok());
    nth.and_then(|nth| skews_ms.get(nth)).copied().unwrap_or(0.0)
}

/// One camera of a scene; renders its pictures in its own buffers.
///
/// Cloning copies these buffers, but not the background, which is shared.
#[derive(Debug, Clone)]
pub struct View {
    scene: Arc<Scene>,
    camera: usize,
    /// The camera in the frame of the stage.
    on_stage: Camera,
    backdrop: Arc<Backdrop>,
    painter: Painter,
}

impl View {
    /// Renders the background, which takes as long as several pictures.
    ///
    /// # Errors
    ///
    /// [`SceneError::Backdrop`] if a photograph cannot be read, [`SceneError::NoCamera`].
    pub fn new(scene: &Arc<Scene>, camera: usize) -> Result<Self, SceneError> {
        let camera = camera_of(&scene.rig, &camera.to_string())?;
        let in_world = &scene.rig.cameras()[camera];
        let on_stage = Camera {
            camera_from_world: in_world.camera_from_world * scene.world_from_stage,
            ..in_world.clone()
        };
        let photo = match &scene.settings.backdrop {
            None => None,
            Some(folder) => {
                let all = photos_in(folder)?;
                let mut random = scene.random.fork("backdrop").nth(camera as u64);
                Some(Photo::read(random.pick::<std::path::PathBuf>(&all))?)
            }
        };
        let backdrop = Backdrop::new(&on_stage, &scene.room, photo.as_ref());
        Ok(Self {
            scene: Arc::clone(scene),
            camera,
            on_stage,
            backdrop: Arc::new(backdrop),
            painter: Painter::new(),
        })
    }

    /// Returns the width and height of the pictures.
    pub fn size(&self) -> Size {
        self.backdrop.size
    }

    /// Renders the picture of a frame, and returns its ground truth.
    ///
    /// * `rgb`: `width * height * 3` bytes, all of which are written.
    ///
    /// # Panics
    ///
    /// If `rgb` has another length.
    pub fn picture(&mut self, frame: u64, rgb: &mut [u8]) -> ViewTruth {
        assert_eq!(
            rgb.len(),
            self.size().rgb_bytes(),
            "a picture is {} in RGB",
            self.size()
        );
        let (seconds, repeated) = self.scene.taken(self.camera, frame);
        let frames = self.draw(seconds, Some(rgb));
        let random = self.scene.random.fork("spoil").nth(self.camera as u64).nth(seconds.to_bits());
        self.scene.settings.flaws.degrade(random, self.backdrop.size, rgb);
        self.ground_truth(&frames, seconds, repeated)
    }

    /// Returns the ground truth of the picture of a frame, without the picture.
    pub fn truth(&mut self, frame: u64) -> ViewTruth {
        let (seconds, repeated) = self.scene.taken(self.camera, frame);
        let frames = self.draw(seconds, None);
        self.ground_truth(&frames, seconds, repeated)
    }

    /// Returns the coverage of every pixel of the last picture by the person, 0 to 255, row major.
    pub fn mask(&self) -> Vec<u8> {
        let size = self.size();
        let mut mask = vec![0; size.width * size.height];
        self.painter.mask(&mut mask);
        mask
    }

    /// Returns the visible area of each person in the last picture, in pixels. The subject comes first, then the others in the order of
    /// [`Scene::other_joints`].
    pub fn seen_px(&self) -> Vec<f64> {
        let samples = self.painter.seen().into_iter();
        samples.map(|n| n as f64 / (SUB * SUB) as f64).collect()
    }

    /// Finds the visible parts of the people, and renders the picture if requested; returns the bones of the subject.
    fn draw(&mut self, seconds: f64, rgb: Option<&mut [u8]>) -> [Isometry3<f64>; N_BONES] {
        let scene = &self.scene;
        let frames = scene.performance.frames(seconds);
        let others = scene.others.iter().map(|other| (other, other.frames(seconds)));
        let others: Vec<(&Bystander, [Isometry3<f64>; N_BONES])> = others.collect();
        let subject = Person {
            figure: &scene.figure,
            frames: &frames,
        };
        let others = others.iter().map(|(other, frames)| Person {
            figure: &other.figure,
            frames,
        });
        let people: Vec<Person<'_>> = core::iter::once(subject).chain(others).collect();
        let input = painter::Input {
            people: &people,
            camera: &self.on_stage,
            backdrop: &self.backdrop,
            light: &scene.room.light,
        };
        self.painter.draw(&input);
        if let Some(rgb) = rgb {
            self.painter.paint(&input, rgb);
        }
        frames
    }

    fn ground_truth(
        &self,
        frames: &[Isometry3<f64>; N_BONES],
        seconds: f64,
        repeated: bool,
    ) -> ViewTruth {
        let camera = &self.scene.rig.cameras()[self.camera];
        let joints = self.scene.performance.bones.joints(frames);
        let in_world = joints.map(|joint| self.scene.world_from_stage * joint);
        let pixels = in_world.map(|joint| camera.project(&joint).map(|px| px.coords.into()));
        let eye = self.on_stage.centre_in_world();
        let facing: f64 = [CHEST, PELVIS]
            .iter()
            .map(|bone| {
                let to_eye = eye - Point3::from(frames[*bone].translation.vector);
                (frames[*bone].rotation * Vector3::x()).dot(&to_eye)
            })
            .sum();
        ViewTruth {
            camera: camera.name.clone(),
            seconds,
            repeated,
            from_behind: facing < 0.0,
            visible: core::array::from_fn(|joint| {
                self.is_visible(joint, &joints[joint], pixels[joint])
            }),
            pixels,
            outline: self.outline(),
        }
    }

    /// Returns true if nothing except the body around a joint hides it.
    fn is_visible(&self, joint: usize, at: &Point3<f64>, pixel: Option<[f64; 2]>) -> bool {
        let Some([x, y]) = pixel else { return false };
        let samples = &self.painter.samples;
        let index = |pixel: f64, n: usize| {
            let sample = ((pixel + 0.5) * SUB as f64).floor();
            (sample >= 0.0 && sample < n as f64).then_some(sample as usize)
        };
        let (Some(column), Some(row)) = (index(x, samples.width), index(y, samples.height)) else {
            return false;
        };
        let depth = (self.on_stage.camera_from_world * at).z;
        let in_front = depth - 1.0 / f64::from(samples.near[row * samples.width + column]);
        in_front < TISSUE[joint] * self.scene.performance.height / 1.75
    }

    /// Returns the bounding box of the samples at which the subject is visible, in pixels.
    fn outline(&self) -> Option<[f64; 4]> {
        let samples = &self.painter.samples;
        let [x1, y1, x2, y2] = samples.touched;
        let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
        for row in y1..y2 {
            for column in x1..x2 {
                if self.painter.sees_subject(row * samples.width + column) {
                    low = [low[0].min(column), low[1].min(row)];
                    high = [high[0].max(column), high[1].max(row)];
                }
            }
        }
        let pixel = |sample: usize| (sample / SUB) as f64;
        (low[0] != usize::MAX)
            .then(|| [pixel(low[0]), pixel(low[1]), pixel(high[0]), pixel(high[1])])
    }
}

#[cfg(test)]
mod tests;
