//! `parallax train network-people` and `parallax train network`: the network that finds joints.

pub(super) mod learn;
pub(super) mod people;
