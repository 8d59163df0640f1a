//! Publishes a run in a separate process.

use core::time::Duration;
use std::ffi::OsString;
use std::path::Path;
use std::time::Instant;

use failure::{ExitKind, Failure};
use runtime::Child;

/// Time that the process may take to notice that the deployment has ended.
const LEAVING: Duration = Duration::from_secs(1);

/// A process that publishes a deployment while it runs. Dropping this value ends the process.
#[derive(Debug)]
pub struct Companion {
    child: Child,
}

impl Companion {
    /// Starts `parallax publish` for a deployment that is about to run. The process ends with the deployment.
    ///
    /// * `executable`: this program.
    /// * `targets`: as the user wrote them.
    /// * `beyond`: whether the targets may be other machines.
    ///
    /// # Errors
    ///
    /// Fails if the process cannot be started.
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
            let text = format!("cannot start the process that sends the skeletons: {error}");
            Failure::new(ExitKind::Run, text)
        })?;
        Ok(Self { child })
    }

    /// Waits until the process ends with the deployment, and returns its messages.
    pub fn finish(mut self) -> Vec<String> {
        let begin = Instant::now();
        let mut said = Vec::new();
        loop {
            let has_ended = !matches!(self.child.try_wait(), Ok(None));
            said.extend(self.child.read_lines().unwrap_or_default());
            if has_ended || begin.elapsed() > LEAVING {
                return said;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Companion {
    fn drop(&mut self) {
        self.child.terminate();
    }
}
