//! How far off every part of a view is expected to be: the paper's sigma (section 4.3).
//!
//! A [`Network`] predicts it from the person's [`Tile`] and, if it wants them, the numbers of
//! [`evidence()`]; what its file says of itself is its [`Card`]. [`Forecaster`] does all of it. [`Table`] holds predictions made elsewhere, and
//! [`Predictor`] gives those of one view, frame by frame. [`Tau`] holds the thresholds beyond which a part
//! is switched off.
#![forbid(unsafe_code)]

mod card;
mod device;
mod evidence;
mod forecast;
mod network;
mod predictor;
mod table;
mod tau;
mod tile;

pub use card::{Card, CardError, Unit, key};
pub use device::Device;
pub use evidence::{
    EVIDENCE_VERSION, EvidenceError, FAR, N_TYPES, PART_NUMBERS, POSE_NUMBERS, evidence,
    evidence_name, n_evidence,
};
pub use forecast::{Forecast, ForecastError, ForecastInput, Forecaster};
#[cfg(feature = "ort")]
pub use network::OnnxRuntime;
pub use network::{Network, NetworkError};
pub use predictor::{NoPredictions, Predictor, Selection};
pub use table::{Table, TableError};
pub use tau::{Tau, TauError, TrainingErrors};
pub use tile::{Normalisation, Sampler, Tile, TileShape};
