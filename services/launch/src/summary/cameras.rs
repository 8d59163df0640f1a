//! Messages about cameras whose measurements are inconsistent with each other.

use messages::{CameraCounts, TimedBy, UNMEASURED};
use runfiles::{CameraFit, Contradicted, Exchanged};
use runtime::metrics::Reading;
use supervise::Outcome;

/// Returns the text about two cameras whose footage seems to be swapped.
pub(super) fn exchanged(exchanged: &Exchanged) -> String {
    let [first, second] = &exchanged.cameras;
    format!(
        "  calibration   {first} and {second} look swapped: rays miss each other by {:.1} degrees, but only by {:.1} if the footage of \
         the two is swapped{}; swap their `source` in the deployment\n",
        exchanged.degrees,
        exchanged.exchanged_degrees,
        if exchanged.sure {
            ""
        } else {
            " (or maybe of two other cameras)"
        },
    )
}

/// Returns the text about cameras whose views contradict each other.
pub(super) fn contradicted(contradicted: &Contradicted) -> String {
    let likely = contradicted.likely.as_ref().map_or_else(String::new, |[first, second]| {
        format!(" (swapping {first} and {second} would fit best)")
    });
    format!(
        "  calibration   the cameras contradict each other: rays to the same part miss each other by {:.1} degrees, where up \
         to {:.1} are usual; check that every `source` is the footage of its camera{likely}, the rig belongs to this \
         footage, paired frames were taken at the same time, and the overlays show one person\n",
        contradicted.degrees, contradicted.usual_degrees,
    )
}

/// Returns the text about a camera whose pictures were not taken at their stated times.
pub(super) fn out_of_step(camera: &str, fit: &CameraFit) -> String {
    let [offset, error] = [fit.offset_ms, fit.offset_error_ms].map(|ms| ms.unwrap_or(f64::NAN));
    let how = if offset < 0.0 { "before" } else { "after" };
    format!(
        "  clock         {camera} is not synchronised: according to the movement of people, its pictures were taken {:.0} ms {how} their \
         stated times (+-{error:.0} ms)\n",
        offset.abs(),
    )
}

/// Returns the counts of every live camera's pictures, one line per camera. The counts of a restarted process begin at its restart. If the
/// picture times of some cameras cannot be compared with those of others, a warning follows.
pub(super) fn live(outcome: &Outcome) -> String {
    let readings = outcome
        .processes
        .iter()
        .filter_map(|process| Reading::from_message(process.measured.as_ref()?).ok());
    let cameras = readings.filter_map(|reading| {
        let name = reading.view.map_or_else(String::new, |view| view.name);
        Some((name, reading.camera?))
    });
    let cameras: Vec<_> = cameras.collect();
    let mut text: String = cameras.iter().map(line).collect();
    text.extend(unlike_times(&cameras));
    text
}

/// Returns the line about the pictures of a live camera.
fn line((name, it): &(String, CameraCounts)) -> String {
    let mut parts = vec![format!(
        "{} pictures taken, {} lost by the camera, {} used",
        it.n_made, it.n_lost, it.n_used
    )];
    let more = [
        (it.n_surplus, "surplus"),
        (it.n_overtaken, "overtaken by newer ones"),
        (it.n_refused, "refused"),
    ];
    let more = more.into_iter().filter(|more| more.0 > 0);
    parts.extend(more.map(|(n, what)| format!("{n} {what}")));
    if it.rate_microhertz > 0 {
        parts.push(format!(
            "{:.3} pictures per second",
            it.rate_microhertz as f64 / 1e6
        ));
    }
    if it.skew_nanos != UNMEASURED {
        let skew = format!(
            "taken {:+.1} ms from the instants of the frames",
            it.skew_nanos as f64 / 1e6
        );
        parts.push(skew);
    }
    if it.drift_ppb != UNMEASURED {
        let ppm = it.drift_ppb as f64 / 1e3;
        let (slow, what) = if ppm < 0.0 {
            (-ppm, "fast")
        } else {
            (ppm, "slow")
        };
        parts.push(format!("{slow:.0} ppm {what}"));
    }
    parts.extend(times(it));
    if it.n_connections > 1 {
        parts.push(format!("opened {} times", it.n_connections));
    }
    format!("  live camera   {name}: {}\n", parts.join(", "))
}

/// Returns the text about the source of a camera's picture times, unless the kernel gives the times.
fn times(it: &CameraCounts) -> Option<String> {
    let ms = it.delay_nanos as f64 / 1e6;
    match it.timed_by {
        TimedBy::CAMERA => Some(format!("delay {ms:.0} ms according to the camera's clock")),
        TimedBy::ARRIVAL => Some("arrival times used as capture times".to_owned()),
        TimedBy::DISBELIEVED => Some(format!(
            "counted as taken when they arrived, because by the camera's own clock they took {ms:.0} ms to get here, which is not \
             plausible (set that clock from the time server of this machine)"
        )),
        _ => None,
    }
}

/// Returns a warning if only some live cameras state when their pictures were taken. Returns `None` if all or none of them do.
///
/// * `cameras`: name and counts of each camera.
fn unlike_times(cameras: &[(String, CameraCounts)]) -> Option<String> {
    let named = |which: fn(TimedBy) -> bool| -> Vec<&str> {
        let those = cameras.iter().filter(|(_, counts)| which(counts.timed_by));
        those.map(|(name, _)| name.as_str()).collect()
    };
    let told = named(|timed_by| matches!(timed_by, TimedBy::CAMERA | TimedBy::DRIVER));
    let late = named(TimedBy::is_arrival);
    if told.is_empty() || late.is_empty() {
        return None;
    }
    let own = named(|timed_by| timed_by == TimedBy::CAMERA);
    let remedy = if own.len() == told.len() {
        format!(
            "; if their delays are similar, set `clock = \"arrival\"` for {}",
            own.join(", ")
        )
    } else {
        String::new()
    };
    Some(format!(
        "  clock         the times of {} are capture times, but the times of {} are arrival times, which are later by the delay of the \
         pictures{remedy}\n",
        told.join(", "),
        late.join(", "),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(name: &str, timed_by: TimedBy) -> (String, CameraCounts) {
        let counts = CameraCounts {
            timed_by,
            delay_nanos: 41_000_000,
            ..CameraCounts::default()
        };
        (name.to_owned(), counts)
    }

    #[test]
    fn a_warning_names_the_cameras_if_only_some_have_timestamps() {
        let streams = [
            camera("left", TimedBy::CAMERA),
            camera("middle", TimedBy::DISBELIEVED),
            camera("right", TimedBy::CAMERA),
        ];
        let text = unlike_times(&streams).unwrap();
        assert!(
            text.contains("of left, right are capture times, but the times of middle"),
            "{text}"
        );
        assert!(
            text.contains("`clock = \"arrival\"` for left, right"),
            "{text}"
        );
        let with_device = [
            camera("usb", TimedBy::DRIVER),
            camera("net", TimedBy::ARRIVAL),
        ];
        let text = unlike_times(&with_device).unwrap();
        assert!(
            text.contains("of usb are capture times, but the times of net"),
            "{text}"
        );
        assert!(!text.contains("clock ="), "{text}");
        for alike in [
            [TimedBy::CAMERA, TimedBy::DRIVER],
            [TimedBy::ARRIVAL, TimedBy::DISBELIEVED],
            [TimedBy::ARRIVAL, TimedBy::NOTHING],
        ] {
            let pair = alike.map(|alike| camera("any", alike));
            assert_eq!(unlike_times(&pair), None, "{alike:?}");
        }
    }

    #[test]
    fn a_rejected_clock_is_reported_with_its_times() {
        let (_, mut it) = camera("left", TimedBy::DISBELIEVED);
        it.delay_nanos = -90_000_000_000;
        let text = times(&it).unwrap();
        assert!(text.contains("-90000 ms to get here"), "{text}");
        let (_, usb) = camera("usb", TimedBy::DRIVER);
        assert_eq!(times(&usb), None);
    }

    #[test]
    fn a_camera_with_a_wrong_clock_offset_is_named_with_the_offset() {
        let fit = CameraFit {
            offset_error_ms: Some(1.2),
            offset_ms: Some(-21.4),
            out_of_step: true,
            ..CameraFit::default()
        };
        let text = out_of_step("left", &fit);
        assert!(text.contains("left is not synchronised"), "{text}");
        assert!(
            text.contains("21 ms before their stated times (+-1 ms)"),
            "{text}"
        );
    }
}
