//! The part of HTTP that a page of a few files needs: one request and one response per connection.

use core::time::Duration;
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::Instant;

use tungstenite::handshake::machine::TryParse as _;
use tungstenite::handshake::server::Request;

/// Largest size of a request, in bytes.
const LARGEST_REQUEST: usize = 16 << 10;

/// A connection with a fixed deadline, whatever the other end does.
#[derive(Debug)]
pub(crate) struct Timed<'s> {
    pub(crate) stream: &'s TcpStream,
    pub(crate) until: Instant,
}

impl Timed<'_> {
    fn left(&self) -> io::Result<Option<Duration>> {
        let left = self.until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        Ok(Some(left))
    }
}

impl Read for Timed<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.stream.set_read_timeout(self.left()?)?;
        self.stream.read(buffer)
    }
}

impl Write for Timed<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stream.set_write_timeout(self.left()?)?;
        self.stream.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// A request, and the bytes that follow it.
#[derive(Debug)]
pub(crate) struct Asked {
    pub(crate) request: Request,
    pub(crate) rest: Vec<u8>,
}

/// Reads a request, or returns the response to invalid data.
///
/// # Errors
///
/// Fails if the connection ended or failed.
pub(crate) fn read(from: &mut impl Read) -> io::Result<Result<Asked, Answer>> {
    let mut bytes = Vec::new();
    let mut buffer = [0; 2048];
    loop {
        match Request::try_parse(&bytes) {
            Ok(Some((n, request))) => {
                let rest = bytes.split_off(n);
                return Ok(Ok(Asked { request, rest }));
            }
            Ok(None) if bytes.len() >= LARGEST_REQUEST => {
                return Ok(Err(Answer::text(431, "the request is too long")));
            }
            Ok(None) => {}
            Err(why) => return Ok(Err(Answer::text(400, &why.to_string()))),
        }
        match from.read(&mut buffer)? {
            0 => return Err(io::ErrorKind::UnexpectedEof.into()),
            n => bytes.extend(&buffer[..n]),
        }
    }
}

/// A response.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Answer {
    pub(crate) status: u16,
    kind: &'static str,
    content: String,
}

impl Answer {
    /// Creates a response with a text file.
    ///
    /// * `kind`: media type of the text, for example `text/css`.
    pub(crate) fn file(kind: &'static str, content: &str) -> Self {
        Self {
            status: 200,
            kind,
            content: content.to_owned(),
        }
    }

    /// Creates a response with a sentence, for example the reason for a refusal.
    pub(crate) fn text(status: u16, content: &str) -> Self {
        Self {
            status,
            kind: "text/plain",
            content: content.to_owned(),
        }
    }

    /// Writes the response with additional headers, and announces that the connection will close.
    ///
    /// # Errors
    ///
    /// Fails if the connection failed.
    pub(crate) fn write(&self, to: &mut impl Write, more: &[(&str, &str)]) -> io::Result<()> {
        let reason = match self.status {
            200 => "OK",
            400 => "Bad Request",
            403 => "Forbidden",
            404 => "Not Found",
            431 => "Request Header Fields Too Large",
            503 => "Service Unavailable",
            _ => "",
        };
        let mut text = format!(
            "HTTP/1.1 {} {reason}\r\nContent-Type: {}; charset=utf-8\r\nContent-Length: {}\r\nConnection: close\r\n",
            self.status,
            self.kind,
            self.content.len()
        );
        for (name, value) in more {
            text.extend([name, ": ", value, "\r\n"]);
        }
        text += "\r\n";
        text += &self.content;
        to.write_all(text.as_bytes())?;
        to.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(text: &str) -> u16 {
        match read(&mut text.as_bytes()) {
            Ok(Ok(_)) => 200,
            Ok(Err(answer)) => answer.status,
            Err(_) => 0,
        }
    }

    #[test]
    fn a_request_is_parsed_and_following_bytes_are_kept() {
        let text = "GET /view.js?x HTTP/1.1\r\nHost: here\r\n\r\nmore";
        let asked = read(&mut text.as_bytes()).unwrap().unwrap();
        assert_eq!(asked.request.uri().path(), "/view.js");
        assert_eq!(asked.request.headers()["host"], "here");
        assert_eq!(asked.rest, b"more");
    }

    #[test]
    fn invalid_requests_are_refused() {
        assert_eq!(status("nonsense\r\n\r\n"), 400);
        assert_eq!(status("POST / HTTP/1.1\r\nHost: here\r\n\r\n"), 400);
        assert_eq!(status("GET / HTTP/1.1\r\nHost: here\r\n"), 0);
        let long = format!("GET / HTTP/1.1\r\nX: {}\r\n\r\n", "x".repeat(1 << 20));
        assert_eq!(status(&long), 431);
    }

    #[test]
    fn an_answer_has_its_length_and_headers() {
        let mut written = Vec::new();
        let answer = Answer::text(404, "none");
        answer.write(&mut written, &[("X", "y")]).unwrap();
        let expected = "HTTP/1.1 404 Not Found\r\nContent-Type: text/plain; charset=utf-8\r\nContent-Length: 4\r\n\
            Connection: close\r\nX: y\r\n\r\nnone";
        assert_eq!(String::from_utf8(written).unwrap(), expected);
    }

    #[test]
    fn a_connection_is_closed_after_its_timeout() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let _other = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let stream = listener.accept().unwrap().0;
        let begin = Instant::now();
        let mut timed = Timed {
            stream: &stream,
            until: begin + Duration::from_millis(50),
        };
        read(&mut timed).unwrap_err();
        assert!(begin.elapsed() < Duration::from_secs(5));
    }
}
