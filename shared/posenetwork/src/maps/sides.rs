//! Left and right of maps: exchanged, or named by what one view shows.

use super::JointMaps;
use crate::network::PoseNetwork;

impl JointMaps {
    /// Exchanges what the network calls left and right of the joints; [`Self::keypoint`] stays as it is.
    pub fn exchange_sides(&mut self) {
        let area = self.rows * self.columns;
        for [right, left] in skeleton::SIDES {
            for cell in 0..area {
                self.values.swap(right * area + cell, left * area + cell);
            }
            self.peaks.swap(right, left);
            if !self.told.is_empty() {
                self.told.swap(right, left);
            }
        }
    }

    /// Makes left and right those of the person, where they are those of the picture, by the direction of the trunk that
    /// the network alone gives: a person seen from behind has them exchanged. Over several views more is known (`multiview`).
    ///
    /// * `network`: what the maps were read from.
    /// * `front`: what it said of the direction ([`Sight::front`](crate::Sight::front)).
    pub fn name_sides(&mut self, network: &PoseNetwork, front: Option<[f32; 2]>) {
        let is_as_seen = network.card().keypoints.sides == keypoints::Sides::Seen;
        let is_from_behind = front.is_some_and(|[_, towards]| towards < 0.0);
        if is_as_seen && is_from_behind {
            self.exchange_sides();
        }
    }
}
