//! Test of a room that a person enters and leaves, from rendered pictures to skeletons, without any settings.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

/// Tests that take long; `cargo test -- --ignored` runs them.
mod long {
    use std::ops::Range;
    use std::path::PathBuf;

    use image::RgbImage;
    use serde_json::Value;

    use crate::common::Case;

    const N_FRAMES: usize = 70;
    /// Frames in which the person is in the room.
    const THERE: Range<usize> = 20..55;

    fn picture(case: &Case, of: &str, camera: &str, frame: usize) -> PathBuf {
        case.path(&format!("room/{of}/{camera}/{frame:06}.png"))
    }

    /// Returns the empty room. The background behind the person is taken from a picture at another time.
    fn empty_room(case: &Case, camera: &str) -> RgbImage {
        let open = |of: &str, frame: usize| image::open(picture(case, of, camera, frame)).unwrap();
        let mut empty = open("cameras", 0).into_rgb8();
        let mut is_known = vec![false; (empty.width() * empty.height()) as usize];
        for frame in (0..N_FRAMES).step_by(3) {
            let shown = open("cameras", frame).into_rgb8();
            let mask = open("masks", frame).into_luma8();
            let pixels = empty.pixels_mut().zip(shown.pixels()).zip(mask.pixels());
            for (((empty, shown), mask), is_known) in pixels.zip(&mut is_known) {
                if mask.0 == [0] && !*is_known {
                    (*empty, *is_known) = (*shown, true);
                }
            }
        }
        empty
    }

    #[test]
    #[ignore = "takes long"]
    fn an_empty_room_has_no_skeleton_and_a_person_who_enters_gets_one() {
        let case = Case::new("entering", &[1, 1], "");
        let who = ["--rig", "ring:4", "--subjects", "907", "--seed", "12"];
        let frames = ["--frames", &N_FRAMES.to_string(), "--rate", "10"];
        case.start(&[&["synth", "room"], &who[..], &frames].concat()).wait().ends(0);
        for camera in ["c1", "c2", "c3", "c4"] {
            let empty = empty_room(&case, camera);
            for frame in (0..N_FRAMES).filter(|i| !THERE.contains(i)) {
                let mut noisy = empty.clone();
                // Noise is added, because identical pictures would look like those of a frozen camera.
                let mut random = fastrand::Rng::with_seed(frame as u64);
                for value in noisy.iter_mut() {
                    *value = value.saturating_add(random.u8(..8));
                }
                noisy.save(picture(&case, "cameras", camera, frame)).unwrap();
            }
        }
        let lossless = ["--set", "capture.mode=lossless"];
        let words = ["run", "room/deployment.toml", "--out", "out"];
        let ended = case.start(&[&words[..], &lossless].concat()).wait();
        // In an empty room, the cameras do not contradict each other, and the results do not contradict themselves.
        assert_eq!(
            ended.status.code(),
            Some(0),
            "{}\n{}",
            ended.stdout,
            ended.stderr
        );
        let text = std::fs::read_to_string(case.path("out/pose3d.jsonl")).unwrap();
        let is_found = |line: &str| {
            let line: Value = serde_json::from_str(line).unwrap();
            line["status"] == "ok"
        };
        let found: Vec<bool> = text.lines().map(is_found).collect();
        assert_eq!(found.len(), N_FRAMES);
        let count = |frames: Range<usize>| found[frames].iter().filter(|seen| **seen).count();
        assert_eq!(count(0..THERE.start), 0, "{found:?}");
        assert_eq!(count(THERE.end..N_FRAMES), 0, "{found:?}");
        // Every view searches for people once per second.
        let soon = THERE.start + 10;
        assert_eq!(count(soon..THERE.end), THERE.end - soon, "{found:?}");
    }
}
