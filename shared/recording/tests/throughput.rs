//! How fast pictures of four views are written and read. It prints figures and judges none:
//! `cargo test --workspace --test throughput -- --ignored --nocapture`.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(clippy::print_stdout, reason = "the test prints what it measures")]

use std::fs::{self, File};
use std::path::Path;
use std::time::Instant;

use messages::topic;
use recording::{About, Buffer, Entry, Kind, Writer, check, encode, in_order, read, scan};

const VIEWS: usize = 4;
const FRAMES: u64 = 60;
const PIXELS: usize = 640 * 480 * 3;

#[test]
#[ignore = "measures, and judges nothing"]
fn four_views_of_vga_are_written_and_read() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("throughput.mcap");
    let topics: Vec<String> = (0..VIEWS)
        .flat_map(|view| [topic::frame(view), topic::view_pose(view)])
        .collect();
    let pixels: Vec<u8> = (0..PIXELS).map(|at| (at * at % 251) as u8).collect();
    let (mut frame, mut pose) = (Vec::new(), Vec::new());
    for _ in 0..4 {
        let begin = Instant::now();
        let file = File::create(&path).unwrap();
        let mut writer = Writer::begin(file, &About::default(), &topics).unwrap();
        for nth in 0..FRAMES {
            let entry = Entry {
                log_time: nth + 1,
                publish_time: nth + 1,
                ..Entry::default()
            };
            // The session, and the frame.
            let stamp = [0_u64.to_le_bytes(), nth.to_le_bytes()].concat();
            frame.clear();
            encode(Kind::Frame, &stamp, &pixels, &mut frame);
            pose.clear();
            encode(Kind::ViewPose, &stamp, &[], &mut pose);
            for view in 0..VIEWS {
                writer.write(2 * view, &entry, &frame).unwrap();
                writer.write(2 * view + 1, &entry, &pose).unwrap();
            }
            if nth % 30 == 29 {
                writer.flush(&[0; 2 * VIEWS]).unwrap();
            }
        }
        writer.finish(&[0; 2 * VIEWS]).unwrap();
        let wrote = begin.elapsed();
        let mut file = File::open(&path).unwrap();
        let begin = Instant::now();
        let recording = scan(&mut file).unwrap();
        let scanned = begin.elapsed();
        let damaged = check(&mut file, &recording, |_| true).unwrap();
        assert!(damaged.is_empty() && recording.extent.is_complete);
        let checked = begin.elapsed();
        let tracks: Vec<_> = recording.tracks.values().collect();
        let mut buffer = Buffer::default();
        let mut n_bytes = 0;
        for (track, entry) in in_order(&tracks) {
            let message = read(&mut file, tracks[track].kind, &entry, &mut buffer).unwrap();
            n_bytes += message.elements.len();
        }
        assert_eq!(n_bytes, PIXELS * VIEWS * FRAMES as usize);
        let done = begin.elapsed();
        let rate = |took: std::time::Duration| n_bytes as f64 / 1e9 / took.as_secs_f64();
        println!(
            "written {:.2} GB/s, found in {:.1} ms, checked {:.2} GB/s, read {:.2} GB/s",
            rate(wrote),
            scanned.as_secs_f64() * 1e3,
            rate(checked - scanned),
            rate(done - checked),
        );
    }
    fs::remove_file(&path).unwrap();
}
