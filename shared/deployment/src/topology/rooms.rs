//! Capacity of the topics between the processes, which follows from their senders and receivers.

use messages::topic;

use super::Topology;
use crate::capture::Mode;

/// Queue length of small messages for one receiver if the latest message wins.
const SMALL_QUEUE_REALTIME: usize = 4;
/// Queue length of small messages for one receiver if nothing is dropped.
const SMALL_QUEUE_LOSSLESS: usize = 16;
/// Queue length of results for one receiver. With space for eight people, each result is as large as a picture.
const SKELETONS_QUEUE: usize = 4;
/// Queue length of images or response maps for one receiver.
const LARGE_QUEUE: usize = 1;
/// Queue length of original pictures of live cameras. The queue holds at most one second of pictures, and needs memory only if the
/// recording falls behind.
const PICTURE_QUEUE: usize = 16;
/// Small messages that one receiver may borrow at the same time.
const SMALL_BORROWED: usize = 2;
/// Response maps of one view that one process may borrow at the same time.
const EVIDENCE_BORROWED: usize = 1;
/// Number of extra receivers of small messages, such as a web page, its recorder or other programs. No sender waits for them.
const ONLOOKERS: usize = 4;
/// Number of extra receivers of images. It is lower because each needs memory for two images.
const ONLOOKERS_OF_IMAGES: usize = 3;

/// Content of a topic between processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content {
    /// Pixels of a view, with their header.
    Frame,
    /// Original pictures of a live camera, with their header.
    Picture,
    /// Response maps of a view, with their header.
    Evidence,
    /// Pose candidates of a single view.
    Sightings,
    /// Expected errors of a view.
    ViewQuality,
    /// Results of one fusion worker.
    PairPose,
    /// The people in a frame.
    People,
    /// The resulting skeletons.
    Skeletons,
}

/// Capacity of one topic, which has one sender.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Room {
    /// Name of the topic.
    pub topic: String,
    /// Content of the topic.
    pub content: Content,
    /// Number of processes that may receive the topic at the same time; at least the number of its receivers in the deployment.
    pub receivers: usize,
    /// Number of extra receivers of the topic, for which no sender waits.
    pub onlookers: usize,
    /// Number of messages that may wait for one receiver.
    pub queued: usize,
    /// Number of messages that one receiver may borrow at the same time.
    pub borrowed: usize,
    /// Maximum number of elements of an array; 1 if messages are not arrays.
    pub longest: usize,
    /// Number of messages that usually exist at the same time, if it is lower than the number that may be queued and borrowed.
    pub usual: Option<usize>,
}

/// Sizes of the largest arrays of one view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ViewSize {
    /// Size of the largest image, in bytes.
    pub frame_bytes: usize,
    /// Maximum number of values in response maps.
    pub evidence_values: usize,
    /// Size of the largest original picture of a live camera, in bytes; 0 if none is recorded.
    pub picture_bytes: usize,
}

impl Topology {
    /// Returns the capacity of all topics between processes: the topics of every view, of every worker, and of the result. Topics of
    /// expected errors are included even if no process publishes any.
    ///
    /// * `mode`: behaviour of a stage that is slower than its input.
    /// * `views`: sizes of every view of the deployment.
    /// * `held_frames`: number of images that one process may borrow at the same time.
    pub fn rooms(&self, mode: Mode, views: &[ViewSize], held_frames: usize) -> Vec<Room> {
        let n_recorders = self.n_recorders();
        let small = |topic: String, content, receivers| Room {
            topic,
            content,
            receivers,
            onlookers: ONLOOKERS,
            queued: match mode {
                Mode::Realtime => SMALL_QUEUE_REALTIME,
                Mode::Lossless | Mode::Paced => SMALL_QUEUE_LOSSLESS,
            },
            borrowed: SMALL_BORROWED,
            longest: 1,
            usual: None,
        };
        let mut rooms = Vec::new();
        for (view, size) in views.iter().enumerate() {
            rooms.push(Room {
                topic: topic::frame(view),
                content: Content::Frame,
                // The receivers are pose, quality and the recorders.
                receivers: 2 + n_recorders,
                onlookers: ONLOOKERS_OF_IMAGES,
                queued: LARGE_QUEUE,
                borrowed: held_frames,
                longest: size.frame_bytes,
                usual: None,
            });
            if size.picture_bytes > 0 {
                rooms.push(picture(view, size.picture_bytes));
            }
            rooms.push(self.evidence(view, size.evidence_values));
            // The receivers are quality, triangulate, fusion and the recorders.
            let receivers = 2 + self.n_workers + n_recorders;
            let pose = topic::sightings(view);
            rooms.push(small(pose, Content::Sightings, receivers));
            let quality = topic::view_quality(view);
            rooms.push(small(quality, Content::ViewQuality, receivers));
        }
        if self.has_maps {
            rooms.push(small(topic::people(), Content::People, 1 + n_recorders));
        }
        for worker in (0..self.n_workers).filter(|_| !self.has_maps) {
            let room = small(topic::pair_pose(worker), Content::PairPose, 1 + n_recorders);
            rooms.push(Room {
                // If all views are solved at once, fusion sends all its messages at the same time, one fewer than there are views.
                queued: room.queued.max(views.len()),
                ..room
            });
        }
        rooms.push(Room {
            queued: SKELETONS_QUEUE,
            ..small(topic::skeletons(), Content::Skeletons, n_recorders)
        });
        rooms
    }

    fn evidence(&self, view: usize, longest: usize) -> Room {
        let topic = topic::evidence(view);
        Room {
            receivers: self.receivers_of(&topic).max(1),
            onlookers: 0,
            topic,
            content: Content::Evidence,
            queued: LARGE_QUEUE,
            borrowed: EVIDENCE_BORROWED,
            longest,
            // One message is written while others are read. These are by far the largest messages. Queueing one more would need as much
            // memory again without saving time.
            usual: Some(1 + EVIDENCE_BORROWED),
        }
    }
}

fn picture(view: usize, longest: usize) -> Room {
    Room {
        topic: topic::picture(view),
        content: Content::Picture,
        receivers: 1,
        onlookers: 0,
        queued: PICTURE_QUEUE,
        borrowed: 1,
        longest,
        // One message is written while another is read.
        usual: Some(2),
    }
}
