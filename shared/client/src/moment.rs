//! A moment, as a program receives it: everything about one frame.

use std::sync::{Arc, Mutex};

use messages::{FrameHeader, Joint3d, SkeletonMessage, Status, ViewPose};
use runfiles::Running;
use runtime::Seen;

use crate::lock::lock;

/// Everything about one frame that was asked for and is there.
#[derive(Debug)]
pub struct Moment {
    /// Description of the deployment by itself: names of joints and cameras.
    pub running: Arc<Running>,
    /// Number of the frame, the same in all views.
    pub frame: u64,
    /// When it was captured, nanoseconds of `CLOCK_MONOTONIC`.
    pub captured_at_nanos: u64,
    /// The people, if skeletons were asked for: there may be a reason in their place ([`Skeletons::status`]).
    pub skeletons: Option<Skeletons>,
    /// The views that were asked for, in the order of the deployment.
    pub views: Vec<ViewMoment>,
    /// True if everything that was asked for is there.
    pub is_complete: bool,
    /// Frames between this moment and the one given before that were not given: skipped by the pipeline, lost with a process, or
    /// passed over because newer ones were there. 0 for the first of a run.
    pub n_missed: u64,
}

/// Parts of a moment that belong to one view.
#[derive(Debug)]
pub struct ViewMoment {
    /// Number of the view.
    pub view: usize,
    /// Poses that the view found alone: the message, which holds positions in cells of the pyramid. Positions in pixels after
    /// fusion are in [`Skeleton::centres_px`].
    pub pose: Option<Box<ViewPose>>,
    /// Its picture.
    pub picture: Option<Picture>,
}

/// The people of one frame.
#[derive(Debug, Clone)]
pub struct Skeletons {
    message: Box<messages::Skeletons>,
    running: Arc<Running>,
}

/// One person of a frame.
#[derive(Debug, Clone, Copy)]
pub struct Skeleton<'a> {
    message: &'a SkeletonMessage,
    running: &'a Running,
}

/// One joint, and where it is or why it is nowhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint<'a> {
    /// Its name.
    pub name: &'a str,
    /// Where it is; or why there is no place.
    pub found: Result<Place, Status>,
}

/// Where a joint is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// In the world frame of the calibration, metres.
    pub in_world: [f64; 3],
    /// Covariance `[xx, xy, xz, yy, yz, zz]`, square metres.
    pub covariance: [f64; 6],
    /// Standard deviation along one axis, the mean over the three: `sqrt((xx + yy + zz) / 3)`, metres.
    pub deviation_m: f64,
    /// Root mean square distance from what the views saw, pixels.
    pub reprojection_px: f64,
    /// Number of views that it was located with.
    pub n_views: u32,
}

impl Skeletons {
    pub(crate) fn new(message: Box<messages::Skeletons>, running: Arc<Running>) -> Self {
        Self { message, running }
    }

    /// The message as it was sent.
    pub fn message(&self) -> &messages::Skeletons {
        &self.message
    }

    /// [`Status::OK`] if anybody has a skeleton, or why nobody has.
    pub fn status(&self) -> Status {
        self.message.status
    }

    /// The people, the followed person first.
    pub fn people(&self) -> impl Iterator<Item = Skeleton<'_>> {
        let people = self.message.listed().iter();
        people.map(|message| Skeleton {
            message,
            running: &self.running,
        })
    }

    /// The followed person; `None` if there is nobody.
    pub fn followed(&self) -> Option<Skeleton<'_>> {
        self.people().next()
    }
}

impl<'a> Skeleton<'a> {
    /// The part of the message that is about the person.
    pub fn message(self) -> &'a SkeletonMessage {
        self.message
    }

    /// Identity within the run, from 1.
    pub fn id(self) -> u64 {
        self.message.id
    }

    /// [`Status::OK`] if there is a skeleton, or why there is none.
    pub fn status(self) -> Status {
        self.message.status
    }

    /// The joints, in the order of the deployment.
    pub fn joints(self) -> impl Iterator<Item = Joint<'a>> {
        let names = self.running.joints.iter();
        names.zip(self.message.listed_joints()).map(named)
    }

    /// The joint of that name; `None` if the deployment has no such joint.
    pub fn joint(self, name: &str) -> Option<Joint<'a>> {
        self.joints().find(|joint| joint.name == name)
    }

    /// Iterates over the keypoints that networks name beside the joints.
    pub fn keypoints(self) -> impl Iterator<Item = Joint<'a>> {
        let names = self.running.keypoints.iter();
        names.zip(self.message.listed_keypoints()).map(named)
    }

    /// The centres of the parts in the frame of a view after fusion, `[column, row]` in pixels; empty where the view has no part in
    /// the skeleton.
    pub fn centres_px(self, view: usize) -> &'a [[f64; 2]] {
        let view = self.message.views.get(view);
        let seen = view.filter(|view| view.status == Status::OK);
        seen.map_or(&[], |view| {
            let n = (view.n_parts as usize).min(view.centres_px.len());
            &view.centres_px[..n]
        })
    }
}

fn named<'a>((name, joint): (&'a String, &Joint3d)) -> Joint<'a> {
    let [xx, _, _, yy, _, zz] = joint.covariance;
    let found = if joint.status == Status::OK {
        Ok(Place {
            in_world: joint.in_world,
            covariance: joint.covariance,
            deviation_m: ((xx + yy + zz) / 3.0).max(0.0).sqrt(),
            reprojection_px: joint.reprojection_px,
            n_views: joint.views_used.count_ones(),
        })
    } else {
        Err(joint.status)
    };
    Joint { name, found }
}

/// The picture of one view.
///
/// Without skeletons it lies where its sender wrote it, and no pixel is copied. Joined with a skeleton, which comes later, it is a
/// copy, in memory that is used again: its sender cannot spare the memory for so long.
#[derive(Debug)]
pub struct Picture {
    pixels: Pixels,
}

#[derive(Debug)]
enum Pixels {
    InPlace(Seen<u8, FrameHeader>),
    Copied {
        header: FrameHeader,
        pixels: Vec<u8>,
        home: Buffers,
    },
}

/// Memory of pictures that were dropped, for those to come.
#[derive(Debug, Clone, Default)]
pub(crate) struct Buffers(Arc<Mutex<Vec<Vec<u8>>>>);

impl Picture {
    pub(crate) fn in_place(seen: Seen<u8, FrameHeader>) -> Self {
        Self {
            pixels: Pixels::InPlace(seen),
        }
    }

    pub(crate) fn copied(seen: &Seen<u8, FrameHeader>, home: &Buffers) -> Self {
        let mut pixels = lock(&home.0).pop().unwrap_or_default();
        pixels.clear();
        pixels.extend_from_slice(seen.payload());
        Self {
            pixels: Pixels::Copied {
                header: *seen.header(),
                pixels,
                home: home.clone(),
            },
        }
    }

    /// The pixels, RGB, row major; empty if there is no picture ([`Self::status`]).
    pub fn pixels(&self) -> &[u8] {
        if self.status() != Status::OK {
            return &[];
        }
        match &self.pixels {
            Pixels::InPlace(seen) => seen.payload(),
            Pixels::Copied { pixels, .. } => pixels,
        }
    }

    /// Width and height, pixels; 0 if there is no picture.
    pub fn size(&self) -> [u32; 2] {
        let header = self.header();
        [header.width, header.height]
    }

    /// [`Status::OK`], or what is wrong with the camera.
    pub fn status(&self) -> Status {
        self.header().status
    }

    /// The header as it was sent.
    pub fn header(&self) -> &FrameHeader {
        match &self.pixels {
            Pixels::InPlace(seen) => seen.header(),
            Pixels::Copied { header, .. } => header,
        }
    }

    /// Returns true if the pixels lie where the sender wrote them.
    pub fn is_in_place(&self) -> bool {
        matches!(self.pixels, Pixels::InPlace(_))
    }
}

impl Drop for Picture {
    fn drop(&mut self) {
        if let Pixels::Copied { pixels, home, .. } = &mut self.pixels {
            lock(&home.0).push(core::mem::take(pixels));
        }
    }
}

impl Moment {
    /// The followed person; `None` if there is nobody, or skeletons were not asked for.
    pub fn followed(&self) -> Option<Skeleton<'_>> {
        self.skeletons.as_ref()?.followed()
    }

    /// Returns true if any picture of the moment lies where its sender wrote it.
    pub(crate) fn is_in_place(&self) -> bool {
        let mut pictures = self.views.iter().filter_map(|view| view.picture.as_ref());
        pictures.any(Picture::is_in_place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::tests::{running, skeletons};

    #[test]
    fn a_joint_has_a_place_or_a_reason() {
        let mut message = Box::new(skeletons(0));
        message.people[1] = message.people[0];
        (message.n_people, message.people[1].id) = (2, 5);
        message.people[1].joints[0].in_world[0] = 3.0;
        let skeletons = Skeletons::new(message, Arc::new(running()));
        let [one, other] = *skeletons.people().collect::<Vec<_>>() else {
            panic!("two people")
        };
        assert_eq!((one.id(), other.id()), (1, 5));
        let head = one.joint("head").unwrap().found.unwrap();
        assert_eq!((head.in_world, head.n_views), ([0.0, 0.0, 1.7], 2));
        assert!((head.deviation_m - 0.02_f64 / 2_f64.sqrt()).abs() < 1e-12);
        let wrist = one.joint("right wrist").unwrap();
        assert_eq!(wrist.found, Err(Status::TOO_FEW_VIEWS));
        assert_eq!(one.joint("tail"), None);
        assert_eq!(one.centres_px(0).len(), 0);
        assert_eq!(one.centres_px(99).len(), 0);
        let head = other.joint("head").unwrap().found.unwrap();
        assert_eq!(head.in_world, [3.0, 0.0, 1.7]);
        assert_eq!(skeletons.followed().map(Skeleton::id), Some(1));
    }
}
