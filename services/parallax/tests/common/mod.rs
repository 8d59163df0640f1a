//! A small deployment with a synthetic figure in its own folder. The program is run as a user would run it.
#![allow(dead_code, reason = "every test file uses a part of it")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

pub(crate) mod networks;
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
use serde_json::Value;
use tempfile::TempDir;

pub(crate) use started::{Ended, Started};

/// Settings without overlays and rotation, so that frames equal the generated pictures.
pub(crate) const PLAIN: &str =
    "[capture]\nupright = false\n[results]\noverlay_every = 0\n[paper]\nworkers = 2\n";

/// Settings like [`PLAIN`], with 20 frames per second, which leaves time to interfere.
pub(crate) const PACED: &str = "[capture]\nupright = false\nmode = \"paced\"\n\
     frame_rate_hz = 20\n[results]\noverlay_every = 0\n[paper]\nworkers = 2\n";

/// Returns the last line of a frame that every view used. On a loaded machine, a view uses every second or fourth frame, and drops all
/// other frames.
pub(crate) fn last_taken(lines: &[Value]) -> &Value {
    let is_taken = |value: &&Value| {
        let mut missing = value["views_missing"].as_object().unwrap().values();
        missing.all(|why| why != "dropped")
    };
    lines.iter().rev().find(is_taken).unwrap()
}

/// A folder with footage, rig, model and deployment file.
pub(crate) struct Case {
    folder: TempDir,
    pub(crate) name: String,
}

impl Case {
    /// Creates a deployment with generated footage.
    ///
    /// * `name`: beginning of the deployment's name, which must be unique.
    /// * `n_frames`: number of frames by view.
    /// * `more`: text that is appended to the deployment file.
    pub(crate) fn new(name: &str, n_frames: &[usize], more: &str) -> Self {
        Self::with_rig(&planted::rig(n_frames.len()), name, n_frames, more)
    }

    /// Creates a deployment like [`Self::new`], with another rig.
    pub(crate) fn with_rig(rig: &Rig, name: &str, n_frames: &[usize], more: &str) -> Self {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let nth = COUNT.fetch_add(1, Ordering::Relaxed);
        let case = Self {
            folder: tempfile::Builder::new().prefix("parallax-").tempdir().unwrap(),
            name: format!("{name}-{}-{nth}", std::process::id()),
        };
        geometry::files::write(&case.path("rig.toml"), Format::Own, rig).unwrap();
        fmp::files::write(&case.path("model.plx"), &planted::model()).unwrap();
        let mut text = format!(
            "name = \"{}\"\nrig = \"rig.toml\"\nmethod = \"paper\"\noutput = \"out\"\n",
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
        // The bones of the test figure do not have human proportions.
        let own = "[paper]\nmodel = \"model.plx\"\nbodies = false";
        let more = if more.contains("[paper]") {
            more.replace("[paper]", own)
        } else {
            format!("{more}\n{own}")
        };
        case.write("deployment.toml", format!("{text}\n{more}\n"));
        case
    }

    /// Returns the path of a file in the folder.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Returns the path of the folder.
    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Writes a file in the folder.
    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).unwrap();
    }

    /// Replaces text in a file in the folder. The text must occur.
    pub(crate) fn edit(&self, name: &str, from: &str, to: &str) {
        let text = fs::read_to_string(self.path(name)).unwrap();
        assert!(
            text.contains(from),
            "{name} does not contain {from}:\n{text}"
        );
        self.write(name, text.replace(from, to));
    }

    /// Sets the method `network`, with these keys in its section, in place of the paper's method.
    pub(crate) fn set_network(&self, keys: &str) {
        let text = fs::read_to_string(self.path("deployment.toml")).unwrap();
        let mut table: toml::Table = toml::from_str(&text).unwrap();
        table.remove("paper");
        table.insert("method".to_owned(), "network".into());
        let keys: toml::Table = toml::from_str(keys).unwrap();
        table.insert("network".to_owned(), keys.into());
        self.write("deployment.toml", toml::to_string(&table).unwrap());
    }

    /// Starts `parallax` with arguments, in the folder of the case.
    pub(crate) fn start(&self, arguments: &[&str]) -> Started {
        // Results of an earlier run may be replaced.
        let may_force = matches!(arguments.first(), Some(&"run" | &"replay"));
        let force = (may_force && !arguments.contains(&"--dry-run")).then_some("--force");
        let arguments: Vec<&str> = arguments.iter().copied().chain(force).collect();
        Started::new(self.folder(), &arguments)
    }

    /// Starts a shell script in the folder. `$PARALLAX` is the program.
    pub(crate) fn start_in_shell(&self, script: &str) -> Started {
        Started::in_shell(self.folder(), script)
    }

    /// Runs the deployment to its end.
    pub(crate) fn run(&self) -> Ended {
        let ended = self.start(&["run", "deployment.toml", "--json"]).wait();
        self.assert_nothing_left();
        ended
    }

    /// Checks that the deployment has left nothing in shared memory.
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

    /// Returns the complete lines of a results file, even if the run is still writing it.
    pub(crate) fn lines(&self, name: &str) -> Vec<Value> {
        let whole = self.path("out").join(name);
        let part = self.path("out").join(format!("{name}.part"));
        let text = fs::read_to_string(part).or_else(|_| fs::read_to_string(whole));
        let text = text.unwrap_or_default();
        let end = text.rfind('\n').map_or(0, |at| at + 1);
        text[..end].lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }
}
