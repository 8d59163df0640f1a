//! People for the tests: bodies in postures, noise, and learned lengths.

use nalgebra::{Point3, Vector3};

use crate::body::{Covariances, Joints, Kind, Lengths, MIN_FRAMES, N_JOINTS, check};

pub(crate) const NO_COVARIANCES: Covariances = [None; N_JOINTS];

/// Returns a mean body of a given stature that stands facing +x, with its left at +y and z up.
pub(crate) fn standing(stature: f64) -> Joints {
    posed(stature, [[0.0; 2], [0.0; 2], [0.0; 2], [0.0; 2]], 0.0)
}

/// Returns a person in the middle of a step.
pub(crate) fn walking(stature: f64) -> Joints {
    posed(
        stature,
        [[0.4, -0.3], [0.2, 0.5], [-0.4, 0.4], [0.3, 0.5]],
        0.05,
    )
}

/// Returns a person on a chair, hands on the knees.
pub(crate) fn sitting(stature: f64) -> Joints {
    posed(
        stature,
        [[1.5, 1.5], [1.5, 1.5], [0.5, 0.5], [0.9, 0.9]],
        0.1,
    )
}

/// Returns a person bent over, with hanging arms.
pub(crate) fn bent(stature: f64) -> Joints {
    posed(
        stature,
        [[-0.1, 0.1], [0.2, 0.2], [1.4, 1.6], [0.0, 0.0]],
        1.4,
    )
}

/// Returns a person with raised arms.
pub(crate) fn reaching(stature: f64) -> Joints {
    posed(
        stature,
        [[0.0, 0.1], [0.0, 0.1], [3.0, 2.9], [0.1, 0.2]],
        0.0,
    )
}

pub(crate) const POSTURES: [fn(f64) -> Joints; 5] = [standing, walking, sitting, bent, reaching];

/// * `angles`: forward angles of hips, knees (backward), shoulders and elbows, right and left; `lean`: angle of the trunk; all in radians.
fn posed(stature: f64, angles: [[f64; 2]; 4], lean: f64) -> Joints {
    let [hips, knees, shoulders, elbows] = angles;
    let of = |kind: Kind| kind.proportion().length(stature);
    let down = |angle: f64| Vector3::new(angle.sin(), 0.0, -angle.cos());
    let up = Vector3::new(lean.sin(), 0.0, lean.cos());
    let aside = |side: usize, width: f64| Vector3::y() * width * if side == 0 { -0.5 } else { 0.5 };
    let mut joints = [None; N_JOINTS];
    let mut put = |joint: usize, at: Vector3<f64>| joints[joint] = Some(Point3::from(at));
    let pelvis = Vector3::new(3.0, -2.0, of(Kind::UpperLeg) + of(Kind::LowerLeg));
    let neck = pelvis + up * of(Kind::Trunk);
    put(12, neck);
    put(13, neck + up * of(Kind::Head));
    let (wide, slant) = (of(Kind::ShoulderWidth), of(Kind::ShoulderToNeck));
    let below = (slant * slant - 0.25 * wide * wide).max(0.0).sqrt();
    for side in 0..2 {
        let leg = [[2, 1, 0], [3, 4, 5]][side];
        let arm = [[8, 7, 6], [9, 10, 11]][side];
        let hip = pelvis + aside(side, of(Kind::HipWidth));
        let knee = hip + down(hips[side]) * of(Kind::UpperLeg);
        let ankle = knee + down(hips[side] - knees[side]) * of(Kind::LowerLeg);
        let shoulder = neck - up * below + aside(side, wide);
        let elbow = shoulder + down(shoulders[side]) * of(Kind::UpperArm);
        let wrist = elbow + down(shoulders[side] + elbows[side]) * of(Kind::LowerArm);
        for (joint, at) in leg.into_iter().zip([hip, knee, ankle]) {
            put(joint, at);
        }
        for (joint, at) in arm.into_iter().zip([shoulder, elbow, wrist]) {
            put(joint, at);
        }
    }
    joints
}

/// Adds normal noise with the given standard deviations along x and perpendicular to x, in metres.
pub(crate) fn noisy(
    joints: &Joints,
    depth: f64,
    across: f64,
    random: &mut fastrand::Rng,
) -> Joints {
    let mut normal = || {
        let [a, b] = [random.f64(), random.f64()];
        (-2.0 * (1.0 - a).ln()).sqrt() * (core::f64::consts::TAU * b).cos()
    };
    joints.map(|joint| {
        joint.map(|joint| {
            joint + Vector3::new(depth * normal(), across * normal(), across * normal())
        })
    })
}

/// Adds frames of a person until all bones are learned.
pub(crate) fn learn(lengths: &mut Lengths, joints: &Joints) {
    let verdict = check(joints, &NO_COVARIANCES, None);
    assert_eq!(verdict.nobody, None);
    for _ in 0..MIN_FRAMES {
        lengths.add(joints, &verdict);
    }
}

/// Returns the joints of a person with left and right swapped.
pub(crate) fn mirrored<T: Copy>(joints: &[T; N_JOINTS]) -> [T; N_JOINTS] {
    [5, 4, 3, 2, 1, 0, 11, 10, 9, 8, 7, 6, 12, 13].map(|joint| joints[joint])
}

/// Returns the mean distance of joints, in metres.
pub(crate) fn error(a: &Joints, b: &Joints) -> f64 {
    let pairs = a.iter().zip(b).filter_map(|(a, b)| Some((a.as_ref()? - b.as_ref()?).norm()));
    let (sum, n) = pairs.fold((0.0, 0.0), |(sum, n), it| (sum + it, n + 1.0));
    sum / n
}
