//! Runs external programs with a time limit, and reads their version.

use std::io::{self, Read};
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Runs a program to its end, and returns its output; `None` if the time limit has passed and the program was killed.
pub(crate) fn output_within(mut command: Command, limit: Duration) -> io::Result<Option<Output>> {
    const PAUSE: Duration = Duration::from_millis(10);
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()?;
    let pipes: [Option<Box<dyn Read + Send>>; 2] = [
        child.stdout.take().map(|stdout| Box::new(stdout) as _),
        child.stderr.take().map(|stderr| Box::new(stderr) as _),
    ];
    let read = |pipe: Option<Box<dyn Read + Send>>| {
        std::thread::Builder::new().spawn(move || {
            let mut bytes = Vec::new();
            // After an error, the bytes that were read before it are used.
            pipe.map(|mut pipe| pipe.read_to_end(&mut bytes).ok());
            bytes
        })
    };
    let [stdout, stderr] = pipes.map(read);
    let begin = Instant::now();
    let status = loop {
        match child.try_wait()? {
            Some(status) => break Some(status),
            None if begin.elapsed() > limit => break None,
            None => std::thread::sleep(PAUSE),
        }
    };
    if status.is_none() {
        child.kill()?;
        child.wait()?;
    }
    let [stdout, stderr] = [stdout?, stderr?].map(|reader| reader.join().unwrap_or_default());
    Ok(status.map(|status| Output {
        status,
        stdout,
        stderr,
    }))
}

/// Returns the version of `ffmpeg`; empty if it does not report one.
pub(crate) fn version_of(ffmpeg: &PathBuf) -> String {
    let said = Command::new(ffmpeg).arg("-version").stdin(Stdio::null()).output();
    let said = said.map(|said| said.stdout).unwrap_or_default();
    let text = String::from_utf8_lossy(&said);
    text.split_whitespace().nth(2).unwrap_or_default().to_owned()
}
