//! Computes the joints of known people from all keypoints of the views.

use std::collections::BTreeMap;

use geometry::Camera;
use nalgebra::{Matrix3, Point3, Vector3};
use skeleton::body::{Covariances, Joints};

use crate::distance::named;
use crate::hypotheses::{Candidate, Hypothesis, RADIUS_M, hypotheses, may_reach};
use crate::sight::{Met, Prior, Sight, Sights, meet, settle, sights};
use crate::tree::{Choice, Expectations, choose};
use crate::{N, Person, View};

/// Probability that a keypoint belongs to a person although the detector assigned it to another person, or to nobody.
const TRUST_OTHERS: f64 = 0.3;
const TRUST_LOOSE: f64 = 0.6;
/// Standard deviation of a joint's expected position, in metres; the next constant is its growth with time, in metres per second.
const EXPECTED_SD_M: f64 = 0.04;
const EXPECTED_SD_M_PER_S: f64 = 1.5;
/// Weight of a new velocity in the stored velocity; the next constant is the weight of the stored velocity in the expected position.
const NEW_VELOCITY: f64 = 0.5;
const DAMPING: f64 = 0.5;
/// Time for which a joint that no view sees is still reported at its expected position, in seconds.
const CARRIED_S: f64 = 1.0;
/// Cost of a candidate position for each half squared standard deviation from the joint's expected position; the next constant is the
/// maximum of this cost.
const MOVED: f64 = 0.25;
const MOST_OF_MOVED: f64 = 0.5;
/// Rays farther from the joint than this many standard deviations are ignored.
const OUTLYING: f64 = 3.0;
/// Number of a person's own rays that, if they agree on a place far from the expected one, show that the joint is not where it was expected.
const SURE: usize = 3;
/// Stature assumed for a person whose stature is unknown, in metres.
const ANY_STATURE_M: f64 = 1.7;

/// The computed joints of a person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solved {
    /// The person's id.
    pub id: u64,
    /// Positions of the joints, in metres in the world.
    pub joints: Joints,
    /// Covariances of the joints, in square metres.
    pub covariances: Covariances,
    /// Number of views that agree on each joint; 0 if only the expected position is known.
    pub n_views: [usize; N],
}

/// State of a joint after the earlier frames.
#[derive(Debug, Clone, Copy)]
struct Past {
    point: Point3<f64>,
    velocity: Vector3<f64>,
    sd: f64,
    /// Time at which a view last saw the joint, in seconds.
    seen_s: f64,
}

/// State of a person after the earlier frames.
#[derive(Debug, Clone, Default)]
struct Knowledge {
    joints: [Option<Past>; N],
    time_s: f64,
}

impl Knowledge {
    fn expected(&self, joint: usize, time_s: f64) -> Option<Prior> {
        let past = self.joints[joint].filter(|past| time_s - past.seen_s <= CARRIED_S)?;
        let step_s = (time_s - self.time_s).max(0.0);
        Some(Prior {
            point: past.point + past.velocity * (DAMPING * step_s),
            sd: past.sd.hypot(EXPECTED_SD_M).hypot(EXPECTED_SD_M_PER_S * step_s),
        })
    }
}

/// Computes the joints of known people, frame by frame.
///
/// The candidate positions of a joint are the points where suitable rays meet. These are the rays of the person's detections and, with a
/// lower weight, rays that the detector assigned to other people or to nobody. The solver chooses one position for each joint, by three
/// criteria: the support from the views, the distance from the expected position, and the bone lengths of a person of this stature. The
/// choice is exact over the tree of the body. Then every joint moves to minimise the squared distances to its rays. The bone lengths correct
/// only the expected positions of the next frame; the caller corrects the result (`skeleton::body::refine`).
#[derive(Debug, Clone)]
pub struct Solver {
    cameras: Vec<Camera>,
    order: Vec<usize>,
    known: BTreeMap<u64, Knowledge>,
}

/// All keypoints of a view, as rays.
struct Rays {
    detections: Vec<Sights>,
    loose: Vec<Vec<Sight>>,
}

impl Solver {
    /// Creates a solver that knows no people yet.
    ///
    /// * `cameras`: the cameras of the views, in the order of the views passed to [`step`](Self::step).
    pub fn new(cameras: Vec<Camera>) -> Self {
        let mut order: Vec<usize> = (0..cameras.len()).collect();
        order.sort_by(|a, b| cameras[*a].name.cmp(&cameras[*b].name));
        Self {
            cameras,
            order,
            known: BTreeMap::new(),
        }
    }

    /// Finds the joints of the people in the next frame.
    ///
    /// * `people`: the people returned by [`Tracker::step`](crate::Tracker::step).
    /// * `views`: the views that were passed to the tracker.
    pub fn step(&mut self, time_s: f64, people: &[Person], views: &[View]) -> Vec<Solved> {
        let rays: Vec<Rays> = self
            .cameras
            .iter()
            .zip(views)
            .map(|(camera, view)| rays(camera, view))
            .collect();
        self.known.retain(|_, known| time_s - known.time_s <= CARRIED_S);
        let scene = Scene {
            people,
            order: &self.order,
            rays: &rays,
        };
        let known = &mut self.known;
        let solved = people.iter().map(|person| {
            let known = known.entry(person.id).or_default();
            solve(time_s, person, &scene, known)
        });
        solved.collect()
    }
}

/// Computes the joints of a person.
fn solve(time_s: f64, person: &Person, scene: &Scene<'_>, known: &mut Knowledge) -> Solved {
    let own: [Option<Met>; N] = core::array::from_fn(|joint| scene.own(joint, person));
    let priors: [Option<Prior>; N] = core::array::from_fn(|joint| {
        let prior = known.expected(joint, time_s)?;
        let is_elsewhere = own[joint]
            .is_some_and(|met| met.n >= SURE && (met.point - prior.point).norm() > RADIUS_M);
        if is_elsewhere {
            known.joints[joint] = None;
            return None;
        }
        Some(prior)
    });
    let near: Joints = core::array::from_fn(|joint| {
        let prior = priors[joint].map(|prior| prior.point).or(person.joints[joint]);
        prior.or_else(|| Some(own[joint]?.point))
    });
    let candidates: [Vec<Candidate>; N] =
        core::array::from_fn(|joint| scene.candidates(joint, person, near[joint].as_ref()));
    let places: [Vec<Hypothesis>; N] =
        core::array::from_fn(|joint| hypotheses(&candidates[joint], near[joint], priors[joint]));
    let choices: [Vec<Choice>; N] = core::array::from_fn(|joint| {
        places[joint].iter().map(|place| choice(place, priors[joint])).collect()
    });
    let stature = skeleton::body::stature(&near).map_or(ANY_STATURE_M, |stature| stature.metres);
    let expectations =
        Expectations::new(stature.clamp(skeleton::body::STATURES[0], skeleton::body::STATURES[1]));
    let chosen = choose(&choices, &expectations);
    let mut solved = Solved {
        id: person.id,
        joints: [None; N],
        covariances: [None; N],
        n_views: [0; N],
    };
    for joint in 0..N {
        let Some(nth) = chosen[joint] else { continue };
        let start = places[joint][nth].place;
        let met = refined(&candidates[joint], start, priors[joint]);
        if let Some((point, covariance, n)) = met {
            solved.joints[joint] = Some(point);
            solved.covariances[joint] = Some(covariance);
            solved.n_views[joint] = n;
        }
    }
    let refined = skeleton::body::refine(&solved.joints, &solved.covariances, None);
    let kept = Solved {
        joints: refined.joints,
        covariances: refined.covariances,
        ..solved
    };
    remember(known, time_s, &kept);
    solved
}

/// Converts a candidate position to a weighted choice for a joint.
fn choice(place: &Hypothesis, prior: Option<Prior>) -> Choice {
    let moved = prior.map_or(0.0, |prior| {
        let z = (place.place - prior.point).norm() / prior.sd;
        (MOVED * 0.5 * z * z).min(MOST_OF_MOVED)
    });
    Choice {
        place: place.place,
        worth: place.support - moved,
    }
}

/// Stores the state that the next frame needs.
fn remember(known: &mut Knowledge, time_s: f64, solved: &Solved) {
    let step_s = time_s - known.time_s;
    for joint in 0..N {
        let Some(point) = solved.joints[joint] else {
            known.joints[joint] = None;
            continue;
        };
        let past = known.joints[joint];
        let measured = past.filter(|_| step_s > 0.0).map(|past| (point - past.point) / step_s);
        let before = past.map_or_else(Vector3::zeros, |past| past.velocity);
        let velocity = before + NEW_VELOCITY * (measured.unwrap_or(before) - before);
        let is_seen = solved.n_views[joint] > 0;
        let variance = solved.covariances[joint].map_or(0.0, |covariance| covariance.trace() / 3.0);
        let seen_s = if is_seen {
            time_s
        } else {
            past.map_or(time_s, |past| past.seen_s)
        };
        known.joints[joint] = Some(Past {
            point,
            velocity,
            sd: variance.sqrt(),
            seen_s,
        });
    }
    known.time_s = time_s;
}

/// Moves a joint to minimise the squared distances to the rays that support its position; also returns its covariance and the number of
/// these views.
fn refined(
    candidates: &[Candidate],
    start: Point3<f64>,
    prior: Option<Prior>,
) -> Option<(Point3<f64>, Matrix3<f64>, usize)> {
    let mut at = start;
    let mut result = None;
    for _ in 0..2 {
        let views = candidates.chunk_by(|a, b| a.view == b.view);
        let best = views.filter_map(|view| {
            let near = view.iter().filter(|candidate| candidate.sight.deviations(&at) < OUTLYING);
            near.max_by(|a, b| a.support(&at).total_cmp(&b.support(&at)))
        });
        let weighted = best.map(|candidate| Sight {
            heat: candidate.sight.heat * candidate.trust,
            ..candidate.sight
        });
        let rays: Vec<Sight> = weighted.collect();
        // The expected position lags behind a joint that changes its speed. It is needed where one of two rays may be wrong.
        let prior = prior.filter(|_| rays.len() < SURE);
        let met = settle(&rays, &at, prior)?;
        at = met.point;
        result = Some((met.point, met.covariance, rays.len()));
    }
    result
}

/// The rays of a frame, and the people to whom they belong.
#[derive(Clone, Copy)]
struct Scene<'a> {
    people: &'a [Person],
    /// Views in the order of their cameras' names.
    order: &'a [usize],
    rays: &'a [Rays],
}

impl Scene<'_> {
    /// Triangulates a joint from the person's own detections.
    fn own(&self, joint: usize, person: &Person) -> Option<Met> {
        let own = self.order.iter().filter_map(|view| {
            let sights = self.rays.get(*view)?.detections.get(person.detections[*view]?)?;
            sights[named(joint, person.is_exchanged[*view])]
        });
        meet(&own.collect::<Vec<Sight>>())
    }

    /// Returns the keypoints that may be a given joint of a person, view by view.
    ///
    /// * `near`: centre of the search; candidates that cannot support a position there are left out.
    fn candidates(
        &self,
        joint: usize,
        person: &Person,
        near: Option<&Point3<f64>>,
    ) -> Vec<Candidate> {
        let mut all = Vec::new();
        let seen = self.order.iter().enumerate();
        for (nth, view) in seen.filter(|(_, view)| **view < self.rays.len()) {
            let first = all.len();
            let name = named(joint, person.is_exchanged[*view]);
            let mut add = |sight: Option<Sight>, trust: &dyn Fn() -> f64| {
                let near = |sight: &Sight| near.is_none_or(|near| may_reach(sight, near));
                all.extend(sight.filter(near).map(|sight| Candidate {
                    view: nth,
                    sight,
                    trust: trust(),
                }));
            };
            for (index, sights) in self.rays[*view].detections.iter().enumerate() {
                add(sights[name], &|| self.trust(person, *view, index));
            }
            for sight in self.rays[*view].loose.get(name).into_iter().flatten() {
                add(Some(*sight), &|| TRUST_LOOSE);
            }
            let by_ray = |candidate: &Candidate| {
                let direction = candidate.sight.direction;
                [direction.x, direction.y, candidate.trust]
            };
            all[first..].sort_by(|a, b| {
                let (a, b) = (by_ray(a), by_ray(b));
                let each = a.iter().zip(&b).map(|(a, b)| a.total_cmp(b));
                each.fold(core::cmp::Ordering::Equal, core::cmp::Ordering::then)
            });
        }
        all
    }

    /// Returns the probability that the keypoints of a detection belong to a person.
    fn trust(&self, person: &Person, view: usize, index: usize) -> f64 {
        let is_of = |person: &Person| person.detections[view] == Some(index);
        if is_of(person) {
            1.0
        } else if self.people.iter().any(is_of) {
            TRUST_OTHERS
        } else {
            TRUST_LOOSE
        }
    }
}

fn rays(camera: &Camera, view: &View) -> Rays {
    let loose = view
        .loose
        .iter()
        .map(|joint| joint.iter().filter_map(|keypoint| Sight::new(camera, keypoint)).collect());
    Rays {
        detections: view.detections.iter().map(|detection| sights(camera, detection)).collect(),
        loose: loose.collect(),
    }
}
