//! Plain data that crosses process boundaries, and the names of the topics.
//!
//! Every message begins with a [`Stamp`]. Its [`Status`] states that it carries a result, or why it has none. Its [`Timing`] has the times
//! at which the input was received and the message was sent. Counts come before fixed-size arrays; entries beyond the count are zero.
//! Receivers must treat every count and index as untrusted (`wire` checks them). All messages are `Pod`: they have no padding and every bit
//! pattern is valid, so they can be written to a file and read again.
#![forbid(unsafe_code)]

mod evidence;
mod frame;
mod health;
mod metrics;
mod people;
mod picture;
mod pose;
mod quality;
mod refusal;
mod skeletons;
mod stamp;
pub mod topic;

pub use evidence::{EvidenceHeader, GridMessage};
pub use frame::FrameHeader;
pub use health::Health;
pub use metrics::{
    CameraCounts, Cause, MAX_NAME, MAX_ROWS, Metrics, MetricsRow, N_CAUSES, NO_PEOPLE, NO_QUEUE,
    NO_VIEW, Span, TimedBy, UNMEASURED,
};
pub use people::{NO_CANDIDATE, People, PersonMessage};
pub use picture::{NO_SEQUENCE, PictureHeader};
pub use pose::{
    LocalMessage, NO_COLOUR, PairHypothesis, PairPose, PoseMessage, Searched, Sightings,
};
pub use quality::ViewQuality;
pub use refusal::Refusal;
pub use skeletons::{FusedView, Joint3d, Kept, Sides, SkeletonMessage, Skeletons};
pub use stamp::{Stamp, Status, Timing};

/// Maximum number of parts of a model.
pub const MAX_PARTS: usize = 32;
/// Maximum number of views of a rig.
pub const MAX_VIEWS: usize = 16;
/// Maximum number of candidates of a view.
pub const MAX_CANDIDATES: usize = 8;
/// Maximum number of people in a frame.
pub const MAX_PEOPLE: usize = 8;
/// Maximum number of joints of a joint set.
pub const MAX_JOINTS: usize = 32;
/// Maximum number of extra keypoints of a person: keypoints of networks that are not joints.
pub const MAX_KEYPOINTS: usize = 128;
/// Maximum number of extra keypoints of all candidates of a view.
pub const MAX_VIEW_KEYPOINTS: usize = 384;
/// Maximum number of levels of a pyramid (96 is enough for 15 000 pixels at ten levels per octave).
pub const MAX_LEVELS: usize = 96;

const _: () = {
    assert!(size_of::<Stamp>() == 32);
    assert!(size_of::<Timing>() == 16);
    assert!(size_of::<FrameHeader>() == 128);
    assert!(size_of::<PictureHeader>() == 192);
    assert!(size_of::<EvidenceHeader>() == 1472);
    assert!(size_of::<PoseMessage>() == 168);
    assert!(size_of::<LocalMessage>() == 12);
    assert!(
        size_of::<Sightings>()
            == 1912 + MAX_CANDIDATES * (MAX_JOINTS + 1) * 12 + MAX_VIEW_KEYPOINTS * 12
    );
    assert!(size_of::<PersonMessage>() == 24);
    assert!(size_of::<People>() == 64 + MAX_PEOPLE * 24);
    assert!(size_of::<ViewQuality>() == 344);
    assert!(size_of::<PairPose>() == 1064);
    assert!(size_of::<Joint3d>() == 88);
    assert!(size_of::<FusedView>() == 544);
    assert!(size_of::<SkeletonMessage>() == 11592 + MAX_KEYPOINTS * 88);
    assert!(size_of::<Skeletons>() == 64 + MAX_PEOPLE * size_of::<SkeletonMessage>());
    assert!(size_of::<Health>() == 168);
    assert!(size_of::<MetricsRow>() == 56);
    assert!(size_of::<Metrics>() == 288 + MAX_ROWS * 56);
};
