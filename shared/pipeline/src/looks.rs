//! Runs a network on the people of a frame, and keeps those who are clearly visible.

use kernels::Rgb8View;
use posenetwork::{JointMaps, Look, LookError, Looker, Turn, outline_of, overlap};

use crate::network_memory::{Empty, NetworkMemory, SEARCH, Seen, is_known, shift};
use crate::tracks::{Pace, Track, moved, wider};

/// Overlap of two boxes above which they show the same person.
const SAME: f64 = 0.5;
/// Overlap of two detector boxes above which they show the same person.
const SAME_BOX: f64 = 0.85;
/// Overlap with the box of a larger person above which a person may soon be hidden.
const BEHIND: f64 = 0.2;
/// Minimum number of joints that must remain visible for a person who is behind others.
const LEAST_BEHIND: usize = 7;
/// Minimum heat of a new person, as a fraction of the heat of the best person in the frame; a fainter detection is often a chair or a
/// poster.
const FAINT: f64 = 0.7;
/// Minimum heat (0 to 1) at which a joint is used to compute the position or motion of the person.
const SURE: f64 = 0.2;

/// Runs the network on the people of a frame, one after another.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Looks<'a> {
    pub(crate) looker: Looker<'a>,
    pub(crate) image: Rgb8View<'a>,
    /// Width and height of the picture.
    pub(crate) size: [usize; 2],
    /// Maximum number of people on whom the network is run.
    pub(crate) n_most: usize,
    /// Minimum mean heat of a person's joints, 0 to 1; below it, the person is not clearly visible.
    pub(crate) least_heat: f64,
    /// Maximum amount by which the score of a pose may be below the usual score of its person.
    pub(crate) most_lost: f32,
}

/// Returns true if the joints seen in a box fill a clearly different box: either the person moved fast, or the last frame is long ago. The
/// box then shows only part of the person, near the edge of the box.
fn has_moved(maps: &JointMaps, outline: [f64; 4]) -> bool {
    let sure = maps.peaks().iter().flatten();
    let sure = sure.filter(|sure| sure.score >= SURE).map(|sure| sure.at);
    outline_of(sure).is_some_and(|other| overlap(other, outline) < SAME)
}

/// Returns the boxes of a detector that do not belong to people whose last sighting is reused.
pub(crate) fn of_others(outlines: Vec<[f64; 4]>, held: &[Seen]) -> Vec<[f64; 4]> {
    let of_held: Vec<usize> =
        held.iter().filter_map(|held| best_box(&outlines, held.outline)).collect();
    let others = outlines.into_iter().enumerate();
    others
        .filter(|other| !of_held.contains(&other.0))
        .map(|other| other.1)
        .collect()
}

/// Returns the detector box that best matches a given box; `None` if none overlaps enough.
fn best_box(outlines: &[[f64; 4]], outline: [f64; 4]) -> Option<usize> {
    let overlaps = outlines.iter().map(|other| overlap(*other, outline));
    let best = overlaps.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    best.filter(|best| best.1 > SAME).map(|best| best.0)
}

/// Returns the velocity of a person of the previous frame, updated with the new sighting.
///
/// * `n_frames`: number of frames since the last run of the network on this person.
fn pace(track: &Track, before: Option<&Seen>, seen: &Seen, n_frames: Option<u64>) -> Option<Pace> {
    let moved = shift(&before?.maps, &seen.maps, SURE)?;
    Some(Pace::next(track.pace, &moved, n_frames?))
}

impl Looks<'_> {
    /// Reuses the last sightings of people who stand still, or whose picture has not changed. The network still runs in every frame on the
    /// first person. It also runs on a person behind a larger one, unless the picture has not changed.
    ///
    /// * `before`: the people of the previous frame; the entries of the reused people are overwritten.
    pub(crate) fn hold_still(
        &self,
        tracks: &mut [Track],
        before: &mut [Seen],
        memory: &mut NetworkMemory,
    ) {
        let Some(hold) = memory.hold.filter(|_| memory.is_followed()) else {
            return;
        };
        for nth in 1..tracks.len() {
            let (larger, others) = tracks.split_at_mut(nth);
            let track = &mut others[0];
            let is_behind = |larger: &Track| overlap(larger.outline, track.outline) > BEHIND;
            let n_frames = track.n_held + hold.gap;
            let Some(before) = before.get_mut(track.index) else {
                continue;
            };
            // Run the network one frame early: by the next frame, the person would have moved too far.
            let is_still = n_frames < hold.most
                && track.is_still(n_frames + 1)
                && !larger.iter().any(is_behind);
            let is_unchanged = n_frames <= hold.most_to_save
                && !track.is_doubtful
                && before.thumbnail.is_some_and(|thumbnail| thumbnail.is_unchanged(self.image));
            if is_still || is_unchanged {
                track.is_seen = self.hold(track, n_frames, before, memory);
            }
        }
    }

    /// Reuses the last sightings of the people for whom no runs are left in this frame. The network runs on the people who may have moved
    /// farthest since it last ran on them.
    ///
    /// * `before`: the people of the previous frame; the entries of the reused people are overwritten.
    pub(crate) fn hold_to_save(
        &self,
        tracks: &mut [Track],
        before: &mut [Seen],
        memory: &mut NetworkMemory,
    ) {
        let hold = memory.hold.filter(|_| memory.is_followed());
        let (Some(credit), Some(hold)) = (memory.credit, hold) else {
            return;
        };
        let credit = credit - if memory.has_searched { SEARCH } else { 0.0 };
        let mut unseen: Vec<usize> =
            (0..tracks.len()).filter(|nth| !tracks[*nth].is_seen).collect();
        let doubt = |nth: &usize| tracks[*nth].doubt(tracks[*nth].n_held + hold.gap);
        unseen.sort_by(|a, b| doubt(b).total_cmp(&doubt(a)));
        for nth in unseen.into_iter().skip(credit.max(0.0) as usize) {
            let track = &mut tracks[nth];
            let n_frames = track.n_held + hold.gap;
            let Some(before) =
                before.get_mut(track.index).filter(|_| n_frames <= hold.most_to_save)
            else {
                continue;
            };
            track.is_seen = self.hold(track, n_frames, before, memory);
            if track.is_seen {
                let newest = memory.n_seen - 1;
                let seen = &mut memory.seen[newest];
                seen.age = n_frames;
                let [_, top, _, bottom] = seen.maps.extent();
                let window_px = bottom - top;
                seen.next = seen.next.map(|track| track.moved_on(hold.gap, window_px));
            }
        }
    }

    /// Runs the network on a person of the previous frame who has not been seen yet in this frame. If people were searched for in this
    /// frame, only the last box is used. Otherwise, the box is enlarged if the last frame is long ago, or if the last pose was doubtful.
    ///
    /// * `before`: the people of the previous frame.
    pub(crate) fn see_once_more(
        &self,
        track: &Track,
        before: &[Seen],
        memory: &mut NetworkMemory,
    ) -> Result<(), LookError> {
        if memory.has_searched {
            return self.see_again(track, before.get(track.index), memory);
        }
        if let Some(apart) = memory.apart {
            return self.see_later(track, moved(track.outline, apart), memory);
        }
        if track.is_doubtful {
            return self.see_wider(track, memory);
        }
        self.see_again(track, before.get(track.index), memory)
    }

    /// Runs the network on the boxes of a detector, each of which shows one person. A single box may fit badly, so the network runs again
    /// on the box around its joints. With several boxes, that second box would be the one of the person in front.
    ///
    /// * `outlines`: the boxes, nearest person first.
    pub(crate) fn see_boxes(
        &self,
        outlines: &[[f64; 4]],
        memory: &mut NetworkMemory,
    ) -> Result<(), LookError> {
        memory.age_empty_boxes();
        for outline in outlines {
            let is_same = |seen: &Seen| overlap(seen.outline, *outline) > SAME_BOX;
            let is_empty = |empty: &Empty| overlap(empty.outline, *outline) > SAME_BOX;
            if memory.n_seen == self.n_most
                || memory.people().iter().any(is_same)
                || memory.empty.iter().any(is_empty)
            {
                continue;
            }
            self.see_box(*outline, outlines.len() == 1, memory)?;
        }
        Ok(())
    }

    /// Runs the network on a box. If the person there is already known, looks for a person behind.
    fn see_box(
        &self,
        outline: [f64; 4],
        is_alone: bool,
        memory: &mut NetworkMemory,
    ) -> Result<(), LookError> {
        let boxed = (outline, Turn::Up);
        let Some(look) = self.see_in(boxed, memory)? else {
            return Ok(());
        };
        if is_known(&memory.seen, memory.n_seen) {
            return self.see_behind(boxed, None, memory);
        }
        let best = if is_alone {
            let (workspace, seen) = memory.next();
            let what = (self.image, look);
            self.looker.look_closer(what, workspace, &mut seen.maps)?
        } else {
            look
        };
        if !self.keep_look(&best, None, memory) {
            memory.empty.push(Empty {
                outline,
                n_searches: 0,
            });
        }
        Ok(())
    }

    /// Looks for a person in a box behind known people, who are painted over first.
    fn see_behind(
        &self,
        boxed: ([f64; 4], Turn),
        usual_score: Option<f32>,
        memory: &mut NetworkMemory,
    ) -> Result<(), LookError> {
        let mut bars = core::mem::take(&mut memory.bars);
        bars.clear();
        for seen in memory.people() {
            if overlap(seen.outline, boxed.0) > 0.0 {
                seen.maps.add_bars(&mut bars);
            }
        }
        memory.look.workspace().cover(&bars);
        let look = self.see_in(boxed, memory);
        memory.look.workspace().cover(&[]);
        let (_, seen) = memory.next();
        let is_somebody = seen.maps.n_outside(&bars) >= LEAST_BEHIND
            && seen.maps.heat() >= FAINT * memory.best_heat();
        memory.bars = bars;
        if let Some(look) = look?.filter(|_| is_somebody) {
            self.keep_look(&look, usual_score, memory);
        }
        Ok(())
    }

    /// Runs the network on a box, with the picture rotated if the person is not upright; the maps are stored in the next person.
    fn see_in(
        &self,
        (outline, turn): ([f64; 4], Turn),
        memory: &mut NetworkMemory,
    ) -> Result<Option<Look>, LookError> {
        let (look, seen) = memory.next();
        let boxed = (outline, turn);
        let network = self.looker.network;
        let Some(sight) = network.look_turned(self.image, boxed, look.workspace())? else {
            return Ok(None);
        };
        seen.maps.read(&sight, self.looker.settings)?;
        let first = (outline, turn, sight.front());
        let first = self.looker.judge(first, &seen.maps);
        let what = (self.image, first);
        let best = self.looker.look_upright(what, look, &mut seen.maps)?;
        Ok(Some(best))
    }

    /// Reuses the last sighting of a person of the previous frame who has hardly moved; returns true if the person was added.
    ///
    /// * `n_held`: number of frames since the network was last run on this person.
    /// * `before`: the sighting of the person in the previous frame; overwritten.
    fn hold(
        &self,
        track: &Track,
        n_held: u64,
        before: &mut Seen,
        memory: &mut NetworkMemory,
    ) -> bool {
        if !self.is_unknown(track.outline, memory) {
            return false;
        }
        let (_, seen) = memory.next();
        core::mem::swap(seen, before);
        seen.next = Some(Track { n_held, ..*track });
        seen.age = 0;
        let is_new = !is_known(&memory.seen, memory.n_seen);
        if is_new {
            memory.n_seen += 1;
        } else {
            let (_, seen) = memory.next();
            core::mem::swap(seen, before);
        }
        is_new
    }

    /// Runs the network on a person of the previous frame twice, in the same box and in a wider box, unless a person is already known
    /// there. Keeps the better sighting if it is good.
    fn see_wider(&self, track: &Track, memory: &mut NetworkMemory) -> Result<(), LookError> {
        if !self.is_unknown(track.outline, memory) {
            return Ok(());
        }
        let (look, seen) = memory.next();
        let what = (self.image, &[track.outline, wider(track.outline)][..]);
        let best = self.looker.best_of(what, track.turn, look, &mut seen.maps)?;
        if let Some(best) = best {
            self.keep_look(&best, Some(track.usual_score), memory);
        }
        Ok(())
    }

    /// Looks around the old box of a person last seen many frames ago, unless a person is already known there. Keeps a person who is
    /// clearly visible and whose score is not much below the usual one.
    ///
    /// * `around`: the old box, enlarged for the time that has passed.
    fn see_later(
        &self,
        track: &Track,
        around: [f64; 4],
        memory: &mut NetworkMemory,
    ) -> Result<(), LookError> {
        if !self.is_unknown(track.outline, memory) {
            return Ok(());
        }
        let (look, seen) = memory.next();
        let boxes = [track.outline, wider(track.outline), around];
        let what = (self.image, &boxes[..]);
        let best = self.looker.best_of(what, track.turn, look, &mut seen.maps)?;
        if let Some(best) = best.filter(|best| best.score >= track.usual_score - self.most_lost) {
            self.keep_look(&best, Some(track.usual_score), memory);
        }
        Ok(())
    }

    /// Runs the network on a person of the previous frame, unless a person is already known there. If the person has moved far, it runs
    /// again on a better box, which takes some time. If the person lies down or gets up, the picture is rotated. Keeps a person who is
    /// clearly visible.
    ///
    /// * `before`: the sighting of the person in the previous frame.
    fn see_again(
        &self,
        track: &Track,
        before: Option<&Seen>,
        memory: &mut NetworkMemory,
    ) -> Result<(), LookError> {
        let most = if memory.has_searched { SAME } else { SAME_BOX };
        let is_same = |seen: &Seen| overlap(seen.outline, track.outline) > most;
        if memory.n_seen == self.n_most || memory.people().iter().any(is_same) {
            return Ok(());
        }
        let is_soon = memory.is_soon;
        let n_frames = memory.hold.map(|hold| track.n_held + hold.gap);
        let (look, seen) = memory.next();
        let network = self.looker.network;
        let boxed = (track.outline, track.turn);
        let Some(sight) = network.look_turned(self.image, boxed, look.workspace())? else {
            return Ok(());
        };
        let front = sight.front();
        seen.maps.read(&sight, self.looker.settings)?;
        if is_known(&memory.seen, memory.n_seen) {
            return self.see_behind(boxed, Some(track.usual_score), memory);
        }
        let (look, seen) = memory.next();
        seen.outline = track.outline;
        seen.turn = track.turn;
        seen.front = front;
        seen.usual_score = Some(track.usual_score);
        seen.pace = pace(track, before, seen, n_frames);
        let has_moved = !is_soon && has_moved(&seen.maps, track.outline);
        if has_moved || seen.maps.turn(track.turn) != track.turn {
            let first = (track.outline, track.turn, seen.front);
            let first = self.looker.judge(first, &seen.maps);
            let what = (self.image, first);
            let best = if has_moved {
                self.looker.look_closer(what, look, &mut seen.maps)?
            } else {
                self.looker.look_upright(what, look, &mut seen.maps)?
            };
            seen.outline = best.outline;
            seen.turn = best.turn;
            seen.front = best.front;
        }
        self.keep(memory);
        Ok(())
    }

    /// Returns true if there is room for another person, and no known person is in the box.
    fn is_unknown(&self, outline: [f64; 4], memory: &NetworkMemory) -> bool {
        let is_known = |seen: &Seen| overlap(seen.outline, outline) > SAME;
        memory.n_seen < self.n_most && !memory.people().iter().any(is_known)
    }

    /// Like [`Self::keep`], for the next person, whose maps have just been computed.
    fn keep_look(&self, look: &Look, usual_score: Option<f32>, memory: &mut NetworkMemory) -> bool {
        let (_, seen) = memory.next();
        seen.outline = look.outline;
        seen.turn = look.turn;
        seen.front = look.front;
        seen.usual_score = usual_score;
        seen.pace = None;
        self.keep(memory)
    }

    /// Keeps the next person if that person is clearly visible and not known yet. Returns true if the person is clearly visible.
    fn keep(&self, memory: &mut NetworkMemory) -> bool {
        let (_, seen) = memory.next();
        if !seen.judge(self.size, self.least_heat) {
            return false;
        }
        let last = &memory.seen[memory.n_seen];
        if last.usual_score.is_none() && last.heat < FAINT * memory.best_heat() {
            return false;
        }
        let is_new = !is_known(&memory.seen, memory.n_seen);
        memory.n_seen += usize::from(is_new);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_detector_box_is_assigned_to_the_person_with_the_largest_overlap() {
        let person = [100.0, 50.0, 180.0, 250.0];
        let shifted = |by: f64| [person[0] + by, person[1], person[2] + by, person[3]];
        assert_eq!(best_box(&[shifted(20.0), shifted(5.0)], person), Some(1));
        assert_eq!(best_box(&[shifted(60.0), shifted(-90.0)], person), None);
        assert_eq!(best_box(&[], person), None);
    }
}
