//! Processes that a supervisor starts and watches.

use core::time::Duration;
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, PipeReader, Read as _, Seek as _, Write as _};
use std::os::fd::{AsFd as _, OwnedFd};
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{MemfdFlags, memfd_create};
use rustix::io::{Errno, ioctl_fionbio};
use rustix::process::{Pid, PidfdFlags, Signal, kill_process, kill_process_group, pidfd_open};

use failure::Stop;

const READ_BYTES: usize = 4096;

/// A process that this process has started. Dropping this value kills the process.
///
/// The kernel ends the process when the *thread* that started it ends (see [`Launch::supervisor`](crate::Launch)).
/// The thread that starts it must therefore be the one that supervises it.
#[derive(Debug)]
pub struct Child {
    process: std::process::Child,
    pidfd: OwnedFd,
    output: Option<PipeReader>,
    /// Output after the last complete line.
    partial: Vec<u8>,
    /// True if the output has ended.
    ended: bool,
}

impl Child {
    /// Starts a process without input and with its output in a pipe. The process has its own process group, so that the
    /// terminal does not signal it.
    ///
    /// # Errors
    ///
    /// Fails if the executable cannot be run, or if the system has no room for another process.
    pub fn start(executable: &Path, args: &[OsString]) -> io::Result<Self> {
        Self::with_input(executable, args, Stdio::null())
    }

    /// Starts a process like [`start`](Self::start), with data on its standard input. The data are in a file without a name, which
    /// cannot be removed.
    ///
    /// # Errors
    ///
    /// Fails in the same cases as [`start`](Self::start). It also fails if the system has no room for the file.
    pub fn start_given(executable: &Path, args: &[OsString], given: &[u8]) -> io::Result<Self> {
        let mut file = File::from(memfd_create("given", MemfdFlags::CLOEXEC)?);
        file.write_all(given)?;
        file.rewind()?;
        Self::with_input(executable, args, file.into())
    }

    fn with_input(executable: &Path, args: &[OsString], input: Stdio) -> io::Result<Self> {
        let (output, writer) = io::pipe()?;
        ioctl_fionbio(&output, true)?;
        let child = Command::new(executable)
            .args(args)
            .stdin(input)
            .stdout(writer.try_clone()?)
            .stderr(writer)
            .process_group(0)
            .spawn()?;
        let pidfd = pidfd_open(Pid::from_child(&child), PidfdFlags::empty())?;
        Ok(Self {
            process: child,
            pidfd,
            output: Some(output),
            partial: Vec::new(),
            ended: false,
        })
    }

    /// Returns the process id.
    pub fn pid(&self) -> u32 {
        self.process.id()
    }

    /// Returns the lines that the process has written since the last call. After its end, returns the unfinished last line as well.
    ///
    /// # Errors
    ///
    /// Fails if the pipe cannot be read.
    pub fn read_lines(&mut self) -> io::Result<Vec<String>> {
        let mut closed = false;
        if let Some(output) = &mut self.output {
            let mut bytes = [0; READ_BYTES];
            loop {
                match output.read(&mut bytes) {
                    Ok(0) => {
                        closed = true;
                        break;
                    }
                    Ok(n) => self.partial.extend(bytes.iter().take(n)),
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                    Err(error) => return Err(error),
                }
            }
        }
        if closed {
            self.output = None;
        }
        let whole = match self.partial.iter().rposition(|&byte| byte == b'\n') {
            Some(last) => self.partial.drain(..=last).collect(),
            None => Vec::new(),
        };
        let rest = if closed || self.ended {
            std::mem::take(&mut self.partial)
        } else {
            Vec::new()
        };
        let text = [whole, rest].concat();
        Ok(String::from_utf8_lossy(&text).lines().map(str::to_owned).collect())
    }

    /// Returns the exit status of the process if it has ended. In this case, its remaining children are killed.
    ///
    /// # Errors
    ///
    /// Fails if the process does not exist any more.
    pub fn try_wait(&mut self) -> io::Result<Option<ExitStatus>> {
        let mut fds = [PollFd::from_borrowed_fd(self.pidfd.as_fd(), PollFlags::IN)];
        let ended = match poll(&mut fds, Some(&Timespec::default())) {
            Err(Errno::INTR) => return Ok(None),
            ended => ended? > 0,
        };
        if ended {
            // Kill the children before the process is reaped: until then, its id cannot belong to another process.
            self.kill();
        }
        let status = self.process.try_wait()?;
        self.ended = status.is_some();
        Ok(status)
    }

    /// Returns true if a signal has stopped the process (SIGSTOP, SIGTSTP). Returns false if the process only waits for a processor, or
    /// if the system does not report its state (`/proc` exists only on Linux).
    pub fn is_stopped(&self) -> bool {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.pid()));
        stat.is_ok_and(|stat| state_in(&stat) == Some('T'))
    }

    /// Sends the process a stop request (SIGTERM).
    pub fn terminate(&self) {
        if let Err(error) = kill_process(Pid::from_child(&self.process), Signal::TERM) {
            tracing::debug!(%error, pid = self.pid(), "cannot signal");
        }
    }

    /// Kills the process and its children.
    pub fn kill(&self) {
        if let Err(error) = kill_process_group(Pid::from_child(&self.process), Signal::KILL) {
            tracing::debug!(%error, pid = self.pid(), "cannot kill");
        }
    }
}

/// Returns the state of a process from `/proc/<pid>/stat`, where it follows the name in parentheses (proc(5)).
fn state_in(stat: &str) -> Option<char> {
    let (_, rest) = stat.rsplit_once(')')?;
    rest.trim_start().chars().next()
}

/// Kills a process (SIGKILL), as a crash would do. Used for fault injection.
///
/// Call this only while the process cannot have been reaped, for example between the supervisor's events `Started` and `Died`. After that,
/// its process id may belong to another process.
///
/// # Errors
///
/// Fails if there is no such process, or if it belongs to another user.
pub fn kill(pid: u32) -> io::Result<()> {
    signal(pid, Signal::KILL)
}

/// Stops a process (SIGSTOP), as a hang would do. Used for fault injection.
///
/// Call this only when [`kill`] may be called.
///
/// # Errors
///
/// Fails in the same cases as [`kill`].
pub fn freeze(pid: u32) -> io::Result<()> {
    signal(pid, Signal::STOP)
}

/// Continues a process that [`freeze`] stopped (SIGCONT).
///
/// Call this only when [`kill`] may be called.
///
/// # Errors
///
/// Fails in the same cases as [`kill`].
pub fn thaw(pid: u32) -> io::Result<()> {
    signal(pid, Signal::CONT)
}

fn signal(pid: u32, signal: Signal) -> io::Result<()> {
    let pid = i32::try_from(pid).ok().and_then(Pid::from_raw);
    let pid = pid.ok_or(io::ErrorKind::InvalidInput)?;
    Ok(kill_process(pid, signal)?)
}

impl Drop for Child {
    fn drop(&mut self) {
        if let Ok(None) = self.try_wait() {
            self.kill();
            if let Err(error) = self.process.wait() {
                tracing::debug!(%error, pid = self.pid(), "cannot wait for the end");
            }
        }
    }
}

/// Sleeps until a child ends or writes something, `stop` is requested, or `timeout` has passed.
///
/// # Errors
///
/// Fails if the system call fails.
pub fn wait_for_any(children: &[&Child], stop: Option<&Stop>, timeout: Duration) -> io::Result<()> {
    let mut fds = Vec::new();
    for child in children {
        fds.push(PollFd::from_borrowed_fd(child.pidfd.as_fd(), PollFlags::IN));
        if let Some(output) = &child.output {
            fds.push(PollFd::from_borrowed_fd(output.as_fd(), PollFlags::IN));
        }
    }
    if let Some(stop) = stop {
        fds.push(PollFd::from_borrowed_fd(stop.as_fd(), PollFlags::IN));
    }
    let timeout = Timespec {
        tv_sec: timeout.as_secs() as i64,
        tv_nsec: i64::from(timeout.subsec_nanos()),
    };
    match poll(&mut fds, Some(&timeout)) {
        Ok(_) | Err(Errno::INTR) => Ok(()),
        Err(error) => Err(error.into()),
    }
}

#[cfg(test)]
mod tests {
    use core::time::Duration;
    use std::ffi::OsString;
    use std::path::Path;
    use std::process::ExitStatus;
    use std::time::Instant;

    use super::{Child, freeze, kill, state_in, thaw, wait_for_any};

    /// Time after which an event counts as never happening.
    const WATCHDOG: Duration = Duration::from_mins(1);

    fn shell(script: &str) -> Child {
        Child::start(Path::new("/bin/sh"), &["-c", script].map(OsString::from)).unwrap()
    }

    fn run(child: &mut Child) -> (Vec<String>, ExitStatus) {
        let mut lines = Vec::new();
        loop {
            wait_for_any(&[&*child], None, Duration::from_secs(10)).unwrap();
            let status = child.try_wait().unwrap();
            lines.extend(child.read_lines().unwrap());
            if let Some(status) = status {
                return (lines, status);
            }
        }
    }

    #[test]
    fn lines_of_both_outputs_are_read_to_the_end() {
        let mut child = shell("echo one; echo two >&2; printf three");
        let (lines, status) = run(&mut child);
        assert_eq!(lines, ["one", "two", "three"]);
        assert!(status.success());
    }

    #[test]
    fn given_data_is_the_whole_standard_input_of_a_child() {
        let args = ["-c", "cat; echo over"].map(OsString::from);
        for _ in 0..2 {
            let mut child = Child::start_given(Path::new("/bin/sh"), &args, b"one\n2\n").unwrap();
            assert_eq!(run(&mut child).0, ["one", "2", "over"]);
        }
    }

    #[test]
    fn incomplete_lines_are_not_returned() {
        let mut child = shell("printf half; exec sleep 600");
        wait_for_any(&[&child], None, Duration::from_secs(10)).unwrap();
        assert_eq!(child.read_lines().unwrap(), Vec::<String>::new());
    }

    #[test]
    fn a_signal_is_distinguished_from_an_exit() {
        use std::os::unix::process::ExitStatusExt as _;
        let (_, status) = run(&mut shell("exit 4"));
        assert_eq!(status.code(), Some(4));
        let mut child = shell("exec sleep 600");
        child.kill();
        let (_, status) = run(&mut child);
        assert_eq!(status.signal(), Some(9));
    }

    #[test]
    fn a_process_is_killed_by_its_id_and_an_invalid_id_is_refused() {
        use std::os::unix::process::ExitStatusExt as _;
        let mut child = shell("exec sleep 600");
        kill(child.pid()).unwrap();
        let (_, status) = run(&mut child);
        assert_eq!(status.signal(), Some(9));
        for none in [0, u32::MAX] {
            let error = kill(none).unwrap_err();
            assert_eq!(error.kind(), std::io::ErrorKind::InvalidInput);
        }
    }

    #[test]
    fn grandchildren_are_killed_with_their_parent() {
        let mut child = shell("sleep 600 & echo $!; kill -9 $$");
        let (lines, status) = run(&mut child);
        assert!(!status.success());
        let orphan = format!("/proc/{}/stat", lines[0]);
        // In `/proc`, the state follows the name, which is in parentheses. A process that is replaced by another program has no command
        // line for a moment, but it has a state.
        let is_alive = || {
            let stat = std::fs::read_to_string(&orphan).unwrap_or_default();
            let state = stat.rsplit(") ").next().unwrap_or_default();
            !state.is_empty() && !state.starts_with(['Z', 'X'])
        };
        let begin = Instant::now();
        while is_alive() && begin.elapsed() < WATCHDOG {
            std::thread::sleep(Duration::from_millis(5));
        }
        assert!(!is_alive(), "{orphan}");
    }

    #[test]
    fn a_dropped_child_is_killed() {
        let child = shell("exec sleep 600");
        let proc = format!("/proc/{}", child.pid());
        assert!(Path::new(&proc).exists());
        drop(child);
        assert!(!Path::new(&proc).exists());
    }

    fn until(or: &str, holds: impl Fn() -> bool) {
        let begin = Instant::now();
        while !holds() {
            assert!(begin.elapsed() < WATCHDOG, "{or}");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn a_stopped_process_can_be_continued() {
        let child = shell("exec sleep 600");
        freeze(child.pid()).unwrap();
        until("it goes on", || child.is_stopped());
        thaw(child.pid()).unwrap();
        until("it is still stopped", || !child.is_stopped());
    }

    #[test]
    fn the_state_follows_the_process_name_in_parentheses() {
        assert_eq!(state_in("7 (a b) T 1 7"), Some('T'));
        assert_eq!(state_in("7 (x) T y) S 1 7"), Some('S'));
        assert_eq!(state_in("7 (x"), None);
        assert_eq!(state_in("7 (x)"), None);
    }

    #[test]
    fn a_stopped_process_can_be_killed() {
        use std::os::unix::process::ExitStatusExt as _;
        let mut child = shell("exec sleep 600");
        assert!(!child.is_stopped());
        freeze(child.pid()).unwrap();
        until("it goes on", || child.is_stopped());
        kill(child.pid()).unwrap();
        let (_, status) = run(&mut child);
        assert_eq!(status.signal(), Some(9));
    }
}
