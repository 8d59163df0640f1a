//! Tests that rays end at walls and furniture, and that nothing blocks the cameras' views of the stage.

use proptest::prelude::*;

use super::*;

fn cameras() -> Vec<Point3<f32>> {
    vec![Point3::new(4.0, 0.0, 1.5), Point3::new(0.0, -4.2, 1.4)]
}

fn room(seed: u64) -> Room {
    Room::new(Random::new(seed), &cameras(), Vec::new())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn every_ray_from_a_camera_ends_in_the_room(
        seed in 0_u64..1000, x in -1.0_f32..1.0, y in -1.0_f32..1.0, z in -1.0_f32..1.0,
    ) {
        let way = Vector3::new(x, y, z);
        prop_assume!(way.norm() > 0.1);
        let room = room(seed);
        for from in cameras() {
            let hit = room.cast(&from, &way);
            prop_assert!(hit.along.is_finite() && hit.along >= 0.0);
            for axis in 0..3 {
                prop_assert!((room.low[axis] - 1e-3..=room.high[axis] + 1e-3).contains(&hit.at[axis]));
            }
            prop_assert!((hit.normal.norm() - 1.0).abs() < 1e-4 && hit.normal.dot(&way) < 1e-4);
            prop_assert!(hit.colour.iter().all(|channel| (0.0..2.0).contains(channel)));
        }
    }

    #[test]
    fn no_furniture_occludes_the_stage(seed in 0_u64..1000, turn in 0.0_f32..6.3, up in 0.05_f32..1.9) {
        let at = Point3::new(turn.cos(), turn.sin(), up);
        for from in cameras() {
            let hit = room(seed).cast(&from, &(at - from));
            prop_assert!(hit.along > 1.0, "something stands at {}", hit.at);
        }
    }
}

#[test]
fn a_block_is_entered_at_its_face() {
    let block = Block::new(
        [0.0, 0.0, 0.5],
        [0.5, 0.2, 0.5],
        core::f32::consts::FRAC_PI_2,
        Material::Plain([10, 20, 30]),
    );
    let from = Point3::new(-3.0, 0.0, 0.5);
    let (along, normal, _) = block.enter(&from, &Vector3::x()).unwrap();
    assert!(
        (along - 2.8).abs() < 1e-5,
        "turned: its thin side is along x"
    );
    assert!((normal + Vector3::x()).norm() < 1e-5);
    assert!(block.enter(&from, &-Vector3::x()).is_none(), "behind");
    assert!(
        block.enter(&from, &Vector3::new(1.0, 1.0, 0.0)).is_none(),
        "beside"
    );
}
