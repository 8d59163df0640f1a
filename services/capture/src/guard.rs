//! Checks the frames of a camera: the picture must change, and the clock must run.

use messages::Status;

/// Largest difference between a frame's time and the time expected from the previous frame. It is so large that gaps in a recording and
/// short delays of a camera do not count as clock jumps.
const JUMP_S: f64 = 2.0;

/// Keeps the state of a camera's last frame, to check the next frame. Does not read a clock.
#[derive(Debug)]
pub(crate) struct Guard {
    /// Number of repetitions from which a picture counts as frozen; 0 to disable the check.
    frozen_after: u32,
    /// Frames of the footage per second.
    rate_hz: Option<f64>,
    last_hash: Option<u64>,
    n_same: u32,
    /// Index and time of the last frame.
    last: Option<(u64, f64)>,
}

impl Guard {
    /// Creates a guard that has not seen a frame.
    ///
    /// * `frozen_after`: number of repetitions from which a picture counts as frozen; 0 to disable the check.
    /// * `rate_hz`: frame rate of the footage per second, counting all frames, not only the used frames.
    pub(crate) fn new(frozen_after: u32, rate_hz: Option<f64>) -> Self {
        Self {
            frozen_after,
            rate_hz,
            last_hash: None,
            n_same: 0,
            last: None,
        }
    }

    /// Returns the fault of a frame, if it has one.
    ///
    /// * `index`: index of the frame in the footage.
    /// * `time_s`: timestamp of the camera, in seconds.
    /// * `pixels`: pixels of the picture, which may have any size.
    pub(crate) fn check(
        &mut self,
        index: u64,
        time_s: Option<f64>,
        pixels: &[u8],
    ) -> Option<Status> {
        // Both checks need every frame, so neither is skipped if the other one fails.
        let of_picture = self.picture(pixels);
        let of_clock = time_s.and_then(|time_s| self.clock(index, time_s));
        of_clock.or(of_picture)
    }

    fn picture(&mut self, pixels: &[u8]) -> Option<Status> {
        if self.frozen_after == 0 {
            return None;
        }
        let hash = Some(fingerprint(pixels));
        self.n_same = if self.last_hash == hash {
            self.n_same.saturating_add(1)
        } else {
            0
        };
        self.last_hash = hash;
        (self.n_same >= self.frozen_after).then_some(Status::FROZEN)
    }

    fn clock(&mut self, index: u64, time_s: f64) -> Option<Status> {
        let (last_index, last_s) = self.last.replace((index, time_s))?;
        let passed_s = time_s - last_s;
        let n_frames = index.saturating_sub(last_index) as f64;
        let expected_s = self.rate_hz.map_or(passed_s, |rate_hz| n_frames / rate_hz);
        if passed_s == 0.0 {
            Some(Status::TIME_REPEATED)
        } else if passed_s < 0.0 {
            Some(Status::TIME_WENT_BACK)
        } else if passed_s - expected_s > JUMP_S || !time_s.is_finite() {
            Some(Status::CLOCK_JUMPED)
        } else {
            None
        }
    }
}

/// Returns a hash of all bytes, to distinguish pictures. It computes four independent hashes in parallel, so it is faster than a copy.
fn fingerprint(bytes: &[u8]) -> u64 {
    const PRIME: u64 = 0x9e37_79b9_7f4a_7c15;
    let mut lanes = [1, 2, 3, 4].map(|i: u64| i.wrapping_mul(PRIME));
    let chunks = bytes.chunks_exact(32);
    let mut rest = [0; 32];
    rest[..chunks.remainder().len()].copy_from_slice(chunks.remainder());
    for chunk in chunks.chain([&rest[..]]) {
        for (lane, word) in lanes.iter_mut().zip(chunk.chunks_exact(8)) {
            let mut bytes = [0; 8];
            bytes.copy_from_slice(word);
            *lane = (*lane ^ u64::from_le_bytes(bytes)).wrapping_mul(PRIME);
            *lane ^= *lane >> 29;
        }
    }
    let mix = |sum: u64, lane: &u64| (sum.rotate_left(17) ^ lane).wrapping_mul(PRIME);
    lanes.iter().fold(bytes.len() as u64, mix)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Returns the results for single-coloured pictures at 10 Hz.
    fn of_pictures(frozen_after: u32, colours: &[u8]) -> Vec<Option<Status>> {
        let mut guard = Guard::new(frozen_after, Some(10.0));
        let frames = colours.iter().enumerate();
        let check = |(index, colour): (usize, &u8)| {
            guard.check(index as u64, Some(index as f64 * 0.1), &[*colour; 50])
        };
        frames.map(check).collect()
    }

    /// Returns the results for timestamps at 10 Hz with changing pictures.
    fn of_times(times_s: &[f64]) -> Vec<Option<Status>> {
        let mut guard = Guard::new(2, Some(10.0));
        let frames = times_s.iter().enumerate();
        let check = |(index, time_s): (usize, &f64)| {
            guard.check(index as u64, Some(*time_s), &[index as u8; 50])
        };
        frames.map(check).collect()
    }

    #[test]
    fn a_picture_counts_as_frozen_from_the_nth_repetition_until_it_changes() {
        let frozen = Some(Status::FROZEN);
        let got = of_pictures(2, &[1, 1, 2, 2, 2, 2, 3, 3]);
        assert_eq!(got, [None, None, None, None, frozen, frozen, None, None]);
        assert_eq!(of_pictures(0, &[1; 40]), [None; 40]);
    }

    #[test]
    fn repeated_decreasing_and_jumping_timestamps_are_clock_faults() {
        let [same, back, jump] = [
            Status::TIME_REPEATED,
            Status::TIME_WENT_BACK,
            Status::CLOCK_JUMPED,
        ]
        .map(Some);
        assert_eq!(
            of_times(&[0.0, 0.1, 0.1, 0.1, 0.4]),
            [None, None, same, same, None]
        );
        assert_eq!(
            of_times(&[0.0, 0.1, 0.05, 0.0, 0.4]),
            [None, None, back, back, None]
        );
        // After a jump, the clock counts as good again.
        assert_eq!(
            of_times(&[0.0, 0.1, 3600.0, 3600.1, 0.4, 0.5]),
            [None, None, jump, None, back, None]
        );
        assert_eq!(of_times(&[0.0, f64::INFINITY, 0.2])[1], jump);
    }

    #[test]
    fn skipped_frames_are_not_a_clock_jump() {
        let mut guard = Guard::new(0, Some(10.0));
        assert_eq!(guard.check(0, Some(0.0), &[]), None);
        assert_eq!(guard.check(500, Some(50.0), &[]), None);
        assert_eq!(guard.check(501, None, &[]), None, "no clock");
        assert_eq!(guard.check(510, Some(51.0), &[]), None);
    }

    #[test]
    fn a_bad_clock_is_reported_before_a_frozen_picture() {
        let mut guard = Guard::new(1, Some(10.0));
        guard.check(0, Some(0.0), &[7; 9]);
        assert_eq!(
            guard.check(1, Some(0.0), &[7; 9]),
            Some(Status::TIME_REPEATED)
        );
        assert_eq!(guard.check(2, Some(0.2), &[7; 9]), Some(Status::FROZEN));
    }

    proptest! {
        #[test]
        fn pictures_that_differ_in_one_byte_have_different_hashes(
            mut bytes in prop::collection::vec(any::<u8>(), 1..200), at in any::<prop::sample::Index>(), by in 1_u8..,
        ) {
            let before = fingerprint(&bytes);
            prop_assert_eq!(fingerprint(&bytes), before);
            let at = at.index(bytes.len());
            bytes[at] = bytes[at].wrapping_add(by);
            prop_assert_ne!(fingerprint(&bytes), before);
            bytes.push(0);
            prop_assert_ne!(fingerprint(&bytes), before);
        }

        #[test]
        fn a_working_camera_has_no_faults(
            n in 1_usize..100, rate_hz in 0.5..200.0, jitter in 0.0..0.4, step in 1_u64..5,
        ) {
            let mut guard = Guard::new(1, Some(rate_hz));
            for nth in 0..n {
                let index = nth as u64 * step;
                let late = if nth % 2 == 0 { jitter } else { 0.0 };
                let time_s = (index as f64 + late) / rate_hz;
                let pixels = [nth as u8, (nth >> 8) as u8];
                prop_assert_eq!(guard.check(index, Some(time_s), &pixels), None);
            }
        }
    }
}
