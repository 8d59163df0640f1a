//! Finds out what an HTTP camera has answered if a decoder found no pictures in its answer.

use std::io::{BufReader, Read as _, Write as _};
use std::net::{TcpStream, ToSocketAddrs as _};
use std::time::Duration;

/// Longest wait for an answer.
const PATIENCE: Duration = Duration::from_secs(3);
/// Maximum size of an answer's head, in bytes.
const MAX_HEAD: u64 = 16 << 10;

/// Kind of answer that a camera has sent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Answer {
    /// The answer is one picture, not a stream.
    Picture,
    /// The answer is not a picture. The text is its media type.
    Other(String),
}

impl Answer {
    /// Returns the error message for this answer.
    pub(crate) fn complaint(self) -> String {
        match self {
            Self::Picture => {
                "this is the address of a single picture; the stream has another address (see the manual of the camera)"
                    .to_owned()
            }
            Self::Other(kind) if kind == "text/html" => {
                "the answer is a web page (text/html) instead of pictures: does the camera require a login (write the name and the \
                 password before the host, followed by @), or is this the address of its menu?"
                    .to_owned()
            }
            Self::Other(kind) => format!("the answer is {kind} instead of pictures"),
        }
    }
}

/// Requests an `http://` address, and returns what kind of answer came back. Returns `None` if there is no answer, or if the answer may be
/// a stream.
pub(crate) fn ask(address: &str) -> Option<Answer> {
    let (scheme, rest) = address.split_once("://")?;
    let (host, path) = rest.split_at(rest.find(['/', '?']).unwrap_or(rest.len()));
    // Without its password, a camera rejects the request; with TLS, the answer cannot be read.
    if !scheme.eq_ignore_ascii_case("http") || host.contains('@') {
        return None;
    }
    let has_port = host.rsplit_once(':').is_some_and(|parts| parts.1.parse::<u16>().is_ok());
    let with_port = if has_port {
        host.to_owned()
    } else {
        format!("{host}:80")
    };
    let to = with_port.to_socket_addrs().ok()?.next()?;
    let mut stream = TcpStream::connect_timeout(&to, PATIENCE).ok()?;
    stream.set_read_timeout(Some(PATIENCE)).ok()?;
    stream.set_write_timeout(Some(PATIENCE)).ok()?;
    let slash = if path.starts_with('/') { "" } else { "/" };
    let request = format!("GET {slash}{path} HTTP/1.0\r\nHost: {host}\r\nAccept: */*\r\n\r\n");
    stream.write_all(request.as_bytes()).ok()?;
    let mut head = Vec::new();
    for byte in BufReader::new(stream).take(MAX_HEAD).bytes() {
        head.push(byte.ok()?);
        if head.ends_with(b"\r\n\r\n") || head.ends_with(b"\n\n") {
            break;
        }
    }
    of_head(&String::from_utf8_lossy(&head))
}

fn of_head(head: &str) -> Option<Answer> {
    let mut lines = head.lines();
    if lines.next()?.split_whitespace().nth(1)? != "200" {
        return None;
    }
    let field = |name: &str| {
        let mut fields = head.lines().filter_map(|line| line.split_once(':'));
        let found = fields.find(|field| field.0.trim().eq_ignore_ascii_case(name))?;
        Some(found.1.trim().to_ascii_lowercase())
    };
    let kind = field("content-type")?;
    let kind = kind.split(';').next().unwrap_or_default().trim().to_owned();
    if kind.starts_with("image/") {
        return field("content-length").map(|_| Answer::Picture);
    }
    let is_stream = ["multipart/", "video/", "audio/", "application/"];
    (!is_stream.iter().any(|prefix| kind.starts_with(prefix))).then_some(Answer::Other(kind))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_is_recognised_by_its_header() {
        let of = |kind: &str, more: &str| {
            of_head(&format!(
                "HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\n{more}\r\n"
            ))
        };
        assert_eq!(
            of("image/jpeg", "Content-Length: 99\r\n"),
            Some(Answer::Picture)
        );
        assert_eq!(
            of("text/html; charset=utf-8", ""),
            Some(Answer::Other("text/html".to_owned()))
        );
        for stream in [
            "multipart/x-mixed-replace; boundary=a",
            "image/jpeg",
            "video/mp4",
            "application/octet-stream",
        ] {
            assert_eq!(of(stream, ""), None, "{stream}");
        }
        assert_eq!(
            of_head("HTTP/1.1 302 Found\r\nContent-Type: text/html\r\n\r\n"),
            None
        );
        assert_eq!(of_head(""), None);
    }

    #[test]
    fn a_missing_server_and_other_protocols_give_no_answer() {
        assert_eq!(ask("http://127.0.0.1:1/x"), None);
        assert_eq!(ask("rtsp://127.0.0.1/x"), None);
    }
}
