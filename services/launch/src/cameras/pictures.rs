//! Properties of pictures that are read from the cameras' files: the rotation to apply, and the frame numbers.

use deployment::Deployment;
use deployment::capture::{Camera, Rotate, Tag};
use failure::Failure;
use footage::{Counting, PictureNumbers, Rotation, Size, SourceSpec, Turn};
use geometry::{Rig, upright_roll};
use nalgebra::{UnitVector3, Vector3};
use rayon::prelude::*;
use scene::Address;

use inputs::rig_of;

use super::is_live;

/// Returns the deployment with `rotate` and `numbers` of every camera that does not set them, as determined from its files. Logs the
/// result.
///
/// Files that cannot be read are ignored here, and reported when they are used.
///
/// # Errors
///
/// Fails if the calibration cannot be read.
pub fn settled(deployment: &Deployment) -> Result<Deployment, Failure> {
    let mut settled = deployment.clone();
    let is_of_files = |camera: &Camera| {
        let is_made =
            Address::is_address(&camera.source) || capture::Blank::is_blank(&camera.source);
        let is_recorded = capture::Recorded::is_recorded(&camera.source);
        !camera.source.is_empty() && !is_made && !is_recorded && !is_live(&camera.source)
    };
    let files: Vec<usize> = (0..settled.cameras.len())
        .filter(|&i| is_of_files(&settled.cameras[i]))
        .collect();
    turn(&mut settled, &files)?;
    count(&mut settled, &files);
    Ok(settled)
}

fn turn(deployment: &mut Deployment, files: &[usize]) -> Result<(), Failure> {
    let cameras = &deployment.cameras;
    let open = files.iter().filter(|file| cameras[**file].rotate.is_none());
    // All files are queried at the same time, because each query starts a program.
    let open: Vec<usize> = open.copied().collect();
    let tagged = open.par_iter().map(|&camera| Tagged::read(&cameras[camera].source));
    let tagged: Vec<Option<Tagged<'_>>> = tagged.collect();
    if tagged.iter().all(Option::is_none) {
        return Ok(());
    }
    let rig = with_up(rig_of(deployment)?);
    let turns = open.into_iter().zip(tagged).filter_map(|(camera, tagged)| {
        let rotate = if tagged?.does_turn(&cameras[camera].name, &rig) {
            Rotate::Tag(Tag::Tag)
        } else {
            Rotate::Degrees(0)
        };
        Some((camera, rotate))
    });
    for (camera, rotate) in turns.collect::<Vec<_>>() {
        deployment.cameras[camera].rotate = Some(rotate);
    }
    Ok(())
}

/// Returns the rotation that is applied to the pictures of a file for a camera of a rig. Logs the result.
pub fn rotation(source: &str, camera: &str, rig: &Rig) -> Rotation {
    let is_turned =
        Tagged::read(source).is_some_and(|tagged| tagged.does_turn(camera, &with_up(rig.clone())));
    if is_turned {
        Rotation::Tag
    } else {
        Rotation::Stored
    }
}

/// Footage with a tag that asks for a rotation.
struct Tagged<'a> {
    source: &'a str,
    stored: Size,
    tag: Turn,
}

impl<'a> Tagged<'a> {
    /// Reads the tag. Returns `None` for footage without a tag, or footage that cannot be read.
    fn read(source: &'a str) -> Option<Self> {
        let (stored, tag) = footage::stored(&SourceSpec::new(source)).ok()?;
        (!tag.is_none()).then_some(Self {
            source,
            stored,
            tag,
        })
    }

    /// Returns true if a camera was calibrated with rotated pictures. Logs the reason for this decision.
    fn does_turn(&self, camera: &str, rig: &Rig) -> bool {
        let (does_turn, why) = by_calibration(camera, rig, self.stored, self.tag);
        let done = if does_turn {
            "is applied"
        } else {
            "is not applied"
        };
        tracing::warn!(
            "camera {camera:?}: the orientation tag of {} ({}) {done}: {why}",
            self.source,
            self.tag
        );
        does_turn
    }
}

/// Returns the rig with an upward direction. If the rig has none, the cameras are assumed to be level.
fn with_up(rig: Rig) -> Rig {
    if rig.up_in_world().is_some() {
        return rig;
    }
    let down = rig.cameras().iter();
    let down: Vector3<f64> =
        down.map(|down| down.camera_from_world.rotation.inverse() * Vector3::y()).sum();
    let up = UnitVector3::try_new(-down, 0.3 * rig.cameras().len() as f64);
    let level = Rig::new(rig.cameras().to_vec(), up, rig.source());
    level.unwrap_or(rig)
}

/// Returns true if a calibration applies to the rotated picture, and the reason for this decision.
fn by_calibration(name: &str, rig: &Rig, stored: Size, tag: Turn) -> (bool, String) {
    const BY_HAND: &str = "to choose explicitly, set `rotate = 0` (as stored) or `rotate = \"tag\"` in the [[camera]]";
    let Some(camera) = rig.camera(name) else {
        return (true, BY_HAND.to_owned());
    };
    let [width, height] = camera.intrinsics.size;
    let turned = tag.size(stored);
    let is_wide = |size: Size| size.width > size.height;
    if tag.swaps_sides() && is_wide(turned) != is_wide(stored) && width != height {
        let does_turn = is_wide(turned) == (width > height);
        let pixels = if does_turn { turned } else { stored };
        let how = if does_turn { "rotated" } else { "as stored" };
        let why = format!(
            "the calibration is for {width}x{height} pixels, and the pictures have {pixels} {how}"
        );
        return (does_turn, why);
    }
    // The rotation that turns the calibrated picture upright.
    let Some(roll) = upright_roll(camera, rig).map(f64::to_degrees) else {
        return (true, format!("video players show it like this; {BY_HAND}"));
    };
    let most = if tag.swaps_sides() { 45.0 } else { 90.0 };
    let does_turn = roll.abs() < most;
    let how = if does_turn {
        "stand upright"
    } else {
        "do not stand upright"
    };
    (
        does_turn,
        format!("according to the calibration, people then {how}; {BY_HAND}"),
    )
}

fn count(deployment: &mut Deployment, files: &[usize]) {
    let is_open = |file: &&usize| deployment.cameras[**file].numbers.is_none();
    let numbered = files.iter().filter(is_open).filter_map(|&file| {
        let numbers = footage::picture_numbers(&deployment.cameras[file].source);
        Some((file, numbers.ok()??))
    });
    let (cameras, numbers): (Vec<usize>, Vec<Vec<u64>>) = numbered.unzip();
    let name = |nth: usize| &deployment.cameras[cameras[nth]].name;
    let ends = || {
        let all = numbers.iter().enumerate();
        let all = all.map(|(nth, numbers)| {
            format!(
                "{} {} to {}",
                name(nth),
                numbers[0],
                numbers[numbers.len() - 1]
            )
        });
        all.collect::<Vec<_>>().join(", ")
    };
    if numbers.is_empty() {
        return;
    }
    let of_cameras = match Counting::of(&numbers) {
        Counting::InOrder => {
            if numbers.iter().any(|number| *number != numbers[0]) {
                tracing::warn!(
                    "the numbers of the pictures ({}) are too far apart to be frame numbers: pictures are paired in their order; \
                     set `numbers = [first, step]` in a [[camera]] to define which numbers are frames",
                    ends()
                );
            }
            return;
        }
        Counting::Common(common) => {
            if numbers.iter().any(|number| number[0] != numbers[0][0]) {
                tracing::warn!(
                    "cameras do not begin with the same picture ({}): frames are paired by these numbers; if each camera counts \
                     separately, set `numbers = [first, step]` in its [[camera]] to define the number of frame 0",
                    ends()
                );
            }
            vec![common; numbers.len()]
        }
        Counting::Own(own) => {
            tracing::warn!(
                "the pictures of each camera are numbered separately ({}): the first picture of each is frame 0; do the cameras begin at the same time? \
                 Set `numbers = [first, step]` in a [[camera]] to define the number of frame 0",
                ends()
            );
            own
        }
    };
    for (nth, counted) in of_cameras.iter().enumerate() {
        if let Some(gaps) = gaps(&numbers[nth], *counted) {
            tracing::warn!("camera {:?} has no picture for {gaps}", name(nth));
        }
    }
    for (camera, PictureNumbers { first, step }) in cameras.into_iter().zip(of_cameras) {
        deployment.cameras[camera].numbers = Some([first, step]);
    }
}

/// Describes the frames between the first and the last picture that have no picture. Returns `None` if there are none.
fn gaps(numbers: &[u64], counted: PictureNumbers) -> Option<String> {
    const MOST_NAMED: usize = 5;
    let PictureNumbers { first, step } = counted;
    let frame = |number: u64| (number - first) / step;
    let missing: Vec<[u64; 2]> = numbers
        .windows(2)
        .map(|pair| [frame(pair[0]) + 1, frame(pair[1])])
        .filter(|range| range[1] > range[0])
        .collect();
    let n: u64 = missing.iter().map(|missing| missing[1] - missing[0]).sum();
    let named = missing.iter().take(MOST_NAMED).map(|[from, end]| {
        let last = end - 1;
        if *from == last {
            from.to_string()
        } else {
            format!("{from} to {last}")
        }
    });
    let named = named.collect::<Vec<_>>().join(", ");
    let more = if missing.len() > MOST_NAMED {
        ", ..."
    } else {
        ""
    };
    let all = numbers.len() as u64 + n;
    (n > 0).then(|| format!("{n} of {all} frames: no file name has the numbers {named}{more}"))
}

#[cfg(test)]
mod tests;
