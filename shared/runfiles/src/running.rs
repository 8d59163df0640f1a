//! Description of a running deployment for other programs.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// Description that a running deployment publishes: the entry [`Running::KEY`] of the file `deployment.json` beside its sockets.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Running {
    /// Version of this description, [`Running::VERSION`].
    pub format: u64,
    /// Step between the used frames of the footage, by which frame numbers increase.
    pub frame_step: u64,
    /// Names of the joints, in the order of the messages.
    pub joints: Vec<String>,
    /// Names of the extra keypoints, in the order of the messages.
    pub keypoints: Vec<String>,
    /// Pairs of joints that are connected, by their numbers.
    pub limbs: Vec<[usize; 2]>,
    /// True if senders wait for slow receivers, so that no frame is lost in the pipeline.
    pub lossless: bool,
    /// Name of the deployment.
    pub name: String,
    /// Folder of results of the deployment.
    pub output: PathBuf,
    /// Version of Parallax that runs the deployment.
    pub parallax: String,
    /// Session of the run, as in the stamp of every message.
    pub session: u64,
    /// The views, in the order of their numbers.
    pub views: Vec<RunningView>,
}

/// One view of a running deployment.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunningView {
    /// Height of the view's frames, in pixels.
    pub height: u32,
    /// Name of the camera.
    pub name: String,
    /// Width of the view's frames, in pixels.
    pub width: u32,
}

/// Reason why a description cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RunningError {
    /// The text is not JSON, or not a description.
    #[error("the description of the deployment cannot be read")]
    Malformed(#[source] serde_json::Error),
    /// The description has no part for other programs, because the deployment is of another version.
    #[error(
        "the deployment has no description for other programs: it was started by another version of Parallax"
    )]
    Absent,
    /// The description is of another version.
    #[error(
        "the description of the deployment has version {theirs}, but this program reads version {ours}"
    )]
    Version {
        /// Version of the deployment.
        theirs: u64,
        /// Version of this program.
        ours: u64,
    },
}

impl Running {
    /// Version of the description. It increases when a field changes its meaning or is removed.
    pub const VERSION: u64 = 1;
    /// Key of the description in `deployment.json`.
    pub const KEY: &'static str = "programs";

    /// Reads the description from the text of `deployment.json`.
    ///
    /// # Errors
    ///
    /// Returns a [`RunningError`] on failure.
    pub fn read(text: &str) -> Result<Self, RunningError> {
        let mut whole: serde_json::Value =
            serde_json::from_str(text).map_err(RunningError::Malformed)?;
        let own = whole.get_mut(Self::KEY).ok_or(RunningError::Absent)?.take();
        let theirs = own.get("format").and_then(serde_json::Value::as_u64);
        match theirs {
            Some(Self::VERSION) => serde_json::from_value(own).map_err(RunningError::Malformed),
            Some(theirs) => Err(RunningError::Version {
                theirs,
                ours: Self::VERSION,
            }),
            None => Err(RunningError::Absent),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn running() -> Running {
        Running {
            format: Running::VERSION,
            frame_step: 2,
            joints: vec!["head".to_owned(), "neck".to_owned()],
            keypoints: Vec::new(),
            limbs: vec![[0, 1]],
            lossless: true,
            name: "walk".to_owned(),
            output: "out".into(),
            parallax: "0.1.0".to_owned(),
            session: u64::MAX,
            views: vec![RunningView {
                height: 480,
                name: "left".to_owned(),
                width: 272,
            }],
        }
    }

    #[test]
    fn a_written_entry_is_read_among_other_entries() {
        let text = serde_json::json!({ "deployment": {}, "programs": running() }).to_string();
        assert_eq!(Running::read(&text).unwrap(), running());
    }

    #[test]
    fn another_version_and_a_missing_description_are_distinguished() {
        let other = Running {
            format: 7,
            ..running()
        };
        let text = serde_json::json!({ "programs": other }).to_string();
        let error = Running::read(&text).unwrap_err().to_string();
        assert!(
            error.contains("version 7") && error.contains("version 1"),
            "{error}"
        );
        for text in ["{}", "{\"programs\": 3}", "[]", "{\"programs\": {}}"] {
            let error = Running::read(text).unwrap_err();
            assert!(matches!(error, RunningError::Absent), "{text}: {error}");
        }
        for text in ["", "{", "{\"programs\": {\"format\": 1}}"] {
            let error = Running::read(text).unwrap_err();
            assert!(
                matches!(error, RunningError::Malformed(_)),
                "{text}: {error}"
            );
        }
    }
}
