//! Folder of a run: lines of results, and pictures with the poses drawn in them.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead as _, BufReader, Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use failure::{ExitKind, Failure};
use launch::Resolved;
use runfiles::{FrameLine, Line as _, Missing, PersonLine, PlacedJoint, ViewLine};
use serde::Deserialize;
use skeleton::PARSE14;

use super::{Finished, Frame, Kept};
use crate::moment::{Moment, Other, Seen, in_view, in_world, spread};
use crate::picture;
use crate::scene::Scene;

/// Longest line that is read, in bytes; enough for hundreds of views.
const LONGEST_LINE: u64 = 4 << 20;
/// Largest number of pixels in a picture that is read.
const MOST_PIXELS: u64 = 64 << 20;

/// Folder of a run.
#[derive(Debug)]
pub(crate) struct Folder {
    poses: Mutex<File>,
    /// For each frame, the position of its first line about the views, and the number of these lines.
    views: BTreeMap<u64, (u64, usize)>,
    view_lines: Option<Mutex<File>>,
    /// For each view, the folder of its pictures and the ascending frame numbers.
    pictures: Vec<(PathBuf, Vec<u64>)>,
}

/// The part of a line about a frame that is needed to find the frame again.
#[derive(Deserialize)]
struct Head {
    frame: u64,
    #[serde(default)]
    status: String,
}

impl Folder {
    /// Opens the folder.
    pub(crate) fn open(path: &Path) -> Result<Finished, Failure> {
        let mut notes = Vec::new();
        let poses = open_lines(path, FrameLine::FILE, &mut notes)?.ok_or_else(|| {
            let text = format!("{} has no {}", path.display(), FrameLine::FILE);
            let failure = Failure::new(ExitKind::Input, text);
            failure.with_hint("name the output folder of a run (`output` in its deployment)")
        })?;
        let mut frames = Vec::new();
        let add = |head: Head, place| {
            frames.push(Frame {
                number: head.frame,
                has_pose: Some(head.status == FrameLine::OK),
                place,
            });
        };
        let n_bad = each_line(&poses, add)?;
        if n_bad > 0 {
            notes.push(format!(
                "{n_bad} lines of {} cannot be read",
                FrameLine::FILE
            ));
        }
        if frames.is_empty() {
            let text = format!("{} in {} has no frames", FrameLine::FILE, path.display());
            return Err(Failure::new(ExitKind::Input, text));
        }
        frames.sort_by_key(|frame| frame.number);
        let view_lines = open_lines(path, ViewLine::FILE, &mut notes)?;
        let mut views: BTreeMap<u64, (u64, usize)> = BTreeMap::new();
        if let Some(file) = &view_lines {
            each_line(file, |head, place| {
                views.entry(head.frame).or_insert((place, 0)).1 += 1;
            })?;
        }
        let scene = scene(path, &mut notes);
        let folders = scene.views.iter().map(|view| pictures(path, &view.name));
        let folder = Self {
            pictures: folders.collect(),
            poses: Mutex::new(poses),
            views,
            view_lines: view_lines.map(Mutex::new),
        };
        Ok(Finished {
            name: path.display().to_string(),
            scene: Arc::new(scene),
            frames,
            notes,
            kept: Kept::Folder(folder),
        })
    }

    /// Returns a frame.
    pub(crate) fn moment(&self, scene: &Scene, place: u64) -> Result<Moment, Failure> {
        let text = &line_at(&self.poses, place, 1)?;
        let line = runfiles::lines::<FrameLine>(text).next();
        let line = line.ok_or("the line is empty").map_err(unreadable)?;
        let line = line.map_err(unreadable)?;
        let mut moment = of_line(scene, &line);
        if let Some((file, (place, n))) = self.view_lines.as_ref().zip(self.views.get(&line.frame))
        {
            let text = line_at(file, *place, *n)?;
            for it in runfiles::lines::<ViewLine>(&text).filter_map(Result::ok) {
                see(scene, &mut moment, &it);
            }
        }
        Ok(moment)
    }

    /// Returns the picture of the frame, or the last picture before it.
    pub(crate) fn picture(&self, frame: u64, view: usize) -> Option<Vec<u8>> {
        let (folder, frames) = self.pictures.get(view)?;
        let before = frames.partition_point(|number| *number <= frame);
        let frame = *frames.get(before.checked_sub(1)?)?;
        let file = folder.join(format!("{frame:06}.png"));
        let (width, height) = image::image_dimensions(&file).ok()?;
        if u64::from(width) * u64::from(height) > MOST_PIXELS {
            return None;
        }
        let read = image::open(&file).ok()?.into_rgb8();
        let size = [width as usize, height as usize];
        picture::message(view, frame, size, read.as_raw(), true)
    }
}

fn unreadable(why: impl Into<Box<dyn core::error::Error + Send + Sync>>) -> Failure {
    Failure::new(ExitKind::Input, why)
}

/// Opens a file of lines. If a run was cut short, the file has another name.
fn open_lines(folder: &Path, name: &str, notes: &mut Vec<String>) -> Result<Option<File>, Failure> {
    let part = format!("{name}.part");
    for name in [name, &part] {
        let path = folder.join(name);
        match files::open(&path) {
            Ok(file) => {
                if name == part {
                    notes.push(format!(
                        "{name} is not complete: the run was cut short or has not ended"
                    ));
                }
                return Ok(Some(file));
            }
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
            Err(error) => return Err(failure::in_file(&path, &error)),
        }
    }
    Ok(None)
}

/// Calls `each` for every valid line with its position, and returns the number of invalid lines. A last line without an end is ignored.
fn each_line(file: &File, mut each: impl FnMut(Head, u64)) -> Result<u64, Failure> {
    let mut reader = BufReader::new(file);
    let (mut place, mut n_bad, mut line) = (0, 0, Vec::new());
    loop {
        line.clear();
        let n = (&mut reader).take(LONGEST_LINE).read_until(b'\n', &mut line);
        let n = n.map_err(unreadable)? as u64;
        if n == 0 || line.last() != Some(&b'\n') {
            return Ok(n_bad);
        }
        match serde_json::from_slice::<Head>(&line) {
            Ok(head) => each(head, place),
            Err(_) => n_bad += 1,
        }
        place += n;
    }
}

/// Reads `n` lines from a position.
fn line_at(file: &Mutex<File>, place: u64, n: usize) -> Result<String, Failure> {
    let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
    file.seek(SeekFrom::Start(place)).map_err(unreadable)?;
    let mut reader = BufReader::new(&mut *file).take(LONGEST_LINE);
    let mut text = String::new();
    for _ in 0..n {
        reader.read_line(&mut text).map_err(unreadable)?;
    }
    Ok(text)
}

/// Returns the cameras and joints, read from the settings of a run, if these can be read.
fn scene(folder: &Path, notes: &mut Vec<String>) -> Scene {
    let file = folder.join("deployment.json");
    let text = failure::read_text(&file);
    let read = text.and_then(|text| {
        let read = serde_json::from_str::<Resolved>(&text);
        read.map_err(|error| failure::in_file(&file, &error))
    });
    match read {
        Ok(resolved) => {
            let mut scene = Scene::of_finished(&resolved);
            // Coordinates in the files of a run are pixels of the footage.
            for (view, footage) in scene.views.iter_mut().zip(&resolved.footage) {
                view.size = footage.size;
                if let Some(camera) = &view.camera
                    && camera.intrinsics.size != footage.size
                {
                    view.camera = of_footage(&resolved, &view.name).or_else(|| view.camera.take());
                }
            }
            notes.extend(scene.problem.clone());
            scene
        }
        Err(why) => {
            notes.push(format!("the cameras are not shown: {why}"));
            Scene {
                name: String::new(),
                views: Vec::new(),
                joints: &PARSE14,
                up: [0.0, 0.0, 1.0],
                frame_rate_hz: None,
                tells_facing: false,
                problem: None,
            }
        }
    }
}

/// Returns the calibrated camera of the footage.
fn of_footage(resolved: &Resolved, name: &str) -> Option<geometry::Camera> {
    let rig = inputs::rig_of(&resolved.deployment).ok()?;
    rig.camera(name).cloned()
}

/// Returns the folder of a camera's pictures, and the numbers of their frames.
fn pictures(folder: &Path, camera: &str) -> (PathBuf, Vec<u64>) {
    let folder = folder.join("overlays").join(camera);
    let is_plain = !camera.starts_with('.') && !camera.contains('/');
    let entries = std::fs::read_dir(&folder).ok().filter(|_| is_plain);
    let names = entries.into_iter().flatten().filter_map(Result::ok);
    let number = |entry: std::fs::DirEntry| {
        let name = entry.file_name();
        name.to_str()?.strip_suffix(".png")?.parse().ok()
    };
    let mut frames: Vec<u64> = names.filter_map(number).collect();
    frames.sort_unstable();
    (folder, frames)
}

/// Returns the frame of a line with the followed person, without the poses in its views.
fn of_line(scene: &Scene, line: &FrameLine) -> Moment {
    let person = line.followed();
    let placed = |person: Option<&PersonLine>| -> Vec<Option<PlacedJoint>> {
        let joints = scene.joints.joints.iter();
        let joint = |name: &str| person?.joints.get(name)?.placed().cloned();
        joints.map(|named| joint(named.name)).collect()
    };
    let places = |placed: &[Option<PlacedJoint>]| {
        let places = placed.iter();
        places
            .map(|place| place.as_ref().map(|joint| in_world(joint.position_m)))
            .collect()
    };
    let others = line.people.iter().skip(1).map(|other| Other {
        id: other.id,
        joints: places(&placed(Some(other))),
        stature: other.stature_m,
        views: Vec::new(),
    });
    let followed = placed(person);
    let views = scene.views.iter().map(|view| Seen {
        why: line.views_missing.get(&view.name).map(|why: &Missing| why.text().to_owned()),
        ..Seen::default()
    });
    let why = line.reason.clone().unwrap_or_else(|| line.status.clone());
    Moment {
        kind: Moment::KIND,
        at: None,
        frame: line.frame,
        seconds: line.time_s,
        why: (!line.has_pose()).then_some(why),
        id: person.map(|person| person.id),
        others: others.collect(),
        joints: places(&followed),
        spread: followed
            .iter()
            .map(|followed| followed.as_ref().and_then(|joint| spread(joint.covariance_m2)))
            .collect(),
        views: views.collect(),
        people: line.seen,
        stature: person.and_then(|person| person.stature_m),
        latency_ms: None,
    }
}

/// Adds the pose in a view.
fn see(scene: &Scene, moment: &mut Moment, line: &ViewLine) {
    let Some(view) = scene.views.iter().position(|view| view.name == line.view) else {
        return;
    };
    let parts = line.fused.iter().flat_map(|pose| &pose.parts);
    let centres = parts.map(|part| [part.x, part.y].map(|side| side.unwrap_or(f64::NAN)));
    let joints = scene.joints_of(&centres.collect::<Vec<_>>());
    if let Some(seen) = moment.views.get_mut(view) {
        seen.joints = joints.map(|joint| joint.into_iter().map(in_view).collect());
        seen.behind = line.facing == Some(runfiles::Facing::Behind);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::moment::tests::scene;

    #[test]
    fn the_followed_person_is_shown_first() {
        let person = |id: u64| {
            format!(
                r#"{{"facing_margin":null,"id":{id},"joints":{{"head":{{"covariance_m2":[1,0,0,1,0,1],"position_m":[{id},2,3],"reprojection_px":1,"views":["a"]}}}},"pairs":1,"stature_m":1.7,"status":"ok","views_used":["a"]}}"#
            )
        };
        let text = format!(
            r#"{{"frame":4,"people":[{},{}],"seen":2,"status":"ok","time_s":null,"views_missing":{{}},"views_present":["a"]}}"#,
            person(7),
            person(2)
        );
        let line = runfiles::lines::<FrameLine>(&text).next().unwrap().unwrap();
        let moment = of_line(&scene(), &line);
        assert_eq!(moment.joints[13], Some([7.0, 2.0, 3.0]));
        assert_eq!(moment.joints.iter().flatten().count(), 1);
        assert_eq!((moment.people, moment.stature), (Some(2), Some(1.7)));
        assert_eq!((moment.id, moment.others[0].id), (Some(7), 2));
        assert_eq!(moment.others[0].joints[13], Some([2.0, 2.0, 3.0]));
    }
}
