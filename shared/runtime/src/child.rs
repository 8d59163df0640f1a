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

/// A process that this one has started. Dropping it kills it.
///
/// The kernel ends it when the *thread* that started it ends (see
/// [`Launch::supervisor`](crate::Launch)), so that thread must be the one which supervises.
#[derive(Debug)]
pub struct Child {
    process: std::process::Child,
    pidfd: OwnedFd,
    output: Option<PipeReader>,
    /// Output since the last end of a line.
    partial: Vec<u8>,
    /// True if the output has ended.
    ended: bool,
}

impl Child {
    /// Starts a process with its output in a pipe and without input, in a process group of its own, which the
    /// terminal does not signal.
    ///
    /// # Errors
    ///
    /// The executable cannot be run, or the system has no room for another process.
    pub fn start(executable: &Path, args: &[OsString]) -> io::Result<Self> {
        Self::with_input(executable, args, Stdio::null())
    }

    /// The same with data on its standard input: a file without a name, which cannot be removed.
    ///
    /// # Errors
    ///
    /// As those of [`start`](Self::start), or the system has no room for the file.
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

    /// Its process id.
    pub fn pid(&self) -> u32 {
        self.process.id()
    }

    /// The lines it has written since the last call; after its end the rest as well.
    ///
    /// # Errors
    ///
    /// The pipe cannot be read.
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

    /// How it ended, if it has. Its remaining children are killed then.
    ///
    /// # Errors
    ///
    /// The process does not exist any more.
    pub fn try_wait(&mut self) -> io::Result<Option<ExitStatus>> {
        let mut fds = [PollFd::from_borrowed_fd(self.pidfd.as_fd(), PollFlags::IN)];
        let ended = poll(&mut fds, Some(&Timespec::default()))? > 0;
        if ended {
            // Before it is reaped, while its id cannot belong to another process.
            self.kill();
        }
        let status = self.process.try_wait()?;
        self.ended = status.is_some();
        Ok(status)
    }

    /// Returns true if a signal has stopped it (SIGSTOP, SIGTSTP), as opposed to it waiting for a processor; `false` where the
    /// system does not report it (`/proc` is Linux's).
    pub fn is_stopped(&self) -> bool {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.pid()));
        stat.is_ok_and(|stat| state_in(&stat) == Some('T'))
    }

    /// Sends it a stop request (SIGTERM).
    pub fn terminate(&self) {
        if let Err(error) = kill_process(Pid::from_child(&self.process), Signal::TERM) {
            tracing::debug!(%error, pid = self.pid(), "cannot signal");
        }
    }

    /// Kills it and its children.
    pub fn kill(&self) {
        if let Err(error) = kill_process_group(Pid::from_child(&self.process), Signal::KILL) {
            tracing::debug!(%error, pid = self.pid(), "cannot kill");
        }
    }
}

/// The state of a process in `/proc/<pid>/stat`, which follows its name in parentheses (proc(5)).
fn state_in(stat: &str) -> Option<char> {
    let (_, rest) = stat.rsplit_once(')')?;
    rest.trim_start().chars().next()
}

/// Kills a process (SIGKILL), as a crash would: for fault injection.
///
/// Call it while the process cannot have been reaped yet, for example between the supervisor's events
/// `Started` and `Died`: a released process id may belong to another process.
///
/// # Errors
///
/// There is no such process, or it belongs to another user.
pub fn kill(pid: u32) -> io::Result<()> {
    signal(pid, Signal::KILL)
}

/// Stops a process (SIGSTOP), as a hang would: for fault injection.
///
/// Call it where [`kill`] may be called.
///
/// # Errors
///
/// As those of [`kill`].
pub fn freeze(pid: u32) -> io::Result<()> {
    signal(pid, Signal::STOP)
}

/// Continues a process that [`freeze`] stopped (SIGCONT).
///
/// Call it where [`kill`] may be called.
///
/// # Errors
///
/// As those of [`kill`].
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
/// The system call fails.
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

    /// Time after which something counts as never happening.
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
        // The state stands behind the name, which is in brackets. A process that begins another program has no command line for
        // a moment, but it has a state.
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
