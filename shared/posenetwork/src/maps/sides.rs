//! Left and right of the maps: swapping them, or assigning them from a single view.

use super::{JointMaps, N_JOINTS};
use crate::network::PoseNetwork;

impl JointMaps {
    /// Swaps the left and right joints as named by the network; [`Self::keypoint`] does not change.
    pub fn exchange_sides(&mut self) {
        let length = self.values.len() / N_JOINTS;
        for [right, left] in skeleton::SIDES {
            for value in 0..length {
                self.values.swap(right * length + value, left * length + value);
            }
            self.peaks.swap(right, left);
            if !self.told.is_empty() {
                self.told.swap(right, left);
            }
        }
    }

    /// Renames left and right from sides of the picture to sides of the person, using the trunk's direction from the network. They are
    /// swapped for a person seen from behind. With several views, `multiview` makes a more reliable decision.
    ///
    /// * `network`: the network that produced the maps.
    /// * `front`: direction in which the trunk faces ([`Sight::front`](crate::Sight::front)).
    pub fn name_sides(&mut self, network: &PoseNetwork, front: Option<[f32; 2]>) {
        let is_as_seen = network.card().keypoints.sides == keypoints::Sides::Seen;
        let is_from_behind = front.is_some_and(|[_, towards]| towards < 0.0);
        if is_as_seen && is_from_behind {
            self.exchange_sides();
        }
    }
}
