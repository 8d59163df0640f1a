//! How fast messages travel between processes, and how fast whole deployments are.

mod course;
mod hop;
mod load;
mod occasion;
mod options;
mod pictures;
mod receiver;
mod report;
mod transport;

pub use load::{Kind, load};
pub use options::Options;
pub use receiver::receive;
pub use report::Report;
pub use transport::{Transport, transport};
