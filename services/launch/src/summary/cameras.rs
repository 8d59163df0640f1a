//! What a run found out about its cameras, in words.

use runfiles::{Contradicted, Exchanged};

/// Two cameras that look as if each had the footage of the other.
pub(super) fn exchanged(it: &Exchanged) -> String {
    let [first, second] = &it.cameras;
    format!(
        "  calibration   {first} and {second} look exchanged: rays miss each other by {:.1} degrees, with the footage of the \
         two exchanged by {:.1}{}; exchange their `source` in the deployment\n",
        it.degrees,
        it.exchanged_degrees,
        if it.sure {
            ""
        } else {
            " (it may be other two)"
        },
    )
}

/// Cameras that do not see one person where the rig says.
pub(super) fn contradicted(it: &Contradicted) -> String {
    let likely = it
        .likely
        .as_ref()
        .map_or_else(String::new, |[first, second]| {
            format!(" ({first} and {second} exchanged would fit best)")
        });
    format!(
        "  calibration   the cameras contradict each other: rays to the same part miss each other by {:.1} degrees, where up \
         to {:.1} are usual; see whether every `source` is the footage of its camera{likely}, the rig is the one of this \
         footage, the frames are of one moment, and the overlays show one person\n",
        it.degrees, it.usual_degrees,
    )
}
