//! The method for finding skeletons, and the keys that belong to one method alone.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use crate::{Deployment, paper};

/// Method for finding skeletons.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Maps of the joints from a network, or keypoints from other programs, solved in space over all views.
    #[default]
    Network,
    /// Filters and the paper's energy between views.
    Paper,
}

impl Method {
    /// Returns the name of the method in a deployment file, which is also the name of its section.
    pub fn name(self) -> &'static str {
        match self {
            Self::Network => "network",
            Self::Paper => "paper",
        }
    }

    /// Returns the other method.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Network => Self::Paper,
            Self::Paper => Self::Network,
        }
    }

    /// Returns true if this method uses a key, given with its section.
    pub fn has(self, key: &str) -> bool {
        key.split('.').next() != Some(self.other().name())
    }
}

/// Maximum number of cameras that the paper's method solves at once.
pub(crate) const MOST_AT_ONCE: usize = 8;

/// Group of views of a frame that are solved together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Views {
    /// Pairs of views, whose poses are then combined: the paper's method.
    Pairs,
    /// All views at once, each supported by all others: the paper's method.
    All,
    /// All views at once, in space: the network's method.
    Space,
}

impl Deployment {
    /// Returns the group of views of a frame that are solved together.
    pub fn views(&self) -> Views {
        match (self.method, self.paper.views) {
            (Method::Network, _) => Views::Space,
            (Method::Paper, paper::Views::Pairs) => Views::Pairs,
            (Method::Paper, paper::Views::All) => Views::All,
        }
    }

    /// Returns the maximum number of fusion processes that have work to do. If all views are solved at once, there is only one task.
    pub(crate) fn most_workers(&self) -> usize {
        match self.views() {
            Views::Pairs => self.paper.workers,
            Views::All | Views::Space => 1,
        }
    }
}

/// A key that belongs to the method that is not used.
pub(crate) struct Stranger {
    /// Name of the key, with its section.
    pub(crate) key: String,
    /// The change to make, and the reason.
    pub(crate) message: String,
}

/// Returns a given key that belongs to the method that is not used; `None` if there is no such key.
///
/// * `given`: settings that the user gave.
pub(crate) fn stranger(method: Method, given: &Table) -> Option<Stranger> {
    let key = stray_key(method, given)?;
    let other = method.other().name();
    let message = format!(
        "`{key}` belongs to the {other}'s method: set `method = \"{other}\"`, or leave out `{key}`"
    );
    Some(Stranger { key, message })
}

fn stray_key(method: Method, given: &Table) -> Option<String> {
    let other = method.other().name();
    let section = given.get(other).and_then(Value::as_table);
    if let Some(key) = section.and_then(|keys| keys.keys().next()) {
        return Some(format!("{other}.{key}"));
    }
    if method == Method::Network {
        return None;
    }
    let cameras = given.get("camera")?.as_array()?;
    let cameras = cameras.iter().filter_map(Value::as_table);
    let has = |key: &str| cameras.clone().any(|keys| keys.contains_key(key));
    let of_network = ["network", "keypoints", "keypoint_names"];
    let stray = of_network.into_iter().find(|key| has(key));
    stray.map(|key| format!("camera.{key}"))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::{AnyMachine, ConfigError, Loaded};

    const CAMERAS: &str =
        "[[camera]]\nname = 'a'\nsource = 'a.mp4'\n[[camera]]\nname = 'b'\nsource = 'b.mp4'\n";

    fn read(top: &str, sections: &str, set: &[&str]) -> Result<Deployment, ConfigError> {
        let text = format!("name = 'n'\nrig = 'r'\noutput = 'o'\n{top}{CAMERAS}{sections}");
        let set: Vec<String> = set.iter().map(|pair| (*pair).to_owned()).collect();
        Loaded::parse(&text, Path::new("n.toml"), &set, &AnyMachine).map(|loaded| loaded.deployment)
    }

    #[test]
    fn the_default_method_is_the_network() {
        let deployment = read("", "", &[]).unwrap();
        assert_eq!(deployment.method, Method::Network);
        assert_eq!(deployment.views(), Views::Space);
        assert_eq!(deployment.network.file, Path::new("shipped"));
    }

    #[test]
    fn a_key_of_the_other_method_is_refused_with_its_line_and_the_word_to_change() {
        for (top, section, said) in [
            (
                "",
                "[paper]\ntau = 'umpm'\n",
                "n.toml:11: `paper.tau` belongs to the paper's method: set `method = \"paper\"`, or leave out `paper.tau`",
            ),
            (
                "method = 'network'\n",
                "[paper]\nworkers = 1\n",
                "`paper.workers` belongs to the paper's method",
            ),
            (
                "method = 'paper'\n",
                "[network]\nmirror = true\n",
                "n.toml:12: `network.mirror` belongs to the network's method: set `method = \"network\"`, or leave out `network.mirror`",
            ),
            (
                "method = 'paper'\n",
                "network = 'b.onnx'\n",
                "`camera.network` belongs to the network's method",
            ),
            (
                "method = 'paper'\n",
                "keypoints = 'b.json'\n",
                "`camera.keypoints` belongs to the network's method",
            ),
        ] {
            let refused = read(top, section, &[]).unwrap_err().to_string();
            assert!(refused.contains(said), "{refused}");
        }
        let refused = read("", "", &["paper.workers=2"]).unwrap_err().to_string();
        assert!(
            refused.starts_with("--set paper.workers: `paper.workers` belongs"),
            "{refused}"
        );
        read("", "[paper]\nworkers = 2\n", &["method=paper"]).unwrap();
    }

    #[test]
    fn no_other_key_changes_the_method() {
        for section in [
            "network = 'b.onnx'\n",
            "keypoints = 'b.json'\n",
            "[network]\nfile = 'n.onnx'\n",
        ] {
            let deployment = read("", section, &[]).unwrap();
            assert_eq!(deployment.method, Method::Network, "{section}");
        }
        let more = "[paper]\nmodel = 'm'\nviews = 'all'\n";
        let deployment = read("method = 'paper'\n", more, &[]).unwrap();
        assert_eq!(
            (deployment.method, deployment.views()),
            (Method::Paper, Views::All)
        );
    }
}
