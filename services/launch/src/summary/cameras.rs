//! Text on cameras that contradict each other.

use messages::UNMEASURED;
use metrics::Reading;
use runfiles::{CameraFit, Contradicted, Exchanged};
use supervise::Outcome;

/// Text on two cameras whose footage seems to be exchanged.
pub(super) fn exchanged(exchanged: &Exchanged) -> String {
    let [first, second] = &exchanged.cameras;
    format!(
        "  calibration   {first} and {second} look exchanged: rays miss each other by {:.1} degrees, with the footage of the \
         two exchanged by {:.1}{}; exchange their `source` in the deployment\n",
        exchanged.degrees,
        exchanged.exchanged_degrees,
        if exchanged.sure {
            ""
        } else {
            " (it may be other two)"
        },
    )
}

/// Text on cameras whose views contradict each other.
pub(super) fn contradicted(contradicted: &Contradicted) -> String {
    let likely = contradicted
        .likely
        .as_ref()
        .map_or_else(String::new, |[first, second]| {
            format!(" ({first} and {second} exchanged would fit best)")
        });
    format!(
        "  calibration   the cameras contradict each other: rays to the same part miss each other by {:.1} degrees, where up \
         to {:.1} are usual; see whether every `source` is the footage of its camera{likely}, the rig is the one of this \
         footage, the frames are of one moment, and the overlays show one person\n",
        contradicted.degrees, contradicted.usual_degrees,
    )
}

/// Text on a camera whose pictures were taken at other times than they say.
pub(super) fn out_of_step(camera: &str, fit: &CameraFit) -> String {
    let [offset, error] = [fit.offset_ms, fit.offset_error_ms].map(|it| it.unwrap_or(f64::NAN));
    let how = if offset < 0.0 { "before" } else { "after" };
    format!(
        "  clock         {camera} is out of step: its pictures were taken {:.0} ms {how} the time that they say, +-{error:.0}, by how \
         people move in them\n",
        offset.abs(),
    )
}

/// What became of the pictures of every live camera, a line each; of a process that was restarted since then.
pub(super) fn live(outcome: &Outcome) -> Vec<String> {
    let readings = outcome
        .processes
        .iter()
        .filter_map(|it| Reading::from_message(it.measured.as_ref()?).ok());
    let lines = readings.filter_map(|reading| {
        let it = reading.camera?;
        let name = reading.view.map_or_else(String::new, |it| it.name);
        let mut parts = vec![format!(
            "{} pictures made, {} lost by the camera, {} used",
            it.n_made, it.n_lost, it.n_used
        )];
        let more = [
            (it.n_surplus, "surplus"),
            (it.n_overtaken, "overtaken by newer ones"),
            (it.n_refused, "refused"),
        ];
        let more = more.into_iter().filter(|it| it.0 > 0);
        parts.extend(more.map(|(n, what)| format!("{n} {what}")));
        if it.rate_microhertz > 0 {
            parts.push(format!("{:.3} a second", it.rate_microhertz as f64 / 1e6));
        }
        if it.skew_nanos != UNMEASURED {
            let skew = format!("{:+.1} ms from the instants", it.skew_nanos as f64 / 1e6);
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
        if it.delay_nanos != UNMEASURED {
            let ms = it.delay_nanos as f64 / 1e6;
            parts.push(format!("{ms:.0} ms from camera to here by its own clock"));
        }
        if it.n_connections > 1 {
            parts.push(format!("opened {} times", it.n_connections));
        }
        let line = format!("{name}: {}", parts.join(", "));
        Some(line)
    });
    lines.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_that_is_out_of_step_is_named_with_its_offset() {
        let fit = CameraFit {
            offset_error_ms: Some(1.2),
            offset_ms: Some(-21.4),
            out_of_step: true,
            ..CameraFit::default()
        };
        let text = out_of_step("left", &fit);
        assert!(text.contains("left is out of step"), "{text}");
        assert!(
            text.contains("21 ms before the time that they say, +-1,"),
            "{text}"
        );
    }
}
