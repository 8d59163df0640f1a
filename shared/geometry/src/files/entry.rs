//! Entry of a calibration file for one camera, and the rig of the cameras that have a pose.

use nalgebra::{Isometry3, UnitVector3};

use super::{ParseError, ReadOptions};
use crate::rig::LeftOut;
use crate::{Camera, Intrinsics, Rig, RigError};

/// Reason why a camera is left out although its lens is known.
const NO_PLACE: &str = "its file has a lens but no pose";

/// A camera in a calibration file.
pub(super) enum Entry {
    /// A camera with its lens and pose.
    Placed(Camera),
    /// A camera with only its lens, placed at the origin.
    Lens(Camera),
    /// A camera of which only the name is known, with the reason why its pose is not known.
    Name(LeftOut),
}

impl Entry {
    /// Returns a camera without a known pose.
    pub(super) fn lens(name: &str, intrinsics: Intrinsics) -> Self {
        Self::Lens(Camera {
            name: name.to_owned(),
            intrinsics,
            camera_from_world: Isometry3::identity(),
        })
    }

    /// Returns a camera of which only the name is known.
    pub(super) fn name(name: &str, why: &'static str) -> Self {
        Self::Name(LeftOut {
            camera: name.to_owned(),
            why,
        })
    }
}

/// Returns the rig of the cameras that have a pose. If [`ReadOptions::lenses_suffice`](super::ReadOptions::lenses_suffice) is set, it also
/// contains the cameras without a pose.
pub(super) fn rig(
    entries: Vec<Entry>,
    up: Option<UnitVector3<f64>>,
    source: &str,
    options: &ReadOptions,
) -> Result<Rig, ParseError> {
    let (mut cameras, mut left_out) = (Vec::new(), Vec::new());
    let mut has_lens = false;
    for entry in entries {
        match entry {
            Entry::Placed(camera) => cameras.push(camera),
            Entry::Lens(camera) => {
                has_lens = true;
                left_out.push(LeftOut {
                    camera: camera.name.clone(),
                    why: NO_PLACE,
                });
                if options.lenses_suffice {
                    cameras.push(camera);
                }
            }
            Entry::Name(camera) => left_out.push(camera),
        }
    }
    if let (true, Some(first)) = (cameras.is_empty(), left_out.first()) {
        return Err(ParseError::NoPlace {
            camera: first.camera.clone(),
            why: first.why,
            has_lens,
        });
    }
    let rig = Rig::new(cameras, up, source).map_err(ParseError::Rig)?;
    for left_out in &left_out {
        let named_alike = rig.cameras().iter().filter(|camera| camera.name == left_out.camera);
        let is_in_the_rig = options.lenses_suffice && left_out.why == NO_PLACE;
        if named_alike.count() > usize::from(is_in_the_rig) {
            let name = left_out.camera.clone();
            return Err(ParseError::Rig(RigError::DuplicateName { name }));
        }
    }
    Ok(rig.with_left_out(left_out))
}
