//! A deployment made ready and run: read, resolved, checked, planned, supervised, and told what became of it.
//!
//! | step | where |
//! |---|---|
//! | the deployment file, checked against this machine | [`load`] |
//! | the files and the footage that it names | [`inputs`], [`Shipped`] |
//! | what every process is given | [`plan::resolve`], [`Resolved`] |
//! | what the stages work with | [`Prepared`] |
//! | processes and topics; the run itself | [`Planned`] |
//! | one of its processes | [`process`] |
//! | progress, and what became of the run | [`Watcher`], [`Report`] |
//! | a run as seen from outside | [`live`] |
//! | what a recording says of its run | [`recorded`] |
//!
//! Data go to standard output and messages to standard error, both through [`output`].
#![forbid(unsafe_code)]

mod claim;
mod padding;
mod planned;
mod prepare;
mod resolved;
mod sanity;
mod scheduling;

mod shipped;
mod vertical;
mod views;

pub mod budget;
pub mod inputs;
pub mod live;
pub mod load;
pub mod nothing;
pub mod output;
pub mod plan;
pub mod process;
pub mod recorded;
pub mod summary;

pub use claim::Claim;
pub use planned::Planned;
pub use prepare::{Prepared, View, frame_scale};
pub use resolved::{Resolved, SERVICES};

pub use shipped::Shipped;
pub use summary::{Recorded, Report, Watcher};
pub use views::ViewReport;
