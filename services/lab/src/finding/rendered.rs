//! Pictures of synthetic scenes.

use failure::{Console, Failure, Stop};
use training::networks::finder::Picture;

use super::around_joints;
use super::reduced::reduced;
use crate::scenes::{Scenes, Shown, of_pictures_shown};

/// A person counts as hidden if less than this fraction of the pixels in the box show the person. Without occlusion, it is about a third.
const HIDDEN: f64 = 0.08;

/// Returns the pictures of all scenes, with the numbers of the subjects.
pub(super) fn pictures(
    scenes: &Scenes,
    watched: (&Stop, &dyn Console),
) -> Result<Vec<(u64, Picture)>, Failure> {
    of_pictures_shown(scenes, watched, picture)
}

fn picture(shown: &Shown<'_>) -> Option<(u64, Picture)> {
    let people = shown.everybody.iter().filter_map(|body| {
        let outline = around_joints(body.joints)?;
        let [left, top, right, bottom] = outline;
        let size = [shown.picture.width(), shown.picture.height()].map(|side| side as f64);
        let inside = (right.min(size[0]) - left.max(0.0)) * (bottom.min(size[1]) - top.max(0.0));
        (body.seen_px > 0.0).then_some((outline, body.seen_px > HIDDEN * inside))
    });
    let people: Vec<_> = people.collect();
    Some((
        shown.subject()?,
        reduced(shown.source.clone(), shown.picture, &people),
    ))
}
