//! Other people, who stand around the subject, or walk and pass it.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::body::{N_BONES, N_EXTRAS, PELVIS};
use crate::mesh;
use crate::motion::{Action, Motion};
use crate::painter::Figure;
use crate::random::Random;
use crate::settings::Settings;
use crate::subject::Subject;
use crate::truth::N_JOINTS;
use crate::wear::Wear;

/// Range of distances of standing people from the middle of the stage, in metres; it is outside the path of a person who walks there.
const AWAY_M: [f64; 2] = [1.7, 2.1];

/// Range of distances, in metres, between the middle of the stage, around which the subject walks, and the centre of a passer's path.
const BESIDE_M: [f64; 2] = [0.4, 0.9];
/// Minimum distance between the trunks of people who pass each other, in metres. It may be smaller if no such path is found.
const NEAREST_M: f64 = 0.6;
/// Number of random paths that are tried for a passer; the next constants are the duration and the interval of the check, in seconds.
const N_WAYS: u64 = 60;
const WATCHED_S: f64 = 20.0;
const WATCHED_EVERY_S: f64 = 0.2;

/// Another person, who either stands still and gestures, or walks.
#[derive(Debug)]
pub(crate) struct Bystander {
    pub(crate) figure: Figure,
    way: Way,
}

/// Motion of a person, and the person's position on the stage.
#[derive(Debug)]
struct Way {
    motion: Box<Motion>,
    on_stage: Isometry3<f64>,
}

impl Way {
    /// Returns the frames of all bones at a time, in the frame of the stage.
    fn frames(&self, seconds: f64) -> [Isometry3<f64>; N_BONES] {
        let frames = self.motion.bones.frames(&self.motion.pose(seconds));
        frames.map(|frame| self.on_stage * frame)
    }

    /// Creates a person who walks around a point beside the middle of the stage.
    fn walking(subject: &Subject, mut random: Random) -> Self {
        let bearing = random.range(0.0, core::f64::consts::TAU);
        let away = random.range(BESIDE_M[0], BESIDE_M[1]);
        let place = Vector3::new(bearing.cos(), bearing.sin(), 0.0) * away;
        Self {
            motion: Box::new(Motion::new(subject, Action::Walking, random.bits())),
            on_stage: Isometry3::new(place, Vector3::zeros()),
        }
    }
}

impl Bystander {
    /// Creates a person who stands.
    ///
    /// * `number`: index among the standing people of the scene.
    pub(crate) fn standing(settings: &Settings, number: u64) -> Self {
        let mut random =
            Random::new(settings.subject).fork("others").nth(settings.seed).nth(number);
        let subject = Subject::new(random.bits());
        let share = (number as f64 + random.range(0.0, 0.6)) / settings.others.max(1) as f64;
        let bearing = share * core::f64::consts::TAU;
        let away = random.range(AWAY_M[0], AWAY_M[1]);
        let place = Vector3::new(bearing.cos(), bearing.sin(), 0.0) * away;
        let turn = Vector3::z() * random.range(0.0, core::f64::consts::TAU);
        let way = Way {
            motion: Box::new(Motion::new(&subject, Action::Gestures, settings.seed)),
            on_stage: Isometry3::new(place, turn),
        };
        Self::new(&subject, way)
    }

    /// Creates a person who walks past the others.
    ///
    /// * `number`: index among the passers of the scene.
    /// * `trunks`: function that returns the trunk positions of the others at a time, in metres on the stage.
    pub(crate) fn passing(
        settings: &Settings,
        number: u64,
        trunks: &dyn Fn(f64) -> Vec<Vector3<f64>>,
    ) -> Self {
        let random = Random::new(settings.subject).fork("passers").nth(settings.seed).nth(number);
        let subject = Subject::new(random.fork("subject").bits());
        let n_instants = (WATCHED_S / WATCHED_EVERY_S) as usize;
        let instants = (0..n_instants).map(|nth| nth as f64 * WATCHED_EVERY_S);
        let others: Vec<(f64, Vec<Vector3<f64>>)> =
            instants.map(|seconds| (seconds, trunks(seconds))).collect();
        let nearest = |way: &Way| {
            let each = others.iter().flat_map(|(seconds, trunks)| {
                let own = way.frames(*seconds)[PELVIS].translation.vector;
                trunks.iter().map(move |trunk| (trunk - own).norm())
            });
            each.fold(f64::INFINITY, f64::min)
        };
        let mut best = Way::walking(&subject, random);
        let mut apart = nearest(&best);
        for nth in 1..N_WAYS {
            if apart >= NEAREST_M {
                break;
            }
            let other = Way::walking(&subject, random.nth(nth));
            let other_apart = nearest(&other);
            if other_apart > apart {
                (best, apart) = (other, other_apart);
            }
        }
        Self::new(&subject, best)
    }

    fn new(subject: &Subject, way: Way) -> Self {
        let (shape, mesh) = mesh::of(subject, &way.motion.bones);
        let wear = Wear::new(subject, &shape);
        Self {
            figure: Figure { mesh, wear },
            way,
        }
    }

    /// Returns the frames of all bones at a time, in the frame of the stage.
    pub(crate) fn frames(&self, seconds: f64) -> [Isometry3<f64>; N_BONES] {
        self.way.frames(seconds)
    }

    /// Returns the joints of `skeleton::PARSE14` at a time, in the frame of the stage.
    pub(crate) fn joints(&self, seconds: f64) -> [Point3<f64>; N_JOINTS] {
        self.way.motion.bones.joints(&self.frames(seconds))
    }

    /// Returns the nose, heels and big toes at a time, in the frame of the stage.
    pub(crate) fn extras(&self, seconds: f64) -> [Point3<f64>; N_EXTRAS] {
        self.way.motion.bones.extras(&self.frames(seconds))
    }
}
