//! Everything about one frame, in the form in which a program receives it.

use std::sync::{Arc, Mutex};

use messages::{FrameHeader, Joint3d, Sightings, SkeletonMessage, Status};
use runfiles::Running;
use runtime::Seen;

use crate::lock::lock;

/// Everything that was requested about one frame and is available.
#[derive(Debug)]
pub struct Moment {
    /// Description that the deployment publishes: names of joints and cameras.
    pub running: Arc<Running>,
    /// Number of the frame, the same in all views.
    pub frame: u64,
    /// Time at which the frame was captured, in nanoseconds of `CLOCK_MONOTONIC`.
    pub captured_at_nanos: u64,
    /// The people, if skeletons were requested. If there are none, [`Skeletons::status`] has the reason.
    pub skeletons: Option<Skeletons>,
    /// The requested views, in the order of the deployment.
    pub views: Vec<ViewMoment>,
    /// True if all requested parts are available.
    pub is_complete: bool,
    /// Number of frames between the previous moment and this one that were not given to the caller. The pipeline skipped them, they were
    /// lost with a process, or newer frames replaced them. It is 0 for the first moment of a run.
    pub n_missed: u64,
}

/// The parts of a [`Moment`] that belong to one view.
#[derive(Debug)]
pub struct ViewMoment {
    /// Index of the view.
    pub view: usize,
    /// Poses from this view alone. The message has positions in cells of the pyramid. Positions in pixels after
    /// fusion are in [`Skeleton::centres_px`].
    pub pose: Option<Box<Sightings>>,
    /// Picture of the view.
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

/// One joint, with its position or the reason why it has none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint<'a> {
    /// Name of the joint.
    pub name: &'a str,
    /// Position of the joint, or the reason why it has none.
    pub found: Result<Place, Status>,
}

/// Position of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Position in the world frame of the calibration, in metres.
    pub in_world: [f64; 3],
    /// Covariance `[xx, xy, xz, yy, yz, zz]`, in square metres.
    pub covariance: [f64; 6],
    /// Standard deviation along one axis, averaged over the three axes: `sqrt((xx + yy + zz) / 3)`, in metres.
    pub deviation_m: f64,
    /// Root mean square distance of the reprojections from the observations of the views, in pixels.
    pub reprojection_px: f64,
    /// Number of views from which the joint was located.
    pub n_views: u32,
}

impl Skeletons {
    pub(crate) fn new(message: Box<messages::Skeletons>, running: Arc<Running>) -> Self {
        Self { message, running }
    }

    /// Returns the message as it was sent.
    pub fn message(&self) -> &messages::Skeletons {
        &self.message
    }

    /// Returns [`Status::OK`] if any person has a skeleton, otherwise the reason why not.
    pub fn status(&self) -> Status {
        self.message.status
    }

    /// Iterates over the people, the followed person first.
    pub fn people(&self) -> impl Iterator<Item = Skeleton<'_>> {
        let people = self.message.listed().iter();
        people.map(|message| Skeleton {
            message,
            running: &self.running,
        })
    }

    /// Returns the followed person; `None` if there is no person.
    pub fn followed(&self) -> Option<Skeleton<'_>> {
        self.people().next()
    }
}

impl<'a> Skeleton<'a> {
    /// Returns the person's part of the message.
    pub fn message(self) -> &'a SkeletonMessage {
        self.message
    }

    /// Returns the person's id within the run, counted from 1.
    pub fn id(self) -> u64 {
        self.message.id
    }

    /// Returns [`Status::OK`] if there is a skeleton, otherwise the reason why not.
    pub fn status(self) -> Status {
        self.message.status
    }

    /// Iterates over the joints, in the order of the deployment.
    pub fn joints(self) -> impl Iterator<Item = Joint<'a>> {
        let names = self.running.joints.iter();
        names.zip(self.message.listed_joints()).map(named)
    }

    /// Returns the joint with a name; `None` if the deployment has no such joint.
    pub fn joint(self, name: &str) -> Option<Joint<'a>> {
        self.joints().find(|joint| joint.name == name)
    }

    /// Iterates over the extra keypoints of networks, which are not joints.
    pub fn keypoints(self) -> impl Iterator<Item = Joint<'a>> {
        let names = self.running.keypoints.iter();
        names.zip(self.message.listed_keypoints()).map(named)
    }

    /// Returns the centres of the parts in the frame of a view after fusion, `[column, row]` in pixels. Empty if the view did not
    /// contribute to the skeleton; NaN for a part whose position is unknown.
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
/// Without skeletons, the pixels stay in the memory of the sender and are not copied. If skeletons are requested too, the picture has to
/// wait for the skeleton, and the sender needs its memory before that. The picture is then a copy, in memory that is reused.
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

/// Memory of dropped pictures, reused for later ones.
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

    /// Returns the pixels, RGB, row major; empty if there is no picture ([`Self::status`]).
    pub fn pixels(&self) -> &[u8] {
        if self.status() != Status::OK {
            return &[];
        }
        match &self.pixels {
            Pixels::InPlace(seen) => seen.payload(),
            Pixels::Copied { pixels, .. } => pixels,
        }
    }

    /// Returns the width and height, in pixels; 0 if there is no picture.
    pub fn size(&self) -> [u32; 2] {
        let header = self.header();
        [header.width, header.height]
    }

    /// Returns [`Status::OK`], or the fault of the camera.
    pub fn status(&self) -> Status {
        self.header().status
    }

    /// Returns the header as it was sent.
    pub fn header(&self) -> &FrameHeader {
        match &self.pixels {
            Pixels::InPlace(seen) => seen.header(),
            Pixels::Copied { header, .. } => header,
        }
    }

    /// Returns true if the pixels are in the memory of the sender.
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
    /// Returns the followed person; `None` if there is no person, or skeletons were not requested.
    pub fn followed(&self) -> Option<Skeleton<'_>> {
        self.skeletons.as_ref()?.followed()
    }

    /// Returns true if any picture of the moment is in the memory of its sender.
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
    fn a_joint_has_a_position_or_a_reason() {
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
