//! Synthetic people, with the poses that the search finds.

use std::sync::Arc;

use failure::{Failure, Stop};
use fmp::{Model, Scope};
use geometry::Camera;
use nalgebra::{Point3, Vector3};
use training::datasets::SkeletonTable;
use viewquality::Sampler;
use viewquality::orientation::{Sample, Tile};

use crate::scenes::{Scenes, Shown, of_pictures};
use crate::searches::Searches;

/// Largest mean error of the parts for which a pose counts as that of the person, as a fraction of the box's height.
const MAX_ERROR: f64 = 0.12;

/// Returns the samples of all scenes: the best pose in every picture, if it is the pose of the subject.
pub(super) fn samples(
    scenes: &Scenes,
    model: &Arc<Model>,
    stop: &Stop,
) -> Result<Vec<Sample>, Failure> {
    let searches = Searches::new(Arc::clone(model));
    let table = SkeletonTable::published();
    of_pictures(
        scenes,
        stop,
        |shown| sample(shown, model, &searches, &table),
        |_, _| (),
    )
}

fn sample(
    shown: &Shown<'_>,
    model: &Model,
    searches: &Searches,
    table: &SkeletonTable,
) -> Option<Sample> {
    let size = [shown.picture.width(), shown.picture.height()];
    let step = searches.of_size(size).ok()?;
    let layout = step.layout();
    let mut values = vec![0.0; layout.n_responses()];
    let found = step.run(shown.picture, Scope::whole(layout), &mut values);
    let pose = found.candidates.first()?;
    let bounds = pose.bounding_box(model, layout);
    let centres = pose.centres(model, layout);
    let truth = table.parts_of(&shown.joints);
    if mean_error(&centres, &truth)? > MAX_ERROR * (bounds[3] - bounds[1]) {
        return None;
    }
    let head = viewquality::orientation::head_of(&centres)?;
    Some(Sample {
        tile: Tile::around(shown.picture, bounds, head, &mut Sampler::default())?,
        front: front_in_view(shown.camera, &shown.everybody.first()?.in_world)?,
        is_photograph: false,
    })
}

/// Returns the mean error of the known parts, for the better of the two assignments of left and right.
fn mean_error(centres: &[[f64; 2]], truth: &[[f64; 2]]) -> Option<f64> {
    let mean = |of: &dyn Fn(usize) -> usize| {
        let distances = centres.iter().enumerate().map(|(part, [x, y])| {
            let there = truth[of(part)];
            (x - there[0]).hypot(y - there[1])
        });
        let known: Vec<f64> = distances.filter(|distance| distance.is_finite()).collect();
        (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
    };
    let sides = [mean(&|part| part)?, mean(&|part| skeleton::MIRROR[part])?];
    Some(sides[0].min(sides[1]))
}

/// Returns the direction in which the person faces, computed from the true 3D joints.
///
/// * `in_world`: joints of `skeleton::PARSE14` in world coordinates.
pub(crate) fn front_in_view(camera: &Camera, in_world: &[[f64; 3]]) -> Option<[f32; 2]> {
    let joints: Vec<Option<Point3<f64>>> = in_world
        .iter()
        .map(|in_world| {
            in_world.iter().all(|value| value.is_finite()).then(|| Point3::from(*in_world))
        })
        .collect();
    let known: Vec<&Point3<f64>> = joints.iter().flatten().collect();
    let sum: Vector3<f64> = known.iter().map(|joint| joint.coords).sum();
    let place = Point3::from(sum / known.len().max(1) as f64);
    let front = multiview::front(&joints)?;
    let in_view = multiview::front_in_view(camera, &place, &front);
    Some(in_view.map(|in_view| in_view as f32))
}
