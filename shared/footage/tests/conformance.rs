//! Tests that one clip gives the same frames, whichever kind of footage it is stored as.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::clip;

use footage::{FrameView, Source, SourceKind, SourceSpec};

const N_FRAMES: usize = 12;

fn clip_frames(n: usize) -> Vec<Vec<u8>> {
    (0..n).map(|i| clip::frame(i).into_raw()).collect()
}

/// Checks the requirements that every source must meet.
///
/// * `expected`: all frames of the footage.
fn check_conformance(spec: &SourceSpec, expected: &[Vec<u8>]) {
    check_all_frames(spec, expected);
    for (start, step, count) in [
        (0, 1, Some(5)),
        (3, 1, None),
        (0, 4, None),
        (2, 3, Some(2)),
        (11, 1, None),
        (1, 100, Some(7)),
        (0, 1, Some(1000)),
    ] {
        check_chosen_frames(spec, expected, (start, step, count));
    }
    check_skipping(spec, expected);
}

fn check_all_frames(spec: &SourceSpec, expected: &[Vec<u8>]) {
    let mut source = Source::open(spec).unwrap();
    assert_eq!(source.info().size, clip::SIZE);
    assert_eq!(source.info().n_frames, expected.len() as u64);
    let mut buffer = vec![99; clip::SIZE.rgb_bytes()];
    for (index, rgb) in expected.iter().enumerate() {
        // Alternate between both ways of reading.
        if index % 2 == 0 {
            assert_frame(source.next_frame().unwrap(), index, rgb);
        } else {
            assert_frame(source.next_into(&mut buffer).unwrap(), index, rgb);
        }
    }
    for _ in 0..3 {
        assert_eq!(source.next_frame().unwrap(), None);
        assert_eq!(source.next_into(&mut buffer).unwrap(), None);
        assert_eq!(source.skip(1).unwrap(), 0);
    }
}

fn assert_frame(found: Option<FrameView<'_>>, index: usize, rgb: &[u8]) {
    let found = found.unwrap();
    assert_eq!(found.index, index as u64);
    let time_s = found.time_s.unwrap();
    assert!((time_s - index as f64 / 25.0).abs() < 1e-9, "{time_s}");
    assert!(found.rgb == rgb, "pixels of frame {index}");
}

fn check_chosen_frames(
    spec: &SourceSpec,
    expected: &[Vec<u8>],
    (start, step, count): (usize, usize, Option<usize>),
) {
    let spec = SourceSpec {
        start: start as u64,
        step: step as u64,
        count: count.map(|count| count as u64),
        ..spec.clone()
    };
    let indices = (start..expected.len()).step_by(step);
    let indices: Vec<usize> = indices.take(count.unwrap_or(usize::MAX)).collect();
    let mut source = Source::open(&spec).unwrap();
    assert_eq!(source.info().n_frames, indices.len() as u64, "{spec:?}");
    let rate_hz = source.info().frame_rate_hz.unwrap();
    assert!((rate_hz * step as f64 - 25.0).abs() < 1e-9, "{rate_hz}");
    for index in indices {
        assert_frame(source.next_frame().unwrap(), index, &expected[index]);
    }
    assert_eq!(source.next_frame().unwrap(), None, "{spec:?}");
}

fn check_skipping(spec: &SourceSpec, expected: &[Vec<u8>]) {
    let mut source = Source::open(spec).unwrap();
    assert_eq!(source.skip(0).unwrap(), 0);
    assert_eq!(source.skip(2).unwrap(), 2);
    assert_frame(source.next_frame().unwrap(), 2, &expected[2]);
    assert_eq!(source.skip(5).unwrap(), 5);
    assert_frame(source.next_frame().unwrap(), 8, &expected[8]);
    assert_eq!(source.skip(100).unwrap(), 3);
    assert_eq!(source.next_frame().unwrap(), None);
}

fn spec(path: &std::path::Path) -> SourceSpec {
    SourceSpec {
        frame_rate_hz: Some(25.0),
        ..SourceSpec::new(path.to_str().unwrap())
    }
}

fn kind(spec: &SourceSpec) -> SourceKind {
    Source::open(spec).unwrap().info().kind
}

#[test]
fn images_of_a_folder_or_glob_or_numbered_pattern_conform() {
    let folder = tempfile::tempdir().unwrap();
    clip::write_images(folder.path(), N_FRAMES);
    // A folder must ignore these files; a glob and a pattern do not match them.
    std::fs::write(folder.path().join("notes.txt"), "not an image").unwrap();
    std::fs::write(folder.path().join(".im0.png"), "hidden").unwrap();
    for name in ["", "im*.png", "im%d.png", "im%04d.png", "im[0-9]*.png"] {
        let spec = spec(&folder.path().join(name));
        assert_eq!(kind(&spec), SourceKind::Images, "{name}");
        check_conformance(&spec, &clip_frames(N_FRAMES));
    }
}

#[test]
fn a_still_image_is_repeated() {
    let folder = tempfile::tempdir().unwrap();
    clip::write_images(folder.path(), 1);
    let once = spec(&folder.path().join("im1.png"));
    assert_eq!(kind(&once), SourceKind::Still);
    check_all_frames(&once, &clip_frames(1));
    let often = SourceSpec {
        count: Some(12),
        ..once
    };
    let expected = vec![clip::frame(0).into_raw(); 12];
    check_all_frames(&often, &expected);
    check_skipping(&often, &expected);
}

#[test]
fn videos_of_several_codecs_and_containers_conform() {
    if !clip::has_ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    clip::write_images(folder.path(), N_FRAMES);
    for (name, options) in [
        ("ffv1.mkv", clip::FFV1),
        ("ffv1.avi", clip::FFV1),
        ("png.mov", &["-c:v", "png"][..]),
    ] {
        let spec = spec(&clip::encode(folder.path(), name, options));
        assert_eq!(kind(&spec), SourceKind::Video, "{name}");
        check_conformance(&spec, &clip_frames(N_FRAMES));
    }
}

#[test]
fn a_video_has_its_own_rate_and_images_use_the_given_rate() {
    let folder = tempfile::tempdir().unwrap();
    clip::write_images(folder.path(), 2);
    let path = folder.path().to_str().unwrap();
    let mut without_rate = Source::open(&SourceSpec::new(path)).unwrap();
    assert_eq!(without_rate.info().frame_rate_hz, None);
    assert_eq!(without_rate.next_frame().unwrap().unwrap().time_s, None);
    if clip::has_ffmpeg() {
        let video = clip::encode(folder.path(), "a.mkv", clip::FFV1);
        let wrong_rate = SourceSpec {
            frame_rate_hz: Some(99.0),
            ..spec(&video)
        };
        let source = Source::open(&wrong_rate).unwrap();
        assert_eq!(source.info().frame_rate_hz, Some(25.0));
    }
}

#[test]
fn frames_of_an_irregular_video_keep_their_own_times() {
    if !clip::has_ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    clip::write_images(folder.path(), 6);
    // Frames 3, 4 and 5 are delayed by a second.
    let late = "setpts=(N/25+gte(N\\,3))/TB";
    let options = ["-vf", late, "-fps_mode", "vfr", "-c:v", "png"];
    for name in ["irregular.mkv", "irregular.mov"] {
        let path = clip::encode(folder.path(), name, &options);
        let mut source = Source::open(&SourceSpec::new(path.to_str().unwrap())).unwrap();
        assert_eq!(source.info().n_frames, 6);
        let uneven_s = source.info().uneven_s.unwrap();
        assert!((uneven_s - 0.4).abs() < 2e-3, "{uneven_s}");
        for expect in [0.0, 0.04, 0.08, 1.12, 1.16, 1.2] {
            let time_s = source.next_frame().unwrap().unwrap().time_s.unwrap();
            assert!((time_s - expect).abs() < 2e-3, "{time_s} for {expect}");
        }
        assert_eq!(source.next_frame().unwrap(), None);
    }
}

#[test]
fn grey_alpha_and_deep_images_become_rgb() {
    let folder = tempfile::tempdir().unwrap();
    let rgb = image::DynamicImage::from(clip::frame(3));
    let mut see_through = rgb.to_rgba8();
    for pixel in see_through.pixels_mut() {
        pixel.0[3] = 77;
    }
    let grey = rgb.to_luma8();
    let grey_as_rgb = image::DynamicImage::from(grey.clone()).into_rgb8();
    let color = rgb.to_rgb8();
    let deep_grey = image::ImageBuffer::from_fn(grey.width(), grey.height(), |x, y| {
        image::Luma([257 * u16::from(grey[(x, y)].0[0])])
    });
    let cases: [(&str, image::DynamicImage, &image::RgbImage); 7] = [
        ("rgba.png", see_through.into(), &color),
        ("rgba.bmp", rgb.to_rgba8().into(), &color),
        ("deep.png", rgb.to_rgb16().into(), &color),
        ("deep_alpha.png", rgb.to_rgba16().into(), &color),
        ("grey.png", grey.clone().into(), &grey_as_rgb),
        ("grey_alpha.png", rgb.to_luma_alpha8().into(), &grey_as_rgb),
        ("deep_grey.png", deep_grey.into(), &grey_as_rgb),
    ];
    for (name, image, expect) in cases {
        let path = folder.path().join(name);
        image.save(&path).unwrap();
        let mut source = Source::open(&spec(&path)).unwrap();
        assert!(
            source.next_frame().unwrap().unwrap().rgb == expect.as_raw(),
            "{name}"
        );
    }
}
