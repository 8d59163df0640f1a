//! Chooses the size of the frames from the calibration if the deployment sets no size, and describes the choice.

use core::fmt::Write as _;

use deployment::Deployment;
use geometry::search_size::{
    GOOD_PX, MOST_PIXELS, PERSON_METRES, USABLE_PX, better_scale, search_sizes,
};
use geometry::{Camera, Rig};
use serde::{Deserialize, Serialize};

/// The sizes of all cameras, chosen from the calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SearchSize {
    /// The size of every camera's frames, in the order of the deployment.
    pub cameras: Vec<CameraSize>,
    /// Largest number of cameras that can see a person at the same place; 0 if no two cameras can.
    pub n_sharing: usize,
}

/// The size of one camera's frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CameraSize {
    /// Name of the camera.
    pub name: String,
    /// Scale of the frames, as a fraction of the camera's image size.
    pub scale: f64,
    /// Width and height of the frames, in pixels.
    pub frame_size: [u32; 2],
    /// Height in the camera's image, in pixels, of a person in the space that the camera shares with other cameras.
    pub person_px: Option<f64>,
    /// Height of the same person in the frames, in pixels.
    pub person_in_frame_px: Option<f64>,
    /// True if the person is too small in the frames, because a limit on the number of pixels prevents larger frames.
    pub is_limited: bool,
}

impl SearchSize {
    /// Chooses the size of every camera's frames, unless the deployment sets it.
    ///
    /// * `rig`: the rig, as [`inputs::rig_of`] reads it.
    ///
    /// Also returns `None` if the rig lacks a camera. This error is reported when the frames are planned.
    pub fn of(deployment: &Deployment, rig: &Rig) -> Option<Self> {
        let capture = &deployment.capture;
        if capture.size.is_some() || capture.scale.is_some() {
            return None;
        }
        let named = deployment.cameras.iter().map(|camera| rig.camera(&camera.name));
        let named: Option<Vec<_>> = named.map(Option::<&Camera>::cloned).collect();
        let used = Rig::new(named?, rig.up_in_world(), rig.source()).ok()?;
        let chosen = search_sizes(&used);
        let cameras = chosen.cameras.into_iter().map(|camera| CameraSize {
            person_in_frame_px: camera.person_in_frame_px(),
            is_limited: camera.is_limited(),
            name: camera.camera,
            scale: camera.scale,
            frame_size: camera.frame_size,
            person_px: camera.person_px,
        });
        Some(Self {
            cameras: cameras.collect(),
            n_sharing: chosen.n_sharing,
        })
    }

    /// Returns the scale of a camera's frames.
    pub(crate) fn scale(&self, camera: &str) -> f64 {
        let found = self.cameras.iter().find(|entry| entry.name == camera);
        found.map_or(1.0, |entry| entry.scale)
    }

    /// Returns the choice and its reason, on one line.
    pub fn text(&self) -> String {
        let mut groups: Vec<Vec<&CameraSize>> = Vec::new();
        for it in &self.cameras {
            let same = |group: &&mut Vec<&CameraSize>| {
                let first = group[0];
                let is_known = first.person_px.is_some() == it.person_px.is_some();
                first.frame_size == it.frame_size && first.scale == it.scale && is_known
            };
            match groups.iter_mut().find(same) {
                Some(group) => group.push(it),
                None => groups.push(vec![it]),
            }
        }
        let chosen: Vec<String> =
            groups.iter().map(|group| describe(group, groups.len() > 1)).collect();
        let why = match self.n_sharing {
            0 => "no two cameras share a space in which a person can stand, so the frames are as large as possible in the available time"
                .to_owned(),
            n => format!("{n} cameras share the space in which a person of {PERSON_METRES:.2} m stands"),
        };
        format!(
            "capture.scale is set automatically: {}; {why} (capture.scale or capture.size overrides this)",
            chosen.join("; ")
        )
    }

    /// Returns a warning with a suggested setting, if a person is too small in some frames.
    pub fn warning(&self) -> Option<String> {
        let px = |camera_size: &CameraSize| camera_size.person_in_frame_px.unwrap_or(f64::INFINITY);
        let small = self.cameras.iter();
        let small = small.filter(|small| small.is_limited || px(small) < USABLE_PX[0]);
        let small: Vec<&CameraSize> = small.collect();
        let first = small.first()?;
        let seen: Vec<[f64; 2]> = small.iter().map(|small| [small.scale, px(small)]).collect();
        let scale = better_scale(&seen)?;
        let names: Vec<&str> = small.iter().map(|small| small.name.as_str()).collect();
        let mut text = format!(
            "a person is about {:.0} px high in the frames of {}, but {} to {} px are best: ",
            px(first),
            names.join(", "),
            GOOD_PX[0],
            GOOD_PX[1]
        );
        // Writing to a string cannot fail.
        let _infallible = if first.is_limited {
            write!(
                text,
                "to limit the time, frames have at most {MOST_PIXELS} pixels by default; for larger frames, \
                 set capture.scale = {scale} ({:.0} times the pixels)",
                (scale / first.scale).powi(2)
            )
        } else {
            write!(
                text,
                "the image has no more pixels; set capture.scale = {scale} to enlarge it for the search"
            )
        };
        Some(text)
    }
}

/// Describes the size of cameras whose frames have the same size.
///
/// * `is_named`: true to name the cameras.
fn describe(cameras: &[&CameraSize], is_named: bool) -> String {
    let first = cameras[0];
    let names: Vec<&str> = cameras.iter().map(|camera| camera.name.as_str()).collect();
    let names = if is_named {
        format!(" for {}", names.join(", "))
    } else {
        String::new()
    };
    let [width, height] = first.frame_size;
    let px = range(cameras.iter().filter_map(|camera| camera.person_px));
    let in_frame = range(cameras.iter().filter_map(|camera| camera.person_in_frame_px));
    let scale = (first.scale * 1e4).round() / 1e4;
    match (px, in_frame) {
        (Some(px), Some(in_frame)) => format!(
            "{scale}{names}, a person is {px} px high in the image and {in_frame} px in {width}x{height}"
        ),
        _ => format!("{scale}{names}, {width}x{height}"),
    }
}

/// Returns the range of numbers, rounded, as text; `None` without numbers.
fn range(numbers: impl Iterator<Item = f64> + Clone) -> Option<String> {
    let least = numbers.clone().reduce(f64::min)?.round();
    let most = numbers.reduce(f64::max)?.round();
    Some(if least == most {
        format!("{least}")
    } else {
        format!("{least} to {most}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn size(cameras: &[(f64, Option<f64>, bool)], n_sharing: usize) -> SearchSize {
        let cameras = cameras.iter().zip(["a", "b", "c"]);
        let cameras = cameras.map(|((scale, person_px, is_limited), name)| CameraSize {
            name: name.to_owned(),
            scale: *scale,
            frame_size: [1920.0, 1080.0].map(|value: f64| (value * scale).round() as u32),
            person_px: *person_px,
            person_in_frame_px: person_px.map(|person_px| person_px * scale),
            is_limited: *is_limited,
        });
        SearchSize {
            cameras: cameras.collect(),
            n_sharing,
        }
    }

    #[test]
    fn cameras_of_the_same_size_are_described_together_and_others_by_name() {
        let alike = size(&[(0.25, Some(690.0), false), (0.25, Some(710.0), false)], 2);
        assert_eq!(
            alike.text(),
            "capture.scale is set automatically: 0.25, a person is 690 to 710 px high in the image and 173 to 178 px in 480x270; 2 cameras \
             share the space in which a person of 1.70 m stands (capture.scale or capture.size overrides this)"
        );
        assert_eq!(alike.warning(), None);
        let text = size(&[(0.25, Some(690.0), false), (0.5, None, false)], 2).text();
        assert!(text.contains("0.25 for a, a person is 690 px"), "{text}");
        assert!(text.contains("; 0.5 for b, 960x540;"), "{text}");
        let nothing = size(&[(0.25, None, false); 2], 0);
        assert!(
            nothing.text().contains("no two cameras share"),
            "{}",
            nothing.text()
        );
        assert_eq!(nothing.warning(), None);
    }

    #[test]
    fn people_who_are_too_small_give_a_warning_with_the_setting_to_change() {
        let limited = size(&[(0.25, Some(300.0), true), (0.25, Some(700.0), false)], 2);
        let warning = limited.warning().unwrap();
        assert!(
            warning.contains("75 px high in the frames of a, but 150 to 250"),
            "{warning}"
        );
        assert!(
            warning.contains("set capture.scale = 0.67 (7 times"),
            "{warning}"
        );
        let small = size(&[(1.0, Some(100.0), false)], 1).warning().unwrap();
        assert!(
            small.ends_with("set capture.scale = 2 to enlarge it for the search"),
            "{small}"
        );
    }
}
