//! `parallax-lab train quality` and `quality-samples`: train the network that predicts the errors of single views.

pub(crate) mod network;
pub(crate) mod samples;
