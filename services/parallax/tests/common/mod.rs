//! A planted deployment in a folder of its own, run by the one executable as a user would.
#![allow(dead_code, reason = "every test file uses a part of it")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

pub(crate) mod planted;
pub(crate) mod same_bits;
pub(crate) mod started;

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use geometry::Rig;
use geometry::files::Format;
use runtime::Namespace;
use tempfile::TempDir;

pub(crate) use started::{Ended, Started};

/// No overlays and no turning, so that frames are the pictures as they were planted.
pub(crate) const PLAIN: &str =
    "[capture]\nupright = false\n[results]\noverlay_every = 0\n[fuse]\nworkers = 2\n";

/// The same at a pace that leaves time to interfere.
pub(crate) const PACED: &str = "[capture]\nupright = false\npace = \"realtime\"\n\
     frame_rate_hz = 20\n[results]\noverlay_every = 0\n[fuse]\nworkers = 2\n";

/// Footage, rig, model and deployment file in a folder.
pub(crate) struct Case {
    folder: TempDir,
    pub(crate) name: String,
}

impl Case {
    /// A planted scene.
    ///
    /// * `name`: of the test; the deployment's is made of it, and is another every time.
    /// * `n_frames`: of every view.
    /// * `more`: what else the deployment file says.
    pub(crate) fn new(name: &str, n_frames: &[usize], more: &str) -> Self {
        Self::seen_by(&planted::rig(n_frames.len()), name, n_frames, more)
    }

    /// The same, seen by other cameras, one for every number of frames.
    pub(crate) fn seen_by(rig: &Rig, name: &str, n_frames: &[usize], more: &str) -> Self {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let nth = COUNT.fetch_add(1, Ordering::Relaxed);
        let case = Self {
            folder: tempfile::Builder::new()
                .prefix("parallax-")
                .tempdir()
                .unwrap(),
            name: format!("{name}-{}-{nth}", std::process::id()),
        };
        geometry::files::write(&case.path("rig.toml"), Format::Own, rig).unwrap();
        fmp::files::write(&case.path("model.plx"), &planted::model()).unwrap();
        let mut text = format!(
            "name = \"{}\"\nrig = \"rig.toml\"\nmodel = \"model.plx\"\noutput = \"out\"\n",
            case.name
        );
        for (camera, n_frames) in rig.cameras().iter().zip(n_frames) {
            let folder = case.path(&camera.name);
            fs::create_dir(&folder).unwrap();
            for frame in 0..*n_frames {
                let file = folder.join(format!("{frame:04}.png"));
                planted::picture(camera, frame).save_png(&file).unwrap();
            }
            let name = &camera.name;
            writeln!(text, "\n[[camera]]\nname = {name:?}\nsource = {name:?}").unwrap();
        }
        case.write("deployment.toml", format!("{text}\n{more}\n"));
        case
    }

    /// A file of the folder.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The folder.
    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Writes a file of the folder.
    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).unwrap();
    }

    /// Replaces text in a file of the folder; it must be there.
    pub(crate) fn edit(&self, name: &str, from: &str, to: &str) {
        let text = fs::read_to_string(self.path(name)).unwrap();
        assert!(
            text.contains(from),
            "{name} does not contain {from}:\n{text}"
        );
        self.write(name, text.replace(from, to));
    }

    /// Starts `parallax` with arguments, in the folder.
    pub(crate) fn start(&self, arguments: &[&str]) -> Started {
        Started::new(self.folder(), arguments)
    }

    /// The same from a shell script; `$PARALLAX` is the program.
    pub(crate) fn start_in_shell(&self, script: &str) -> Started {
        Started::in_shell(self.folder(), script)
    }

    /// Runs the deployment to its end.
    pub(crate) fn run(&self) -> Ended {
        let ended = self.start(&["run", "deployment.toml", "--json"]).wait();
        self.assert_nothing_left();
        ended
    }

    /// Nothing of the deployment lies in shared memory any more.
    pub(crate) fn assert_nothing_left(&self) {
        let namespace = Namespace::new(&self.name).unwrap();
        let left: Vec<String> = fs::read_dir("/dev/shm")
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .filter(|name| name.starts_with(namespace.prefix()))
            .collect();
        assert_eq!(left, Vec::<String>::new(), "left in shared memory");
        assert!(
            !namespace.root().exists(),
            "{} is left",
            namespace.root().display()
        );
    }

    /// The lines of a file of results, as far as they are whole; those of a run that goes on, too.
    pub(crate) fn lines(&self, name: &str) -> Vec<serde_json::Value> {
        let whole = self.path("out").join(name);
        let part = self.path("out").join(format!("{name}.part"));
        let text = fs::read_to_string(part).or_else(|_| fs::read_to_string(whole));
        let text = text.unwrap_or_default();
        let end = text.rfind('\n').map_or(0, |it| it + 1);
        text[..end]
            .lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect()
    }
}
