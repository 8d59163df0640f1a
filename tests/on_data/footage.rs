//! The four videos of Pose2Sim's balancing trial: sizes, counts, first and last frames, and decoding times.

use std::time::{Duration, Instant};

use footage::{Affine, Fill, Size, Source, SourceKind, SourceSpec, Warp};

use crate::shared_dir;

/// Size of the pipeline's frames.
const OUTPUT: Size = Size::new(272, 480);

/// Returns a map to a quarter of the size, with a rotation of 28 degrees about the centre, which is the roll of cam04.
fn upright(source: Size) -> Affine {
    let (sin, cos) = 28_f64.to_radians().sin_cos();
    let linear = [[4.0 * cos, -4.0 * sin], [4.0 * sin, 4.0 * cos]];
    let middle = |size: Size| {
        [
            (size.width as f64 - 1.0) / 2.0,
            (size.height as f64 - 1.0) / 2.0,
        ]
    };
    let ([x, y], towards) = (middle(OUTPUT), middle(source));
    std::array::from_fn(|i| {
        let [a, b] = linear[i];
        [a, b, towards[i] - a * x - b * y]
    })
}

/// Returns the mean grey level.
fn mean(rgb: &[u8]) -> f64 {
    rgb.iter().map(|&rgb| f64::from(rgb)).sum::<f64>() / rgb.len() as f64
}

/// Reads a video to the end, and returns the mean times for decoding and for warping a frame.
fn read(path: &str, width: usize) -> [Duration; 2] {
    let mut source = Source::open(&SourceSpec::new(path)).unwrap();
    let info = source.info().clone();
    assert_eq!(info.kind, SourceKind::Video);
    assert_eq!(info.size, Size::new(width, 1920), "{path}");
    assert_eq!(
        (info.n_frames, info.frame_rate_hz),
        (100, Some(60.0)),
        "{path}"
    );
    let mut warp = Warp::new(info.size, OUTPUT, &upright(info.size), Fill::Black).unwrap();
    let mut out = vec![0; OUTPUT.rgb_bytes()];
    let [mut waited, mut warped] = [Duration::ZERO; 2];
    for index in 0..100 {
        let began = Instant::now();
        let frame = source.next_frame().unwrap().unwrap();
        waited += began.elapsed();
        assert_eq!(frame.index, index, "{path}");
        let began = Instant::now();
        warp.apply(frame.rgb, &mut out);
        warped += began.elapsed();
        // The room is bright, so the mean grey level is high. No frame has a uniform colour.
        assert!(
            (60.0..200.0).contains(&mean(&out)),
            "{path} {index}: {}",
            mean(&out)
        );
        assert!(out.iter().any(|&value| value > 230), "{path} {index}");
    }
    assert_eq!(source.next_frame().unwrap(), None, "{path}");
    [waited / 100, warped / 100]
}

#[test]
#[ignore = "needs ../shared"]
fn all_frames_of_all_cameras_are_read() {
    let Some(shared) = shared_dir() else { return };
    // The video of cam02 is VP9; all other videos are H.264.
    for (name, width) in [
        ("cam01", 1080),
        ("cam02", 1080),
        ("cam03", 1088),
        ("cam04", 1088),
    ] {
        let path = shared.join(format!("data/pose2sim_balancing/videos/{name}.mp4"));
        let [decode, warp] = read(path.to_str().unwrap(), width);
        eprintln!("{name}: {decode:.2?} a frame to decode, {warp:.2?} to turn and shrink");
    }
}

#[test]
#[ignore = "needs ../shared"]
fn reading_can_start_at_the_last_frame() {
    let Some(shared) = shared_dir() else { return };
    let path = shared.join("data/pose2sim_balancing/videos/cam02.mp4");
    let all = SourceSpec::new(path.to_str().unwrap());
    let mut source = Source::open(&all).unwrap();
    assert_eq!(source.skip(99).unwrap(), 99);
    let expect = source.next_frame().unwrap().unwrap().rgb.to_vec();
    let last = SourceSpec { start: 99, ..all };
    let mut source = Source::open(&last).unwrap();
    let frame = source.next_frame().unwrap().unwrap();
    assert_eq!(frame.index, 99);
    assert!(frame.rgb == expect);
}
