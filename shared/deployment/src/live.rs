//! Rules of a deployment with live cameras: nothing waits, and no picture can be read twice.

use toml::Table;

use crate::capture::{Camera, Mode};
use crate::complaint::demand;
use crate::{Complaint, Deployment, Machine};

/// Switches a deployment with a live camera to real time, and checks the keys that only live cameras have.
///
/// * `given`: settings that the user gave.
///
/// # Errors
///
/// Fails if the settings need something that a live camera cannot do, or if a camera with footage has keys of live cameras.
pub(crate) fn settle(
    it: &mut Deployment,
    given: &Table,
    machine: &dyn Machine,
) -> Result<(), Complaint> {
    for camera in &it.cameras {
        if machine.is_live(&camera.source) {
            keys_of_live(camera)?;
        } else {
            no_keys_of_live(camera)?;
        }
    }
    let mut cameras = it.cameras.iter();
    let Some(camera) = cameras.find(|camera| machine.is_live(&camera.source)) else {
        return Ok(());
    };
    let name = &camera.name;
    demand(
        !it.has_clocks(),
        "camera.offset_ms",
        "given (or `drift_ppm` is) for footage",
        &format!(
            "neither of these keys, because camera {name:?} is live, and all footage in the same run begins with the run"
        ),
    )?;
    let mode = given.get("capture").and_then(|section| section.get("mode"));
    demand(
        mode.is_none() || it.capture.mode == Mode::Realtime,
        "capture.mode",
        &mode.map_or_else(String::new, ToString::to_string),
        &format!(
            "\"realtime\" or no value, because camera {name:?} is live and does not wait, so its runs are never lossless"
        ),
    )?;
    demand(
        it.capture.start_frame == 0,
        "capture.start_frame",
        &it.capture.start_frame.to_string(),
        &format!("0, because camera {name:?} is live, and frames before the start do not exist"),
    )?;
    it.capture.mode = Mode::Realtime;
    Ok(())
}

/// Checks the values of a live camera.
fn keys_of_live(camera: &Camera) -> Result<(), Complaint> {
    let of = format!("given for the live camera {:?}", camera.name);
    demand(
        camera.fault.is_empty(),
        "camera.fault",
        &of,
        "no faults, because only footage can have simulated faults",
    )?;
    demand(
        camera.keypoints.is_none(),
        "camera.keypoints",
        &of,
        "no keypoints file, because the keypoints of a live camera are found during the run",
    )?;
    demand(
        camera.skew_ms.is_none(),
        "camera.skew_ms",
        &of,
        "no value, because it is measured during the run",
    )?;
    demand(
        camera.offset_ms.is_none() && camera.drift_ppm.is_none(),
        "camera.offset_ms",
        &format!(
            "given (or `drift_ppm` is) for the live camera {:?}",
            camera.name
        ),
        "neither of these keys, because they are for footage only; a live camera reports its own times",
    )?;
    let sides = camera.size.unwrap_or([1, 1]);
    demand(
        sides.iter().all(|side| (1..=16_384).contains(side)),
        "camera.size",
        &format!("{sides:?}"),
        "1 to 16384 each",
    )?;
    let rate = camera.frame_rate_hz.unwrap_or(1.0);
    let is_rate = (0.1..=1000.0).contains(&rate);
    demand(
        is_rate,
        "camera.frame_rate_hz",
        &rate.to_string(),
        "0.1 to 1000",
    )?;
    keys_of_kind(camera)
}

/// Refuses keys of a live camera that belong to a different kind of camera.
fn keys_of_kind(camera: &Camera) -> Result<(), Complaint> {
    let is_device = camera.source.starts_with("/dev/") || camera.source.starts_with("v4l2:");
    demand(
        is_device || (camera.format.is_none() && camera.controls.is_empty()),
        "camera.format",
        &format!("given (or `controls` is) for the stream {:?}", camera.name),
        "neither of these keys, because both are for video devices only",
    )?;
    demand(
        !is_device || camera.transport.is_none(),
        "camera.transport",
        &format!("given for the video device {:?}", camera.name),
        "no value, because this key is for RTSP cameras only",
    )?;
    let scheme = camera.source.split(':').next().unwrap_or_default();
    let is_rtsp = ["rtsp", "rtsps"].iter().any(|name| scheme.eq_ignore_ascii_case(name));
    demand(
        is_rtsp || camera.clock.is_none(),
        "camera.clock",
        &format!("given for {:?}", camera.name),
        "no value, because this key is for RTSP cameras only",
    )
}

/// Refuses keys that have no meaning for footage.
fn no_keys_of_live(camera: &Camera) -> Result<(), Complaint> {
    let keys = [
        ("camera.format", camera.format.is_some()),
        ("camera.size", camera.size.is_some()),
        ("camera.frame_rate_hz", camera.frame_rate_hz.is_some()),
        ("camera.controls", !camera.controls.is_empty()),
        ("camera.transport", camera.transport.is_some()),
        ("camera.clock", camera.clock.is_some()),
    ];
    for (key, is_given) in keys {
        demand(
            !is_given,
            key,
            &format!("given for {:?}", camera.name),
            "no value, because this key is for live cameras, and the `source` of this camera is footage",
        )?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::path::{Path, PathBuf};

    use super::*;
    use crate::{ConfigError, Loaded};

    /// A machine on which every source that begins with `/dev/` or `rtsp:` is live.
    struct Room;

    impl Machine for Room {
        fn folder_of(&self, _file: &Path) -> PathBuf {
            PathBuf::new()
        }

        fn footage(&self, named: &str, _base: &Path) -> String {
            named.to_owned()
        }

        fn is_live(&self, named: &str) -> bool {
            named.starts_with("/dev/") || named.starts_with("rtsp:")
        }
    }

    /// Reads a deployment with a live camera and a camera with footage.
    ///
    /// * `top`: sections; `camera`: more keys of the live camera; `other`: more keys of the footage.
    fn read([top, camera, other]: [&str; 3]) -> Result<Deployment, ConfigError> {
        let text = format!(
            "name = 'a'\nrig = 'r'\noutput = 'o'\n{top}\n[[camera]]\nname = 'b'\nsource = '/dev/video0'\n{camera}\n\
             [[camera]]\nname = 'c'\nsource = 's.mp4'\n{other}\n"
        );
        Loaded::parse(&text, Path::new("d.toml"), &[], &Room).map(|value| value.deployment)
    }

    #[test]
    fn a_live_camera_makes_the_run_realtime() {
        let it = read(["", "", ""]).unwrap();
        assert_eq!(it.capture.mode, Mode::Realtime);
        assert_eq!(it.deadline_ms(), 200);
        read(["[capture]\nmode = 'realtime'", "", ""]).unwrap();
    }

    #[test]
    fn settings_that_a_live_camera_does_not_support_are_refused_with_the_reason() {
        for (text, words) in [
            (["[capture]\nmode = 'lossless'", "", ""], "never lossless"),
            (["[capture]\nmode = 'paced'", "", ""], "\"b\" is live"),
            (
                ["[capture]\nstart_frame = 3", "", ""],
                "`capture.start_frame` is 3",
            ),
            (["", "fault = 'freeze@3+4'", ""], "`camera.fault`"),
            (["", "offset_ms = 3.0", ""], "`camera.offset_ms`"),
            (["", "size = [0, 480]", ""], "`camera.size` is [0, 480]"),
            (
                ["", "frame_rate_hz = 0.0", ""],
                "`camera.frame_rate_hz` is 0",
            ),
            (["", "transport = 'tcp'", ""], "RTSP"),
            (["", "clock = 'arrival'", ""], "`camera.clock`"),
            (["", "skew_ms = 3", ""], "it is measured"),
            (
                ["", "", "format = 'MJPG'"],
                "`camera.format` is given for \"c\"",
            ),
            (["", "", "controls = { gain = 3 }"], "`camera.controls`"),
        ] {
            let refused = read(text).unwrap_err().to_string();
            assert!(refused.contains(words), "{text:?}: {refused}");
        }
    }

    #[test]
    fn camera_controls_are_numbers_with_a_name() {
        let it = read(["", "controls = { gain = 3, focus_absolute = 0 }", ""]).unwrap();
        assert_eq!(it.cameras[0].controls["gain"], 3);
        let refused = read(["", "controls = { gain = 'high' }", ""]).unwrap_err();
        assert!(
            refused.to_string().contains("gain") || refused.to_string().contains("whole number")
        );
    }
}
