//! Tests that a picture of a stream is available before the next one is sent.

use crate::clip;

use std::io::{Read as _, Write as _};
use std::net::TcpListener;
use std::process::Command;
use std::sync::mpsc::sync_channel;
use std::time::Duration;

use footage::{Size, StreamSpec};

const SIZE: Size = Size {
    width: 64,
    height: 48,
};
/// Number of pictures before the last one. A decoder reads some of them to identify the stream, and may lose the first picture.
const N: usize = 40;
/// Number of bytes of the picture after the last one. They are sent at one byte per second, which takes far longer than the test.
const N_BYTES: u64 = 120;

/// Returns a picture of one colour as JPEG, as a part of a stream over HTTP.
fn part(colour: &str) -> Vec<u8> {
    let picture = format!("color={colour}:size=64x48");
    let made = Command::new("ffmpeg")
        .args(["-v", "error", "-f", "lavfi", "-i", &picture])
        .args(["-frames:v", "1", "-f", "mjpeg", "-"])
        .output()
        .unwrap();
    let jpeg = made.stdout;
    let head = format!(
        "--next\r\nContent-Type: image/jpeg\r\nContent-Length: {}\r\n\r\n",
        jpeg.len()
    );
    [head.as_bytes(), &jpeg, b"\r\n"].concat()
}

#[test]
fn the_last_picture_of_a_stream_is_available_without_a_following_one() {
    if !clip::has_ffmpeg() {
        return;
    }
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("http://{}/camera", listener.local_addr().unwrap());
    let [black, white] = ["black", "white"].map(part);
    let (is_here, wait) = sync_channel::<()>(1);
    let server = std::thread::Builder::new().spawn(move || {
        let (mut client, _) = listener.accept().unwrap();
        assert!(client.read(&mut [0; 4096]).unwrap() > 0, "it asks");
        let head =
            "HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=next\r\n\r\n";
        client.write_all(head.as_bytes()).unwrap();
        for _ in 0..N {
            client.write_all(&black).unwrap();
        }
        client.write_all(&white).unwrap();
        // The next picture begins, byte by byte, so that the stream is not silent while the reader waits for the last picture.
        client.write_all(b"--next\r\nX-Wait: ").unwrap();
        for _ in 0..N_BYTES {
            if wait.recv_timeout(Duration::from_secs(1)).is_ok() || client.write_all(b"a").is_err()
            {
                break;
            }
        }
    });
    let mut live = StreamSpec::new(address).open(SIZE).unwrap();
    let end = live.end();
    let (done, over) = sync_channel::<()>(1);
    let watchdog = std::thread::Builder::new().spawn(move || {
        if over.recv_timeout(Duration::from_secs(N_BYTES / 2)).is_err() {
            end.end();
        }
    });
    let mut rgb = vec![0; SIZE.rgb_bytes()];
    let mut is_last = false;
    while !is_last && live.next_into(&mut rgb).is_ok() {
        is_last = rgb[0] > 200;
    }
    done.send(()).ok();
    is_here.send(()).ok();
    watchdog.unwrap().join().unwrap();
    server.unwrap().join().unwrap();
    assert!(is_last, "a picture waited for the one after it");
}
