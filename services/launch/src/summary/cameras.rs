//! Text on cameras that contradict each other.

use runfiles::{Contradicted, Exchanged};

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
