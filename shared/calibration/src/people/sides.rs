//! Detection of views in which left and right are swapped at an instant.

use geometry::{Camera, Observation};
use nalgebra::Point3;

use super::instant::place;
use super::sightings::{Sight, Sightings};
use super::two_view::{Match, essential_of, normalised, sampson};

/// Left and right are swapped only if this decreases the cost by at least this value.
const CLEARLY: f64 = 4.0;
/// Minimum number of joints, among those with a left and a right, that must be compared.
pub(crate) const LEAST_JOINTS: usize = 4;

/// Costs of the joints with left and right as named, and with left and right swapped.
#[derive(Default)]
struct Costs {
    here: f64,
    exchanged: f64,
    n: usize,
}

impl Costs {
    fn is_exchanged(&self) -> bool {
        self.n >= LEAST_JOINTS && self.exchanged + CLEARLY < self.here
    }
}

/// Swaps left and right of a view at an instant if the other views clearly contradict its naming. Returns the number of swaps. With three
/// or more views, each view is compared with the joints as triangulated from the others. With two views, epipolar lines are used.
pub(crate) fn exchange(
    cameras: &[Camera],
    sightings: &mut Sightings,
    sigmas_px: &[Vec<f64>],
    sides: &[usize],
) -> usize {
    let mut n = 0;
    for instant in 0..sightings.seen.len() {
        // The worst view of an instant is handled first, because a view in which left and right are swapped makes the others look wrong.
        for _ in 0..cameras.len() {
            let seen = &sightings.seen[instant];
            let gain = |camera: usize| {
                let costs = costs(cameras, seen, camera, sigmas_px, sides);
                costs.is_exchanged().then_some((camera, costs.here - costs.exchanged))
            };
            let worst = (1..=cameras.len()).filter_map(|i| gain(cameras.len() - i));
            let Some((camera, _)) = worst.max_by(|a, b| a.1.total_cmp(&b.1)) else {
                break;
            };
            sightings.exchange(instant, camera, sides);
            n += 1;
        }
    }
    n
}

fn costs(
    cameras: &[Camera],
    seen: &[Vec<Option<Sight>>],
    camera: usize,
    sigmas_px: &[Vec<f64>],
    sides: &[usize],
) -> Costs {
    let others =
        |other: &usize| *other != camera && seen[*other].iter().flatten().count() >= LEAST_JOINTS;
    let others: Vec<usize> = (0..cameras.len()).filter(others).collect();
    let mut costs = Costs::default();
    let sided = |joint: &usize| sides.get(*joint).is_some_and(|side| side != joint);
    for joint in (0..sides.len()).filter(sided) {
        let sigma = sigmas_px[camera][joint];
        let pair = [seen[camera][joint], seen[camera][sides[joint]]];
        let [Some(here), Some(other)] = pair else {
            continue;
        };
        let each = match &others[..] {
            [] => None,
            [only] => of_pair(cameras, [*only, camera], seen[*only][joint], [here, other]),
            many => {
                let point = point(cameras, seen, many, joint, sigmas_px);
                point.and_then(|point| of_point(&cameras[camera], &point, [here, other]))
            }
        };
        if let Some([a, b]) = each {
            costs.here += (a / sigma).powi(2).ln_1p();
            costs.exchanged += (b / sigma).powi(2).ln_1p();
            costs.n += 1;
        }
    }
    costs
}

/// Returns a joint as triangulated by the other cameras.
pub(crate) fn point(
    cameras: &[Camera],
    seen: &[Vec<Option<Sight>>],
    others: &[usize],
    joint: usize,
    sigmas_px: &[Vec<f64>],
) -> Option<Point3<f64>> {
    let observations: Vec<Observation<'_>> = others
        .iter()
        .filter_map(|other| {
            Some(Observation {
                camera: &cameras[*other],
                point_px: seen[*other][joint]?.at,
                sigma_px: sigmas_px[*other][joint],
            })
        })
        .collect();
    place(&observations)
}

fn of_point(camera: &Camera, point: &Point3<f64>, both: [Sight; 2]) -> Option<[f64; 2]> {
    let image = camera.project(point)?;
    Some(both.map(|sight| (sight.at - image).norm()))
}

/// Returns the distances of joints from their epipolar lines, in pixels of the second camera.
pub(crate) fn of_pair(
    cameras: &[Camera],
    [a, b]: [usize; 2],
    seen: Option<Sight>,
    both: [Sight; 2],
) -> Option<[f64; 2]> {
    let (first, second) = (&cameras[a], &cameras[b]);
    let b_from_a = second.camera_from_world * first.camera_from_world.inverse();
    let essential = essential_of(&b_from_a);
    let at = normalised(first, &seen?.at);
    Some(both.map(|sight| {
        let pair = Match {
            a: at,
            b: normalised(second, &sight.at),
        };
        sampson(&pair, &essential).abs() * second.intrinsics.fx
    }))
}
