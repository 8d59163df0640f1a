//! Tests of properties that files state about themselves (rotations, trims, rates, covers, numbers, depths), and of a decoder's messages
//! about them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use footage::{PictureNumbers, Rotation, Size, Source, SourceInfo, SourceKind, SourceSpec, Turn};
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageBuffer, ImageEncoder as _, Luma};

use crate::clip::{SIZE, encode, frame, has_ffmpeg, write_images};

/// Options for a lossless film of independent pictures, in a container with display matrix and edit list.
const PNG: &[&str] = &["-c:v", "png"];

fn spec(path: &Path) -> SourceSpec {
    SourceSpec::new(path.to_str().unwrap())
}

/// Returns all frames with their numbers.
fn frames(spec: &SourceSpec) -> (SourceInfo, Vec<(u64, Vec<u8>)>) {
    let mut source = Source::open(spec).unwrap();
    let mut all = Vec::new();
    while let Some(it) = source.next_frame().unwrap() {
        all.push((it.index, it.rgb.to_vec()));
    }
    (source.info().clone(), all)
}

fn indices(spec: &SourceSpec) -> Vec<u64> {
    frames(spec).1.into_iter().map(|frame| frame.0).collect()
}

/// Replaces bytes after the name of a box.
fn patch(from: &Path, to: &str, (name, skipped): (&[u8; 4], usize), bytes: &[u8]) -> PathBuf {
    let mut file = fs::read(from).unwrap();
    let at = file.windows(4).position(|window| window == name).unwrap() + 4 + skipped;
    file[at..at + bytes.len()].copy_from_slice(bytes);
    let to = from.with_file_name(to);
    fs::write(&to, file).unwrap();
    to
}

/// Writes a copy with another display matrix.
fn turned(from: &Path, to: &str, [a, b, c, d]: [i32; 4]) -> PathBuf {
    let rows = [a, b, 0, c, d, 0].map(|number| (number << 16).to_be_bytes());
    patch(from, to, (b"tkhd", 40), rows.as_flattened())
}

#[test]
fn videos_are_rotated_by_their_display_matrix_on_request() {
    if !has_ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write_images(folder.path(), 2);
    let lying = encode(folder.path(), "lying.mov", PNG);
    let quarter = |degrees| Turn::clockwise(degrees).unwrap();
    for (matrix, due) in [
        ([1, 0, 0, 1], Some(quarter(0))),
        ([0, 1, -1, 0], Some(quarter(90))),
        ([-1, 0, 0, -1], Some(quarter(180))),
        ([0, -1, 1, 0], Some(quarter(270))),
        ([-1, 0, 0, 1], None),
        ([1, 0, 0, -1], None),
        ([0, 1, 1, 0], None),
        ([0, -1, -1, 0], None),
    ] {
        let film = turned(&lying, "turned.mov", matrix);
        let (info, stored) = frames(&spec(&film));
        assert_eq!(info.size, SIZE, "pixels are left as they are stored");
        assert!(
            due.is_none_or(|due| due == info.tag),
            "{matrix:?}: {}",
            info.tag
        );
        assert_eq!(footage::stored(&spec(&film)).unwrap(), (SIZE, info.tag));
        let (upright, shown) = frames(&SourceSpec::upright(film.to_str().unwrap()));
        assert_eq!(upright.size, info.tag.size(SIZE), "{matrix:?}");
        for ((_, stored), (_, shown)) in stored.into_iter().zip(shown) {
            assert!(info.tag.apply(SIZE, stored).1 == shown, "{matrix:?}");
        }
        let by_hand = SourceSpec {
            rotation: Rotation::By(quarter(270)),
            ..spec(&film)
        };
        assert_eq!(frames(&by_hand).0.size, Size::new(SIZE.height, SIZE.width));
    }
}

#[test]
fn every_photograph_of_a_folder_is_rotated_by_its_own_tag() {
    let folder = tempfile::tempdir().unwrap();
    for (nth, value) in [(0, 6_u8), (1, 8), (2, 6)] {
        let mut file = Vec::new();
        let encoder = JpegEncoder::new(&mut file);
        let picture = frame(nth);
        let [width, height] = [SIZE.width, SIZE.height].map(|value| value as u32);
        let written = encoder.write_image(&picture, width, height, ExtendedColorType::Rgb8);
        written.unwrap();
        let file = testkit::exif::tagged(&file, value);
        fs::write(folder.path().join(format!("{nth}.jpg")), file).unwrap();
    }
    let (info, upright) = frames(&SourceSpec::upright(folder.path().to_str().unwrap()));
    assert_eq!(info.size, Size::new(SIZE.height, SIZE.width));
    for (nth, (_, rgb)) in upright.into_iter().enumerate() {
        let alone = footage::read_upright(&folder.path().join(format!("{nth}.jpg")));
        assert!(alone.unwrap().1 == rgb, "picture {nth}");
    }
    assert_eq!(frames(&spec(folder.path())).0.size, SIZE);
}

#[test]
fn videos_are_shrunk_by_a_divisor_of_their_size_to_means_of_pixels() {
    if !has_ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("film.nut");
    let made = Command::new("ffmpeg")
        .args(["-nostdin", "-v", "error", "-f", "lavfi", "-i"])
        .args(["testsrc=size=72x60:duration=0.2", "-c:v", "ffv1"])
        .args(["-pix_fmt", "gbrp"])
        .arg(&path)
        .status();
    assert!(made.unwrap().success());
    let (whole, full) = frames(&spec(&path));
    assert_eq!((whole.size, whole.shrink), (Size::new(72, 60), 1));
    // 5 divides 60 but not 72.
    let (info, small) = frames(&SourceSpec {
        most_shrink: 5,
        min_side: 60,
        ..spec(&path)
    });
    assert_eq!((info.size, info.shrink), (Size::new(18, 15), 4));
    assert_eq!((small.len(), small.len()), (full.len(), 5));
    for ((_, full), (_, small)) in full.iter().zip(&small) {
        let mean = |x: usize, y: usize, channel: usize| {
            let cells = (0..16).map(|nth| (4 * x + nth % 4, 4 * y + nth / 4));
            let values = cells.map(|(x, y)| u32::from(full[(72 * y + x) * 3 + channel]));
            f64::from(values.sum::<u32>()) / 16.0
        };
        for (nth, value) in small.iter().enumerate() {
            let due = mean(nth / 3 % 18, nth / 54, nth % 3);
            assert!(
                (f64::from(*value) - due).abs() <= 2.0,
                "{nth}: {value}, {due}"
            );
        }
    }
    // A rotated film is shrunk before it is rotated.
    let (info, _) = frames(&SourceSpec {
        most_shrink: 3,
        rotation: Rotation::By(Turn::clockwise(90).unwrap()),
        ..spec(&path)
    });
    assert_eq!((info.size, info.shrink), (Size::new(20, 24), 3));
}

#[test]
fn shrunk_pictures_sent_as_planes_have_the_colours_of_the_decoder() {
    if !has_ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for space in ["smpte170m", "bt709"] {
        // This container stores the standard of the colours.
        let path = folder.path().join(format!("{space}.mkv"));
        let made = Command::new("ffmpeg")
            .args(["-nostdin", "-v", "error", "-f", "lavfi", "-i"])
            .args(["testsrc=size=96x64:duration=0.1", "-c:v", "ffv1"])
            .args(["-vf", &format!("scale=out_color_matrix={space}")])
            .args([
                "-pix_fmt",
                "yuv420p",
                "-colorspace",
                space,
                "-color_range",
                "tv",
            ])
            .arg(&path)
            .status();
        assert!(made.unwrap().success());
        let decoded = Command::new("ffmpeg")
            .args(["-nostdin", "-v", "error", "-i"])
            .arg(&path)
            .args(["-vf", "scale=48:32:flags=area+accurate_rnd+full_chroma_int"])
            .args(["-pix_fmt", "rgb24", "-f", "rawvideo", "-"])
            .output()
            .unwrap();
        let (info, small) = frames(&SourceSpec {
            most_shrink: 2,
            ..spec(&path)
        });
        assert_eq!((info.size, info.shrink), (Size::new(48, 32), 2));
        let own: Vec<u8> = small.into_iter().flat_map(|(_, rgb)| rgb).collect();
        assert_eq!(own.len(), decoded.stdout.len());
        let differences = own.iter().zip(&decoded.stdout).map(|(a, b)| a.abs_diff(*b));
        let all: Vec<u8> = differences.collect();
        let mean = all.iter().map(|by| f64::from(*by)).sum::<f64>() / all.len() as f64;
        assert!(mean < 0.5, "{space}: {mean} of 255 on average");
    }
}

#[test]
fn frames_excluded_by_an_edit_list_are_skipped() {
    if !has_ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write_images(folder.path(), 9);
    let whole = encode(
        folder.path(),
        "whole.mov",
        &[PNG, &["-video_track_timescale", "100"]].concat(),
    );
    let (_, all) = frames(&spec(&whole));
    // The edit list begins at the third frame and shows four frames of 40 ms. The unit of the film is a millisecond, and the unit of the
    // track is 10 ms.
    let edit = [160_u32.to_be_bytes(), 8_u32.to_be_bytes()];
    let trimmed = patch(&whole, "trimmed.mov", (b"elst", 8), edit.as_flattened());
    let (info, shown) = frames(&spec(&trimmed));
    assert_eq!((info.n_frames, shown.len()), (4, 4));
    for (nth, (index, rgb)) in shown.into_iter().enumerate() {
        assert_eq!(index, nth as u64);
        assert!(rgb == all[nth + 2].1, "frame {nth}");
    }
}

#[test]
fn a_raw_stream_has_all_its_pictures_and_no_invented_rate() {
    if !has_ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write_images(folder.path(), 6);
    for name in ["film.mjpeg", "film.jpg", "film.m2v"] {
        let format = if name == "film.m2v" {
            "mpeg2video"
        } else {
            "mjpeg"
        };
        let film = encode(folder.path(), name, &["-f", format, "-bf", "0"]);
        let (info, all) = frames(&spec(&film));
        assert_eq!(
            (info.kind, info.n_frames, all.len()),
            (SourceKind::Video, 6, 6),
            "{name}"
        );
        let tells = name == "film.m2v";
        assert_eq!(info.frame_rate_hz, tells.then_some(25.0), "{name}");
        assert!(all.windows(2).all(|pair| pair[0].1 != pair[1].1), "{name}");
        let told = SourceSpec {
            frame_rate_hz: Some(60.0),
            start: 2,
            step: 2,
            ..spec(&film)
        };
        assert_eq!(indices(&told), [2, 4], "{name}");
        let due = if tells { 12.5 } else { 30.0 };
        assert_eq!(Source::open(&told).unwrap().info().frame_rate_hz, Some(due));
    }
}

#[test]
fn the_video_is_read_instead_of_the_cover_picture_before_it() {
    if !has_ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write_images(folder.path(), 5);
    let film = encode(folder.path(), "film.mov", PNG);
    let cover = folder.path().join("cover.png");
    image::RgbImage::new(200, 200).save(&cover).unwrap();
    for (name, more) in [
        ("marked.mp4", &["-disposition:v:0", "attached_pic"][..]),
        ("single.mov", &[]),
        ("single.mkv", &[]),
    ] {
        let with_cover = folder.path().join(name);
        let made = Command::new("ffmpeg")
            .args(["-nostdin", "-v", "error", "-i"])
            .arg(&cover)
            .arg("-i")
            .arg(&film)
            .args([
                "-map", "0", "-map", "1", "-c:v:0", "mjpeg", "-c:v:1", "libx264", "-pix_fmt",
                "yuv444p",
            ])
            .args(more)
            .arg(&with_cover)
            .status();
        assert!(made.unwrap().success());
        let (info, all) = frames(&spec(&with_cover));
        assert_eq!((info.size, all.len()), (SIZE, 5), "{name}");
    }
}

/// Writes a sequence of JPEG pictures, some of which are truncated, in a container.
fn cut(folder: &Path, name: &str, is_cut: impl Fn(usize) -> bool) -> PathBuf {
    let mut stream = Vec::new();
    for nth in 0..8 {
        let mut file = Vec::new();
        frame(nth).write_with_encoder(JpegEncoder::new(&mut file)).unwrap();
        let n = if is_cut(nth) {
            file.len() * 7 / 10
        } else {
            file.len()
        };
        stream.extend_from_slice(&file[..n]);
    }
    let raw = folder.join("raw.mjpeg");
    fs::write(&raw, stream).unwrap();
    let film = folder.join(name);
    let made = Command::new("ffmpeg")
        .args([
            "-nostdin",
            "-v",
            "error",
            "-y",
            "-f",
            "image2pipe",
            "-c:v",
            "mjpeg",
            "-framerate",
            "25",
            "-i",
        ])
        .arg(raw)
        .args(["-c", "copy"])
        .arg(&film)
        .status();
    assert!(made.unwrap().success());
    film
}

#[test]
fn truncated_pictures_are_left_out_and_counted() {
    if !has_ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for name in ["cut.avi", "cut.mkv", "cut.mov"] {
        let film = cut(folder.path(), name, |nth| [0, 3, 4].contains(&nth));
        let mut source = Source::open(&spec(&film)).unwrap();
        let mut found = Vec::new();
        while let Some(it) = source.next_frame().unwrap() {
            found.push(it.index);
        }
        assert_eq!(found, [1, 2, 5, 6, 7], "{name}");
        let complaints = source.complaints();
        assert_eq!(complaints.undecoded, 3, "{name}: {complaints:?}");
    }
    let whole = cut(folder.path(), "whole.avi", |_| false);
    let mut source = Source::open(&spec(&whole)).unwrap();
    assert_eq!(source.skip(99).unwrap(), 8);
    assert_eq!(source.complaints().messages, 0);
}

#[test]
fn numbered_pictures_get_their_numbers_as_frame_numbers() {
    let folder = tempfile::tempdir().unwrap();
    write_images(folder.path(), 12);
    for nth in [4, 5, 9] {
        fs::remove_file(folder.path().join(format!("im{nth}.png"))).unwrap();
    }
    for name in ["", "im%d.png", "im*.png"] {
        let path = folder.path().join(name);
        let all: Vec<u64> = [1, 2, 3, 6, 7, 8, 10, 11, 12].into();
        assert_eq!(
            footage::picture_numbers(path.to_str().unwrap()).unwrap(),
            Some(all)
        );
        let numbered = SourceSpec {
            numbers: Some(PictureNumbers { first: 0, step: 1 }),
            ..spec(&path)
        };
        assert_eq!(indices(&numbered), [1, 2, 3, 6, 7, 8, 10, 11, 12]);
        let part = SourceSpec {
            start: 2,
            step: 2,
            count: Some(4),
            ..numbered
        };
        assert_eq!(indices(&part), [2, 6, 8]);
        let mut source = Source::open(&part).unwrap();
        assert_eq!(source.info().n_frames, 4);
        assert_eq!(
            source.skip(2).unwrap(),
            2,
            "a frame without a picture counts"
        );
        assert_eq!(source.next_frame().unwrap().unwrap().index, 6);
        assert_eq!(indices(&spec(&path)).len(), 9, "in their order");
    }
}

#[test]
fn pictures_with_12_bits_of_16_are_scaled() {
    let folder = tempfile::tempdir().unwrap();
    for (nth, brightest) in [(0, 900), (1, 4000)] {
        let ramp =
            ImageBuffer::<Luma<u16>, _>::from_fn(64, 2, |x, _| Luma([(x * brightest / 63) as u16]));
        ramp.save(folder.path().join(format!("{nth}.png"))).unwrap();
    }
    let (info, all) = frames(&spec(folder.path()));
    let depth = info.depth.unwrap();
    assert_eq!((depth.bits, depth.brightest), (12, 4000));
    let most = |nth: usize| all[nth].1.iter().copied().max().unwrap();
    assert_eq!([most(0), most(1)], [56, 249]);
}

#[test]
fn interlaced_videos_are_reported() {
    if !has_ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write_images(folder.path(), 3);
    let options = ["-c:v", "mpeg2video", "-flags", "+ilme+ildct", "-top", "1"];
    let film = encode(folder.path(), "film.ts", &options);
    assert!(frames(&spec(&film)).0.is_interlaced);
    let film = encode(folder.path(), "film.mov", PNG);
    assert!(!frames(&spec(&film)).0.is_interlaced);
}
