//! Tests that errors for invalid footage name the file, and that nothing panics.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::clip;

use std::fs;
use std::path::Path;

use footage::{FootageError, Size, Source, SourceSpec};
use proptest::prelude::*;
use tempfile::TempDir;

fn spec(path: &Path) -> SourceSpec {
    SourceSpec::new(path.to_str().unwrap())
}

fn refusal(path: &Path) -> FootageError {
    Source::open(&spec(path)).unwrap_err()
}

/// Reads to the end or to the first error. Returns the number of frames.
fn read_all(spec: &SourceSpec) -> Result<u64, FootageError> {
    let mut source = Source::open(spec)?;
    let mut n = 0;
    let outcome = loop {
        match source.next_frame() {
            Ok(Some(_)) => n += 1,
            Ok(None) => break Ok(n),
            Err(error) => break Err(error),
        }
    };
    assert!(
        matches!(source.next_frame(), Ok(None)),
        "no frame after the end"
    );
    outcome
}

fn named(error: &FootageError, name: &str) {
    let text = error.to_string();
    assert!(text.contains(name), "{text} does not name {name}");
}

fn images(n: usize) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    clip::write_images(folder.path(), n);
    folder
}

#[test]
fn missing_files_and_empty_patterns_are_refused() {
    let folder = images(0);
    let error = refusal(&folder.path().join("absent.mp4"));
    assert!(matches!(error, FootageError::NotFound { .. }), "{error}");
    named(&error, "absent.mp4");
    for name in ["", "*.png", "im%05d.png"] {
        let error = refusal(&folder.path().join(name));
        assert!(matches!(error, FootageError::NoImages { .. }), "{error}");
        named(&error, name);
    }
    let error = refusal(&folder.path().join("a**b[.png"));
    assert!(matches!(error, FootageError::BadPattern { .. }), "{error}");
}

#[test]
fn empty_files_are_refused() {
    let folder = images(2);
    for name in ["zero.png", "zero.mp4", "zero"] {
        let path = folder.path().join(name);
        fs::write(&path, []).unwrap();
        let error = refusal(&path);
        assert!(matches!(error, FootageError::Empty { .. }), "{error}");
        named(&error, name);
    }
    fs::write(folder.path().join("im2.png"), []).unwrap();
    let error = read_all(&spec(&folder.path().join("im*.png"))).unwrap_err();
    assert!(matches!(error, FootageError::Empty { .. }), "{error}");
}

#[test]
fn truncated_images_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for format in ["png", "jpg", "bmp"] {
        let path = folder.path().join(format!("cut.{format}"));
        clip::frame(0).save(&path).unwrap();
        assert_eq!(read_all(&spec(&path)).unwrap(), 1, "{format}");
        let whole = fs::read(&path).unwrap();
        for share in [0.2, 0.5, 0.9] {
            fs::write(&path, &whole[..(whole.len() as f64 * share) as usize]).unwrap();
            let error = read_all(&spec(&path)).unwrap_err();
            assert!(
                matches!(error, FootageError::Image { .. }),
                "{format} {share} {error}"
            );
            named(&error, &format!("cut.{format}"));
        }
    }
}

#[test]
fn a_text_file_named_as_an_image_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("text.png");
    fs::write(&path, "this is a text, whatever its name says").unwrap();
    let error = refusal(&path);
    assert!(matches!(error, FootageError::Image { .. }), "{error}");
    named(&error, "text.png");
}

#[test]
fn an_image_of_another_size_in_a_sequence_is_refused() {
    let folder = images(4);
    let odd = image::RgbImage::new(50, 45);
    odd.save(folder.path().join("im3.png")).unwrap();
    let error = read_all(&spec(folder.path())).unwrap_err();
    let FootageError::SizeDiffers {
        found, expected, ..
    } = &error
    else {
        panic!("{error}");
    };
    assert_eq!((*found, *expected), (Size::new(50, 45), clip::SIZE));
    for part in ["im3.png", "50x45", "67x45", "im1.png"] {
        named(&error, part);
    }
}

#[test]
fn images_smaller_than_the_minimum_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dot.png");
    image::RgbImage::new(1, 1).save(&path).unwrap();
    assert_eq!(read_all(&spec(&path)).unwrap(), 1);
    let wanted = SourceSpec {
        min_side: 40,
        ..spec(&path)
    };
    let error = Source::open(&wanted).unwrap_err();
    assert!(matches!(error, FootageError::TooSmall { .. }), "{error}");
    for part in ["dot.png", "1x1", "40"] {
        named(&error, part);
    }
}

#[test]
fn a_header_with_a_huge_size_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bomb.bmp");
    clip::frame(0).save(&path).unwrap();
    let mut bytes = fs::read(&path).unwrap();
    bytes[18..26].copy_from_slice(&[0xff, 0xff, 0, 0, 0xff, 0xff, 0, 0]);
    fs::write(&path, bytes).unwrap();
    let error = refusal(&path);
    assert!(matches!(error, FootageError::Image { .. }), "{error}");
    named(&error, "bomb.bmp");
}

#[test]
fn a_start_beyond_the_end_is_refused() {
    let folder = images(3);
    let late = SourceSpec {
        start: 3,
        ..spec(folder.path())
    };
    let error = Source::open(&late).unwrap_err();
    assert!(
        matches!(
            error,
            FootageError::StartBeyondEnd {
                start: 3,
                n_frames: 3,
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn a_missing_ffprobe_is_an_error_with_advice() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("video.mp4");
    fs::write(&path, "could be a video").unwrap();
    let without = SourceSpec {
        ffprobe: "no-such-ffprobe".into(),
        ..spec(&path)
    };
    let error = Source::open(&without).unwrap_err();
    assert!(
        matches!(error, FootageError::FfmpegMissing { .. }),
        "{error}"
    );
    for part in [
        "no-such-ffprobe",
        "video.mp4",
        "apt-get install ffmpeg",
        "PATH",
    ] {
        named(&error, part);
    }
}

#[test]
fn a_missing_ffmpeg_is_an_error() {
    if !clip::has_ffmpeg() {
        return;
    }
    let folder = images(3);
    let path = clip::encode(folder.path(), "a.mkv", clip::FFV1);
    let without = SourceSpec {
        ffmpeg: "no-such-ffmpeg".into(),
        ..spec(&path)
    };
    let error = Source::open(&without).unwrap_err();
    assert!(
        matches!(error, FootageError::FfmpegMissing { .. }),
        "{error}"
    );
    named(&error, "no-such-ffmpeg");
}

#[test]
fn files_that_are_not_videos_are_refused() {
    if !clip::has_ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for name in ["text.mp4", "text.txt", "-text.mkv", "noise.avi"] {
        let path = folder.path().join(name);
        let noise: Vec<u8> =
            (0_u32..5000).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let text = b"this is a text, whatever its name says\n";
        fs::write(
            &path,
            if name.starts_with("noise") {
                &noise[..]
            } else {
                text
            },
        )
        .unwrap();
        let error = read_all(&spec(&path)).unwrap_err();
        assert!(
            matches!(error, FootageError::Video { .. }),
            "{name}: {error}"
        );
        named(&error, name);
    }
}

#[test]
fn a_video_without_a_video_stream_is_refused() {
    if !clip::has_ffmpeg() {
        return;
    }
    let folder = images(1);
    let sound = ["-f", "lavfi", "-i", "sine=duration=0.1", "-map", "1:a"];
    let path = clip::encode(folder.path(), "sound.wav", &sound);
    let error = refusal(&path);
    assert!(matches!(error, FootageError::Video { .. }), "{error}");
    named(&error, "no video stream");
}

#[test]
fn truncated_videos_are_an_error() {
    if !clip::has_ffmpeg() {
        return;
    }
    let folder = images(12);
    let early_index: &[&str] = &["-c:v", "png", "-movflags", "faststart"];
    for (name, options) in [
        ("cut.mkv", clip::FFV1),
        ("cut.avi", clip::FFV1),
        ("cut.mov", early_index),
    ] {
        let path = clip::encode(folder.path(), name, options);
        assert_eq!(read_all(&spec(&path)).unwrap(), 12, "{name}");
        let whole = fs::read(&path).unwrap();
        fs::write(&path, &whole[..whole.len() * 6 / 10]).unwrap();
        let error = read_all(&spec(&path)).unwrap_err();
        let FootageError::VideoTruncated {
            n_read, n_expected, ..
        } = &error
        else {
            panic!("{name}: {error}");
        };
        assert!((4..12).contains(n_read), "{name}: {error}");
        assert_eq!(*n_expected, 12, "{name}: {error}");
        named(&error, name);
    }
}

/// Returns the frames read from a video of 60 frames with damage in the middle: index and last pixel.
fn frames_of_damaged_video(start: u64, step: u64) -> Vec<(u64, [u8; 3])> {
    let folder = images(60);
    let options = [
        "-c:v", "libx264", "-qp", "0", "-pix_fmt", "yuv444p", "-g", "10", "-bf", "2",
    ];
    let path = clip::encode(folder.path(), "damaged.mp4", &options);
    let mut bytes = fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    let noise = (0..400_u32).map(|i| ((i * i * 31) >> 3) as u8);
    bytes[middle..middle + 400].copy_from_slice(&noise.collect::<Vec<_>>());
    fs::write(&path, bytes).unwrap();
    let spec = SourceSpec {
        start,
        step,
        ..spec(&path)
    };
    let mut source = Source::open(&spec).unwrap();
    let mut all = Vec::new();
    while let Some(frame) = source.next_frame().unwrap() {
        let corner = frame.rgb.last_chunk().copied().unwrap();
        assert_eq!(frame.time_s, Some(frame.index as f64 / 25.0));
        all.push((frame.index, corner));
    }
    all
}

#[test]
fn undecodable_frames_do_not_shift_the_others() {
    if !clip::has_ffmpeg() {
        return;
    }
    let whole = frames_of_damaged_video(0, 1);
    assert!((30..60).contains(&whole.len()), "{} frames", whole.len());
    assert_eq!(whole.last().map(|whole| whole.0), Some(59));
    assert!(whole.is_sorted_by(|a, b| a.0 < b.0));
    // The last group of pictures is undamaged, and every frame in it shows its number.
    for (index, corner) in whole.iter().filter(|whole| whole.0 >= 50) {
        let picture = clip::frame(*index as usize).into_raw();
        let expected = &picture[picture.len() - 3..];
        let off = corner.iter().zip(expected).map(|(a, b)| a.abs_diff(*b));
        assert!(
            off.max() <= Some(6),
            "frame {index}: {corner:?}, expected {expected:?}"
        );
    }
    let third = frames_of_damaged_video(1, 3);
    let expected = whole.iter().filter(|whole| whole.0 % 3 == 1);
    assert_eq!(third, expected.copied().collect::<Vec<_>>());
}

proptest! {
    #[test]
    fn any_bytes_of_an_image_file_are_read_or_refused(
        seed in 0_usize..3, edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..20),
        cut in any::<prop::sample::Index>(), noise in prop::collection::vec(any::<u8>(), 1..200),
        is_noise: bool,
    ) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(["x.png", "x.jpg", "x.bmp"][seed]);
        clip::frame(1).save(&path).unwrap();
        let mut bytes = fs::read(&path).unwrap();
        for (at, value) in edits {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if cut.index(4) == 0 {
            bytes.truncate(1 + cut.index(bytes.len()));
        }
        fs::write(&path, if is_noise { &noise } else { &bytes }).unwrap();
        // Either result is right, but reading must not panic.
        if let Err(error) = read_all(&spec(&path)) {
            named(&error, "x.");
        }
    }
}
