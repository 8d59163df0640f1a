//! Tests with HTTP cameras that behave unusually.

use std::io::{Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::thread;
use std::time::Duration;

use footage::StreamSpec;
use image::codecs::jpeg::JpegEncoder;

use crate::clip::{SIZE, frame, has_ffmpeg};

/// Starts a camera that sends this answer to every client, and returns its address.
fn camera(answer: fn(&mut TcpStream, &[u8]) -> std::io::Result<()>) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let serve = move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            let answer_one = move || {
                let mut jpeg = Vec::new();
                let picture = frame(3);
                picture.write_with_encoder(JpegEncoder::new(&mut jpeg)).unwrap();
                let mut request = [0; 4096];
                let read = stream.read(&mut request);
                // A client may close the connection before the end of the answer.
                read.and_then(|_| answer(&mut stream, &jpeg)).ok();
            };
            thread::Builder::new().spawn(answer_one).unwrap();
        }
    };
    thread::Builder::new().spawn(serve).unwrap();
    format!("http://{address}/stream")
}

/// Sends pictures for two seconds, each with a text before and after it.
fn pictures(to: &mut TcpStream, jpeg: &[u8], [before, behind]: [&str; 2]) -> std::io::Result<()> {
    to.write_all(
        b"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=12345\r\n\r\n",
    )?;
    for _ in 0..40 {
        let n = jpeg.len();
        write!(
            to,
            "{before}Content-Type: image/jpeg\r\nContent-Length: {n}\r\n\r\n"
        )?;
        to.write_all(jpeg)?;
        to.write_all(behind.as_bytes())?;
        thread::sleep(Duration::from_millis(50));
    }
    Ok(())
}

#[test]
fn a_camera_without_a_first_boundary_has_pictures() {
    if !has_ffmpeg() {
        return;
    }
    let address = camera(|to, jpeg| pictures(to, jpeg, ["", "\r\n--12345\r\n"]));
    let spec = StreamSpec::new(address);
    assert_eq!(spec.probe().unwrap().0, SIZE);
    let bare = StreamSpec {
        is_bare: true,
        ..spec
    };
    let mut live = bare.open(SIZE).unwrap();
    let mut rgb = vec![0; SIZE.rgb_bytes()];
    for _ in 0..3 {
        live.next_into(&mut rgb).unwrap();
    }
    let address = camera(|to, jpeg| pictures(to, jpeg, ["--12345\r\n", "\r\n"]));
    assert_eq!(StreamSpec::new(address).probe().unwrap().0, SIZE);
}

#[test]
fn the_error_describes_an_answer_that_is_not_a_stream() {
    if !has_ffmpeg() {
        return;
    }
    let page = camera(|to, _| {
        let page = "<html><body>Sign in</body></html>";
        let n = page.len();
        write!(
            to,
            "HTTP/1.1 200 OK\r\nContent-Type: text/html\r\nContent-Length: {n}\r\n\r\n{page}"
        )
    });
    let single = camera(|to, jpeg| {
        let n = jpeg.len();
        write!(
            to,
            "HTTP/1.1 200 OK\r\nContent-Type: image/jpeg\r\nContent-Length: {n}\r\n\r\n"
        )?;
        to.write_all(jpeg)
    });
    for (address, due) in [
        (page, "the answer is a web page (text/html)"),
        (single, "a single picture"),
    ] {
        let error = StreamSpec::new(address).probe().unwrap_err().to_string();
        assert!(error.contains(due), "{error}");
    }
}
