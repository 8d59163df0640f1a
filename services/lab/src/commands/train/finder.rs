//! `parallax-lab train finder-pictures` and `parallax-lab train finder`: the network that finds people in whole pictures.

pub(super) mod learn;
pub(super) mod pictures;
