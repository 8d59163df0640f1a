//! Tests with simulated clocks and delays.

use fastrand::Rng;
use proptest::prelude::*;

use super::*;

const MS: f64 = 1e6;
const S: u64 = 1_000_000_000;

/// Another host: the state of its clock, and the delays of messages in both directions, in milliseconds.
struct Other {
    offset: i64,
    drift: f64,
    there: f64,
    back: f64,
    /// Mean of the random delay that is added in either direction.
    noise: f64,
    random: Rng,
}

impl Other {
    fn theirs(&self, ours: u64) -> u64 {
        let drifted = (ours as f64 * self.drift).round() as i64;
        ours.strict_add_signed(self.offset).strict_add_signed(drifted)
    }

    fn exchange(&mut self, asked_at: u64) -> Exchange {
        let mut way = |ms: f64| {
            let noise = -self.noise * (1.0 - self.random.f64()).ln();
            ((ms + noise) * MS) as u64
        };
        let came = asked_at + way(self.there);
        let went = came + 20_000;
        let heard_at = went + way(self.back);
        Exchange {
            asked_at,
            received_at: self.theirs(came),
            answered_at: self.theirs(went),
            heard_at,
        }
    }
}

/// Returns the estimate and the true offset a second after the last exchange. There is one exchange per second, for some seconds.
fn after(seconds: u64, other: &mut Other) -> (Estimate, i64) {
    let mut clock = Clock::default();
    let start = 1000 * S;
    for nth in 0..seconds {
        clock.add(other.exchange(start + nth * S)).unwrap();
    }
    let now = start + seconds * S;
    let truth = other.theirs(now).cast_signed() - now.cast_signed();
    (clock.estimate(now).unwrap(), truth)
}

fn other(there: f64, back: f64, noise: f64, drift_ppm: f64) -> Other {
    Other {
        offset: 5_000_000_000_123,
        drift: drift_ppm * 1e-6,
        there,
        back,
        noise,
        random: Rng::with_seed(7),
    }
}

#[test]
fn on_an_idle_network_the_offset_is_accurate_to_microseconds_and_the_drift_is_found() {
    let (got, truth) = after(60, &mut other(0.1, 0.1, 0.0, 40.0));
    let off = got.offset_nanos - truth;
    assert!(off.abs() < 3_000, "{off} ns");
    assert!((got.drift_ppb - 40_000.0).abs() < 50.0, "{}", got.drift_ppb);
    assert!(got.bound_nanos < 130_000, "{}", got.bound_nanos);
    assert!(
        (199_000..201_000).contains(&got.trip_nanos),
        "{}",
        got.trip_nanos
    );
}

#[test]
fn the_shortest_round_trips_filter_out_noise() {
    let (got, truth) = after(60, &mut other(0.1, 0.1, 5.0, 20.0));
    let off = (got.offset_nanos - truth).abs();
    // The mean of all exchanges would be wrong by a few milliseconds divided by the square root of 60. A single exchange could be wrong by
    // tens of milliseconds.
    assert!(off < 1_500_000, "{off} ns");
    assert!(got.bound_nanos as i64 >= off, "{} {off}", got.bound_nanos);
}

#[test]
fn the_error_from_asymmetric_delays_stays_within_the_bound() {
    let (got, truth) = after(60, &mut other(8.0, 1.0, 0.0, 0.0));
    let off = got.offset_nanos - truth;
    assert!(
        (3_400_000..3_600_000).contains(&off),
        "half of the difference: {off}"
    );
    assert!(got.bound_nanos as i64 >= off, "{}", got.bound_nanos);
    assert!((4_400_000..5_000_000).contains(&got.bound_nanos));
}

#[test]
fn the_bound_grows_while_no_answer_arrives() {
    let mut other = other(0.1, 0.1, 0.0, 30.0);
    let mut clock = Clock::default();
    for nth in 0..60 {
        clock.add(other.exchange((1000 + nth) * S)).unwrap();
    }
    let bounds = [1060, 1120, 1660].map(|at| clock.estimate(at * S).unwrap().bound_nanos);
    assert!(bounds[0] < bounds[1] && bounds[1] < bounds[2], "{bounds:?}");
    for at in [1060, 1120, 1660] {
        let got = clock.estimate(at * S).unwrap();
        let truth = other.theirs(at * S).cast_signed() - (at * S).cast_signed();
        assert!((got.offset_nanos - truth).unsigned_abs() <= got.bound_nanos);
    }
}

#[test]
fn a_clock_that_is_set_is_detected_after_three_exchanges() {
    let mut other = other(0.1, 0.1, 0.0, 0.0);
    let mut clock = Clock::default();
    for nth in 0..20 {
        clock.add(other.exchange((1000 + nth) * S)).unwrap();
    }
    other.offset -= 300_000_000_000;
    for nth in 20..23 {
        assert_eq!(clock.n_resets(), 0);
        clock.add(other.exchange((1000 + nth) * S)).unwrap();
    }
    assert_eq!(clock.n_resets(), 1);
    let got = clock.estimate(1023 * S).unwrap();
    let truth = other.offset;
    assert!((got.offset_nanos - truth).abs() < 10_000, "{got:?}");
}

#[test]
fn impossible_times_are_refused() {
    let good = Exchange {
        asked_at: 100,
        received_at: 900,
        answered_at: 950,
        heard_at: 200,
    };
    let mut clock = Clock::default();
    assert_eq!(clock.estimate(0), None);
    let add = |clock: &mut Clock, change: fn(&mut Exchange)| {
        let mut it = good;
        change(&mut it);
        clock.add(it)
    };
    let backwards = Err(ExchangeError::Backwards);
    assert_eq!(
        add(&mut clock, |exchange| exchange.heard_at = 99),
        backwards
    );
    assert_eq!(
        add(&mut clock, |exchange| exchange.answered_at = 899),
        backwards
    );
    let [inside, outside] = [101, 100];
    let expected = Err(ExchangeError::Inside { inside, outside });
    assert_eq!(
        add(&mut clock, |exchange| exchange.answered_at = 1001),
        expected
    );
    let slow = add(&mut clock, |exchange| exchange.heard_at = u64::MAX);
    assert!(matches!(slow, Err(ExchangeError::Slow { .. })));
    assert_eq!(clock.estimate(0), None);
    assert_eq!(add(&mut clock, |_| {}), Ok(()));
}

#[test]
fn a_bound_above_the_limit_gives_a_warning_with_advice() {
    let (got, _) = after(10, &mut other(8.0, 8.0, 0.0, 0.0));
    assert_eq!(got.warning(200_000_000, 0.1), None, "8 of 200 ms");
    let text = got.warning(33_000_000, 0.1).unwrap();
    assert!(
        text.contains("chrony") && text.contains("linuxptp"),
        "{text}"
    );
    assert!(text.contains("% of the time between two frames"), "{text}");
}

#[test]
fn converting_a_time_forth_and_back_gives_the_same_time() {
    let (got, _) = after(10, &mut other(0.1, 0.1, 0.0, 0.0));
    assert_eq!(got.ours(got.theirs(1234)), 1234);
    assert_eq!(got.ours(0), 0, "before our clock began");
}

/// Three exchanges over six seconds, for which the fitted line is far from the line through the first and the last exchange.
#[test]
fn the_bound_covers_the_error_of_a_line_fitted_outside_its_samples() {
    let random = Rng::with_seed(10_865_627_331_665_547_518);
    let mut other = Other {
        random,
        ..other(0.01, 0.01, 5.354_207_936_067_242, 0.0)
    };
    let (got, truth) = after(6, &mut other);
    let off = (got.offset_nanos - truth).unsigned_abs();
    assert!(
        off <= got.bound_nanos,
        "off by {off} ns, bound {}",
        got.bound_nanos
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4096))]
    #[test]
    fn the_true_offset_is_within_the_bound(
        there in 0.01..20.0,
        back in 0.01..20.0,
        noise in 0.0..10.0,
        drift_ppm in -400.0..400.0,
        seconds in 1_u64..90,
        seed: u64,
    ) {
        let mut other = Other { random: Rng::with_seed(seed), ..other(there, back, noise, drift_ppm) };
        let (got, truth) = after(seconds, &mut other);
        let off = (got.offset_nanos - truth).unsigned_abs();
        prop_assert!(off <= got.bound_nanos + 2, "off by {off} ns, bound {}", got.bound_nanos);
    }

    #[test]
    fn any_times_are_accepted_or_refused_without_panic(times: [u64; 4], now: u64) {
        let [asked_at, received_at, answered_at, heard_at] = times;
        let mut clock = Clock::default();
        let _taken = clock.add(Exchange { asked_at, received_at, answered_at, heard_at }).is_ok();
        let _known = clock.estimate(now).map(|estimate| (estimate.ours(now), estimate.theirs(now)));
    }
}
