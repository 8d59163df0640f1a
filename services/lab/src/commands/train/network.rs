//! `parallax-lab train network-people` and `parallax-lab train network`: train the network that finds joints.

pub(super) mod learn;
pub(super) mod people;
