//! The sound of a video, from `ffmpeg`.

use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

use super::answers::run_ffprobe;
use super::listing::{self, Listing};
use super::log::summary;
use super::probe::{number, probe};
use super::program::{input_name, missing};
use crate::{FootageError, SourceSpec, is_image};

/// The sound of a video, with all channels mixed.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedSound {
    /// Time of the first sample, in seconds after the first frame.
    pub begins_s: f64,
    /// The samples.
    pub samples: Vec<i16>,
}

/// Reads the whole sound of footage; returns `None` for images and for videos without sound.
///
/// * `rate_hz`: sample rate to which the sound is converted, in hertz.
///
/// # Errors
///
/// Fails if there is no such footage, if it cannot be read, or if `ffmpeg` is missing.
pub fn read_sound(spec: &SourceSpec, rate_hz: u32) -> Result<Option<RecordedSound>, FootageError> {
    let path = match listing::list(&spec.path)? {
        Listing::File(path) if !is_image(&path)? => path,
        _ => return Ok(None),
    };
    let wanted = ["-show_entries", "stream=start_time:format=start_time"];
    let of_sound = run_ffprobe(&path, spec, "a:0", &wanted)?;
    if of_sound["streams"].as_array().is_none_or(Vec::is_empty) {
        return Ok(None);
    }
    let film = probe(&path, spec)?.stream.to_string();
    let of_pictures = run_ffprobe(&path, spec, &film, &wanted)?;
    let start_s = |value: &Value| number(&value["start_time"]).unwrap_or(0.0);
    let first_frame_s = start_s(&of_pictures["streams"][0]);
    Ok(Some(RecordedSound {
        // The decoder inserts silence if the sound begins later than the file.
        begins_s: start_s(&of_pictures["format"]) - first_frame_s,
        samples: samples(&path, spec, rate_hz)?,
    }))
}

fn samples(path: &Path, spec: &SourceSpec, rate_hz: u32) -> Result<Vec<i16>, FootageError> {
    let output = Command::new(&spec.ffmpeg)
        .args(["-nostdin", "-v", "error", "-i"])
        .arg(input_name(path))
        .args(["-map", "0:a:0", "-af", "aresample=async=1:first_pts=0"])
        .args([
            "-ac",
            "1",
            "-ar",
            &rate_hz.to_string(),
            "-f",
            "s16le",
            "pipe:1",
        ])
        .stdin(Stdio::null())
        .output()
        .map_err(|source| missing(&spec.ffmpeg, path, source))?;
    if !output.status.success() {
        return Err(FootageError::Video {
            path: path.to_path_buf(),
            message: summary(&output.stderr),
        });
    }
    let (samples, _) = output.stdout.as_chunks::<2>();
    Ok(samples.iter().map(|sample| i16::from_le_bytes(*sample)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Creates a video with a tone that begins 0.5 s after the first frame. Without ffmpeg, prints a message and returns `None`.
    #[expect(clippy::print_stderr, reason = "a skipped test must say so")]
    fn video(path: &Path, with_sound: bool) -> Option<()> {
        let mut command = Command::new("ffmpeg");
        command.args(["-nostdin", "-v", "error", "-f", "lavfi", "-i"]);
        command.arg("testsrc=size=64x48:rate=10:duration=2");
        if with_sound {
            command.args([
                "-itsoffset",
                "0.5",
                "-f",
                "lavfi",
                "-i",
                "sine=1000:duration=1",
            ]);
        }
        let Ok(status) = command.arg(path).status() else {
            eprintln!("skipped: there is no ffmpeg on the PATH");
            return None;
        };
        assert!(status.success());
        Some(())
    }

    #[test]
    fn sound_has_the_time_base_of_the_pictures() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["tone.mkv", "tone.mp4"] {
            let path = folder.path().join(name);
            if video(&path, true).is_none() {
                return;
            }
            let spec = SourceSpec::new(path.to_str().unwrap());
            let sound = read_sound(&spec, 8000).unwrap().unwrap();
            let loud = sound.samples.iter().position(|sample| sample.unsigned_abs() > 500);
            let from_s = sound.begins_s + loud.unwrap() as f64 / 8000.0;
            assert!((from_s - 0.5).abs() < 0.03, "{name}: {from_s} s");
        }
        let silent = folder.path().join("silent.mp4");
        video(&silent, false).unwrap();
        let spec = SourceSpec::new(silent.to_str().unwrap());
        assert_eq!(read_sound(&spec, 8000).unwrap(), None);
    }

    #[test]
    fn images_have_no_sound_and_files_that_are_not_videos_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let image = folder.path().join("000.png");
        image::RgbImage::new(4, 4).save(&image).unwrap();
        let spec = SourceSpec::new(folder.path().to_str().unwrap());
        assert_eq!(read_sound(&spec, 8000).unwrap(), None);
        let text = folder.path().join("text.mp4");
        std::fs::write(&text, "no video").unwrap();
        let refused = read_sound(&SourceSpec::new(text.to_str().unwrap()), 8000);
        assert!(matches!(
            refused,
            Err(FootageError::Video { .. } | FootageError::FfmpegMissing { .. })
        ));
    }
}
