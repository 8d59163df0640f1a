//! Measures how well the result is corrected if cameras take their pictures up to half a period away from the instants of the frames.

use geometry::skew::{Tracks, Velocity, moved, widened_px};
use geometry::{Observation, Settings, longer_side, triangulate};
use nalgebra::{Point2, Point3};
use scene::Action;

use crate::film::{Film, N, RATE_HZ};

/// How the time skews of the cameras are taken into account.
#[derive(Debug, Clone, Copy, PartialEq)]
enum By {
    /// The skews are ignored.
    Nothing,
    /// The deviation of each point grows by its speed times the skew.
    Widening,
    /// Each point is moved to the instant by its own velocity.
    Moving,
    /// Each point is moved, and its deviation grows by the error of the move, as in a run.
    Both,
}

/// Returns the mean distance of the joints from the truth at the instants of the frames, in millimetres.
///
/// * `skews_ms`: skews of the cameras from the first on, repeated cyclically.
fn error_mm(film: &mut Film, skews_ms: &[f64], by: By) -> f64 {
    let cameras = film.cameras().to_vec();
    let skews_s: Vec<f64> =
        (0..cameras.len()).map(|view| skews_ms[view % skews_ms.len()] * 1e-3).collect();
    let mut tracks = vec![Tracks::default(); cameras.len()];
    let (mut sum, mut n) = (0.0, 0.0);
    for frame in 0..90 {
        let instant_s = f64::from(frame) / RATE_HZ;
        let mut seen: Vec<Vec<(Point2<f64>, f64)>> = Vec::new();
        for ((camera, skew_s), tracks) in cameras.iter().zip(&skews_s).zip(&mut tracks) {
            let taken_s = instant_s + skew_s;
            let noise = film.noise();
            let points = film.see(camera, taken_s, &noise);
            let height =
                longer_side(points.iter().map(|point| [point.x, point.y])).expect("points");
            let each = points.iter().enumerate().map(|(joint, at)| {
                let velocity = tracks.velocity(joint, (taken_s, *at), height);
                used((*at, film.noise_px), velocity, (*skew_s, height), by)
            });
            seen.push(each.collect());
            tracks.note(taken_s, points.map(Some).to_vec());
        }
        let truth = film.truth(instant_s);
        // The first frames have no velocities yet.
        for (joint, truth) in truth.iter().enumerate().filter(|_| frame > 2) {
            let views = cameras.iter().zip(&seen);
            let observations = views.map(|(camera, seen)| Observation {
                camera,
                point_px: seen[joint].0,
                sigma_px: seen[joint].1,
            });
            let observations: Vec<Observation<'_>> = observations.collect();
            let found: Point3<f64> =
                triangulate(&observations, &Settings::default()).expect("a point").in_world;
            (sum, n) = (sum + (found - truth).norm(), n + 1.0);
        }
    }
    assert_eq!(n as usize, 87 * N);
    1e3 * sum / n
}

/// Returns the position of a point as used for the estimate, and its deviation.
fn used(
    (at, sigma_px): (Point2<f64>, f64),
    velocity: Option<Velocity>,
    (skew_s, height): (f64, f64),
    by: By,
) -> (Point2<f64>, f64) {
    let speed = velocity.map_or(height, |velocity| velocity.px_per_s.norm());
    let (there, more) = moved(at, velocity, skew_s, [sigma_px, height]);
    match by {
        By::Nothing => (at, sigma_px),
        By::Widening => (at, widened_px(sigma_px, speed, skew_s)),
        By::Moving => (there, sigma_px),
        By::Both => (there, sigma_px.hypot(more)),
    }
}

/// Returns the errors for three people: without skews; and with skews, under no correction, widening, moving and both.
fn measured(rig: &str, action: Action, skews_ms: &[f64]) -> [f64; 5] {
    let mut sums = [0.0; 5];
    for seed in 1..=3 {
        let mut film = Film::new(rig, action, seed);
        let runs = [
            (&[0.0][..], By::Both),
            (skews_ms, By::Nothing),
            (skews_ms, By::Widening),
            (skews_ms, By::Moving),
            (skews_ms, By::Both),
        ];
        for (sum, (skews_ms, by)) in sums.iter_mut().zip(runs) {
            film.reseed(seed);
            *sum += error_mm(&mut film, skews_ms, by) / 3.0;
        }
    }
    let name = action.name();
    println!(
        "{name} {rig} {skews_ms:?} ms: {:.1} mm without skews; with them {:.1}, widened {:.1}, moved {:.1}, both {:.1}",
        sums[0], sums[1], sums[2], sums[3], sums[4]
    );
    sums
}

#[test]
fn for_a_runner_skews_of_half_a_period_increase_the_error_by_at_most_a_tenth() {
    for (rig, skews_ms) in [
        ("ring:4", &[0.0, 5.0, 11.0, 16.0][..]),
        ("ring:4", &[0.0, -16.0, 8.0, 16.0]),
        ("ring:4", &[16.6]),
        ("ring:8", &[-16.6, -12.0, -7.0, -2.0, 2.0, 7.0, 12.0, 16.6]),
        ("humaneva", &[0.0, 16.6, -16.6]),
    ] {
        let [without, nothing, widened, _, both] = measured(rig, Action::Jogging, skews_ms);
        assert!(both < 1.1 * without, "{rig} {skews_ms:?}: {both} {without}");
        assert!(nothing > 1.2 * without, "{rig} {skews_ms:?}: it matters");
        assert!(widened > both, "{rig} {skews_ms:?}: moving is better");
    }
}

#[test]
fn for_a_boxing_person_skews_hardly_increase_the_error() {
    let [without, _, _, _, both] = measured("ring:4", Action::Boxing, &[0.0, -16.0, 8.0, 16.0]);
    assert!(both < 1.05 * without, "{both} {without}");
}

#[test]
fn even_the_largest_skews_are_better_corrected_than_not() {
    let skews_ms = [-16.6, 16.6, -16.6, 16.6];
    let [without, nothing, _, moved, both] = measured("ring:4", Action::Jogging, &skews_ms);
    assert!(both < 0.6 * nothing && both < 1.25 * without);
    assert!(both < moved, "what is moved ahead is trusted less");
}
