//! Expected errors of a person's parts in one view: the paper's sigma (section 4.3).
//!
//! A [`Network`] predicts the errors from the person's [`Tile`] and, optionally, the [`evidence()`]. A [`Card`] is the description in the
//! network's file. [`Forecaster`] runs all steps. [`Table`] contains predictions that were made by another program, and [`Predictor`]
//! returns the predictions of one view, frame by frame. [`Tau`] contains the thresholds above which a part is switched off.
#![forbid(unsafe_code)]

mod card;
mod evidence;
mod forecast;
mod network;
pub mod orientation;
mod predictor;
mod table;
mod tau;
mod tile;

pub use card::{Card, CardError, Unit, key};
pub use evidence::{
    EVIDENCE_VERSION, EvidenceError, FAR, N_TYPES, PART_NUMBERS, POSE_NUMBERS, evidence,
    evidence_name, n_evidence,
};
pub use forecast::{Forecast, ForecastError, ForecastInput, Forecaster};
pub use network::{Network, NetworkError};
pub use predictor::{NoPredictions, Predictor, Selection};
pub use table::{Table, TableError};
pub use tau::{Tau, TauError, TrainingErrors};
pub use tile::{Normalisation, Sampler, Tile, TileShape};
