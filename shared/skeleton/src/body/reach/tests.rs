//! Tests of the reaches.

use super::*;
use crate::body::testing;

fn one(_kind: Kind) -> f64 {
    1.0
}

#[test]
fn the_reach_is_the_distance_along_the_bones() {
    assert_eq!(between(6, 8, one), 2.0);
    assert_eq!(between(8, 6, one), 2.0);
    assert_eq!(between(0, 2, one), 2.0);
    assert_eq!(between(0, 5, one), 5.0);
    assert_eq!(between(2, 4, one), 2.0);
    assert_eq!(between(6, 11, one), 6.0);
    assert_eq!(between(13, 6, one), 4.0);
    assert_eq!(between(2, 13, one), 2.5);
    assert_eq!(between(5, 6, one), 6.5);
    assert_eq!(between(7, 7, one), 0.0);
}

#[test]
fn a_joint_without_neighbours_is_reported_as_alone() {
    let mut joints = testing::standing(1.7);
    let all = (1 << N_JOINTS) - 1;
    assert!(pieces(&joints).iter().all(|piece| *piece == all));
    joints[7] = None;
    let found = pieces(&joints);
    assert_eq!(found[6], 1 << 6);
    assert_eq!(found[0], all & !(1 << 6) & !(1 << 7));
}
