//! Looking at people in boxes that may not fit: into several, and closer where a person is seen.

use kernels::Rgb8View;

use crate::maps::{JointMaps, MapSettings};
use crate::network::{LookError, PoseNetwork, Turn, Workspace};
use crate::outline::overlap;

/// Boxes that cover each other by more show the same to a network: another look shows nothing new.
const FITS: f64 = 0.8;
/// Amount by which the mean heat of the joints may be lower in a box that fits better, 0 to 1.
const FAINTER: f64 = 0.1;
/// Most looks at one person beside the first.
const MOST_MORE: usize = 2;

/// Network and settings with which the people of a picture are looked at.
#[derive(Debug, Clone, Copy)]
pub struct Looker<'a> {
    /// The network.
    pub network: &'a PoseNetwork,
    /// How maps become evidence.
    pub settings: &'a MapSettings,
}

/// Memory that is used again from person to person.
#[derive(Debug, Default)]
pub struct LookMemory {
    workspace: Workspace,
    /// Maps of a box that may turn out the better one.
    other: JointMaps,
}

/// Result of a look at a box, beside the maps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// The box: left, top, right, bottom, pixels of the picture.
    pub outline: [f64; 4],
    /// In which direction the trunk faces ([`Sight::front`](crate::Sight::front)).
    pub front: Option<[f32; 2]>,
    /// Mean heat of the joints ([`JointMaps::heat`]): how well the person is seen, also compared with boxes of other sizes.
    pub heat: f64,
    /// Evidence of the joints at their peaks ([`JointMaps::score`]).
    pub score: f32,
    /// The box around the joints ([`JointMaps::around`]).
    pub around: Option<[f64; 4]>,
    /// How the picture was turned.
    pub turn: Turn,
}

impl LookMemory {
    /// The memory of the network.
    pub fn workspace(&mut self) -> &mut Workspace {
        &mut self.workspace
    }
}

impl Looker<'_> {
    /// Looks into a box.
    ///
    /// * `outline`: left, top, right, bottom, pixels of the picture.
    /// * `maps`: of the joints, filled.
    /// * Returns `None` for a box without an extent.
    ///
    /// # Errors
    ///
    /// [`LookError`].
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

    /// Judges what was seen in a box whose maps are read.
    ///
    /// * `turn`: how the picture was turned; `front`: what the network says of the direction in which the trunk faces.
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

    /// Looks into the box around the joints that were seen in another one, and so on, as long as that is another box and shows the person
    /// about as well or better: a box in which a person is small or at the edge is left for one that fits. One that cuts off the feet
    /// stays: a network puts them at its edge.
    ///
    /// * `seen`, `maps`: what was seen in the first box; the maps are replaced by better ones.
    ///
    /// # Errors
    ///
    /// [`LookError`].
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

    /// Looks at a person who is seen lying, or head down, once more, with the picture turned; what is seen better counts.
    ///
    /// * `seen`, `maps`: what was seen in the box; the maps are replaced by better ones.
    ///
    /// # Errors
    ///
    /// [`LookError`].
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

    /// Looks into several boxes, and closer at the person who is seen best there.
    ///
    /// * `outlines`: of the boxes; `turn`: how the picture is turned at first.
    /// * `maps`: of the joints of that person, filled.
    /// * Returns `None` if no box has an extent.
    ///
    /// # Errors
    ///
    /// [`LookError`].
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

    /// Looks into a box; the maps are `other` of the memory.
    fn look_beside(
        &self,
        what: (Rgb8View<'_>, [f64; 4]),
        turn: Turn,
        memory: &mut LookMemory,
    ) -> Result<Option<Look>, LookError> {
        self.look_in(what, turn, &mut memory.workspace, &mut memory.other)
    }
}
