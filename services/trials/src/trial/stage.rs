//! Cameras that do not exist around a person who does not either, and their deployment.

use std::path::{Path, PathBuf};

use geometry::files::Format as RigFormat;
use geometry::{Camera, Intrinsics, Rig};
use launch::inputs;
use runtime::{ExitKind, Failure, OrFail as _};
use scene::{Action, Address, RigChoice, Scene, Settings};

use super::Point;

/// Cameras of a demo, evenly around the stage.
pub(crate) const N_CAMERAS: usize = 4;
/// How far from its middle, and how high, metres.
const RADIUS: f64 = 4.2;
const HEIGHT: f64 = 1.5;
/// Pixels of a picture per pixel of a ring's: 320x240, so that two cores can make and solve four of them.
const SCALE: f64 = 0.5;
/// Every so manieth frame is drawn.
const OVERLAY_EVERY: u64 = 4;

/// What is played, and under which name.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cast<'a> {
    /// Number of the person.
    pub subject: u64,
    /// What the person does.
    pub action: Action,
    /// Seed of the performance, the room and the lamps.
    pub seed: u64,
    /// Frames a second.
    pub rate_hz: f64,
    /// Frames of every camera.
    pub n_frames: u64,
    /// Cameras, evenly around the stage.
    pub n_cameras: usize,
    /// How long a stage waits for a view that is late, milliseconds.
    pub deadline_ms: u64,
    /// Name of the deployment.
    pub name: &'a str,
    /// The command that writes it.
    pub command: &'a str,
}

/// Who is seen by whom.
#[derive(Debug)]
pub(crate) struct Stage {
    /// Of everything that is written, absolute.
    pub folder: PathBuf,
    /// The cameras.
    pub rig: Rig,
    /// Of their pictures.
    pub settings: Settings,
}

impl Stage {
    /// Makes the cameras, and the folder.
    ///
    /// * `folder`: absolute.
    pub(crate) fn new(cast: &Cast<'_>, folder: PathBuf) -> Result<Self, Failure> {
        inputs::make_folder(&folder)?;
        let ring = RigChoice::Ring {
            n: cast.n_cameras,
            radius: RADIUS,
            height: HEIGHT,
        };
        let ring = ring.rig().or_fail(ExitKind::Run)?;
        let cameras = ring.cameras().iter().map(smaller).collect();
        Ok(Self {
            rig: Rig::new(cameras, ring.up_in_world(), ring.source()).or_fail(ExitKind::Run)?,
            settings: Settings {
                rig: RigChoice::File(folder.join("rig.toml")),
                subject: cast.subject,
                action: cast.action,
                seed: cast.seed,
                rate_hz: cast.rate_hz,
                ..Settings::default()
            },
            folder,
        })
    }

    /// Writes the rig and the deployment; its file.
    pub(crate) fn write(&self, cast: &Cast<'_>) -> Result<PathBuf, Failure> {
        let rig = self.folder.join("rig.toml");
        geometry::files::write(&rig, RigFormat::Own, &self.rig).or_fail(ExitKind::Input)?;
        let file = self.folder.join("deployment.toml");
        let text = self.deployment(cast);
        std::fs::write(&file, text).map_err(|error| runtime::in_file(&file, &error))?;
        Ok(file)
    }

    fn deployment(&self, cast: &Cast<'_>) -> String {
        let quoted = |it: &str| toml::Value::from(it).to_string();
        let settings = Settings {
            rig: RigChoice::File(PathBuf::from("rig.toml")),
            ..self.settings.clone()
        };
        let camera = |it: &Camera| {
            let address = Address {
                settings: settings.clone(),
                camera: it.name.clone(),
                n_frames: cast.n_frames,
            };
            let (name, source) = (quoted(&it.name), quoted(&address.to_string()));
            format!("\n[[camera]]\nname = {name}\nsource = {source}\n")
        };
        let cameras: Vec<String> = self.rig.cameras().iter().map(camera).collect();
        format!(
            "# Written by `parallax {}`: subject {}, {}, before cameras that make their pictures while they run.\n\
             # The same without a killed camera and without the truth: parallax run deployment.toml\n\n\
             name = {}\nrig = \"rig.toml\"\noutput = \"run\"\n{}\n\
             [capture]\nmode = \"realtime\"       # keep up with the clock; what there is no time for is dropped and counted\n\
             pace = \"realtime\"\nframe_rate_hz = {:?}\n\n\
             [pose]\nsearch = \"tracked\"       # near the last pose, and everywhere now and then\n\n\
             [results]\noverlay_every = {OVERLAY_EVERY}\n\n\
             [supervise]\ndeadline_ms = {}        # how long a stage waits for a view that is late\n\
             hang_limit_s = 60        # a machine that is busy is slow, not hung\n",
            cast.command,
            self.settings.subject,
            self.settings.action.name(),
            quoted(cast.name),
            cameras.concat(),
            self.settings.rate_hz,
            cast.deadline_ms,
        )
    }

    /// Where the joints of `skeleton::PARSE14` are in some frames, metres in the world.
    pub(crate) fn truth(
        &self,
        frames: impl Iterator<Item = u64>,
    ) -> Result<Vec<Vec<Point>>, Failure> {
        let scene = Scene::new(&self.settings).or_fail(ExitKind::Run)?;
        let joints = frames.map(|it| scene.joints(scene.seconds(it)).to_vec());
        Ok(joints.collect())
    }
}

/// The camera with pictures of fewer pixels.
fn smaller(camera: &Camera) -> Camera {
    let it = camera.intrinsics;
    // The centre of the top-left pixel is at 0.
    let centre = |at: f64| SCALE * (at + 0.5) - 0.5;
    Camera {
        intrinsics: Intrinsics {
            fx: SCALE * it.fx,
            fy: SCALE * it.fy,
            cx: centre(it.cx),
            cy: centre(it.cy),
            size: it.size.map(|side| (SCALE * f64::from(side)) as u32),
            lens: it.lens,
        },
        ..camera.clone()
    }
}

/// An absolute path, for processes that work in any folder.
pub(crate) fn absolute(folder: &Path) -> Result<PathBuf, Failure> {
    std::path::absolute(folder).or_fail(ExitKind::Usage)
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    #[test]
    fn a_smaller_picture_shows_the_same_in_half_the_pixels() {
        let ring = RigChoice::parse("ring:4").unwrap().rig().unwrap();
        for camera in ring.cameras() {
            let half = smaller(camera);
            assert_eq!(half.intrinsics.size, [320, 240]);
            for point in [Point3::new(0.0, 0.0, 0.9), Point3::new(0.5, -0.3, 1.7)] {
                let whole = camera.project(&point).unwrap();
                let seen = half.project(&point).unwrap();
                // A pixel of the half picture covers two by two.
                assert!((2.0 * seen.x + 0.5 - whole.x).abs() < 1e-9);
                assert!((2.0 * seen.y + 0.5 - whole.y).abs() < 1e-9);
            }
        }
    }
}
