//! Publishing beside a run, in a process of its own.

use std::ffi::OsString;
use std::path::Path;

use runtime::{Child, ExitKind, Failure};

/// A process that publishes a deployment while it runs. Dropping it ends that.
#[derive(Debug)]
pub struct Companion {
    child: Child,
}

impl Companion {
    /// Starts `parallax publish` for a deployment that is about to run; it ends with the deployment.
    ///
    /// * `executable`: this program.
    /// * `targets`: as the user wrote them.
    /// * `beyond`: whether they may be other machines.
    ///
    /// # Errors
    ///
    /// The process cannot be started.
    pub fn start(
        executable: &Path,
        deployment: &str,
        targets: &[String],
        beyond: bool,
    ) -> Result<Self, Failure> {
        let mut arguments: Vec<OsString> = vec!["publish".into(), deployment.into()];
        arguments.extend(targets.iter().map(OsString::from));
        arguments.push("--until-end".into());
        if beyond {
            arguments.push("--beyond-this-machine".into());
        }
        let child = Child::start(executable, &arguments).map_err(|error| {
            let text = format!("cannot start the process that publishes: {error}");
            Failure::new(ExitKind::Run, text)
        })?;
        Ok(Self { child })
    }

    /// What it has said since it was asked before: why it ended, for example.
    pub fn said(&mut self) -> Vec<String> {
        self.child.read_lines().unwrap_or_default()
    }
}

impl Drop for Companion {
    fn drop(&mut self) {
        self.child.terminate();
    }
}
