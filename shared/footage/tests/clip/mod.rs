//! A small synthetic clip, and functions that write it to files.

use std::path::{Path, PathBuf};
use std::process::Command;

use footage::Size;
use image::RgbImage;

/// Size of the clip. It is odd on purpose, so that rows are not aligned in memory.
pub(crate) const SIZE: Size = Size::new(67, 45);

/// Returns a ramp with a moving square. Every frame differs in every channel.
pub(crate) fn frame(index: usize) -> RgbImage {
    RgbImage::from_fn(SIZE.width as u32, SIZE.height as u32, |x, y| {
        let (left, n) = (4 * index as u32, index as u8);
        if (left..left + 9).contains(&x) && (10..19).contains(&y) {
            image::Rgb([255, n, 0])
        } else {
            image::Rgb([3 * x as u8, 5 * y as u8, n.wrapping_mul(17)])
        }
    })
}

/// Writes `im1.png`, `im2.png`, ..., `im10.png`, ... into `folder`.
pub(crate) fn write_images(folder: &Path, n: usize) {
    for index in 0..n {
        let path = folder.join(format!("im{}.png", index + 1));
        frame(index).save(path).unwrap();
    }
}

/// Returns true if ffmpeg is available. Otherwise, prints that the test is skipped.
#[expect(clippy::print_stderr, reason = "a skipped test must say so")]
pub(crate) fn has_ffmpeg() -> bool {
    let is_there = Command::new("ffmpeg").arg("-version").output().is_ok();
    if !is_there {
        eprintln!("skipped: there is no ffmpeg on the PATH");
    }
    is_there
}

/// Encodes the images of `write_images` with 25 frames per second.
pub(crate) fn encode(folder: &Path, name: &str, options: &[&str]) -> PathBuf {
    let path = folder.join(name);
    let output = Command::new("ffmpeg")
        .args(["-nostdin", "-v", "error", "-y", "-framerate", "25", "-i"])
        .arg(folder.join("im%d.png"))
        .args(options)
        .arg(&path)
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    path
}

/// Options for lossless encoding with every third frame a key frame.
pub(crate) const FFV1: &[&str] = &["-c:v", "ffv1", "-pix_fmt", "gbrp", "-g", "3"];
