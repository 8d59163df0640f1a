//! Finds the same person in all views, among the people found by a network in each view.

use geometry::Camera;
use nalgebra::Point2;

/// A person found by a network in one view.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenPerson {
    /// The 14 joints of `skeleton::PARSE14`, each with its position in pixels of the picture and the confidence of the network, 0 to 1.
    pub joints: Vec<Option<([f64; 2], f64)>>,
    /// Height of the box, as a fraction of the height of the picture.
    pub height: f64,
}

/// Maximum distance between rays to the same person, in metres. Only the nearest third of the joints is used, since half of a person may be
/// hidden.
const SAME_M: f64 = 0.20;
/// Minimum score of a joint that is used to identify a person.
const LEAST_SCORE: f64 = 0.3;
/// Maximum number of people per view that are considered, largest boxes first.
const MOST: usize = 4;

/// Chooses one person in every view so that the rays of the views meet. If there are several such people, the largest is chosen.
///
/// * `views`: the camera and the people of every view.
/// * `as_seen`: true if views name left and right as they appear in the picture, so that two views may disagree.
/// * Returns the index of the person in each view; `None` if nobody in the view fits the others. A single view keeps its largest
///   person.
pub fn same_person(views: &[(&Camera, &[SeenPerson])], as_seen: bool) -> Vec<Option<usize>> {
    let by_size = |people: &[SeenPerson]| {
        let mut order: Vec<usize> = (0..people.len()).collect();
        order.sort_by(|&a, &b| people[b].height.total_cmp(&people[a].height));
        order.truncate(MOST);
        order
    };
    let mut best: (f64, Vec<Option<usize>>) = (f64::NEG_INFINITY, vec![None; views.len()]);
    // Every detection is tried as the person; each other view then contributes the detection nearest to its rays.
    for (nth, (camera, people)) in views.iter().enumerate() {
        for person in by_size(people) {
            let mut chosen = vec![None; views.len()];
            chosen[nth] = Some(person);
            let mut size = people[person].height;
            for (other, (their_camera, theirs)) in views.iter().enumerate() {
                if other == nth {
                    continue;
                }
                let distance = |i: &usize| {
                    let both = [(*camera, &people[person]), (*their_camera, &theirs[*i])];
                    let as_named = apart(both, |joint| joint);
                    let exchanged = as_seen.then(|| apart(both, |joint| MIRROR[joint])).flatten();
                    as_named.into_iter().chain(exchanged).reduce(f64::min)
                };
                let near = by_size(theirs)
                    .into_iter()
                    .filter_map(|candidate| Some((distance(&candidate)?, candidate)));
                let nearest = near.min_by(|a, b| a.0.total_cmp(&b.0));
                if let Some((_, it)) = nearest.filter(|nearest| nearest.0 < SAME_M) {
                    chosen[other] = Some(it);
                    size += theirs[it].height;
                }
            }
            // More views win; among equal numbers of views, the larger person wins.
            let n = chosen.iter().flatten().count();
            let score = 100.0 * n as f64 + size;
            if score > best.0 {
                best = (score, chosen);
            }
        }
    }
    best.1
}

/// The same joint on the other side.
const MIRROR: [usize; 14] = [5, 4, 3, 2, 1, 0, 11, 10, 9, 8, 7, 6, 12, 13];

/// Returns the distance within which the rays of two views meet for the nearest third of the joints that they share; `None` if they share
/// fewer than three joints.
///
/// * `named`: the second view's name of a joint of the first view.
fn apart([a, b]: [(&Camera, &SeenPerson); 2], named: impl Fn(usize) -> usize) -> Option<f64> {
    let ray = |camera: &Camera, joint: &Option<([f64; 2], f64)>| {
        let (at, score) = (*joint)?;
        (score >= LEAST_SCORE).then(|| camera.ray(&Point2::from(at)))?
    };
    let joints = a.1.joints.iter().enumerate();
    let mut distances: Vec<f64> = joints
        .filter_map(|(joint, in_a)| {
            let in_b = b.1.joints.get(named(joint))?;
            let (a, b) = (ray(a.0, in_a)?, ray(b.0, in_b)?);
            let normal = a.direction.cross(&b.direction);
            let length = normal.norm();
            (length > 1e-3).then(|| ((b.origin - a.origin).dot(&normal) / length).abs())
        })
        .collect();
    if distances.len() < 3 {
        return None;
    }
    distances.sort_by(f64::total_cmp);
    Some(distances[distances.len() / 3])
}
