//! Finds the people in a frame. Each person is a group of candidates, at most one per view, that show the same person in space.

use geometry::{Camera, Ray};
use multiview::ViewPlan;
use nalgebra::{Matrix3, Point2, Point3, Vector3};

use crate::view_result::ViewResult;

/// Pairs of parts whose means are points of the midline of the body: head, neck, hips, knees, ankles. These points are the same whichever
/// side is labelled left.
const LINE: [[usize; 2]; N_POINTS] = [[0, 0], [1, 1], [9, 21], [11, 23], [13, 25]];
const N_POINTS: usize = 5;
/// Indices of the neck and of the hips in `LINE`.
const NECK: usize = 1;
const HIPS: usize = 2;
/// Minimum and maximum distance of successive points, in metres: wide enough for both a three-year-old child and a tall man. The midpoint
/// between two knees may be anywhere between the legs.
const LENGTHS: [[f64; 2]; N_POINTS - 1] = [[0.05, 0.5], [0.2, 0.8], [0.0, 0.7], [0.0, 0.7]];

/// Maximum mean distance of a candidate's points from the projected person, as a fraction of the candidate's size in the picture.
const TOLERANCE: f64 = 0.15;
/// A candidate shows a person if its trunk is nearer to the person's midline than this fraction of the candidate's size.
const SAME: f64 = 0.15;
/// Distance between two trunks below which they belong to the same person, in metres.
const APART_M: f64 = 0.5;
/// Maximum distance between two rays to the same point, in metres: twice the tolerance for the size of a body.
const MAX_GAP_M: f64 = 0.5;
/// Maximum number of rounds in which further views of a person are searched for.
const MAX_ROUNDS: usize = 3;
/// Minimum determinant of the normal matrix of the rays. For comparison, two rays 3 degrees apart have a determinant of 0.005.
const MIN_SPREAD: f64 = 0.002;
/// Minimum number of views that must agree on a person; in a smaller rig, all views must agree.
const MIN_VIEWS: usize = 3;
/// Minimum strength of a person, as a fraction of the strength of the strongest person.
const MIN_STRENGTH: f64 = 0.28;

/// A person that several views may show.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Person {
    /// The candidate of every view; `None` for a view without a candidate.
    pub candidates: Vec<Option<usize>>,
    /// Midline of the body (head, neck, hips, knees, ankles) in each picture that contains all of it, in pixels of the frame.
    pub lines_px: Vec<Option<Line>>,
    /// Centre of the trunk in the world, in metres.
    pub place: Point3<f64>,
    /// Sum, over the views, of how clearly each sees the person. A view contributes the amount by which its candidate's score exceeds the
    /// scores of the weakest third of the view's candidates. The contribution shrinks with the distance of the candidate from the projected
    /// person.
    pub strength: f64,
    /// Size in the pictures, in pixels of the frame: longer side of the rectangle around the parts, averaged over the views
    /// that see the person.
    pub size_px: f64,
}

impl Person {
    /// Returns the number of views that see the person.
    pub(crate) fn n_views(&self) -> usize {
        self.candidates.iter().flatten().count()
    }
}

/// Midline of a body in a picture, in pixels of the frame.
type Line = [[f64; 2]; N_POINTS];

/// A candidate of a view.
pub(crate) struct FoundBody {
    points_px: Line,
    rays: [Option<Ray>; N_POINTS],
    size_px: f64,
    strength: f64,
}

impl FoundBody {
    /// * `strength`: how clearly the view sees the body; negative values count as 0.
    fn new(camera: &Camera, points_px: Line, size_px: f64, strength: f64) -> Self {
        let ray = |[x, y]: [f64; 2]| {
            let is_seen = x.is_finite() && y.is_finite();
            is_seen.then(|| camera.ray(&Point2::new(x, y))).flatten()
        };
        Self {
            points_px,
            rays: points_px.map(ray),
            size_px: size_px.max(1.0),
            strength: strength.max(0.0),
        }
    }

    fn middle(&self) -> [f64; 2] {
        let [neck, hips] = [self.points_px[NECK], self.points_px[HIPS]];
        [0, 1].map(|axis| f64::midpoint(neck[axis], hips[axis]))
    }

    /// Returns true if the body coincides with the midline of a person in the picture.
    fn is_on(&self, line: &Line) -> bool {
        let middle = self.middle();
        let mut bones = line.array_windows();
        bones.any(|[a, b]| distance_to_segment(middle, *a, *b) < SAME * self.size_px)
    }

    /// Returns the mean distance of the points from the projected points of a person, as a fraction of the size of the body.
    fn distance(&self, projected: &Line) -> f64 {
        let each = self.points_px.iter().zip(projected);
        let sum: f64 = each.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).sum();
        sum / (N_POINTS as f64 * self.size_px)
    }
}

/// A frame's candidates, and the people that they may show.
pub(crate) struct Found {
    views: Vec<Vec<FoundBody>>,
    pub(crate) people: Vec<Person>,
}

impl Found {
    /// Returns the candidates of every view that show a person other than the followed one, as bit sets.
    ///
    /// Views that see only other people are not included: the followed person may be hidden there, or poorly detected.
    ///
    /// * `followed`: index of the followed person; `None` if the person was not found.
    pub(crate) fn others(&self, followed: Option<usize>) -> Vec<u64> {
        let people = || self.people.iter().enumerate();
        let of_view = |(view, sightings): (usize, &Vec<FoundBody>)| {
            let is_of = |person: &Person, it: &FoundBody| {
                person.lines_px[view].as_ref().is_some_and(|line| it.is_on(line))
            };
            let is_other = |found_body: &FoundBody| {
                let mut others = people().filter(|(index, _)| Some(*index) != followed);
                !followed.is_some_and(|it_is| is_of(&self.people[it_is], found_body))
                    && others.any(|(_, other)| is_of(other, found_body))
            };
            let each = sightings.iter().enumerate().take(u64::BITS as usize);
            let others = each.filter(|(_, it)| is_other(it));
            let others: Vec<usize> = others.map(|other| other.0).collect();
            if others.len() == sightings.len() {
                return 0;
            }
            others.iter().fold(0, |mask, it| mask | 1_u64 << it)
        };
        self.views.iter().enumerate().map(of_view).collect()
    }
}

impl Found {
    /// Returns the views that see other people but not this person, as bit sets.
    pub(crate) fn without(&self, followed: usize) -> u64 {
        let is_seen = |view: usize| self.people[followed].candidates[view].is_some();
        let sees_others =
            |view: usize| self.people.iter().any(|person| person.candidates[view].is_some());
        let views = 0..self.views.len().min(u64::BITS as usize);
        views
            .filter(|view| !is_seen(*view) && sees_others(*view))
            .fold(0, |mask, view| mask | 1_u64 << view)
    }
}

/// Finds the people of a frame; the person seen most clearly by the most views comes first.
///
/// For each pair of candidates of two views, a person is triangulated from the two midlines. A plausible person is then searched for in the
/// other views until nothing changes. The strongest group is the first person. Each other group is a further person if it is separate from
/// all earlier people, both in space and in all pictures but at most one. A person must be seen by three views, or by both views of a rig
/// with two, and be at least 0.28 times as strong as the first. People whose trunks are less than half a metre apart count as one. The
/// paper assumes one person; this method is our own.
///
/// * `cameras`, `views`: the cameras of the views, and the candidates of each view.
pub(crate) fn find(cameras: &[&Camera], views: Vec<Vec<FoundBody>>) -> Found {
    let people = distinct(&views, groups(cameras, &views));
    Found { views, people }
}

/// Returns all groups on which enough views agree; the same person occurs in many of them.
fn groups(cameras: &[&Camera], views: &[Vec<FoundBody>]) -> Vec<Person> {
    let n_present = views.iter().filter(|view| !view.is_empty()).count();
    let needed = MIN_VIEWS.min(n_present).max(2);
    let mut found = Vec::new();
    let mut candidates = vec![None; views.len()];
    let mut rays = Vec::with_capacity(views.len());
    for first in 0..views.len() {
        for second in first + 1..views.len() {
            for (a, one) in views[first].iter().enumerate() {
                for (b, other) in views[second].iter().enumerate() {
                    if may_meet(one, other) {
                        candidates.fill(None);
                        candidates[first] = Some(a);
                        candidates[second] = Some(b);
                        let group = person(cameras, views, &mut candidates, &mut rays);
                        found.extend(group.filter(|group| group.n_views() >= needed));
                    }
                }
            }
        }
    }
    found
}

/// Returns the best group, and each of the other groups that is a different person.
fn distinct(views: &[Vec<FoundBody>], mut found: Vec<Person>) -> Vec<Person> {
    found.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    let mut kept: Vec<Person> = Vec::new();
    for person in found {
        let best = kept.first().map_or(0.0, |first| first.strength);
        if person.strength >= MIN_STRENGTH * best
            && kept.iter().all(|other| differ(views, other, &person))
        {
            kept.push(person);
        }
    }
    kept
}

/// Returns true if two people are different: they are separate in space, and overlap in at most one picture.
fn differ(views: &[Vec<FoundBody>], one: &Person, other: &Person) -> bool {
    let shared = views.iter().enumerate().filter(|(view, sightings)| {
        let line = one.lines_px[*view].as_ref();
        line.zip(other.candidates[*view])
            .is_some_and(|(line, it)| sightings[it].is_on(line))
    });
    let n_shared = shared.count();
    let own = other.n_views() - n_shared;
    (one.place - other.place).norm() >= APART_M && n_shared <= 1 && own >= 2
}

/// Returns true if two bodies can be the same person: the rays to the necks, and the rays to the hips, are close enough to each other.
fn may_meet(one: &FoundBody, other: &FoundBody) -> bool {
    [NECK, HIPS].into_iter().all(|point| {
        let (Some(a), Some(b)) = (&one.rays[point], &other.rays[point]) else {
            return false;
        };
        let across = a.direction.cross(&b.direction);
        (b.origin - a.origin).dot(&across).abs() <= MAX_GAP_M * across.norm()
    })
}

/// Returns the person formed by two candidates together with the matching candidates of the other views.
///
/// * `rays`: a buffer.
fn person<'a>(
    cameras: &[&Camera],
    views: &'a [Vec<FoundBody>],
    candidates: &mut [Option<usize>],
    rays: &mut Vec<&'a Ray>,
) -> Option<Person> {
    let mut seen = placed(cameras, views, candidates, rays)?;
    // Each added view changes the 3D position of the person, so further views may match afterwards.
    for _ in 0..MAX_ROUNDS {
        if seen.candidates == *candidates {
            return Some(seen);
        }
        candidates.copy_from_slice(&seen.candidates);
        seen = placed(cameras, views, candidates, rays)?;
    }
    Some(seen)
}

/// Returns the person in space formed by these candidates, with each view's candidate nearest to the projection of the person.
fn placed<'a>(
    cameras: &[&Camera],
    views: &'a [Vec<FoundBody>],
    candidates: &[Option<usize>],
    rays: &mut Vec<&'a Ray>,
) -> Option<Person> {
    let points = line_in_world(views, candidates, rays)?;
    let is_body = points.windows(2).zip(LENGTHS).all(|(ends, [least, most])| {
        let length = (ends[0] - ends[1]).norm();
        (least..=most).contains(&length)
    });
    if !is_body {
        return None;
    }
    let mut person = Person {
        candidates: vec![None; views.len()],
        lines_px: vec![None; views.len()],
        place: nalgebra::center(&points[NECK], &points[HIPS]),
        strength: 0.0,
        size_px: 0.0,
    };
    for (view, sightings) in views.iter().enumerate() {
        let Some(projected) = project(cameras[view], &points) else {
            continue;
        };
        person.lines_px[view] = Some(projected);
        let each = sightings.iter().enumerate();
        let nearest = each
            .map(|(candidate, it)| (candidate, it.distance(&projected)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((candidate, distance)) = nearest.filter(|nearest| nearest.1 <= TOLERANCE) {
            person.candidates[view] = Some(candidate);
            let it = &sightings[candidate];
            person.strength += it.strength * (1.0 - distance / TOLERANCE);
            person.size_px += it.size_px;
        }
    }
    person.size_px /= person.n_views().max(1) as f64;
    Some(person)
}

/// Returns the points nearest to the rays of some candidates; `None` if the rays are parallel or meet behind a camera.
fn line_in_world<'a>(
    views: &'a [Vec<FoundBody>],
    candidates: &[Option<usize>],
    rays: &mut Vec<&'a Ray>,
) -> Option<[Point3<f64>; N_POINTS]> {
    let mut points = [Point3::origin(); N_POINTS];
    for (index, point) in points.iter_mut().enumerate() {
        let seen = views.iter().zip(candidates);
        rays.clear();
        rays.extend(seen.filter_map(|(sightings, it)| sightings[(*it)?].rays[index].as_ref()));
        *point = meeting(rays)?;
    }
    Some(points)
}

fn project(camera: &Camera, points: &[Point3<f64>; N_POINTS]) -> Option<Line> {
    let mut projected = [[0.0; 2]; N_POINTS];
    for (to, point) in projected.iter_mut().zip(points) {
        *to = camera.project(point)?.into();
    }
    Some(projected)
}

/// Returns the point with the smallest sum of squared distances from the rays.
fn meeting(rays: &[&Ray]) -> Option<Point3<f64>> {
    let mut normal = Matrix3::zeros();
    let mut target = Vector3::zeros();
    for ray in rays {
        let across = Matrix3::identity() - ray.direction.as_ref() * ray.direction.transpose();
        normal += across;
        target += across * ray.origin.coords;
    }
    // With unit directions the smallest eigenvalue is of the order of the squared sine of the angle between the rays.
    if normal.determinant().abs() < MIN_SPREAD {
        return None;
    }
    let point = Point3::from(normal.cholesky()?.solve(&target));
    let is_before = rays.iter().all(|ray| (point - ray.origin).dot(&ray.direction) > 0.0);
    is_before.then_some(point)
}

fn distance_to_segment(point: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let [point, a, b] = [point, a, b].map(Point2::from);
    let along = b - a;
    let share = (point - a).dot(&along) / along.norm_squared().max(1e-12);
    (point - (a + along * share.clamp(0.0, 1.0))).norm()
}

/// Returns the candidates of a view for the paper's method; empty if the model's parts are not those of the published models.
pub(crate) fn bodies_of_poses(plan: &ViewPlan, answer: Option<&ViewResult>) -> Vec<FoundBody> {
    let is_body = plan.model().n_parts() == skeleton::N_PARTS;
    let Some(answer) = answer.filter(|_| is_body) else {
        return Vec::new();
    };
    let scores = answer.candidates.iter().map(|pose| f64::from(pose.score));
    let mut scores: Vec<f64> = scores.collect();
    scores.sort_by(|a, b| b.total_cmp(a));
    let usual = scores.get(scores.len() * 2 / 3).copied().unwrap_or(0.0);
    let body = |pose: &fmp::Pose| {
        let points_px = LINE.map(|parts| {
            let [a, b] = parts.map(|part| plan.centre(pose, part));
            middle(a, b)
        });
        let strength = f64::from(pose.score) - usual;
        FoundBody::new(plan.camera(), points_px, plan.size(pose), strength)
    };
    answer.candidates.iter().map(body).collect()
}

fn middle(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|axis| f64::midpoint(a[axis], b[axis]))
}

#[cfg(test)]
pub(crate) mod tests;
