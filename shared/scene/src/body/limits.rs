//! The joint limits of a healthy adult, in degrees.

use super::N_BONES;

/// Minimum and maximum flexion, abduction and twist of every bone.
///
/// The values are the normal ranges of the American Academy of Orthopaedic Surgeons, rounded; the ranges of the spine are divided between
/// two bones.
pub(crate) const LIMITS: [[[f64; 2]; 3]; N_BONES] = [
    [[0.0, 0.0], [0.0, 0.0], [0.0, 0.0]],
    [[-15.0, 50.0], [-20.0, 20.0], [-15.0, 15.0]],
    [[-15.0, 35.0], [-20.0, 20.0], [-30.0, 30.0]],
    [[-30.0, 30.0], [-25.0, 25.0], [-40.0, 40.0]],
    [[-25.0, 25.0], [-15.0, 15.0], [-40.0, 40.0]],
    COLLAR,
    UPPER_ARM,
    FOREARM,
    HAND,
    COLLAR,
    UPPER_ARM,
    FOREARM,
    HAND,
    THIGH,
    SHIN,
    FOOT,
    THIGH,
    SHIN,
    FOOT,
];

const COLLAR: [[f64; 2]; 3] = [[-15.0, 20.0], [-5.0, 35.0], [0.0, 0.0]];
const UPPER_ARM: [[f64; 2]; 3] = [[-60.0, 175.0], [-30.0, 170.0], [-90.0, 90.0]];
const FOREARM: [[f64; 2]; 3] = [[0.0, 150.0], [0.0, 0.0], [-80.0, 80.0]];
const HAND: [[f64; 2]; 3] = [[-70.0, 75.0], [-20.0, 35.0], [0.0, 0.0]];
const THIGH: [[f64; 2]; 3] = [[-25.0, 125.0], [-20.0, 45.0], [-40.0, 45.0]];
const SHIN: [[f64; 2]; 3] = [[0.0, 145.0], [0.0, 0.0], [0.0, 0.0]];
const FOOT: [[f64; 2]; 3] = [[-50.0, 25.0], [-15.0, 15.0], [0.0, 0.0]];
