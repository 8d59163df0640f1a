//! Walking and jogging around the middle of the room.

use core::f64::consts::TAU;

use super::Actor;
use super::stance::Stance;
use crate::body::{FOOT, FOREARM, SHIN, THIGH, UPPER_ARM};

/// Parameters of a gait.
struct Gait {
    /// Number of strides (two steps) per second; the next field is the length of a stride in multiples of the person's height.
    hertz: f64,
    stride: f64,
    /// Centre and amplitude of the hip's swing; the next field is the bend of the knee in the swing phase and the stance phase. All are in
    /// degrees.
    hip: [f64; 2],
    knee: [f64; 2],
    arm: f64,
    elbow: f64,
    lean: f64,
    /// Height of the body's flight between steps, in metres.
    flight: f64,
}

pub(super) fn walking(actor: &Actor, seconds: f64) -> Stance {
    let energy = actor.subject.style.energy;
    let gait = Gait {
        hertz: 0.88 * actor.subject.style.tempo,
        stride: 0.74 * energy,
        hip: [9.0, 20.0 * energy],
        knee: [56.0, 13.0],
        arm: 19.0,
        elbow: 12.0,
        lean: 2.0,
        flight: 0.0,
    };
    gait_stance(actor, &gait, seconds)
}

pub(super) fn jogging(actor: &Actor, seconds: f64) -> Stance {
    let energy = actor.subject.style.energy;
    let gait = Gait {
        hertz: 1.32 * actor.subject.style.tempo,
        stride: 0.98 * energy,
        hip: [18.0, 30.0 * energy],
        knee: [88.0 * energy, 26.0],
        arm: 34.0,
        elbow: 82.0,
        lean: 8.0,
        flight: 0.05,
    };
    gait_stance(actor, &gait, seconds)
}

/// Returns a smooth peak of height 1 around a phase of the stride.
fn bump(phase: f64, at: f64, width: f64) -> f64 {
    let off = (phase - at + 0.5).rem_euclid(1.0) - 0.5;
    (-0.5 * (off / width).powi(2)).exp()
}

/// Returns the stance at a time. Joint angles over the stride are peaks and sine waves, fitted by eye to the curves of Winter,
/// *Biomechanics and Motor Control of Human Movement*.
fn gait_stance(actor: &Actor, gait: &Gait, seconds: f64) -> Stance {
    let style = actor.subject.style;
    let mut stage = actor.random.fork("way");
    let radius = stage.range(0.8, 1.05);
    let direction = if stage.chance(0.5) { 1.0 } else { -1.0 };
    let speed = gait.hertz * gait.stride * actor.subject.proportions.height;
    let turned = direction * speed / radius * seconds;
    let stride = stage.unit() + gait.hertz * seconds;
    let mut stance = Stance::standing(&actor.subject).trunk(gait.lean, 0.0, 0.0);
    for side in 0..2 {
        // The right leg is half a stride behind; each arm moves with the opposite leg.
        let phase = (stride + 0.5 * side as f64).rem_euclid(1.0);
        let wave = (TAU * phase + 0.25).cos();
        stance.angles[THIGH[side]][0] = gait.hip[0] + gait.hip[1] * wave;
        stance.angles[THIGH[side]][1] = 1.5;
        let swing = gait.knee[0] * bump(phase, 0.71, 0.09);
        stance.angles[SHIN[side]][0] = 4.0 + swing + gait.knee[1] * bump(phase, 0.14, 0.07);
        stance.angles[FOOT[side]][0] = 9.0 * bump(phase, 0.42, 0.12)
            - 19.0 * bump(phase, 0.63, 0.06)
            - 5.0 * bump(phase, 0.07, 0.04);
        let arm = -gait.arm * style.arm_swing * wave;
        stance.angles[UPPER_ARM[side]][0] = arm - 2.0;
        stance.angles[FOREARM[side]][0] = gait.elbow + 0.6 * style.elbows + 0.5 * arm.max(0.0);
    }
    let wave = (TAU * stride).cos();
    stance = stance.trunk(0.0, 1.5 * (TAU * stride).sin(), 5.0 * wave);
    stance.spin = -4.0 * wave;
    // The person leans and looks towards the centre of the path.
    stance.roll = -2.0 * direction;
    stance = stance.look(2.0, 6.0 * direction + 5.0 * (0.37 * seconds).sin());
    stance.heading = actor.heading + turned + direction * TAU / 4.0;
    let angle = actor.heading + turned;
    stance.place = [radius * angle.cos(), radius * angle.sin()];
    stance.planted = false;
    stance.lift = gait.flight * (2.0 * TAU * (stride + 0.13)).cos().max(0.0);
    stance
}
