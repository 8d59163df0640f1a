//! What a run found out about its cameras, in words.

use serde_json::Value;

/// Two cameras that look as if each had the footage of the other.
pub(super) fn exchanged(it: &Value) -> String {
    let [first, second] = names(&it["cameras"]);
    format!(
        "  calibration   {first} and {second} look exchanged: rays miss each other by {:.1} degrees, with the footage of the \
         two exchanged by {:.1}{}; exchange their `source` in the deployment\n",
        number(it, "degrees"),
        number(it, "exchanged_degrees"),
        if it["sure"] == true {
            ""
        } else {
            " (it may be other two)"
        },
    )
}

/// Cameras that do not see one person where the rig says.
pub(super) fn contradicted(it: &Value) -> String {
    let likely = if it["likely"].is_array() {
        let [first, second] = names(&it["likely"]);
        format!(" ({first} and {second} exchanged would fit best)")
    } else {
        String::new()
    };
    format!(
        "  calibration   the cameras contradict each other: rays to the same part miss each other by {:.1} degrees, where up \
         to {:.1} are usual; see whether every `source` is the footage of its camera{likely}, the rig is the one of this \
         footage, the frames are of one moment, and the overlays show one person\n",
        number(it, "degrees"),
        number(it, "usual_degrees"),
    )
}

fn names(pair: &Value) -> [&str; 2] {
    [0, 1].map(|nth| pair[nth].as_str().unwrap_or_default())
}

fn number(it: &Value, key: &str) -> f64 {
    it[key].as_f64().unwrap_or(f64::NAN)
}
