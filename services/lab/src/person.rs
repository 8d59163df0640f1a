//! Training of a model that finds people, from annotated people to the model file.

mod alarms;
mod album;
mod data;
mod per_dataset;
mod progress;
mod report;
mod store;
mod train;

pub use data::{Chosen, parse_skeleton};
pub(crate) use data::{read_options, sides_of};
pub(crate) use per_dataset::deal;
pub use progress::Progress;
pub use report::Report;
pub use store::Store;
pub use train::{Job, train};
