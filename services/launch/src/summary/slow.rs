//! Warning that the machine was too slow for many frames of a run.

use runfiles::Summary;

/// The warning is given if the fraction of frames with a result is below this value.
const MOST: f64 = 0.8;

/// Returns a line with the number of frames that the machine processed in time, and with advice. Returns `None` if it processed most frames
/// in time, and always with lossless delivery.
///
/// * `n_frames`: number of frames of the footage that the run reached.
/// * `seconds`: duration of the run.
pub(super) fn text(
    summary: &Summary,
    n_frames: u64,
    seconds: f64,
    is_lossless: bool,
) -> Option<String> {
    let n = summary.frames;
    let is_slow = !is_lossless && n > 0 && (n as f64) < MOST * n_frames as f64;
    is_slow.then(|| {
        format!(
            "  slow          this machine had time for {n} of {n_frames} frames, {:.1} per second. Smaller pictures (capture.scale), fewer cameras, fewer \
             other programs or more cores would help; `latency` below shows which stage takes long\n",
            n as f64 / seconds.max(1e-3)
        )
    })
}

/// Returns a line with the fraction of people on whom the network did not run for lack of time; `None` if there are none.
pub(super) fn predicted(summary: &Summary) -> Option<String> {
    let share = summary.sightings_predicted as f64 / summary.sightings.max(1) as f64;
    (share > 0.0).then(|| {
        format!(
            "  predicted     {:.0} % of the people in the views; the network had time for the others (network.looks). Fewer cameras, fewer other \
             programs or more cores would help\n",
            100.0 * share
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn summary(frames: u64) -> Summary {
        Summary {
            frames,
            ..Summary::default()
        }
    }

    #[test]
    fn the_fraction_of_predicted_people_is_reported() {
        let summary = |sightings_predicted| Summary {
            sightings: 400,
            sightings_predicted,
            ..Summary::default()
        };
        assert_eq!(predicted(&summary(0)), None);
        assert!(predicted(&summary(100)).unwrap().contains("25 % of the people"));
        assert_eq!(predicted(&Summary::default()), None);
    }

    #[test]
    fn a_machine_that_processed_few_frames_is_reported() {
        let told = text(&summary(6), 60, 8.0, false).unwrap();
        assert!(told.contains("6 of 60 frames, 0.8 per second"), "{told}");
        assert_eq!(text(&summary(50), 60, 8.0, false), None);
        assert_eq!(text(&summary(6), 60, 8.0, true), None);
        assert_eq!(
            text(&summary(0), 60, 8.0, false),
            None,
            "it has a reason of its own"
        );
    }
}
