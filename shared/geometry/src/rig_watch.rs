//! Whether every camera stands where the calibration says, from what the cameras see of a person.

mod swap;

#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use nalgebra::{Point2, Point3};

use crate::{Camera, Ray};

pub use swap::{Contradiction, Swap, SwapWatch};

/// Frames that the running median looks back on.
const WINDOW: usize = 60;
/// Frames without which nothing is said.
const LEAST_FRAMES: usize = 12;
/// A camera is named once it has been suspected for so many frames in a row that told something.
const PERSISTENT: u32 = 8;
/// Points of a frame without which it says nothing.
const LEAST_POINTS: usize = 5;
/// Sine of the angle between two rays below which their meeting point is too uncertain.
const LEAST_SINE: f64 = 0.2;
/// A camera is suspected if cameras disagree so many times more with it than without it, and by at least
/// so many degrees, and pixels: where people stand in a grid of cells of four, half a cell may always be
/// missing in the same direction.
const FACTOR: f64 = 2.5;
const LEAST_DEGREES: f64 = 0.5;
const LEAST_PX: f64 = 4.0;
/// Nothing is said where the others disagree by more among themselves.
const MOST_DEGREES: f64 = 1.5;

/// Follows how far apart the cameras see the same points, with each camera and without it.
///
/// From four cameras on, every two others meet in a point of space, which is projected into the camera:
/// the way from there to what it sees itself counts. Of a frame that is the median over all points, in x
/// and in y; of such a group of cameras the length of the median over the last frames: what is found
/// wrongly goes now this way and now that, and what a camera that was moved sees always goes the same way.
/// Of a camera it is the median over all groups that it is in: one wrong camera spoils those, and none of
/// the others. With three, the length of the way to the ray of one other camera counts (the epipolar
/// distance), which a camera that is turned along its epipolar lines hardly shows; its direction does not,
/// since the only two that are left without a camera may agree by chance. With two cameras nobody can tell
/// which of them is wrong.
///
/// Not a calibration: it names a camera that was moved, and does not say where it stands.
#[derive(Debug, Clone)]
pub struct RigWatch {
    cameras: Vec<Camera>,
    groups: Vec<Group>,
    /// By camera: frames in a row in which it was suspected.
    streaks: Vec<u32>,
    /// By camera: whether it was named, at any time.
    named: Vec<bool>,
}

/// Some cameras, and how far apart they saw the same points.
#[derive(Debug, Clone)]
struct Group {
    /// The camera into which is projected, and the two others, or twice the one other.
    views: [usize; 3],
    /// Of the last frames: the median way from where a point should be to where it was seen, pixels.
    px: VecDeque<[f64; 2]>,
}

/// A camera that does not stand where the calibration says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Suspect {
    /// The camera.
    pub view: usize,
    /// How far apart cameras see the same points if it is one of them, pixels.
    pub residual_px: f64,
    /// The same without it, pixels.
    pub without_px: f64,
}

impl RigWatch {
    /// Begins to watch cameras.
    pub fn new(cameras: Vec<Camera>) -> Self {
        let n = cameras.len();
        let counts = |[view, a, b]: &[usize; 3]| {
            let is_new = if n > 3 { a < b } else { n == 3 && a == b };
            is_new && view != a && view != b
        };
        let all = (0..n).flat_map(|view| (0..n * n).map(move |it| [view, it / n, it % n]));
        let groups = all.filter(counts).map(|views| Group {
            views,
            px: VecDeque::new(),
        });
        Self {
            groups: groups.collect(),
            streaks: vec![0; n],
            named: vec![false; n],
            cameras,
        }
    }

    /// Takes in what the cameras see of one frame.
    ///
    /// * `points_px`: one entry a camera, `None` where it saw nothing; the same points of the world in the
    ///   same order, pixels of the recorded image.
    pub fn note(&mut self, points_px: &[Option<Vec<[f64; 2]>>]) {
        let views = self.cameras.iter().zip(points_px);
        let see = |(camera, points): (&Camera, &Option<Vec<[f64; 2]>>)| -> Vec<Option<Seen>> {
            let points = points.iter().flatten();
            points.map(|at| Seen::new(camera, *at)).collect()
        };
        let seen: Vec<Vec<Option<Seen>>> = views.map(see).collect();
        let mut tells = false;
        for group in &mut self.groups {
            let [Some(own), Some(a), Some(b)] = group.views.map(|it| seen.get(it)) else {
                continue;
            };
            let camera = &self.cameras[group.views[0]];
            let is_one = group.views[1] == group.views[2];
            let points = own.iter().zip(a).zip(b);
            let px = points.filter_map(|((own, a), b)| {
                let (own, a, b) = (own.as_ref()?, a.as_ref()?, b.as_ref()?);
                if is_one {
                    let way = own.px_to_ray(camera, &a.ray)?;
                    Some([way[0].hypot(way[1]), 0.0])
                } else {
                    own.px_to_meeting(camera, &a.ray, &b.ray)
                }
            });
            let px: Vec<[f64; 2]> = px.collect();
            tells |= group.note(&px);
        }
        if tells {
            self.follow();
        }
    }

    /// Names who has been suspected long enough.
    fn follow(&mut self) {
        let suspects = self.suspects();
        for (view, streak) in self.streaks.iter_mut().enumerate() {
            let is_suspect = suspects.iter().any(|it| it.view == view);
            *streak = if is_suspect { *streak + 1 } else { 0 };
            self.named[view] |= *streak >= PERSISTENT;
        }
    }

    /// Whether a camera was found, at any time, not to stand where the calibration says: suspected for
    /// several frames in a row.
    pub fn is_named(&self, view: usize) -> bool {
        self.named.get(view).copied().unwrap_or(false)
    }

    /// How far apart cameras see the same points if a camera is one of them, pixels; `None` while too
    /// little was seen.
    pub fn residual_px(&self, view: usize) -> Option<f64> {
        self.apart(|it| it.views.contains(&view))
    }

    /// The same of the others without it, pixels.
    pub fn without_px(&self, view: usize) -> Option<f64> {
        self.apart(|it| !it.views.contains(&view))
    }

    /// The median over some groups.
    fn apart(&self, counts: impl Fn(&Group) -> bool) -> Option<f64> {
        let groups = self.groups.iter().filter(|it| counts(it));
        median(groups.filter_map(Group::apart).collect())
    }

    /// The cameras that do not stand where the calibration says.
    ///
    /// One at a time: the one without which the others agree best. A wrong camera spoils what the others say of each
    /// other, so that a second is sought among those that are left, of which there must be four.
    pub fn suspects(&self) -> Vec<Suspect> {
        let mut left_out = Vec::new();
        let mut found = Vec::new();
        while let Some(it) = self.worst(&left_out) {
            left_out.push(it.view);
            found.push(it);
            if self.cameras.len() < 4 + left_out.len() {
                break;
            }
        }
        found
    }

    /// Of the cameras that are not left out, the one without which the others agree best, if it is wrong.
    fn worst(&self, left_out: &[usize]) -> Option<Suspect> {
        let views = (0..self.cameras.len()).filter(|it| !left_out.contains(it));
        let suspects = views.filter_map(|view| self.suspect(view, left_out));
        let gain = |it: &Suspect| it.residual_px / it.without_px.max(1e-9);
        suspects.max_by(|a, b| gain(a).total_cmp(&gain(b)))
    }

    fn suspect(&self, view: usize, left_out: &[usize]) -> Option<Suspect> {
        let counts = |it: &Group| !left_out.iter().any(|out| it.views.contains(out));
        let residual_px = self.apart(|it| counts(it) && it.views.contains(&view))?;
        let without_px = self.apart(|it| counts(it) && !it.views.contains(&view))?;
        let it = &self.cameras[view].intrinsics;
        let px = |degrees: f64| it.fx.min(it.fy).abs() * degrees.to_radians().tan();
        let least_px = px(LEAST_DEGREES).max(LEAST_PX);
        let is_wrong =
            residual_px > least_px.max(FACTOR * without_px) && without_px < px(MOST_DEGREES);
        is_wrong.then_some(Suspect {
            view,
            residual_px,
            without_px,
        })
    }
}

impl Group {
    /// Notes the ways between where the points of a frame should be and were seen; whether they were enough.
    fn note(&mut self, px: &[[f64; 2]]) -> bool {
        if px.len() < LEAST_POINTS {
            return false;
        }
        self.px.extend(median_way(px));
        if self.px.len() > WINDOW {
            self.px.pop_front();
        }
        true
    }

    fn apart(&self) -> Option<f64> {
        let frames: Vec<_> = self.px.iter().copied().collect();
        let way = median_way(&frames).filter(|_| frames.len() >= LEAST_FRAMES)?;
        Some(way[0].hypot(way[1]))
    }
}

/// A point that a camera sees.
#[derive(Debug, Clone, Copy)]
struct Seen {
    at_px: Point2<f64>,
    ray: Ray,
}

impl Seen {
    fn new(camera: &Camera, at: [f64; 2]) -> Option<Self> {
        let at_px = Point2::from(at);
        let ray = camera.ray(&at_px)?;
        Some(Self { at_px, ray })
    }

    /// The way to it from the point in which two rays meet, pixels of its camera.
    fn px_to_meeting(&self, camera: &Camera, a: &Ray, b: &Ray) -> Option<[f64; 2]> {
        let [on_a, on_b] = closest(a, b)?;
        self.px_to_point(camera, &nalgebra::center(&on_a, &on_b))
    }

    /// The way to it from a ray, pixels of its camera: from where the ray comes closest to its own.
    fn px_to_ray(&self, camera: &Camera, ray: &Ray) -> Option<[f64; 2]> {
        let [on_ray, _] = closest(ray, &self.ray)?;
        self.px_to_point(camera, &on_ray)
    }

    fn px_to_point(&self, camera: &Camera, in_world: &Point3<f64>) -> Option<[f64; 2]> {
        let way = self.at_px - camera.project(in_world)?;
        let is_finite = way.iter().all(|it| it.is_finite());
        is_finite.then_some([way.x, way.y])
    }
}

/// Where two rays come closest, a point on either; `None` if they are almost parallel, or come closest
/// behind a camera.
fn closest(a: &Ray, b: &Ray) -> Option<[Point3<f64>; 2]> {
    let across = a.direction.cross(&b.direction);
    let squared_sine = across.norm_squared();
    if squared_sine.is_nan() || squared_sine < LEAST_SINE.powi(2) {
        return None;
    }
    let between = b.origin - a.origin;
    let along = |other: &Ray| between.cross(&other.direction).dot(&across) / squared_sine;
    let (along_a, along_b) = (along(b), along(a));
    let is_ahead = along_a > 0.0 && along_b > 0.0;
    is_ahead.then(|| {
        [
            a.origin + along_a * *a.direction,
            b.origin + along_b * *b.direction,
        ]
    })
}

/// The median in x and in y; none of nothing.
fn median_way(all: &[[f64; 2]]) -> Option<[f64; 2]> {
    let along = |axis: usize| median(all.iter().map(|it| it[axis]).collect());
    Some([along(0)?, along(1)?])
}

/// The lower of the two in the middle; none of nothing.
fn median(mut all: Vec<f64>) -> Option<f64> {
    all.sort_by(f64::total_cmp);
    all.get(all.len().saturating_sub(1) / 2).copied()
}
