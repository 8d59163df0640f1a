//! How much room the topics between the processes have: numbers that follow from who sends to whom.

use messages::topic;

use super::Topology;
use crate::capture::Mode;

/// Queue of small messages of one receiver where the latest message wins.
const SMALL_QUEUE_REALTIME: usize = 4;
/// Queue of small messages of one receiver where nothing is dropped.
const SMALL_QUEUE_LOSSLESS: usize = 16;
/// Queue of results of one receiver: with room for eight people each is as large as a picture.
const SKELETONS_QUEUE: usize = 4;
/// Queue of images or response maps of one receiver.
const LARGE_QUEUE: usize = 1;
/// Queue of pictures of live cameras, as they came: a second or less, which costs memory only where the recording lags.
const PICTURE_QUEUE: usize = 16;
/// Small messages that one receiver may borrow at the same time.
const SMALL_BORROWED: usize = 2;
/// Response maps of one view that one process may borrow at the same time.
const EVIDENCE_BORROWED: usize = 1;
/// Receivers of small messages beyond those of the deployment, which no sender waits for: a page, what it records, other
/// programs.
const ONLOOKERS: usize = 4;
/// The same of images: fewer, as each costs memory for two.
const ONLOOKERS_OF_IMAGES: usize = 3;

/// Content of a topic between processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content {
    /// Pixels of a view, with their header.
    Frame,
    /// Pictures of a live camera as they came, with their header.
    Picture,
    /// Response maps of a view, with their header.
    Evidence,
    /// Single-view candidates of a view.
    ViewPose,
    /// Expected errors of a view.
    ViewQuality,
    /// Results of one fusion worker.
    PairPose,
    /// Who is in a frame.
    People,
    /// The result.
    Skeletons,
}

/// The room of one topic, which has one sender.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Room {
    /// Its name.
    pub topic: String,
    /// Content of the topic.
    pub content: Content,
    /// Processes that may receive it at the same time, at least those of the deployment.
    pub receivers: usize,
    /// Onlookers that may receive it besides; no sender waits for them.
    pub onlookers: usize,
    /// Messages that wait for one receiver.
    pub queued: usize,
    /// Messages that one receiver may borrow at the same time.
    pub borrowed: usize,
    /// Longest array, elements; 1 where messages are no arrays.
    pub longest: usize,
    /// Messages that usually exist at the same time, where that is fewer than all that may be queued and borrowed.
    pub usual: Option<usize>,
}

/// The largest arrays of one view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ViewSize {
    /// Largest image, bytes.
    pub frame_bytes: usize,
    /// Longest response maps, values.
    pub evidence_values: usize,
    /// Largest picture as it came from a live camera, bytes; 0 where none is recorded.
    pub picture_bytes: usize,
}

impl Topology {
    /// The room of all topics between processes: those of every view, of every worker, and of the result. Topics of expected
    /// errors are there whether or not a process sends any.
    ///
    /// * `mode`: what happens when a stage is slower than its input.
    /// * `views`: as many as the deployment has.
    /// * `held_frames`: images that one process may borrow at the same time.
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
                // Pose, quality and the recorders.
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
            // Quality, triangulate, fusion and the recorders.
            let receivers = 2 + self.n_workers + n_recorders;
            let pose = topic::view_pose(view);
            rooms.push(small(pose, Content::ViewPose, receivers));
            let quality = topic::view_quality(view);
            rooms.push(small(quality, Content::ViewQuality, receivers));
        }
        if self.has_maps {
            rooms.push(small(topic::people(), Content::People, 1 + n_recorders));
        }
        for worker in (0..self.n_workers).filter(|_| !self.has_maps) {
            let room = small(topic::pair_pose(worker), Content::PairPose, 1 + n_recorders);
            rooms.push(Room {
                // Fusion of all views at once sends a message for every view but one at a time.
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
            // One to write while others are read. These are by far the largest messages: a queued one would cost as much
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
        // One to write while another is read.
        usual: Some(2),
    }
}
