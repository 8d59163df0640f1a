//! Stores, in a file beside the rig, a vertical that was found in pictures, because the search takes half a minute.

use std::fs;
use std::path::{Path, PathBuf};

use formats::checksum::fnv1a;
use geometry::Camera;
use serde::{Deserialize, Serialize};

use super::Vertical;

/// Content of the file.
#[derive(Debug, Serialize, Deserialize)]
struct Kept {
    /// Hash of the cameras for which the vertical was found.
    cameras: String,
    up: [f64; 3],
    why: String,
}

/// Returns the path of the file beside a rig, such as `Calib.toml.up.json`.
fn file(rig: &Path) -> PathBuf {
    let mut name = rig.as_os_str().to_owned();
    name.push(".up.json");
    PathBuf::from(name)
}

/// Reads the vertical that was found for these cameras before. Returns `None` if the rig has changed since.
pub(super) fn read(rig: &Path, cameras: &[Camera]) -> Option<Vertical> {
    let file = file(rig);
    if fs::metadata(&file).ok()?.len() > 1 << 16 {
        return None;
    }
    let kept: Kept = serde_json::from_str(&fs::read_to_string(&file).ok()?).ok()?;
    let length = kept.up.iter().map(|up| up * up).sum::<f64>();
    if kept.cameras != digest(cameras) || (length - 1.0).abs() > 1e-6 {
        return None;
    }
    let why = format!(
        "{} (found by an earlier run and stored in {}: delete this file to search again)",
        kept.why,
        file.display()
    );
    Some(Vertical { up: kept.up, why })
}

/// Stores a vertical. If the folder cannot be written, the next run searches again.
pub(super) fn write(rig: &Path, cameras: &[Camera], found: &Vertical) {
    let kept = Kept {
        cameras: digest(cameras),
        up: found.up,
        why: found.why.clone(),
    };
    let Ok(text) = serde_json::to_string_pretty(&kept) else {
        return;
    };
    let file = file(rig);
    if let Err(error) = files::replace(&file, text.as_bytes()) {
        tracing::info!(
            "the upward direction could not be stored in {}: {error}",
            file.display()
        );
    }
}

/// Returns a short hash of the names and poses of cameras.
fn digest(cameras: &[Camera]) -> String {
    let text: Vec<String> = cameras
        .iter()
        .map(|camera| format!("{} {:?}", camera.name, camera.camera_from_world))
        .collect();
    format!("{:016x}", fnv1a(text.join("\n").as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::super::tests::ring;
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn a_stored_vertical_is_used_only_for_the_cameras_it_was_found_for() {
        let folder = tempfile::tempdir().unwrap();
        let rig = folder.path().join("rig.toml");
        let cameras = ring(&[0.0, 5.0], Vector3::z_axis());
        let found = Vertical {
            up: [0.0, 0.0, 1.0],
            why: "people are found".to_owned(),
        };
        assert_eq!(read(&rig, &cameras), None);
        write(&rig, &cameras, &found);
        let kept = read(&rig, &cameras).unwrap();
        assert_eq!(kept.up, found.up);
        assert!(kept.why.contains("rig.toml.up.json"), "{}", kept.why);
        assert_eq!(read(&rig, &ring(&[0.0, 6.0], Vector3::z_axis())), None);
    }
}
