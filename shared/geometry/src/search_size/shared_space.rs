//! The space that several cameras see, and the height of a standing person there in their pictures.

use nalgebra::{Point2, Point3, UnitVector3, Vector3};
use statistics::Sorted;

use crate::{Camera, Rig};

/// Height of a standing person, in metres.
pub const PERSON_METRES: f64 = 1.7;
/// Numbers of sample points: cells along each side of a camera's image, and depths along each ray.
const CELLS: usize = 9;
const DEPTHS: usize = 24;
/// Maximum height of a person relative to the side of the image along the person: for a person who must be entirely in the image, and for
/// one who may be cut off.
const MAX_SHARE_WHOLE: f64 = 1.25;
const MAX_SHARE_PARTIAL: f64 = 4.0;
/// Minimum height of a person, relative to the same side.
const MIN_SHARE: f64 = 0.0625;
/// Parts of space in order of preference. The first part that is shared by as many cameras as any other is used. People are near the point
/// at which cameras are aimed; the space that parallel cameras share has no end.
const BOUNDS: [Bound; 4] = [
    Bound::NearFocus,
    Bound::MinShare(0.25),
    Bound::MinShare(0.125),
    Bound::MinShare(MIN_SHARE),
];
/// Largest ratio between a depth and the depth of the rig's focus at which the two count as near each other.
const NEAR_FACTOR: f64 = 1.6;
/// Minimum angle between optical axes that have a common focus, in radians (4 degrees).
const MIN_AXIS_ANGLE: f64 = 0.07;
/// Minimum size of a space seen by more than two cameras, relative to the space seen by two.
const MIN_SPACE_SHARE: f64 = 0.03;
/// Minimum height of a person seen from above, relative to the height seen from the side. There is a minimum because the size of the body
/// parts in the picture does not change.
const MIN_FORESHORTENING: f64 = 0.7;

/// Height of a standing person in each camera, in the space that this camera and other cameras see.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Heights {
    /// Median height in every camera, in pixels of the calibrated image; `None` for a camera that sees no space together with others.
    pub(super) median_px: Vec<Option<f64>>,
    /// Maximum number of cameras that see a common space of sufficient size; 0 if no two cameras do.
    pub(super) n_sharing: usize,
}

/// A part of space.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Bound {
    /// The part at about the same distance from the camera as the focus of the rig.
    NearFocus,
    /// The part in which the height of a person is at least this fraction of the image's side along the person.
    MinShare(f64),
}

/// The image of a person in one camera.
#[derive(Debug, Clone, Copy)]
struct Projection {
    /// Height, in pixels of the calibrated image.
    px: f64,
    /// Height relative to the side of the image along the person.
    share: f64,
    /// Ratio between the depth and the depth of the focus, or its inverse, whichever is larger; infinite without a focus.
    from_focus: f64,
}

impl Projection {
    fn is_within(&self, bound: Bound) -> bool {
        match bound {
            Bound::NearFocus => self.from_focus <= NEAR_FACTOR,
            Bound::MinShare(least) => self.share >= least,
        }
    }
}

/// A position where a person may stand, with the image of the person in every camera.
struct Place {
    seen: Vec<Option<Projection>>,
}

impl Place {
    fn seen_by(&self, camera: usize, bound: Bound) -> Option<Projection> {
        self.seen[camera].filter(|projection| projection.is_within(bound))
    }

    fn n_seen(&self, bound: Bound) -> usize {
        let seen = self.seen.iter().flatten();
        seen.filter(|projection| projection.is_within(bound)).count()
    }
}

/// Finds the heights of a standing person in the space that the cameras share. Positions at which the images show the whole person are
/// preferred over positions at which they show only the middle of the person.
///
/// Without an up direction, the height is measured as seen from the side.
pub(super) fn heights(rig: &Rig) -> Heights {
    let n = rig.cameras().len();
    for is_whole in [true, false] {
        let places = places(rig, is_whole);
        let found = BOUNDS.map(|bound| (bound, n_sharing(&places, n, bound)));
        let most = found.iter().map(|found| found.1).max().unwrap_or(0);
        let first = found.iter().find(|found| found.1 == most && most >= 2);
        if let Some((bound, n_sharing)) = first {
            let median = |camera| median_px(&places, camera, *bound, *n_sharing);
            return Heights {
                median_px: (0..n).map(median).collect(),
                n_sharing: *n_sharing,
            };
        }
    }
    Heights {
        median_px: vec![None; n],
        n_sharing: 0,
    }
}

/// Returns the maximum number of cameras that see a sufficient part of the space seen by two cameras; 0 if no two cameras see a common
/// space.
fn n_sharing(places: &[Place], n_cameras: usize, bound: Bound) -> usize {
    let n_of: Vec<usize> = places.iter().map(|place| place.n_seen(bound)).collect();
    let shared_by = |n: usize| n_of.iter().filter(|value| **value >= n).count();
    let enough = (MIN_SPACE_SHARE * shared_by(2) as f64).max(1.0);
    let mut sharing = (2..=n_cameras).rev();
    let found = sharing.find(|n| shared_by(*n) as f64 >= enough);
    found.unwrap_or(0)
}

/// Returns the median height in a camera, over the positions that as many other cameras as possible also see.
fn median_px(places: &[Place], camera: usize, bound: Bound, n_sharing: usize) -> Option<f64> {
    let of = |n: usize, bound: Bound| {
        let shared = places.iter().filter(|place| place.n_seen(bound) >= n);
        let seen = shared.filter_map(|place| place.seen_by(camera, bound));
        let px: Vec<f64> = seen.map(|projection| projection.px).collect();
        Sorted::new(px).upper_median()
    };
    let fewer = (2..=n_sharing).rev();
    let found = fewer.clone().find_map(|n| of(n, bound));
    // This is for a camera that is aimed in a different direction from the others.
    found.or_else(|| BOUNDS.iter().find_map(|bound| fewer.clone().find_map(|n| of(n, *bound))))
}

/// Returns positions on the rays of all cameras. Each position is seen by at least two cameras.
fn places(rig: &Rig, is_whole: bool) -> Vec<Place> {
    let (up, focus) = (rig.up_in_world(), aim(rig));
    let viewpoint = |camera| Viewpoint::new(camera, up, focus, is_whole);
    let viewpoints: Vec<Viewpoint<'_>> = rig.cameras().iter().map(viewpoint).collect();
    let points = viewpoints.iter().flat_map(Viewpoint::points);
    let place = |point: Point3<f64>| Place {
        seen: viewpoints.iter().map(|viewpoint| viewpoint.person(&point)).collect(),
    };
    let is_shared = |place: &Place| place.seen.iter().flatten().count() >= 2;
    points.map(place).filter(is_shared).collect()
}

/// Returns the point at which cameras are aimed; `None` if their axes are nearly parallel.
fn aim(rig: &Rig) -> Option<Point3<f64>> {
    let axes: Vec<_> = rig.cameras().iter().map(Camera::axis_in_world).collect();
    let differ = |a: &UnitVector3<f64>| axes.iter().any(|b| a.angle(b) > MIN_AXIS_ANGLE);
    rig.focus().filter(|_| axes.iter().any(differ))
}

/// A camera, with the values that determine the height of people in it.
struct Viewpoint<'a> {
    camera: &'a Camera,
    up: Option<UnitVector3<f64>>,
    /// Maximum height of a person, relative to `side`.
    max_share: f64,
    is_whole: bool,
    /// Depth of the point at which the cameras are aimed, in metres.
    focus_depth: Option<f64>,
    /// Mean focal length, in pixels.
    focal: f64,
    /// Side of the image that is along a standing person, in pixels.
    side: f64,
}

impl<'a> Viewpoint<'a> {
    fn new(
        camera: &'a Camera,
        up: Option<UnitVector3<f64>>,
        focus: Option<Point3<f64>>,
        is_whole: bool,
    ) -> Self {
        let intrinsics = &camera.intrinsics;
        let [width, height] = intrinsics.size.map(f64::from);
        let up_in_camera = up.map(|up| camera.camera_from_world.rotation * up.into_inner());
        let across = up_in_camera.map_or(0.0, |up_in_camera| up_in_camera.xy().norm());
        // Seen from above, or without a known up direction, a person may have any orientation in the picture.
        let side = match up_in_camera.filter(|_| across > 0.3) {
            Some(up) => (width * across / up.x.abs()).min(height * across / up.y.abs()),
            None => (width * height).sqrt(),
        };
        Self {
            camera,
            up,
            max_share: if is_whole {
                MAX_SHARE_WHOLE
            } else {
                MAX_SHARE_PARTIAL
            },
            is_whole,
            focus_depth: focus
                .map(|focus| (camera.camera_from_world * focus).z)
                .filter(|depth| *depth > 0.0),
            focal: (intrinsics.fx * intrinsics.fy).sqrt(),
            side,
        }
    }

    /// Returns points on the camera's rays. The depths range from a person filling the image to a person who is small in it. Every doubling
    /// of the depth has the same number of points.
    fn points(&self) -> impl Iterator<Item = Point3<f64>> + '_ {
        let [width, height] = self.camera.intrinsics.size.map(f64::from);
        let middle = |nth: usize, n: usize| (nth as f64 + 0.5) / n as f64;
        let cells = (0..CELLS * CELLS).filter_map(move |cell| {
            let x = middle(cell % CELLS, CELLS) * width - 0.5;
            let y = middle(cell / CELLS, CELLS) * height - 0.5;
            self.camera.ray(&Point2::new(x, y))
        });
        cells.flat_map(move |ray| {
            let axis = self.camera.axis_in_world();
            let along = ray.direction.dot(&axis).max(0.05);
            (0..DEPTHS).map(move |nth| {
                let share = self.max_share * (MIN_SHARE / self.max_share).powf(middle(nth, DEPTHS));
                let depth = self.focal * PERSON_METRES / (share * self.side);
                ray.origin + ray.direction.into_inner() * (depth / along)
            })
        })
    }

    /// Returns the image of a person whose middle is at a point.
    fn person(&self, middle: &Point3<f64>) -> Option<Projection> {
        let centre = self.inside(middle)?;
        let depth = (self.camera.camera_from_world * middle).z;
        let from_side = self.focal * PERSON_METRES / depth;
        let px = match self.up {
            Some(up) => self.between_ends(
                middle,
                &(up.into_inner() * (PERSON_METRES / 2.0)),
                from_side,
            )?,
            None if self.is_whole && !self.has_room(&centre, from_side) => return None,
            None => from_side,
        };
        let px = px.max(MIN_FORESHORTENING * from_side);
        let share = px / self.side;
        let ratio = self.focus_depth.map_or(f64::INFINITY, |focus_depth| depth / focus_depth);
        (px.is_finite() && share <= self.max_share).then_some(Projection {
            px,
            share,
            from_focus: ratio.max(1.0 / ratio),
        })
    }

    /// Returns the distance from head to feet in pixels; `None` if they must be in the image but are not.
    ///
    /// * `half`: vector from the middle to the head.
    /// * `otherwise`: result if the lens model has no image of the head or the feet.
    fn between_ends(
        &self,
        middle: &Point3<f64>,
        half: &Vector3<f64>,
        otherwise: f64,
    ) -> Option<f64> {
        let ends = [middle + half, middle - half];
        if self.is_whole {
            let [head, feet] = [self.inside(&ends[0])?, self.inside(&ends[1])?];
            return Some((head - feet).norm());
        }
        let [head, feet] = ends.map(|end| self.camera.project(&end));
        let px = head.zip(feet).map(|(head, feet)| (head - feet).norm());
        Some(px.unwrap_or(otherwise))
    }

    /// Returns true if a person of a given height fits into the picture around a pixel, upright or across.
    fn has_room(&self, centre: &Point2<f64>, px: f64) -> bool {
        let [width, height] = self.camera.intrinsics.size.map(f64::from);
        let across = centre.x.min(width - centre.x);
        let upright = centre.y.min(height - centre.y);
        2.0 * across.max(upright) >= px
    }

    /// Returns the pixel of a point, if it is in the picture.
    fn inside(&self, point: &Point3<f64>) -> Option<Point2<f64>> {
        let [width, height] = self.camera.intrinsics.size.map(f64::from);
        let pixel = self.camera.project(point)?;
        let is_in = (-0.5..width).contains(&pixel.x) && (-0.5..height).contains(&pixel.y);
        is_in.then_some(pixel)
    }
}
