//! How far off every part of a view is expected to be: the paper's sigma (section 4.3).
//!
//! [`Table`] holds predictions made elsewhere; [`Predictor`] gives those of one view, frame by frame;
//! [`Tau`] holds the thresholds beyond which a part is switched off.
#![forbid(unsafe_code)]

mod predictor;
mod table;
mod tau;

pub use predictor::{NoPredictions, Predictor, Selection};
pub use table::{Table, TableError};
pub use tau::{Tau, TauError, TrainingErrors};
