//! C3D files, in all encodings.
#![no_main]

use c3d::C3d;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    if let Ok(trial) = C3d::parse(input) {
        let n_points = trial.n_frames() * trial.n_points();
        assert!(8 * n_points <= input.len() || trial.n_points() == 0);
        for frame in 0..trial.n_frames() {
            assert_eq!(trial.frame(frame).len(), trial.n_points());
        }
    }
});
