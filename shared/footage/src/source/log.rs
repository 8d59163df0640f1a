//! What a decoder says on its standard error.

use std::io::Read;
use std::thread::JoinHandle;

/// Bytes kept of a log; a damaged video can fill a disk with it.
const MAX_BYTES: usize = 16 << 10;

/// Reads a log to its end in a thread of its own, so that a decoder with much to say does not block.
#[derive(Debug)]
pub(super) struct Log {
    reader: Option<JoinHandle<Vec<u8>>>,
}

impl Log {
    pub(super) fn follow(stream: impl Read + Send + 'static) -> std::io::Result<Self> {
        let reader = std::thread::Builder::new()
            .name("decoder log".to_owned())
            .spawn(move || keep_end(stream))?;
        Ok(Self {
            reader: Some(reader),
        })
    }

    /// Waits for the end of the log, and gives the last of it; empty if nothing was said.
    pub(super) fn finish(&mut self) -> String {
        let bytes = self.reader.take().and_then(|it| it.join().ok());
        summary(&bytes.unwrap_or_default())
    }
}

fn keep_end(mut stream: impl Read) -> Vec<u8> {
    let mut kept = Vec::new();
    let mut chunk = [0; 1024];
    while let Ok(n @ 1..) = stream.read(&mut chunk) {
        kept.extend_from_slice(&chunk[..n]);
        if kept.len() > MAX_BYTES {
            kept.drain(..kept.len() - MAX_BYTES / 2);
        }
    }
    kept
}

/// The last three lines, as one.
pub(super) fn summary(log: &[u8]) -> String {
    let text = String::from_utf8_lossy(log);
    let lines: Vec<&str> = text
        .lines()
        .map(str::trim)
        .filter(|it| !it.is_empty())
        .collect();
    lines[lines.len().saturating_sub(3)..].join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_three_lines_are_kept_of_a_log_of_any_length() {
        let text = (0..100_000).fold(String::new(), |text, it| text + &format!("line {it}\n"));
        let kept = keep_end(text.as_bytes());
        assert!(kept.len() <= MAX_BYTES);
        assert_eq!(summary(&kept), "line 99997; line 99998; line 99999");
    }

    #[test]
    fn an_empty_log_has_an_empty_summary() {
        assert_eq!(summary(b"\n  \n"), "");
    }
}
