//! Predicts the expected error of every part: receives frames and candidates, and sends expected errors.

mod service;
mod settings;

pub use service::{Job, NetworkSource, Source, run};
pub use settings::selection;
pub use stage::HELD_REALTIME;
