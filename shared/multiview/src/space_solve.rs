//! The joints of a person in space: the best on the tree, with the limbs apart, then on finer and finer grids about it.

use nalgebra::Point3;

use crate::space_apart::kept_apart;
use crate::space_tree::{BoneLength, N, Places, SpacePose, SpaceSettings, SpaceView, best_on_tree};

/// Solves for all joints at once.
///
/// * `places`: of every joint, for example of [`places`](crate::places); a joint without one is left out.
/// * `lengths`: of the bones of [`TREE`](crate::TREE).
/// * Returns `None` if no joint has a place.
pub fn solve_in_space(
    views: &[SpaceView<'_>],
    places: &Places,
    lengths: &[BoneLength; N - 1],
    settings: &SpaceSettings,
) -> Option<SpacePose> {
    let first = best_on_tree(views, places, (lengths, &[None; N]), settings)?;
    let (mut best, occupied) = kept_apart(views, places, lengths, settings, first);
    let mut step = settings.coarsest_m;
    while step >= settings.finest_m {
        for _ in 0..2 {
            let about: Places = core::array::from_fn(|joint| match &best.joints[joint] {
                Some(at) => grid(at, step),
                None => Vec::new(),
            });
            let found = best_on_tree(views, &about, (lengths, &occupied), settings)?;
            let has_moved = found.joints != best.joints;
            best = found;
            if !has_moved {
                break;
            }
        }
        step /= 2.0;
    }
    Some(best)
}

/// The 125 places of a grid about a place, that one in the middle.
fn grid(about: &Point3<f64>, step: f64) -> Vec<Point3<f64>> {
    let along = |nth: usize| (nth as f64 - 2.0) * step;
    (0..125)
        .map(|nth| {
            let by = [along(nth % 5), along(nth / 5 % 5), along(nth / 25)];
            about + nalgebra::Vector3::from(by)
        })
        .collect()
}
