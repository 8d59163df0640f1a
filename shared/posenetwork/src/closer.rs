//! Runs the network on boxes that may not fit the person: on several boxes, then on a closer box around the person that was found.

use kernels::Rgb8View;

use crate::maps::{JointMaps, MapSettings};
use crate::network::{LookError, PoseNetwork, Turn, Workspace};
use crate::outline::overlap;

/// Largest overlap of two boxes for which a second run is worthwhile. Boxes that overlap more show the network nearly the same picture.
const FITS: f64 = 0.8;
/// Largest decrease of the mean heat of the joints, 0 to 1, that is accepted for a box that fits better.
const FAINTER: f64 = 0.1;
/// Maximum number of further runs for one person, after the first run.
const MOST_MORE: usize = 2;

/// Network and settings for finding the joints of people in a picture.
#[derive(Debug, Clone, Copy)]
pub struct Looker<'a> {
    /// The network.
    pub network: &'a PoseNetwork,
    /// Settings for the conversion of maps to evidence.
    pub settings: &'a MapSettings,
}

/// Memory that is reused from person to person.
#[derive(Debug, Default)]
pub struct LookMemory {
    workspace: Workspace,
    /// Maps for a box that may fit better than the current box.
    other: JointMaps,
}

/// Result of running the network on a box, apart from the maps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// The box: left, top, right, bottom, in pixels of the picture.
    pub outline: [f64; 4],
    /// Direction in which the trunk faces ([`Sight::front`](crate::Sight::front)).
    pub front: Option<[f32; 2]>,
    /// Mean heat of the joints ([`JointMaps::heat`]). It measures how well the person is seen, and can be compared between boxes of
    /// different sizes.
    pub heat: f64,
    /// Evidence of the joints at their peaks ([`JointMaps::score`]).
    pub score: f32,
    /// The box around the joints ([`JointMaps::around`]).
    pub around: Option<[f64; 4]>,
    /// Rotation of the picture.
    pub turn: Turn,
}

impl LookMemory {
    /// The network's working memory.
    pub fn workspace(&mut self) -> &mut Workspace {
        &mut self.workspace
    }
}

impl Looker<'_> {
    /// Runs the network on a box of the picture.
    ///
    /// * `outline`: left, top, right, bottom, in pixels of the picture.
    /// * `maps`: filled with the maps of the joints.
    /// * Returns `None` if the box is empty.
    ///
    /// # Errors
    ///
    /// Fails with [`LookError`].
    pub fn look(
        &self,
        what: (Rgb8View<'_>, [f64; 4]),
        memory: &mut LookMemory,
        maps: &mut JointMaps,
    ) -> Result<Option<Look>, LookError> {
        self.look_in(what, Turn::Up, &mut memory.workspace, maps)
    }

    fn look_in(
        &self,
        (image, outline): (Rgb8View<'_>, [f64; 4]),
        turn: Turn,
        workspace: &mut Workspace,
        maps: &mut JointMaps,
    ) -> Result<Option<Look>, LookError> {
        let sight = self.network.look_turned(image, (outline, turn), workspace)?;
        let Some(sight) = sight else {
            return Ok(None);
        };
        maps.read(&sight, self.settings)?;
        Ok(Some(self.judge((outline, turn, sight.front()), maps)))
    }

    /// Returns the result for a box whose maps have been read.
    ///
    /// * `turn`: rotation of the picture.
    /// * `front`: direction in which the trunk faces, according to the network.
    pub fn judge(
        &self,
        (outline, turn, front): ([f64; 4], Turn, Option<[f32; 2]>),
        maps: &JointMaps,
    ) -> Look {
        Look {
            outline,
            front,
            heat: maps.heat(),
            score: maps.score(self.settings),
            around: maps.around(),
            turn,
        }
    }

    /// Runs the network again on the box around the joints found in the previous box. This repeats as long as the box changes and shows the
    /// person about as well or better. A box in which the person is small or near the edge is thus replaced by a box that fits. A box that
    /// cuts off the feet is not replaced, because the network then finds the feet at the edge of the box.
    ///
    /// * `seen`, `maps`: result for the first box; the maps are replaced by better ones.
    ///
    /// # Errors
    ///
    /// Fails with [`LookError`].
    pub fn look_closer(
        &self,
        (image, seen): (Rgb8View<'_>, Look),
        memory: &mut LookMemory,
        maps: &mut JointMaps,
    ) -> Result<Look, LookError> {
        let mut best = self.look_upright((image, seen), memory, maps)?;
        let least = best.heat - FAINTER;
        for _ in 0..MOST_MORE {
            let next = best.around.filter(|around| overlap(*around, best.outline) <= FITS);
            let Some(next) = next else {
                break;
            };
            let more = self.look_beside((image, next), best.turn, memory)?;
            let Some(more) = more.filter(|more| more.heat > least) else {
                break;
            };
            core::mem::swap(maps, &mut memory.other);
            best = more;
        }
        Ok(best)
    }

    /// Runs the network once more on a rotated picture if the person is lying or upside down. The better of the two results is kept.
    ///
    /// * `seen`, `maps`: result for the box; the maps are replaced by better ones.
    ///
    /// # Errors
    ///
    /// Fails with [`LookError`].
    pub fn look_upright(
        &self,
        (image, seen): (Rgb8View<'_>, Look),
        memory: &mut LookMemory,
        maps: &mut JointMaps,
    ) -> Result<Look, LookError> {
        let turn = maps.turn(seen.turn);
        if turn == seen.turn || !self.network.may_turn() {
            return Ok(seen);
        }
        let outline = seen.around.unwrap_or(seen.outline);
        let turned = self.look_beside((image, outline), turn, memory)?;
        let Some(turned) = turned.filter(|turned| turned.heat > seen.heat) else {
            return Ok(seen);
        };
        core::mem::swap(maps, &mut memory.other);
        Ok(turned)
    }

    /// Runs the network on several boxes, then on a closer box around the person in the box with the best result.
    ///
    /// * `outlines`: the boxes.
    /// * `turn`: rotation of the picture at first.
    /// * `maps`: filled with the maps of that person's joints.
    /// * Returns `None` if all boxes are empty.
    ///
    /// # Errors
    ///
    /// Fails with [`LookError`].
    pub fn best_of(
        &self,
        (image, outlines): (Rgb8View<'_>, &[[f64; 4]]),
        turn: Turn,
        memory: &mut LookMemory,
        maps: &mut JointMaps,
    ) -> Result<Option<Look>, LookError> {
        let mut best: Option<Look> = None;
        for outline in outlines {
            let look = self.look_beside((image, *outline), turn, memory)?;
            if let Some(look) = look.filter(|look| best.is_none_or(|best| look.heat > best.heat)) {
                core::mem::swap(maps, &mut memory.other);
                best = Some(look);
            }
        }
        best.map(|seen| self.look_closer((image, seen), memory, maps)).transpose()
    }

    /// Runs the network on a box and writes the maps to `memory.other`.
    fn look_beside(
        &self,
        what: (Rgb8View<'_>, [f64; 4]),
        turn: Turn,
        memory: &mut LookMemory,
    ) -> Result<Option<Look>, LookError> {
        self.look_in(what, turn, &mut memory.workspace, &mut memory.other)
    }
}
