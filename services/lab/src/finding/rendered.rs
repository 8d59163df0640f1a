//! Pictures of synthetic scenes.

use failure::{Console, Failure};
use training::networks::finder::Picture;

use super::around_joints;
use super::reduced::reduced;
use crate::scenes::{Scenes, Shown, of_pictures};

/// A person counts as hidden if less than this fraction of the pixels in the box show the person. Without occlusion, it is about a third.
const HIDDEN: f64 = 0.08;

/// Returns the pictures of all scenes, with the numbers of the subjects.
pub(super) fn pictures(
    scenes: &Scenes,
    go_on: &(dyn Fn() -> Result<(), Failure> + Sync),
    console: &dyn Console,
) -> Result<Vec<(u64, Picture)>, Failure> {
    if scenes.n == 0 {
        return Ok(Vec::new());
    }
    console.begin("scenes", "pictures");
    let found = of_pictures(
        scenes,
        |shown| {
            go_on()?;
            Ok(picture(shown))
        },
        |n, _| console.advance(n),
    );
    console.finish();
    found
}

fn picture(shown: &Shown<'_>) -> Option<(u64, Picture)> {
    let subject = shown.group.rsplit(' ').next()?.parse().ok()?;
    let people = shown.everybody.iter().filter_map(|body| {
        let outline = around_joints(body.joints)?;
        let [left, top, right, bottom] = outline;
        let size = [shown.picture.width(), shown.picture.height()].map(|side| side as f64);
        let inside = (right.min(size[0]) - left.max(0.0)) * (bottom.min(size[1]) - top.max(0.0));
        (body.seen_px > 0.0).then_some((outline, body.seen_px > HIDDEN * inside))
    });
    let people: Vec<_> = people.collect();
    Some((
        subject,
        reduced(shown.source.clone(), shown.picture, &people),
    ))
}
