//! Prepares and runs a deployment: reads, resolves, checks and plans it, supervises the run, and reports on it.
//!
//! | step | where |
//! |---|---|
//! | read the deployment file and check it against this machine | [`load`] |
//! | read its input files, and inspect its footage | [`inputs`], [`cameras`] |
//! | resolve it: add the metadata of its footage, which every process needs | [`plan::resolve`], [`Resolved`] |
//! | prepare the model, the views and the settings of the stages | [`Prepared`] |
//! | plan processes and topics, and run them | [`Planned`] |
//! | run one of its processes | [`process`] |
//! | show progress, and report on the run | [`Watcher`], [`Report`] |
//! | get the joints that every camera sees, to compare the clocks of the cameras | [`films`] |
//! | select the part of a deployment that one host runs | [`hosts`] |
//! | observe a running deployment from another process | [`live`] |
//! | read the settings from a recording, and report damaged or missing parts | [`recorded`] |
//! | export a finished run to the file formats of other tools | [`export`] |
//!
//! Data goes to standard output and messages to standard error, both through [`terminal::output`].
#![forbid(unsafe_code)]

mod device;
mod earlier;
mod find_every;
mod in_process;
mod padding;
mod planned;
mod prepare;
mod programs;
mod resolved;
mod sanity;
mod scheduling;
mod search_size;

mod vertical;
mod views;

pub mod budget;
pub mod cameras;
pub mod export;
pub mod films;
pub mod hosts;
pub mod keypoints;
pub mod live;
pub mod load;
pub mod no_results;
pub mod plan;
pub mod process;
pub mod recorded;
pub mod summary;

pub use device::device;
pub use earlier::{check_name, make_way};
pub use find_every::FOLLOWED_S;
pub use in_process::{InProcess, SentFrame};
pub use planned::Planned;
pub use prepare::{Prepared, View};
pub use resolved::{Resolved, SERVICES};
pub use search_size::{CameraSize, SearchSize};

pub use summary::{Recorded, Report, Watcher};
pub use views::ViewReport;
