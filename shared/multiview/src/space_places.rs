//! The places in space that pairs of views suggest for the joints, with the evidence of every view there. They are computed once, for all
//! swaps of left and right and all selections of views.

use nalgebra::Point3;

use geometry::Ray;

use crate::space_view::{N, Places, SpaceView, name, other_side};

/// Candidate places of every joint, and the evidence of all views for the joint at each place.
pub(crate) struct Choices {
    /// Positions, in metres in the world.
    pub(crate) places: Places,
    /// Scores, one for each place of a joint.
    pub(crate) scores: [Vec<f64>; N],
}

impl Choices {
    /// Adds places for the joints that have none, from more views. Returns true if there were such joints.
    ///
    /// * `n`: maximum number of places of a joint.
    pub(crate) fn complete(&mut self, views: &[SpaceView<'_>], n: usize) -> bool {
        if self.places.iter().all(|places| !places.is_empty()) {
            return false;
        }
        let mut crossings = Crossings::new(views);
        let used = views.iter().enumerate().map(|(view, shown)| Used {
            view,
            exchanged: shown.exchanged,
        });
        let used: Vec<Used> = used.collect();
        for joint in 0..N {
            if self.places[joint].is_empty() {
                crossings.choose(joint, &used, n, self);
            }
        }
        true
    }
}

/// A view that is used, and whether its left and right are swapped, for the arms and for the legs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Used {
    /// Index of the view among the views of [`Crossings::new`].
    pub(crate) view: usize,
    pub(crate) exchanged: [bool; 2],
}

/// The points at which rays of two views come nearest to each other.
#[derive(Default)]
struct Points {
    at: Vec<Point3<f64>>,
    /// Evidence of every view for every point, both for the name of the first view's joint and for the same joint on the other side.
    evidence: Vec<[f64; 2]>,
}

/// The points at which the rays of maxima of two views come nearest to each other.
pub(crate) struct Crossings<'a> {
    views: &'a [SpaceView<'a>],
    /// Rays by view and name. Inverting a lens is iterative and slow, so it is done once per maximum.
    rays: Vec<[Vec<Ray>; N]>,
    /// Points by pair of views, by joint name in the first view, and by whether the second view gives it the name of the other side;
    /// computed on demand.
    points: Vec<Option<Points>>,
}

impl<'a> Crossings<'a> {
    /// Prepares the views; their [`SpaceView::exchanged`] is ignored.
    pub(crate) fn new(views: &'a [SpaceView<'a>]) -> Self {
        let rays = views.iter().map(|view| core::array::from_fn(|name| view.rays(name)));
        let n_pairs = views.len() * views.len();
        Self {
            views,
            rays: rays.collect(),
            points: (0..n_pairs * N * 2).map(|_| None).collect(),
        }
    }

    /// Returns the places of every joint, the best first.
    ///
    /// * `n`: maximum number of places of a joint.
    /// * A joint that fewer than two of the views show has no places.
    pub(crate) fn choices(&mut self, used: &[Used], n: usize) -> Choices {
        let mut choices = Choices {
            places: core::array::from_fn(|_| Vec::new()),
            scores: core::array::from_fn(|_| Vec::new()),
        };
        for joint in 0..N {
            self.choose(joint, used, n, &mut choices);
        }
        choices
    }

    /// Sets the places of one joint.
    fn choose(&mut self, joint: usize, used: &[Used], n: usize, choices: &mut Choices) {
        let mut found: Vec<(f64, Point3<f64>)> = Vec::new();
        for (nth, first) in used.iter().enumerate() {
            for second in &used[nth + 1..] {
                self.add(joint, [*first, *second], used, &mut found);
            }
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        found.truncate(n);
        choices.scores[joint] = found.iter().map(|(score, _)| *score).collect();
        choices.places[joint] = found.into_iter().map(|(_, at)| at).collect();
    }

    /// Adds the places that two views suggest for a joint, with the evidence of all used views.
    fn add(
        &mut self,
        joint: usize,
        [first, second]: [Used; 2],
        used: &[Used],
        found: &mut Vec<(f64, Point3<f64>)>,
    ) {
        let names = [first, second].map(|view| name(joint, view.exchanged));
        let n_views = self.views.len();
        let pair = first.view * n_views + second.view;
        let index = (pair * N + names[0]) * 2 + usize::from(names[0] != names[1]);
        if self.points[index].is_none() {
            self.points[index] = Some(self.cross([first.view, second.view], names));
        }
        let Some(points) = &self.points[index] else {
            return;
        };
        for (at, evidence) in points.at.iter().zip(points.evidence.chunks_exact(n_views)) {
            let score = used.iter().map(|view| {
                let side = usize::from(name(joint, view.exchanged) != names[0]);
                evidence[view.view][side]
            });
            found.push((score.sum(), *at));
        }
    }

    /// Crosses the rays of two views.
    fn cross(&self, [first, second]: [usize; 2], names: [usize; 2]) -> Points {
        let mut points = Points::default();
        let sides = [names[0], other_side(names[0])];
        for a in &self.rays[first][names[0]] {
            for b in &self.rays[second][names[1]] {
                let Some(at) = nearest(a, b) else {
                    continue;
                };
                points.at.push(at);
                let evidence = self.views.iter().map(|view| view.evidence_of(sides, &at));
                points.evidence.extend(evidence);
            }
        }
        points
    }
}

/// Returns the point nearest to two rays; `None` if it is behind a camera, or the rays are parallel.
fn nearest(a: &Ray, b: &Ray) -> Option<Point3<f64>> {
    let (u, v) = (a.direction.into_inner(), b.direction.into_inner());
    let between = b.origin - a.origin;
    let cosine = u.dot(&v);
    let sine2 = 1.0 - cosine * cosine;
    if sine2 < 1e-6 {
        return None;
    }
    let along_a = (between.dot(&u) - cosine * between.dot(&v)) / sine2;
    let along_b = (cosine * between.dot(&u) - between.dot(&v)) / sine2;
    if along_a <= 0.0 || along_b <= 0.0 {
        return None;
    }
    Some(nalgebra::center(
        &(a.origin + u * along_a),
        &(b.origin + v * along_b),
    ))
}
