//! Formats with a file for every view: keypoints, and videos.

use std::fs;
use std::io::{self, Write as _};
use std::path::Path;

use exports::{Trial, ViewCamera, annotate, openpose};
use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use footage::{Canvas, FootageError, Size, VideoWriter};

use super::pictures::Pictures;
use super::{Written, cannot_write};

/// File that marks a folder as written by Parallax, so that it may be replaced.
const MARK: &str = ".parallax";

/// Writes a folder of keypoints. It contains a folder for each view, with a file for each frame.
pub(super) fn openpose(
    trials: &[Trial],
    cameras: &[ViewCamera],
    path: &Path,
    stop: &Stop,
    console: &dyn Console,
) -> Result<Written, Failure> {
    let beside = files::beside(path);
    let made = write_all(trials, cameras, &beside, stop, console);
    let placed = made.and_then(|()| {
        results::remove_pictures(path).or_fail(ExitKind::Usage)?;
        fs::rename(&beside, path).map_err(|error| cannot_write(path, &error))
    });
    if placed.is_err() {
        // The first error is reported, so an error here is ignored.
        drop(fs::remove_dir_all(&beside));
    }
    placed?;
    let mut notes = vec![
        "BODY_25 without the points that are not joints (nose, eyes, ears, toes, heels, unless a network finds them)".to_owned(),
        "the confidence is the share of the views from which a joint was triangulated; `pose_keypoints_sd_px` is its \
         standard deviation in the picture"
            .to_owned(),
    ];
    if trials[0].joints.joints.iter().any(|joint| joint.name == "head") {
        notes.push("the head is left out, because BODY_25 has no head".to_owned());
    }
    Ok(Written {
        format: "openpose",
        path: path.to_owned(),
        about: [
            "pixels of the footage",
            "x right, y down, the centre of the top-left pixel at (0, 0)",
            "0, 0, 0; nobody in a frame without a result",
            "standard deviation in pixels, as an addition to the format",
        ],
        notes,
    })
}

fn write_all(
    trials: &[Trial],
    cameras: &[ViewCamera],
    folder: &Path,
    stop: &Stop,
    console: &dyn Console,
) -> Result<(), Failure> {
    let at = |path: &Path, done: io::Result<()>| done.map_err(|error| cannot_write(path, &error));
    let trial = &trials[0];
    if folder.exists() {
        // The folder was left by a process that was killed.
        at(folder, fs::remove_dir_all(folder))?;
    }
    let room = files::Folder::create(folder).map_err(|error| cannot_write(folder, &error))?;
    let put = |room: &files::Folder, name: &str, text: &str| {
        let written = room.begin(name).and_then(|mut file| file.write_all(text.as_bytes()));
        at(&room.path().join(name), written)
    };
    put(&room, MARK, "keypoints exported by parallax\n")?;
    console.set(0, cameras.len() * trial.slots.len());
    for view in cameras {
        let room = room.inner(&view.name);
        let room = room.map_err(|error| cannot_write(&folder.join(&view.name), &error))?;
        for slot in 0..trial.slots.len() {
            stop.check("interrupted")?;
            let name = openpose::file_name(&view.name, trial.frame(slot));
            put(&room, &name, &openpose::frame(trials, slot, view))?;
            console.advance(1);
        }
    }
    Ok(())
}

/// Writes the video of a view, with the pose drawn on it.
pub(super) fn video(
    trials: &[Trial],
    pictures: &mut Pictures,
    path: &Path,
    stop: &Stop,
    console: &dyn Console,
) -> Result<Written, Failure> {
    let beside = files::beside(path);
    let drawn = draw_all(trials, pictures, &beside, stop, console);
    let placed = drawn.and_then(|n_without| {
        fs::rename(&beside, path).map_err(|error| cannot_write(path, &error))?;
        Ok(n_without)
    });
    if placed.is_err() {
        // The first error is reported, so an error here is ignored.
        drop(fs::remove_file(&beside));
    }
    let n_without = placed?;
    let mut notes = vec![format!(
        "the ellipses show {} standard deviations of the joints, as the view sees them",
        annotate::DEVIATIONS
    )];
    if n_without > 0 {
        notes.push(format!("{n_without} frames have no picture, and are black"));
    }
    Ok(Written {
        format: "mp4",
        path: path.to_owned(),
        about: [
            "pixels of the pictures",
            "x right, y down",
            "a limb with a missing end is not drawn; frames without a result are labelled",
            "ellipses",
        ],
        notes,
    })
}

/// Draws all frames. Returns the number of frames without a picture.
fn draw_all(
    trials: &[Trial],
    pictures: &mut Pictures,
    path: &Path,
    stop: &Stop,
    console: &dyn Console,
) -> Result<usize, Failure> {
    let [width, height] = pictures.view.size.map(|size| size as usize);
    let size = Size::new(width, height);
    let trial = &trials[0];
    let rate_hz = trial.rate_hz.unwrap_or_default();
    let failed = |error: FootageError| Failure::new(ExitKind::Input, error);
    let mut video = VideoWriter::create(path, size, rate_hz, "ffmpeg".as_ref()).map_err(failed)?;
    console.begin("mp4", &pictures.view.name);
    console.set(0, trial.slots.len());
    let mut n_without = 0;
    for slot in 0..trial.slots.len() {
        stop.check("interrupted")?;
        let picture = pictures.at(trial.frame(slot))?;
        n_without += usize::from(picture.is_none());
        let mut canvas = picture.map_or_else(
            || Canvas::new(size, [0; 3]),
            |rgb| Canvas::from_rgb(size, rgb),
        );
        annotate::draw(&mut canvas, trials, slot, &pictures.view);
        video.add(canvas.rgb()).map_err(failed)?;
        console.advance(1);
    }
    video.finish().map_err(failed)?;
    Ok(n_without)
}
