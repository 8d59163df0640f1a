//! Pictures of synthetic people.

use std::path::PathBuf;
use std::sync::Arc;

use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use kernels::Rgb8View;
use rayon::prelude::*;
use scene::truth::N_JOINTS;
use scene::{Action, Flaws, N_EXTRAS, RigChoice, Scene, Settings, View};

/// Settings of the scenes.
#[derive(Debug, Clone)]
pub struct Scenes {
    /// Number of scenes; each gives several pictures from every camera.
    pub n: u32,
    /// First and last number of the subjects in the scenes.
    pub subjects: [u64; 2],
    /// Frames of every camera in a scene, some seconds apart.
    pub frames: u16,
    /// Largest number of other people who stand around the subject. Also the largest number of people who walk past.
    pub company: u64,
    /// Folder of photographs without people, which are the background of every third scene in place of a rendered room.
    pub backdrop: Option<PathBuf>,
    /// Random seed.
    pub seed: u64,
}

impl Scenes {
    /// Returns the random number generator of a scene.
    fn rng(&self, nth: u32) -> fastrand::Rng {
        fastrand::Rng::with_seed(self.seed.wrapping_mul(1_000_003) + u64::from(nth))
    }
}

/// One picture of a scene.
pub(crate) struct Shown<'a> {
    /// Name of the subject.
    pub(crate) group: &'a str,
    /// Name that describes the content of the picture.
    pub(crate) source: String,
    /// The picture.
    pub(crate) picture: Rgb8View<'a>,
    /// Joints of `skeleton::PARSE14` in the picture, in pixels; not finite where they are not visible.
    pub(crate) joints: Vec<[f64; 2]>,
    /// The camera.
    pub(crate) camera: &'a geometry::Camera,
    /// Every person in the picture. The subject comes first.
    pub(crate) everybody: Vec<Body>,
}

impl Shown<'_> {
    /// Returns the number of the subject.
    pub(crate) fn subject(&self) -> Option<u64> {
        self.group.rsplit(' ').next()?.parse().ok()
    }
}

/// A person in a picture.
pub(crate) struct Body {
    /// Joints of `skeleton::PARSE14` in world coordinates, in metres.
    pub(crate) in_world: [[f64; 3]; N_JOINTS],
    /// The joints in the picture, in pixels; not finite behind the camera.
    pub(crate) joints: [[f64; 2]; N_JOINTS],
    /// Nose, heels and big toes in the picture, in the order of [`Scene::extras`], in pixels; not finite behind the camera.
    pub(crate) extras: [[f64; 2]; N_EXTRAS],
    /// Number of pixels that show the person.
    pub(crate) seen_px: f64,
}

/// Calls a function on every picture of all scenes, and returns the results in the order of the scenes, whatever the number of threads.
///
/// * `make`: returns the result of one picture; `None` if the picture cannot be used.
/// * `stop`: checked before every picture.
/// * `watch`: called after every camera, with its number of pictures, and the number of unusable pictures among them.
pub(crate) fn of_pictures<T: Send>(
    scenes: &Scenes,
    stop: &Stop,
    make: impl Fn(&Shown<'_>) -> Option<T> + Sync,
    watch: impl Fn(usize, usize) + Sync,
) -> Result<Vec<T>, Failure> {
    let made: Result<Vec<_>, Failure> = (0..scenes.n)
        .into_par_iter()
        .map(|nth| of_scene(scenes, &settings(scenes, nth), (stop, &make), &watch))
        .collect();
    Ok(made?.into_iter().flatten().collect())
}

/// Calls a function on every picture of all scenes, as [`of_pictures`] does, and shows the progress.
pub(crate) fn of_pictures_shown<T: Send>(
    scenes: &Scenes,
    (stop, console): (&Stop, &dyn Console),
    make: impl Fn(&Shown<'_>) -> Option<T> + Sync,
) -> Result<Vec<T>, Failure> {
    if scenes.n == 0 {
        return Ok(Vec::new());
    }
    console.begin("scenes", "pictures");
    let found = of_pictures(scenes, stop, make, |n, _| console.advance(n));
    console.finish();
    found
}

/// Returns the settings of a scene by its number. Actions and subjects alternate; everything else is random.
fn settings(scenes: &Scenes, nth: u32) -> Settings {
    let mut rng = scenes.rng(nth);
    let [from, to] = scenes.subjects;
    let mut between = |low: f64, high: f64| low + (high - low) * rng.f64();
    let rig = match nth % 4 {
        0 => RigChoice::HumanEva,
        1 => RigChoice::Umpm,
        _ => RigChoice::Ring {
            n: 3,
            radius: between(3.4, 5.5),
            height: between(0.8, 2.4),
        },
    };
    // About half of the cameras have poor image quality.
    let is_bad = between(0.0, 1.0) < 0.5;
    let flaws = Flaws {
        noise: between(1.0, 12.0),
        blur_px: between(0.3, 1.5),
        exposure_stops: between(-1.2, 0.8),
        ..Flaws::default()
    };
    let is_photo = between(0.0, 1.0) < 1.0 / 3.0;
    let mut company = scenes.rng(nth);
    let mut others = || company.u64(0..=scenes.company.min(Settings::MOST_OTHERS));
    Settings {
        rig,
        subject: from + rng.u64(0..=to - from),
        others: others(),
        passers: others(),
        action: Action::ALL[rng.usize(0..Action::ALL.len())],
        seed: rng.u64(1..1 << 32),
        // One frame every three quarters of a second, so that no two frames show the same pose.
        rate_hz: 4.0 / 3.0,
        backdrop: scenes.backdrop.clone().filter(|_| is_photo),
        flaws: if is_bad { flaws } else { Flaws::default() },
        skews_ms: Vec::new(),
    }
}

fn of_scene<T>(
    scenes: &Scenes,
    settings: &Settings,
    (stop, make): (&Stop, &impl Fn(&Shown<'_>) -> Option<T>),
    watch: &impl Fn(usize, usize),
) -> Result<Vec<T>, Failure> {
    let scene = Arc::new(Scene::new(settings).or_fail(ExitKind::Input)?);
    let group = format!("subject {}", settings.subject);
    let mut all = Vec::new();
    for (nth, camera) in scene.rig().cameras().iter().enumerate() {
        let mut view = View::new(&scene, nth).or_fail(ExitKind::Input)?;
        let size = view.size();
        let mut rgb = vec![0; size.rgb_bytes()];
        let before = all.len();
        for frame in 0..u64::from(scenes.frames) {
            let truth = view.picture(frame, &mut rgb);
            let joints = truth.pixels.map(|pixel| pixel.unwrap_or([f64::NAN; 2]));
            let shown = Shown {
                group: &group,
                source: format!(
                    "{group} {} seed {} camera {} frame {frame}",
                    settings.action.name(),
                    settings.seed,
                    truth.camera
                ),
                picture: Rgb8View::new(size.width, size.height, &rgb).or_fail(ExitKind::Run)?,
                joints: joints.to_vec(),
                camera,
                everybody: everybody(&scene, camera, (truth.seconds, &view)),
            };
            stop.check("stopped")?;
            all.extend(make(&shown));
        }
        let n = usize::from(scenes.frames);
        watch(n, n - (all.len() - before));
    }
    Ok(all)
}

/// Returns all people in the last picture of a view, the subject first.
fn everybody(scene: &Scene, camera: &geometry::Camera, (seconds, view): (f64, &View)) -> Vec<Body> {
    let in_picture = |at: &[f64; 3]| {
        let pixel = camera.project(&(*at).into());
        pixel.map_or([f64::NAN; 2], Into::into)
    };
    let joints = core::iter::once(scene.joints(seconds)).chain(scene.other_joints(seconds));
    let extras = core::iter::once(scene.extras(seconds)).chain(scene.other_extras(seconds));
    let all = joints.zip(extras).zip(view.seen_px());
    let bodies = all.map(|((in_world, extras), seen_px)| Body {
        in_world,
        joints: in_world.each_ref().map(in_picture),
        extras: extras.each_ref().map(in_picture),
        seen_px,
    });
    bodies.collect()
}
