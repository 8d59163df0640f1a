//! Deployments with synthetic cameras around a synthetic person.

use std::path::{Path, PathBuf};

use failure::{ExitKind, Failure, OrFail as _};
use geometry::files::Format as RigFormat;
use geometry::{Camera, Intrinsics, Rig};
use scene::{Action, Address, RigChoice, Scene, Settings};

use super::Point;

/// The default number of synthetic cameras.
pub(crate) const N_CAMERAS: usize = 4;
/// Radius of the ring of cameras, in metres.
const RADIUS: f64 = 4.2;
/// Height of the cameras, in metres.
const HEIGHT: f64 = 1.5;
/// Scale of the images relative to the ring's default: 320x240 pixels, so that two cores can render and process four views.
const SCALE: f64 = 0.5;
/// Interval between frames with overlays, in frames.
const OVERLAY_EVERY: u64 = 4;

/// Method that finds the person.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Finder {
    /// The default method: the shipped network.
    Default,
    /// The filters, which search near the last pose.
    TrackingFilters,
}

impl Finder {
    /// Returns the line for this method at the top of the deployment file.
    fn method(self) -> &'static str {
        match self {
            Self::Default => "",
            Self::TrackingFilters => "method = \"paper\"\n",
        }
    }

    /// Returns the section for this method in the deployment file.
    fn section(self) -> &'static str {
        match self {
            Self::Default => "",
            Self::TrackingFilters => {
                "[paper]\nsearch = \"tracked\"       # near the last pose, and everywhere now and then\nviews = \"all\"\n\n"
            }
        }
    }
}

/// Settings of a synthetic deployment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SyntheticSetup<'a> {
    /// Number of the person, which determines body shape and clothes.
    pub subject: u64,
    /// The action of the person.
    pub action: Action,
    /// Number of further people, who cross the room.
    pub passers: u64,
    /// Seed of the motion, the room and the lighting.
    pub seed: u64,
    /// Frames per second.
    pub rate_hz: f64,
    /// Frames per camera.
    pub n_frames: u64,
    /// Number of cameras, evenly spaced on a ring.
    pub n_cameras: usize,
    /// Time that a stage waits for a late view, in milliseconds.
    pub deadline_ms: u64,
    /// Method that finds the person.
    pub finder: Finder,
    /// The name of the deployment.
    pub name: &'a str,
    /// The command that writes the deployment, for a comment in its file.
    pub command: &'a str,
}

/// A deployment with synthetic cameras.
#[derive(Debug)]
pub(crate) struct SyntheticDeployment {
    /// Absolute folder for all files of the deployment.
    pub folder: PathBuf,
    /// The cameras.
    pub rig: Rig,
    /// The settings of the rendered scene.
    pub settings: Settings,
}

impl SyntheticDeployment {
    /// Places the cameras, and creates the folder.
    ///
    /// * `folder`: an absolute path.
    pub(crate) fn new(setup: &SyntheticSetup<'_>, folder: PathBuf) -> Result<Self, Failure> {
        inputs::make_folder(&folder)?;
        let ring = RigChoice::Ring {
            n: setup.n_cameras,
            radius: RADIUS,
            height: HEIGHT,
        };
        let ring = ring.rig().or_fail(ExitKind::Run)?;
        let cameras = ring.cameras().iter().map(scaled).collect();
        Ok(Self {
            rig: Rig::new(cameras, ring.up_in_world(), ring.source()).or_fail(ExitKind::Run)?,
            settings: Settings {
                rig: RigChoice::File(folder.join("rig.toml")),
                subject: setup.subject,
                action: setup.action,
                passers: setup.passers,
                seed: setup.seed,
                rate_hz: setup.rate_hz,
                ..Settings::default()
            },
            folder,
        })
    }

    /// Writes the rig and the deployment, and returns the deployment file.
    pub(crate) fn write(&self, setup: &SyntheticSetup<'_>) -> Result<PathBuf, Failure> {
        let rig = self.folder.join("rig.toml");
        geometry::files::write(&rig, RigFormat::Own, &self.rig).or_fail(ExitKind::Input)?;
        let file = self.folder.join("deployment.toml");
        let text = self.deployment(setup);
        files::replace(&file, text.as_bytes()).map_err(|error| failure::in_file(&file, &error))?;
        Ok(file)
    }

    fn deployment(&self, setup: &SyntheticSetup<'_>) -> String {
        let quoted = |text: &str| toml::Value::from(text).to_string();
        let settings = Settings {
            rig: RigChoice::File(PathBuf::from("rig.toml")),
            ..self.settings.clone()
        };
        let camera = |camera: &Camera| {
            let address = Address {
                settings: settings.clone(),
                camera: camera.name.clone(),
                n_frames: setup.n_frames,
            };
            let (name, source) = (quoted(&camera.name), quoted(&address.to_string()));
            format!("\n[[camera]]\nname = {name}\nsource = {source}\n")
        };
        let cameras: Vec<String> = self.rig.cameras().iter().map(camera).collect();
        format!(
            "# Written by `parallax {}`: subject {}, {}, before cameras that make their pictures while they run.\n\
             # The same without a killed camera and without the truth: parallax run deployment.toml\n\n\
             name = {}\nrig = \"rig.toml\"\n{}output = \"run\"\n{}\n\
             [capture]\nmode = \"realtime\"       # keep up with the clock; what there is no time for is dropped and counted\n\
             frame_rate_hz = {:?}\n\n\
             {}[results]\noverlay_every = {OVERLAY_EVERY}\n\n\
             [supervise]\ndeadline_ms = {}        # how long a stage waits for a view that is late\n\
             hang_limit_s = 60        # a machine that is busy is slow, not hung\n",
            setup.command,
            self.settings.subject,
            self.settings.action.name(),
            quoted(setup.name),
            setup.finder.method(),
            cameras.concat(),
            self.settings.rate_hz,
            setup.finder.section(),
            setup.deadline_ms,
        )
    }

    /// Returns the true positions of the joints of `skeleton::PARSE14` of each person in the given frames, in world coordinates, in metres.
    pub(crate) fn truth(
        &self,
        frames: impl Iterator<Item = u64>,
    ) -> Result<Vec<Vec<Vec<Point>>>, Failure> {
        let scene = Scene::new(&self.settings).or_fail(ExitKind::Run)?;
        let people = |frame: u64| {
            let seconds = scene.seconds(frame);
            let others = scene.other_joints(seconds).into_iter();
            let all = std::iter::once(scene.joints(seconds)).chain(others);
            all.map(|joints| joints.to_vec()).collect()
        };
        Ok(frames.map(people).collect())
    }
}

/// Returns the camera with images scaled by `SCALE`.
fn scaled(camera: &Camera) -> Camera {
    let intrinsics = camera.intrinsics;
    // In both images, the centre of the top-left pixel is at 0.
    let centre = |at: f64| SCALE * (at + 0.5) - 0.5;
    Camera {
        intrinsics: Intrinsics {
            fx: SCALE * intrinsics.fx,
            fy: SCALE * intrinsics.fy,
            cx: centre(intrinsics.cx),
            cy: centre(intrinsics.cy),
            size: intrinsics.size.map(|side| (SCALE * f64::from(side)) as u32),
            lens: intrinsics.lens,
        },
        ..camera.clone()
    }
}

/// Returns the absolute path of a file or folder.
pub(crate) fn absolute(folder: &Path) -> Result<PathBuf, Failure> {
    std::path::absolute(folder).or_fail(ExitKind::Usage)
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    #[test]
    fn a_scaled_camera_has_the_same_view() {
        let ring = RigChoice::parse("ring:4").unwrap().rig().unwrap();
        for camera in ring.cameras() {
            let half = scaled(camera);
            assert_eq!(half.intrinsics.size, [320, 240]);
            for point in [Point3::new(0.0, 0.0, 0.9), Point3::new(0.5, -0.3, 1.7)] {
                let whole = camera.project(&point).unwrap();
                let seen = half.project(&point).unwrap();
                // A pixel of the scaled image covers two by two pixels.
                assert!((2.0 * seen.x + 0.5 - whole.x).abs() < 1e-9);
                assert!((2.0 * seen.y + 0.5 - whole.y).abs() < 1e-9);
            }
        }
    }
}
