//! Tests in simulated rooms with sound sources at random positions, including the travel time to each camera. Results are compared with the
//! simulated clocks.

use super::*;

const RATE_HZ: f64 = 8000.0;

/// A simulated room that all cameras record.
struct Room {
    centres: Vec<Point3<f64>>,
    /// Start time of each camera, in seconds.
    begins_s: Vec<f64>,
    /// Amount by which a second of each camera's clock is too long.
    drifts: Vec<f64>,
    length_s: f64,
    /// Times of the sounds.
    sounds_s: Vec<f64>,
    /// Level of the noise; sounds have levels of 1000 to 8000 at a distance of one metre.
    noise: f64,
}

impl Room {
    fn drawn(seed: u64, length_s: f64, n_sounds: usize) -> (Self, fastrand::Rng) {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut within = |low: f64, high: f64| low + (high - low) * random.f64();
        let room = Self {
            centres: (0..4)
                .map(|_| Point3::new(within(-4.0, 4.0), within(-4.0, 4.0), 2.0))
                .collect(),
            begins_s: (0..4).map(|_| within(0.0, 7.0)).collect(),
            drifts: vec![0.0; 4],
            length_s,
            sounds_s: (0..n_sounds).map(|_| within(7.5, length_s)).collect(),
            noise: within(5.0, 40.0),
        };
        (room, random)
    }

    /// Returns the recordings of the cameras. Every sound has its own position, begins suddenly, and fades with an echo.
    fn record(&self, random: &mut fastrand::Rng) -> Vec<Sound> {
        let sources: Vec<(f64, Point3<f64>, f64, u64)> = self
            .sounds_s
            .iter()
            .map(|at_s| {
                let mut within = |low: f64, high: f64| low + (high - low) * random.f64();
                let place = Point3::new(within(-3.0, 3.0), within(-3.0, 3.0), within(0.0, 2.0));
                (*at_s, place, within(1000.0, 8000.0), random.u64(..))
            })
            .collect();
        let each = self.centres.iter().zip(&self.begins_s).zip(&self.drifts);
        each.map(|((centre, begin_s), drift)| {
            let n = ((self.length_s - begin_s) * RATE_HZ) as usize;
            let mut heard: Vec<f64> = (0..n).map(|_| self.noise * (random.f64() - 0.5)).collect();
            for (at_s, place, level, seed) in &sources {
                let metres = (place - centre).norm().max(0.5);
                for (echo_s, share) in [(0.0, 1.0), (0.013, 0.4), (0.031, 0.2)] {
                    let common_s = at_s + metres / SPEED_M_S + echo_s;
                    let own_s = (common_s - begin_s) / (1.0 + drift);
                    let from = (own_s * RATE_HZ).round() as i64;
                    let mut burst = fastrand::Rng::with_seed(*seed);
                    for nth in 0..1200 {
                        let value = burst.f64() - 0.5;
                        let at = usize::try_from(from + nth).ok();
                        if let Some(sample) = at.and_then(|at| heard.get_mut(at)) {
                            let fall = (-(nth as f64) / 240.0).exp();
                            *sample += level / metres * share * fall * value;
                        }
                    }
                }
            }
            Sound {
                rate_hz: RATE_HZ,
                begins_s: 0.0,
                samples: heard.iter().map(|heard| heard.clamp(-32e3, 32e3) as i16).collect(),
            }
        })
        .collect()
    }

    fn settings(&self) -> SoundSettings {
        SoundSettings {
            reference: 0,
            window_s: 10.0,
            centres: Some(self.centres.clone()),
        }
    }
}

#[test]
fn offsets_are_found_within_the_travel_time_of_the_sound() {
    let mut errors = Vec::new();
    for seed in 0..20 {
        let (room, mut random) = Room::drawn(seed, 40.0, 25);
        let sounds = room.record(&mut random);
        let found = estimate_by_sound(&sounds, &room.settings()).unwrap();
        assert_eq!(found.doubts, [], "seed {seed}");
        for (camera, it) in found.cameras.iter().enumerate().skip(1) {
            let truth = room.begins_s[camera] - room.begins_s[0];
            let error = (it.offset_s - truth).abs();
            let way_s = (room.centres[camera] - room.centres[0]).norm() / SPEED_M_S;
            assert!(
                error < way_s + 0.004,
                "seed {seed}, camera {camera}: {error} s"
            );
            errors.push(error);
        }
    }
    errors.sort_by(f64::total_cmp);
    assert!(errors[30] < 0.008, "{errors:?}");
}

#[test]
fn a_drifting_clock_is_detected() {
    let (mut room, mut random) = Room::drawn(3, 300.0, 300);
    room.drifts = vec![0.0, 120e-6, -80e-6, 0.0];
    let sounds = room.record(&mut random);
    let found = estimate_by_sound(&sounds, &room.settings()).unwrap();
    assert_eq!(found.doubts, []);
    for (it, drift) in found.cameras.iter().zip(&room.drifts).skip(1) {
        let error = it.drift_error.unwrap();
        assert!(
            (it.drift - drift).abs() < (4.0 * error).max(1e-5),
            "{} of {drift}",
            it.drift
        );
    }
    assert_eq!(found.cameras[3].drift, 0.0);
    let at_zero = room.begins_s[1] - room.begins_s[0];
    assert!((found.cameras[1].offset_s - at_zero).abs() < 0.02);
}

#[test]
fn silence_and_sounds_of_another_room_are_refused() {
    let (room, mut random) = Room::drawn(5, 30.0, 20);
    let (other, mut other_random) = Room::drawn(6, 30.0, 20);
    let settings = room.settings();
    let refused = |sounds: &[Sound]| estimate_by_sound(sounds, &settings).unwrap().doubts;
    let mut sounds = room.record(&mut random);
    let good = sounds.clone();
    sounds[2].samples.fill(0);
    assert!(matches!(
        refused(&sounds)[..],
        [Doubt::Quiet {
            camera: 2,
            n: 0,
            ..
        }]
    ));
    // This recording is from another room.
    sounds[2] = other.record(&mut other_random).swap_remove(2);
    let doubts = refused(&sounds);
    assert!(
        matches!(&doubts[..], [Doubt::Unheard { cameras, .. }] if cameras.contains(&2)),
        "{doubts:?}"
    );
    // The sound is a metronome.
    let (mut beats, mut random) = Room::drawn(7, 30.0, 0);
    beats.sounds_s = (0..40).map(|i| 8.0 + 0.5 * f64::from(i)).collect();
    let doubts = refused(&beats.record(&mut random));
    assert!(!doubts.is_empty());
    // The offset is beyond the window.
    let far = SoundSettings {
        window_s: 0.1,
        ..settings.clone()
    };
    assert!(!estimate_by_sound(&good, &far).unwrap().doubts.is_empty());
    // Some seconds are missing in the middle.
    let (long, mut random) = Room::drawn(8, 240.0, 240);
    let mut sounds = long.record(&mut random);
    let n = sounds[1].samples.len();
    sounds[1].samples.drain(n / 2..n / 2 + 2000);
    let doubts = estimate_by_sound(&sounds, &long.settings()).unwrap().doubts;
    assert!(
        matches!(&doubts[..], [Doubt::Parts { camera: 1, .. }]),
        "{doubts:?}"
    );
}

#[test]
fn noise_alone_is_never_taken_for_a_common_sound() {
    for seed in 0..30 {
        let (room, mut random) = Room::drawn(seed, 30.0, 0);
        let sounds = room.record(&mut random);
        let found = estimate_by_sound(&sounds, &room.settings()).unwrap();
        assert!(!found.doubts.is_empty(), "seed {seed}");
    }
}

#[test]
fn sounds_from_different_rooms_never_match() {
    for seed in 0..30 {
        let (room, mut random) = Room::drawn(seed, 40.0, 5 + seed as usize);
        let mut sounds = room.record(&mut random);
        let (other, mut random) = Room::drawn(seed + 100, 40.0, 5 + seed as usize);
        sounds[1] = other.record(&mut random).swap_remove(1);
        let found = estimate_by_sound(&sounds, &room.settings()).unwrap();
        assert!(!found.doubts.is_empty(), "seed {seed}");
    }
}
