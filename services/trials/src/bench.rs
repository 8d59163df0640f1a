//! Benchmarks of the transport between processes, of whole deployments under load, and of the GPU.

mod gpu;
mod hop;
mod load;
mod options;
mod pictures;
mod provenance;
mod receiver;
mod report;
mod transport;
mod workload;

pub use gpu::{Gpu, gpu};
pub use load::{Kind, load};
pub use options::Options;
pub use receiver::receive;
pub use report::Report;
pub use transport::{Transport, transport};
