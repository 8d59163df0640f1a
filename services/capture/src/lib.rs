//! Reads the footage of a camera, and sends its frames.
#![forbid(unsafe_code)]

mod blank;
mod camera;
mod feed;
mod guard;
mod info;
mod job;
mod kept;
mod live;
mod live_service;
mod recorded;
mod retimed;
mod service;
mod supply;

pub use blank::{Blank, BlankError, BlankFeed};
pub use feed::{Feed, FeedError, Stage};
pub use info::FeedInfo;
pub use job::Job;
pub use live::{LiveCamera, LiveError, LiveJob, take_picture};
pub use recorded::{Recorded, RecordedError};
pub use retimed::Retimed;
pub use service::run;
