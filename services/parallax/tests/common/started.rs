//! A running `parallax`: its output, its processes, and its exit.

use core::time::Duration;
use std::fs::{self, File};
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// If a process takes longer than this, it is stuck, even on a slow and busy machine.
pub(crate) const WATCHDOG: Duration = Duration::from_mins(15);

/// A running `parallax`.
pub(crate) struct Started {
    child: Child,
    folder: PathBuf,
    log: PathBuf,
}

/// Returns the path of the executable `parallax`.
pub(crate) fn parallax() -> PathBuf {
    built("parallax")
}

/// Returns the executable that has the command in the first argument.
fn program(arguments: &[&str]) -> PathBuf {
    const LAB: [&str; 6] = ["eval", "judge", "model", "simulate", "synth", "train"];
    let is_lab = arguments.first().is_some_and(|command| LAB.contains(command))
        || arguments.contains(&"--truth");
    built(if is_lab { "parallax-lab" } else { "parallax" })
}

/// Returns the path of a program of the workspace, beside the folder of this test.
pub(crate) fn built(name: &str) -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let file = test.ancestors().nth(2).unwrap().join(name);
    assert!(
        file.is_file(),
        "{} is not built: test with --workspace",
        file.display()
    );
    file
}

/// Exit status and output of a finished `parallax`.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) status: ExitStatus,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Ended {
    /// Checks the exit code.
    #[track_caller]
    pub(crate) fn ends(self, code: i32) -> Self {
        assert_eq!(self.status.code(), Some(code), "{}", self.stderr);
        self
    }

    /// Checks that the standard error has a text.
    #[track_caller]
    pub(crate) fn says(&self, text: &str) {
        assert!(self.stderr.contains(text), "{}", self.stderr);
    }
}

impl Started {
    /// Starts the program in a folder and in its own process group.
    pub(crate) fn new(folder: &Path, arguments: &[&str]) -> Self {
        let mut command = Command::new(program(arguments));
        command.args(arguments);
        Self::from_command(folder, command)
    }

    /// Starts a shell script in its own mount namespace. `$PARALLAX` is the program. Returns `None` if this is not permitted.
    pub(crate) fn in_mount_namespace(folder: &Path, script: &str) -> Option<Self> {
        let allowed = Command::new("unshare")
            .args(["-m", "sh", "-c", "mount -t tmpfs tmpfs /mnt"])
            .stderr(Stdio::null())
            .status();
        if !allowed.is_ok_and(|status| status.success()) {
            return None;
        }
        let mut command = Command::new("unshare");
        command.args(["-m", "sh", "-ec", script]).env("PARALLAX", parallax());
        Some(Self::from_command(folder, command))
    }

    /// Starts a shell script. `$PARALLAX` is the program.
    pub(crate) fn in_shell(folder: &Path, script: &str) -> Self {
        let mut command = Command::new("sh");
        command.args(["-ec", script]).env("PARALLAX", parallax());
        Self::from_command(folder, command)
    }

    fn from_command(folder: &Path, mut command: Command) -> Self {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let nth = COUNT.fetch_add(1, Ordering::Relaxed);
        let log = folder.join(format!("log-{nth}"));
        let child = command
            .current_dir(folder)
            .stdout(File::create(log.with_extension("out")).unwrap())
            .stderr(File::create(log.with_extension("err")).unwrap())
            .process_group(0)
            .spawn()
            .unwrap();
        Self {
            child,
            folder: folder.to_owned(),
            log,
        }
    }

    /// Waits for the end of the program, and checks that none of its processes is left.
    pub(crate) fn wait(self) -> Ended {
        let folder = self.folder.clone();
        let ended = self.wait_among_others();
        assert_eq!(
            processes(&folder),
            [],
            "left behind after\n{}",
            ended.stderr
        );
        ended
    }

    /// Waits for the end of the program, while other programs may run in the same folder.
    pub(crate) fn wait_among_others(mut self) -> Ended {
        let begin = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            // If the program is still running, dropping the value kills it.
            assert!(begin.elapsed() < WATCHDOG, "stuck:\n{}", self.output("err"));
            std::thread::sleep(Duration::from_millis(10));
        };
        let ended = Ended {
            status,
            stdout: self.output("out"),
            stderr: self.output("err"),
        };
        assert!(!ended.stderr.contains("panicked"), "{}", ended.stderr);
        ended
    }

    /// Returns the process id of a service, once it exists.
    ///
    /// * `service`: the service as on its command line, for example `pose --index 1`.
    pub(crate) fn pid_of(&mut self, service: &str) -> u32 {
        let words: Vec<&str> = service.split(' ').collect();
        let mut found = None;
        self.until(service, |folder| {
            found = processes(folder)
                .into_iter()
                .find(|(_, line)| words.iter().all(|word| line.contains(&(*word).to_owned())))
                .map(|process| process.0);
            found.is_some()
        });
        found.unwrap()
    }

    /// Waits until a condition is true, while the program runs.
    pub(crate) fn until(&mut self, what: &str, mut holds: impl FnMut(&Path) -> bool) {
        let folder = self.folder.clone();
        wait_until(what, || {
            let over = self.child.try_wait().unwrap();
            assert!(
                over.is_none(),
                "over before {what}:\n{}",
                self.output("err")
            );
            holds(&folder)
        });
    }

    /// Waits until the program has printed a text on standard error.
    pub(crate) fn until_said(&mut self, words: &str) {
        let file = self.log.with_extension("err");
        let said = || fs::read_to_string(&file).is_ok_and(|text| text.contains(words));
        self.until(words, |_| said());
    }

    /// Returns the process id, which is also that of the process group.
    pub(crate) fn id(&self) -> i64 {
        i64::from(self.child.id())
    }

    /// Returns the file that has the standard output.
    pub(crate) fn out_file(&self) -> PathBuf {
        self.log.with_extension("out")
    }

    fn output(&self, what: &str) -> String {
        fs::read_to_string(self.log.with_extension(what)).unwrap()
    }
}

impl Drop for Started {
    /// Kills the process if a failed test left it running.
    fn drop(&mut self) {
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

/// Sends a signal to a process, or to a process group if the number is negative.
pub(crate) fn signal(name: &str, id: i64) {
    let status = Command::new("kill").args(["-s", name, "--", &id.to_string()]).status();
    assert!(status.unwrap().success(), "kill -s {name} {id}");
}

/// Waits until a condition is true.
fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !holds() {
        assert!(begin.elapsed() < WATCHDOG, "waited in vain: {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Returns the processes whose command line contains a folder, with their arguments.
pub(crate) fn processes(folder: &Path) -> Vec<(u32, Vec<String>)> {
    let folder = folder.to_str().unwrap();
    let entries = fs::read_dir("/proc").unwrap();
    entries
        .filter_map(|entry| {
            let entry = entry.ok()?;
            let pid = entry.file_name().to_str()?.parse().ok()?;
            // A process that has ended in the meantime has no command line.
            let line = fs::read_to_string(entry.path().join("cmdline")).ok()?;
            let arguments = line.split('\0').map(str::to_owned).collect();
            line.contains(folder).then_some((pid, arguments))
        })
        .collect()
}
