//! Tests that a stream that is kept in its original form gives the same pictures when it is decoded later.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::clip;

use std::io::Write as _;
use std::net::TcpListener;
use std::process::Command;
use std::time::Duration;

use footage::{Piece, PieceKind, RemadeStream, Size, StreamSpec};

const SIZE: Size = Size {
    width: 64,
    height: 48,
};

/// Factors by which the decoders shrink the pictures.
const SHRINKS: [usize; 2] = [1, 4];

/// Returns a stream of 80 pictures, every fifth of which can be decoded independently. A decoder reads most of the stream to identify it.
fn stream() -> Vec<u8> {
    let made = Command::new("ffmpeg")
        .args([
            "-v",
            "error",
            "-f",
            "lavfi",
            "-i",
            "testsrc=size=64x48:rate=10",
        ])
        .args([
            "-frames:v",
            "20",
            "-c:v",
            "mpeg4",
            "-g",
            "5",
            "-f",
            "mpegts",
            "-",
        ])
        .output()
        .unwrap();
    made.stdout
}

/// Returns the pictures of a live stream with their times, and its pieces.
fn live(shrink: usize) -> (Vec<(i64, Vec<u8>)>, Vec<Piece>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp://{}", listener.local_addr().unwrap());
    let server = std::thread::Builder::new().spawn(move || {
        let (mut client, _) = listener.accept().unwrap();
        // The decoder may end before it has read everything.
        client.write_all(&stream()).ok();
    });
    let spec = StreamSpec {
        keeps: true,
        most_shrink: shrink,
        ..StreamSpec::new(address)
    };
    let mut live = spec.open(SIZE).unwrap();
    let mut pictures = Vec::new();
    let mut rgb = vec![0; SIZE.shrunk(shrink).rgb_bytes()];
    while let Ok(frame) = live.next_into(&mut rgb) {
        pictures.push((frame.label_nanos, rgb.clone()));
    }
    server.unwrap().join().unwrap();
    let pieces = live.pieces().unwrap();
    let mut all: Vec<Piece> = Vec::new();
    let n_all = |all: &[Piece]| all.iter().filter(|piece| piece.kind != PieceKind::Head).count();
    for _ in 0..2000 {
        all.extend(core::iter::from_fn(|| pieces.next()));
        if n_all(&all) >= pictures.len() {
            break;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(pieces.take_lost(), 0);
    (pictures, all)
}

#[test]
fn a_recorded_stream_decodes_to_the_same_pictures() {
    if !clip::has_ffmpeg() {
        return;
    }
    for shrink in SHRINKS {
        let (pictures, pieces) = live(shrink);
        assert!(pictures.len() >= 3, "{}", pictures.len());
        let n_heads = pieces.iter().filter(|piece| piece.kind == PieceKind::Head).count();
        assert!(
            n_heads >= 1,
            "before every picture that needs no other: {n_heads}"
        );
        let is_first_head = |nth: usize, it: &Piece| nth == 0 || it.kind != PieceKind::Head;
        let bytes: Vec<Vec<u8>> = pieces
            .iter()
            .enumerate()
            .filter(|(nth, it)| is_first_head(*nth, it))
            .map(|piece| piece.1.bytes.clone())
            .collect();
        let mut again = RemadeStream::open("kept", bytes.into_iter(), SIZE, shrink).unwrap();
        let mut rgb = vec![0; SIZE.shrunk(shrink).rgb_bytes()];
        let mut n_same = 0;
        while let Some(label) = again.next_into(&mut rgb).unwrap() {
            let is_it = |frame: &&(i64, Vec<u8>)| frame.0.abs_diff(label) <= 1_000_000;
            if let Some((_, expected)) = pictures.iter().find(is_it) {
                assert!(rgb == *expected, "the picture at {label}");
                n_same += 1;
            }
        }
        assert!(n_same >= 3, "{n_same} of {}", pictures.len());
    }
}
