//! For each part, selects one of the positions from each view's pairs, so that all views agree on one point in the world.

use geometry::{Camera, Ray};
use nalgebra::{Point2, Point3};

/// The positions of a part in one view, one for each pair that contains the view.
#[derive(Debug, Clone)]
pub struct Sightings<'a> {
    /// The camera of the frame.
    pub camera: &'a Camera,
    /// Uncertainty of a position, in pixels of the frame.
    pub sigma_px: f64,
    /// One position per pair, in pixels of the frame.
    pub points_px: Vec<[f64; 2]>,
}

/// Settings of the consensus.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConsensusSettings {
    /// Reprojection error above which the influence of a view decreases, in multiples of sigma.
    pub loss_sigmas: f64,
    /// Maximum distance at which the positions from two pairs of a view count as the same, in multiples of sigma.
    pub same_sigmas: f64,
    /// Weight of the number of a view's pairs that found a position, relative to the agreement between views.
    pub vote_weight: f64,
}

impl Default for ConsensusSettings {
    fn default() -> Self {
        Self {
            loss_sigmas: 1.0,
            same_sigmas: 0.5,
            vote_weight: 0.5,
        }
    }
}

/// Error assumed for a view that cannot see a point, in multiples of sigma.
const UNSEEN: f64 = 1e6;

/// A position found by some of the pairs of a view.
#[derive(Debug, Clone, Copy)]
struct Choice {
    at: Point2<f64>,
    ray: Option<Ray>,
    /// Cost of choosing this position.
    cost: f64,
}

/// Chooses a part's position in every view.
///
/// The paper takes the mean over a view's pairs. If the pairs disagree, for example on crossed legs or raised arms, the mean lies between
/// two positions and fits neither. This function instead looks for the point in the world that the most views support. It considers every
/// point `X` at which the rays through positions of two views meet, and minimises
///
/// `sum over views of min over positions k of c^2 (ln(1 + r_k^2 / c^2) - w ln(n_k / n))`
///
/// where `r_k` is the distance of the projection of `X` from position `k` in sigma, and `n_k` of the view's `n` pairs found that position.
/// The means are a further alternative, at the cost of a position that only one pair found; they are chosen if nothing else is consistent.
/// A view with a single position keeps it. This rule is our own.
///
/// * Returns one position per view, in pixels; `None` for a view without positions.
pub fn consensus(settings: &ConsensusSettings, views: &[Sightings<'_>]) -> Vec<Option<[f64; 2]>> {
    let mut workspace = ConsensusWorkspace::default();
    workspace.agree(settings, views).collect()
}

/// Workspace of [`consensus()`]: lists that are reused from part to part.
#[derive(Debug, Clone, Default)]
pub struct ConsensusWorkspace {
    /// Choices of every view.
    choices: Vec<Vec<Choice>>,
    /// Mean position of every view that has positions.
    means: Vec<Vec<Choice>>,
    kinds: Vec<Kind>,
}

impl ConsensusWorkspace {
    /// Like [`consensus()`], but takes the views one after the other.
    pub fn agree<'a>(
        &'a mut self,
        settings: &'a ConsensusSettings,
        views: &'a [Sightings<'_>],
    ) -> impl Iterator<Item = Option<[f64; 2]>> + 'a {
        self.choices.resize_with(views.len(), Vec::new);
        self.means.resize_with(views.len(), Vec::new);
        for (choices, view) in self.choices.iter_mut().zip(views) {
            distinct(settings, view, &mut self.kinds, choices);
        }
        let is_settled = self.choices.iter().all(|choices| choices.len() <= 1);
        for (mean, view) in self.means.iter_mut().zip(views) {
            mean.clear();
            mean.extend(of_mean(view).filter(|_| !is_settled));
        }
        let (choices, means) = (&self.choices[..], &self.means[..]);
        let point = if is_settled {
            None
        } else {
            meeting(settings, views, choices, means)
        };
        (0..views.len()).map(move |view| {
            let own = &choices[view];
            let chosen = match &point {
                Some(point) => own.get(nearest(settings, &views[view], own, point).0),
                None if is_settled => own.first(),
                None => means[view].first(),
            };
            chosen.map(|choice| choice.at.into())
        })
    }
}

/// Returns the point in the world indicated by the choices, unless the means agree better.
fn meeting(
    settings: &ConsensusSettings,
    views: &[Sightings<'_>],
    choices: &[Vec<Choice>],
    means: &[Vec<Choice>],
) -> Option<Point3<f64>> {
    let most = views.iter().map(|view| view.points_px.len()).max();
    let price = vote_cost(settings, 1, most.unwrap_or(1));
    let chosen = best(settings, views, choices);
    let average = best(settings, views, means);
    match (chosen, average) {
        (Some((cost, point)), Some((cost_of_means, _))) if cost <= cost_of_means + price => {
            Some(point)
        }
        (Some((_, point)), None) => Some(point),
        _ => None,
    }
}

fn vote_cost(settings: &ConsensusSettings, n_votes: usize, n_pairs: usize) -> f64 {
    let share = n_votes as f64 / n_pairs.max(1) as f64;
    -settings.loss_sigmas.powi(2) * settings.vote_weight * share.ln()
}

/// Returns the distinct positions of a view, in order of first occurrence.
///
/// Positions close to the first one of a group are merged into one position at their mean.
fn distinct(
    settings: &ConsensusSettings,
    view: &Sightings<'_>,
    kinds: &mut Vec<Kind>,
    choices: &mut Vec<Choice>,
) {
    kinds.clear();
    let reach = settings.same_sigmas * view.sigma_px;
    for &point in &view.points_px {
        let is_near =
            |kind: &&mut Kind| (kind.first[0] - point[0]).hypot(kind.first[1] - point[1]) <= reach;
        match kinds.iter_mut().find(is_near) {
            Some(kind) => kind.add(point),
            None => kinds.push(Kind::new(point)),
        }
    }
    let choice = |kind: &Kind| {
        let at = Point2::from(kind.sum.map(|sum| sum / kind.n as f64));
        Choice {
            at,
            ray: view.camera.ray(&at),
            cost: vote_cost(settings, kind.n, view.points_px.len()),
        }
    };
    choices.clear();
    choices.extend(kinds.iter().map(choice));
}

/// A group of positions that are close to the first of them.
#[derive(Debug, Clone)]
struct Kind {
    first: [f64; 2],
    sum: [f64; 2],
    n: usize,
}

impl Kind {
    fn new(first: [f64; 2]) -> Self {
        let mut kind = Self {
            first,
            sum: [0.0; 2],
            n: 0,
        };
        kind.add(first);
        kind
    }

    fn add(&mut self, point: [f64; 2]) {
        self.sum = [self.sum[0] + point[0], self.sum[1] + point[1]];
        self.n += 1;
    }
}

fn of_mean(view: &Sightings<'_>) -> Option<Choice> {
    if view.points_px.is_empty() {
        return None;
    }
    let at = mean(&view.points_px);
    let ray = view.camera.ray(&at);
    Some(Choice { at, ray, cost: 0.0 })
}

fn mean(points: &[[f64; 2]]) -> Point2<f64> {
    let sum = points.iter().fold([0.0; 2], |sum, it| [sum[0] + it[0], sum[1] + it[1]]);
    Point2::from(sum.map(|sum| sum / points.len() as f64))
}

/// Returns the cost and the position of the cheapest point at which two rays meet.
fn best(
    settings: &ConsensusSettings,
    views: &[Sightings<'_>],
    choices: &[Vec<Choice>],
) -> Option<(f64, Point3<f64>)> {
    let mut best: Option<(f64, Point3<f64>)> = None;
    for (first, of_first) in choices.iter().enumerate() {
        for of_second in &choices[first + 1..] {
            for (a, b) in of_first.iter().flat_map(|a| of_second.iter().map(move |b| (a, b))) {
                let (Some(a), Some(b)) = (&a.ray, &b.ray) else {
                    continue;
                };
                let Some(point) = meeting_point(a, b) else {
                    continue;
                };
                let cost = judge(settings, views, choices, &point);
                if best.as_ref().is_none_or(|best| cost < best.0) {
                    best = Some((cost, point));
                }
            }
        }
    }
    best
}

/// Returns the cost of a point in the world over all views.
fn judge(
    settings: &ConsensusSettings,
    views: &[Sightings<'_>],
    choices: &[Vec<Choice>],
    point: &Point3<f64>,
) -> f64 {
    let each = views.iter().zip(choices);
    let answered = each.filter(|(_, choices)| !choices.is_empty());
    answered.fold(0.0, |total, (view, choices)| {
        total + nearest(settings, view, choices, point).1
    })
}

/// Returns the position of a view that is nearest to a point in the world, and its cost.
fn nearest(
    settings: &ConsensusSettings,
    view: &Sightings<'_>,
    choices: &[Choice],
    point: &Point3<f64>,
) -> (usize, f64) {
    let c2 = settings.loss_sigmas.powi(2);
    let seen = view.camera.project(point);
    let cost = |choice: &Choice| {
        let r = seen.map_or(UNSEEN, |seen| (seen - choice.at).norm() / view.sigma_px);
        choice.cost + c2 * (r * r / c2).ln_1p()
    };
    let costs = choices.iter().map(cost).enumerate();
    let dearest = (0, f64::INFINITY);
    costs.fold(dearest, |least, it| if it.1 < least.1 { it } else { least })
}

/// Returns the point closest to both rays; `None` if the rays are parallel or the point lies behind one of them.
fn meeting_point(a: &Ray, b: &Ray) -> Option<Point3<f64>> {
    let between = b.origin - a.origin;
    let cosine = a.direction.dot(&b.direction);
    let sine2 = 1.0 - cosine * cosine;
    if sine2 < 1e-9 {
        return None;
    }
    let [on_a, on_b] = [a.direction.dot(&between), b.direction.dot(&between)];
    let along_a = (on_a - cosine * on_b) / sine2;
    let along_b = (cosine * on_a - on_b) / sine2;
    (along_a > 0.0 && along_b > 0.0).then(|| {
        nalgebra::center(
            &(a.origin + a.direction.scale(along_a)),
            &(b.origin + b.direction.scale(along_b)),
        )
    })
}

#[cfg(test)]
mod tests {
    use geometry::{Intrinsics, Lens, LensModel};
    use nalgebra::{Isometry3, Vector3};
    use proptest::prelude::*;

    use super::*;

    /// Cameras on a circle of radius 4 m, looking at the origin.
    fn cameras(n: usize) -> Vec<Camera> {
        let camera = |i: usize| {
            let angle = 0.9 * i as f64;
            let eye = Point3::new(4.0 * angle.cos(), 4.0 * angle.sin(), 1.0);
            let down = -Vector3::z();
            Camera {
                name: format!("camera {i}"),
                intrinsics: Intrinsics {
                    fx: 400.0,
                    fy: 400.0,
                    cx: 200.0,
                    cy: 200.0,
                    size: [400, 400],
                    lens: Lens::new(LensModel::BrownConrady {
                        k: [0.0; 6],
                        p: [0.0; 2],
                    }),
                },
                camera_from_world: Isometry3::look_at_lh(&eye, &Point3::origin(), &down),
            }
        };
        (0..n).map(camera).collect()
    }

    fn projected(camera: &Camera, point: [f64; 3]) -> [f64; 2] {
        camera.project(&Point3::from(point)).unwrap().into()
    }

    fn sightings(
        cameras: &[Camera],
        points: impl Fn(usize) -> Vec<[f64; 2]>,
    ) -> Vec<Sightings<'_>> {
        let of_view = |(view, camera)| Sightings {
            camera,
            sigma_px: 5.0,
            points_px: points(view),
        };
        cameras.iter().enumerate().map(of_view).collect()
    }

    fn choose(views: &[Sightings<'_>]) -> Vec<Option<[f64; 2]>> {
        consensus(&ConsensusSettings::default(), views)
    }

    const KNEE: [f64; 3] = [0.1, 0.0, 0.2];
    const OTHER_KNEE: [f64; 3] = [-0.2, 0.15, 0.2];

    #[test]
    fn a_position_that_fits_the_other_views_beats_a_more_frequent_one() {
        let cameras = cameras(4);
        let right = |view: usize| projected(&cameras[view], KNEE);
        let wrong = |view: usize| projected(&cameras[view], OTHER_KNEE);
        let views = sightings(&cameras, |view| match view {
            0 => vec![wrong(0), right(0), wrong(0)],
            _ => vec![right(view); 3],
        });
        let got = choose(&views);
        for (view, got) in got.into_iter().enumerate() {
            let ([x, y], [gx, gy]) = (right(view), got.unwrap());
            assert!((gx - x).hypot(gy - y) < 1e-9, "view {view}: {gx} {gy}");
        }
    }

    #[test]
    fn a_single_position_per_view_is_kept() {
        let cameras = cameras(3);
        let points = [[10.0, 20.0], [300.0, 7.0], [55.0, 390.0]];
        let views = sightings(&cameras, |view| vec![points[view]]);
        assert_eq!(choose(&views), points.map(Some));
    }

    #[test]
    fn a_view_without_positions_gets_none_and_is_ignored() {
        let cameras = cameras(4);
        let right = |view: usize| projected(&cameras[view], KNEE);
        let wrong = |view: usize| projected(&cameras[view], OTHER_KNEE);
        let views = sightings(&cameras, |view| match view {
            0 => vec![wrong(0), right(0)],
            1 => Vec::new(),
            _ => vec![right(view); 2],
        });
        let got = choose(&views);
        assert_eq!(got[1], None);
        assert_eq!(got[0], Some(right(0)), "of the two, the one that fits");
    }

    #[test]
    fn the_means_are_chosen_if_nothing_else_is_consistent() {
        let cameras = cameras(4);
        let views = sightings(&cameras, |view| {
            let [x, y] = projected(&cameras[view], KNEE);
            // The offsets point in all directions, so that the point where two views' positions meet is far from a third view's position.
            let [dx, dy] = [[60.0, 80.0], [-70.0, 75.0], [65.0, -90.0], [-85.0, -60.0]][view];
            vec![[x + dx, y + dy], [x - dx, y - dy]]
        });
        for (view, got) in choose(&views).into_iter().enumerate() {
            let ([x, y], [gx, gy]) = (projected(&cameras[view], KNEE), got.unwrap());
            assert!((gx - x).hypot(gy - y) < 1e-9, "view {view}: {gx} {gy}");
        }
    }

    #[test]
    fn positions_closer_than_their_uncertainty_are_merged() {
        let cameras = cameras(2);
        let [x, y] = projected(&cameras[0], KNEE);
        let views = sightings(&cameras, |view| match view {
            0 => vec![[x - 1.0, y], [x + 1.0, y]],
            _ => vec![projected(&cameras[1], KNEE)],
        });
        assert_eq!(choose(&views)[0], Some([x, y]));
    }

    #[test]
    fn cameras_at_one_place_keep_the_means() {
        let camera = cameras(1).remove(0);
        let cameras = [camera.clone(), camera];
        let views = sightings(&cameras, |_| vec![[100.0, 100.0], [200.0, 100.0]]);
        assert_eq!(choose(&views), [Some([150.0, 100.0]); 2]);
    }

    proptest! {
        #[test]
        fn every_view_gets_one_of_its_positions_or_their_mean(
            points in prop::collection::vec(prop::collection::vec([0.0..400.0_f64, 0.0..400.0], 1..4), 2..5),
        ) {
            let cameras = cameras(points.len());
            let settings = ConsensusSettings { same_sigmas: 0.0, ..ConsensusSettings::default() };
            let views = sightings(&cameras, |view| points[view].clone());
            for (got, points) in consensus(&settings, &views).into_iter().zip(&points) {
                let got = got.unwrap();
                prop_assert!(points.contains(&got) || got == <[f64; 2]>::from(mean(points)));
            }
        }
    }
}
