//! Other people, who stand around the subject.

use nalgebra::{Isometry3, Vector3};

use crate::body::N_BONES;
use crate::mesh;
use crate::motion::{Action, Motion};
use crate::painter::Figure;
use crate::random::Random;
use crate::settings::Settings;
use crate::subject::Subject;
use crate::wear::Wear;

/// Distance from the middle of the stage, metres: beyond the path of somebody who walks there.
const AWAY_M: [f64; 2] = [1.7, 2.1];

/// A person who stands still and gestures.
#[derive(Debug)]
pub(crate) struct Bystander {
    pub(crate) figure: Figure,
    motion: Box<Motion>,
    on_stage: Isometry3<f64>,
}

impl Bystander {
    /// * `number`: among the others of the scene, from 0.
    pub(crate) fn new(settings: &Settings, number: u64) -> Self {
        let mut random = Random::new(settings.subject)
            .fork("others")
            .nth(settings.seed)
            .nth(number);
        let subject = Subject::new(random.bits());
        let share = (number as f64 + random.range(0.0, 0.6)) / settings.others.max(1) as f64;
        let bearing = share * core::f64::consts::TAU;
        let away = random.range(AWAY_M[0], AWAY_M[1]);
        let place = Vector3::new(bearing.cos(), bearing.sin(), 0.0) * away;
        let turn = Vector3::z() * random.range(0.0, core::f64::consts::TAU);
        let motion = Motion::new(&subject, Action::Gestures, settings.seed);
        let (shape, mesh) = mesh::of(&subject, &motion.bones);
        let wear = Wear::new(&subject, &shape);
        Self {
            figure: Figure { mesh, wear },
            motion: Box::new(motion),
            on_stage: Isometry3::new(place, turn),
        }
    }

    /// The frames of all bones at a time, in the frame of the stage.
    pub(crate) fn frames(&self, seconds: f64) -> [Isometry3<f64>; N_BONES] {
        let frames = self.motion.bones.frames(&self.motion.pose(seconds));
        frames.map(|it| self.on_stage * it)
    }
}
