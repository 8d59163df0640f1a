//! Actions that consist of key poses at regular intervals, here called beats. Key poses are random where the action allows it.

use super::stance::Stance;
use super::{Action, Actor, Motion};
use crate::body::{HEAD, PELVIS, Pose};
use crate::random::Random;
use crate::room::{Block, Material};

/// Seconds from one key pose to the next.
fn beat_seconds(action: Action) -> f64 {
    match action {
        Action::Boxing => 0.42,
        Action::ThrowCatch => 0.6,
        Action::Gestures | Action::Table => 1.1,
        Action::Grab => 1.2,
        Action::Chair => 1.3,
        _ => 2.2,
    }
}

/// Returns the stance at a time, between two key poses.
pub(super) fn stance(actor: &Actor, action: Action, seconds: f64) -> Stance {
    let beats = seconds * actor.subject.style.tempo / beat_seconds(action);
    let nth = beats.floor();
    // In the first three quarters of a beat, the body moves to the next pose; in the last quarter, it keeps this pose.
    let share = ((beats - nth) / 0.75).min(1.0);
    let share = share * share * (3.0 - 2.0 * share);
    let nth = nth as i64;
    let mut it = key(actor, action, nth).towards(&key(actor, action, nth + 1), share);
    it.place = actor.place;
    it.heading = actor.heading;
    if matches!(
        action,
        Action::Boxing | Action::Gestures | Action::ThrowCatch
    ) {
        it.heading += 0.6 * (0.31 * seconds).sin();
        it.place[0] += 0.12 * (0.53 * seconds).sin();
        it.place[1] += 0.12 * (0.41 * seconds).cos();
    }
    it
}

/// Returns the n-th key pose.
fn key(actor: &Actor, action: Action, nth: i64) -> Stance {
    let mut random = actor.random.fork("keys").nth(nth as u64);
    let it = Stance::standing(&actor.subject);
    let mut it = match action {
        Action::Boxing => boxing(it, nth, &mut random),
        Action::Gestures => gestures(it, &mut random),
        Action::ThrowCatch => throw_catch(it, nth.rem_euclid(6)),
        Action::Chair => chair(it, nth.rem_euclid(6), &mut random),
        Action::Grab => grab(it, nth.rem_euclid(4), &mut random),
        Action::Lean => lean(it, nth, actor),
        Action::Table => table(it, &mut random),
        Action::Lying => lying(it, actor, &mut random),
        Action::Walking | Action::Jogging => it,
    };
    // No two repetitions are the same.
    for angle in it.angles.iter_mut().flatten() {
        *angle *= 1.0 + 0.06 * random.normal();
    }
    if matches!(action, Action::Lying) {
        it
    } else {
        it.flat()
    }
}

fn boxing(it: Stance, nth: i64, random: &mut Random) -> Stance {
    let knees = random.range(18.0, 34.0);
    let guard = it
        .leg(0, 24.0, knees)
        .leg(1, -4.0, knees)
        .arms([38.0, 14.0, -8.0], 122.0)
        .trunk(10.0, 0.0, -12.0);
    if nth.rem_euclid(2) == 0 {
        return guard;
    }
    let side = usize::from(random.chance(0.45));
    let turn = if side == 0 { -28.0 } else { 34.0 };
    let (shoulder, elbow) = match random.unit() {
        it if it < 0.6 => ([84.0, 4.0, -20.0], 10.0),
        it if it < 0.8 => ([62.0, 55.0, -30.0], 85.0),
        _ => ([72.0, 2.0, 0.0], 75.0),
    };
    guard.arm(side, shoulder, elbow).trunk(6.0, 0.0, turn)
}

/// Angles of the shoulder and the elbow for gestures.
const ARM_GESTURES: [([f64; 3], f64); 11] = [
    ([4.0, 10.0, 0.0], 14.0),
    ([4.0, 10.0, 0.0], 14.0),
    ([5.0, 85.0, 78.0], 75.0),
    ([5.0, 80.0, 80.0], 110.0),
    ([86.0, 6.0, 0.0], 6.0),
    ([6.0, 86.0, 0.0], 6.0),
    ([160.0, 12.0, 0.0], 12.0),
    ([-22.0, 42.0, -48.0], 96.0),
    ([42.0, 16.0, 15.0], 108.0),
    ([46.0, 8.0, -42.0], 100.0),
    ([26.0, 14.0, 8.0], 78.0),
];

fn gestures(it: Stance, random: &mut Random) -> Stance {
    let left = *random.pick(&ARM_GESTURES);
    let right = if random.chance(0.4) {
        left
    } else {
        *random.pick(&ARM_GESTURES)
    };
    it.arm(0, left.0, left.1)
        .arm(1, right.0, right.1)
        .trunk(
            random.range(-4.0, 10.0),
            random.range(-5.0, 5.0),
            random.range(-16.0, 16.0),
        )
        .look(random.range(-8.0, 12.0), random.range(-30.0, 30.0))
        .leg(0, random.range(-3.0, 6.0), random.range(2.0, 12.0))
        .leg(1, random.range(-3.0, 6.0), random.range(2.0, 12.0))
}

fn throw_catch(it: Stance, phase: i64) -> Stance {
    let ready = it.clone().legs(8.0, 16.0);
    match phase {
        0 => ready.arms([34.0, 10.0, -10.0], 84.0),
        1 => ready
            .leg(0, 18.0, 14.0)
            .arm(0, [55.0, 25.0, 0.0], 25.0)
            .arm(1, [10.0, 88.0, 78.0], 96.0)
            .trunk(-4.0, 0.0, -26.0),
        2 => ready
            .leg(0, 30.0, 18.0)
            .leg(1, -14.0, 14.0)
            .arm(0, [10.0, 22.0, 0.0], 40.0)
            .arm(1, [118.0, 18.0, 10.0], 22.0)
            .trunk(12.0, 0.0, 20.0),
        3 => ready
            .leg(0, 28.0, 22.0)
            .leg(1, -12.0, 18.0)
            .arm(0, [0.0, 20.0, 0.0], 50.0)
            .arm(1, [40.0, -12.0, 0.0], 24.0)
            .trunk(22.0, 0.0, 26.0),
        4 => it.arms([30.0, 14.0, 0.0], 70.0).legs(14.0, 26.0),
        _ => ready.arms([72.0, 4.0, -6.0], 46.0).trunk(6.0, 0.0, 0.0),
    }
}

fn sitting(it: Stance) -> Stance {
    let mut it = it.legs(88.0, 84.0).trunk(8.0, 0.0, 0.0);
    for thigh in crate::body::THIGH {
        it.angles[thigh][1] = 7.0;
    }
    it
}

fn chair(it: Stance, phase: i64, random: &mut Random) -> Stance {
    let rest = |stance: Stance, random: &mut Random| match random.unit() {
        share if share < 0.5 => stance.arms([24.0, 8.0, -8.0], 62.0),
        share if share < 0.75 => stance.arms([42.0, 8.0, -42.0], 98.0),
        _ => stance.arm(0, [26.0, 14.0, 8.0], 84.0).arm(1, [24.0, 8.0, -8.0], 60.0),
    };
    match phase {
        0 => it,
        1 | 5 => it
            .legs(72.0, 84.0)
            .pitched(24.0)
            .trunk(22.0, 0.0, 0.0)
            .arms([34.0, 8.0, 0.0], 40.0)
            .look(-20.0, 0.0),
        2 => rest(sitting(it), random),
        3 => rest(sitting(it), random).trunk(
            random.range(-8.0, 18.0),
            0.0,
            random.range(-20.0, 20.0),
        ),
        _ => rest(sitting(it), random).look(random.range(-5.0, 20.0), random.range(-40.0, 40.0)),
    }
}

fn grab(it: Stance, phase: i64, random: &mut Random) -> Stance {
    match phase {
        0 if random.chance(0.5) => it
            .legs(112.0, 112.0)
            .pitched(30.0)
            .trunk(22.0, 0.0, 0.0)
            .arms([70.0, 6.0, 0.0], 18.0),
        0 => it
            .legs(72.0, 34.0)
            .pitched(52.0)
            .trunk(44.0, 0.0, random.range(-12.0, 12.0))
            .arms([74.0, 4.0, 0.0], 12.0)
            .look(-20.0, 0.0),
        1 => it.arms([24.0, 8.0, -14.0], 86.0).look(15.0, 0.0),
        2 => {
            let turn = random.range(-25.0, 25.0);
            it.arms([122.0, 8.0, 0.0], 28.0).trunk(-4.0, 0.0, turn).look(-18.0, turn)
        }
        _ => {
            let side = usize::from(random.chance(0.5));
            it.arm(side, [92.0, 28.0, 0.0], 14.0).trunk(8.0, 6.0, 12.0)
        }
    }
}

/// Returns the variant of leaning. It is the same throughout a performance, because the furniture does not move.
fn leaning_variant(actor: &Actor) -> u64 {
    actor.random.fork("lean").bits() % 3
}

fn lean(it: Stance, nth: i64, actor: &Actor) -> Stance {
    let deep = if nth.rem_euclid(2) == 0 { 1.0 } else { 0.82 };
    match leaning_variant(actor) {
        0 => it
            .pitched(22.0 * deep)
            .legs(22.0 * deep, 4.0)
            .trunk(22.0 * deep, 0.0, 0.0)
            .arms([58.0 * deep, 12.0, 0.0], 8.0)
            .look(-14.0, 12.0 * (deep - 0.9)),
        1 => it
            .pitched(40.0 * deep)
            .legs(62.0 * deep, 28.0)
            .trunk(30.0, 0.0, 0.0)
            .arms([78.0 * deep, 10.0, 0.0], 14.0)
            .look(-26.0, 0.0),
        _ => it
            .rolled(8.0 * deep)
            .leg(0, 14.0, 30.0 * deep)
            .arm(1, [10.0, 82.0 * deep, 40.0], 30.0)
            .arm(0, [-20.0, 40.0, -48.0], 96.0),
    }
}

fn table(it: Stance, random: &mut Random) -> Stance {
    let mut arm = |stance: Stance, side: usize| {
        let shoulder = [
            random.range(18.0, 64.0),
            random.range(4.0, 26.0),
            random.range(-25.0, 5.0),
        ];
        let elbow = random.range(26.0, 88.0);
        stance.arm(side, shoulder, elbow)
    };
    let it = arm(it, 0);
    let it = arm(it, 1);
    let bend = random.range(4.0, 30.0);
    it.trunk(bend, random.range(-6.0, 6.0), random.range(-20.0, 20.0))
        .pitched(0.4 * bend)
        .legs(0.4 * bend, 4.0)
        .look(14.0, random.range(-20.0, 20.0))
}

fn lying(it: Stance, actor: &Actor, random: &mut Random) -> Stance {
    let mut it = it.pitched(-90.0);
    let on = actor.random.fork("lying").unit();
    it.spin = match on {
        it if it < 0.55 => 0.0,
        it if it < 0.7 => 78.0,
        it if it < 0.85 => -78.0,
        _ => 180.0,
    } + random.range(-10.0, 10.0);
    it.planted = false;
    it.lift = 0.06;
    for side in 0..2 {
        it = match random.unit() {
            share if share < 0.5 => it.leg(side, 3.0, 6.0),
            share if share < 0.8 && on < 0.85 => it.leg(side, 48.0, 92.0),
            _ => it.leg(side, 18.0, 34.0),
        };
        it = match random.unit() {
            share if share < 0.4 => it.arm(side, [4.0, 16.0, 0.0], 14.0),
            share if share < 0.6 => it.arm(side, [10.0, 70.0, 30.0], 30.0),
            share if share < 0.8 => it.arm(side, [140.0, 40.0, 40.0], 100.0),
            _ => it.arm(side, [30.0, 14.0, -42.0], 96.0),
        };
    }
    it
}

const WOOD: Material = Material::Wood([150, 108, 66]);
const STEEL: Material = Material::Plain([70, 72, 78]);

/// Returns the furniture that the action needs.
pub(super) fn furniture(motion: &Motion, action: Action) -> Vec<Block> {
    let actor = &motion.actor;
    let placed = |stance: Stance| {
        let place = actor.place;
        let pose = motion.grounded(&Stance {
            place,
            heading: actor.heading,
            ..stance
        });
        (motion.bones.frames(&pose), pose)
    };
    let standing = || Stance::standing(&actor.subject).flat();
    let height = actor.subject.proportions.height;
    let set = |pose: &Pose| Placement {
        at: pose.root.translation.vector.xy().into(),
        heading: actor.heading,
    };
    match action {
        Action::Chair => {
            let (frames, pose) = placed(sitting(standing()).flat());
            let seat = frames[PELVIS].translation.z - 0.098 * height / 1.75;
            set(&pose).chair(seat)
        }
        Action::Table => set(&placed(standing()).1).table(0.43, 0.43 * height),
        Action::Lean if leaning_variant(actor) == 0 => {
            set(&placed(standing()).1).table(0.62, 0.46 * height)
        }
        Action::Lean if leaning_variant(actor) == 2 => {
            vec![set(&placed(standing()).1).block(
                [0.05, -0.72, 1.1],
                [0.14, 0.14, 1.1],
                Material::Plain([190, 186, 176]),
            )]
        }
        Action::Lying => {
            let (frames, pose) = placed(lying(standing(), actor, &mut actor.random.fork("mat")));
            let middle =
                (frames[HEAD].translation.vector + frames[PELVIS].translation.vector) / 2.0;
            let set = Placement {
                at: [
                    0.75 * pose.root.translation.x + 0.25 * middle.x,
                    0.75 * pose.root.translation.y + 0.25 * middle.y,
                ],
                heading: actor.heading,
            };
            vec![set.block(
                [0.0, 0.0, 0.03],
                [1.05, 0.45, 0.03],
                Material::Plain([60, 90, 130]),
            )]
        }
        _ => Vec::new(),
    }
}

/// A frame of reference on the floor for placing furniture.
struct Placement {
    at: [f64; 2],
    heading: f64,
}

impl Placement {
    /// Creates a block whose centre is at given distances forward, to the left and up.
    fn block(&self, centre: [f64; 3], half: [f64; 3], material: Material) -> Block {
        let (sin, cos) = self.heading.sin_cos();
        let [forward, left, up] = centre;
        let centre = [
            (self.at[0] + cos * forward - sin * left) as f32,
            (self.at[1] + sin * forward + cos * left) as f32,
            up as f32,
        ];
        Block::new(
            centre,
            half.map(|half| half as f32),
            self.heading as f32,
            material,
        )
    }

    fn legs(&self, middle: [f64; 2], half: [f64; 2], height: f64) -> Vec<Block> {
        let corner = |x: f64, y: f64| {
            let centre = [
                middle[0] + x * half[0],
                middle[1] + y * half[1],
                height / 2.0,
            ];
            self.block(centre, [0.018, 0.018, height / 2.0], STEEL)
        };
        vec![
            corner(1.0, 1.0),
            corner(1.0, -1.0),
            corner(-1.0, 1.0),
            corner(-1.0, -1.0),
        ]
    }

    fn chair(&self, seat: f64) -> Vec<Block> {
        let mut all = self.legs([0.04, 0.0], [0.18, 0.18], seat - 0.03);
        all.push(self.block([0.04, 0.0, seat - 0.018], [0.21, 0.21, 0.018], WOOD));
        all.push(self.block([-0.2, 0.0, seat + 0.33], [0.015, 0.2, 0.14], WOOD));
        for out in [-0.18, 0.18] {
            all.push(self.block([-0.2, out, seat + 0.22], [0.014, 0.014, 0.24], STEEL));
        }
        all
    }

    fn table(&self, forward: f64, height: f64) -> Vec<Block> {
        let depth = 0.3;
        let middle = forward + depth - 0.16;
        let mut all = self.legs([middle, 0.0], [depth - 0.04, 0.52], height);
        all.push(self.block([middle, 0.0, height], [depth, 0.58, 0.018], WOOD));
        all.push(self.block(
            [middle + 0.1, 0.3, height + 0.08],
            [0.06, 0.09, 0.06],
            Material::Plain([170, 60, 50]),
        ));
        all.push(self.block(
            [middle + 0.08, -0.32, height + 0.11],
            [0.05, 0.05, 0.09],
            Material::Plain([60, 110, 150]),
        ));
        all
    }
}
