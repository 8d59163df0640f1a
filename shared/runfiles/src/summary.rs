//! `summary.json`: counts of detections and losses over the whole run.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::nullable::nullable;
use crate::read::{parse, to_text};
use crate::{LatencyReport, Missing, ReadError, Trust, VERSION};

/// Maximum number of ids in a text for users.
const MOST_IDS: usize = 8;

/// The file `summary.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunSummary {
    /// Frames per second of the footage, if known.
    #[serde(deserialize_with = "nullable")]
    pub frame_rate_hz: Option<f64>,
    /// Name of the set of joints.
    pub joints: String,
    /// How the time was used.
    pub latency: LatencyReport,
    /// [`VERSION`] of all files of the run.
    pub schema_version: u64,
    /// Session of the run.
    pub session: u64,
    /// Counts of detections and losses.
    pub summary: Summary,
    /// Meaning of the axes of `pose3d.trc`, in words.
    pub trc_axes: String,
    /// The views, in the order of their indices in messages.
    pub views: Vec<ViewSummary>,
}

/// One view of the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ViewSummary {
    /// Width and height of the frames that were searched, in pixels.
    pub frame_size: [u32; 2],
    /// Name of the camera.
    pub name: String,
    /// Map from pixels of the searched frames to pixels of the footage: two rows of an affine map.
    pub source_from_frame: [[f64; 3]; 2],
}

/// Counts of detections and losses over the whole run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Summary {
    /// How well every camera agrees with the others, by name, since the last start of the process.
    pub calibration: BTreeMap<String, CameraFit>,
    /// Cameras whose observations of one person contradict the rig, for an unknown reason, or for one other than swapped footage.
    #[serde(deserialize_with = "nullable")]
    pub contradicted: Option<Contradicted>,
    /// Mean size of the evidence that each view sent in shared memory, in bytes per frame, by name, since the last start of the process.
    pub evidence_bytes_per_frame: BTreeMap<String, u64>,
    /// Two cameras whose footage seems to be swapped.
    #[serde(deserialize_with = "nullable")]
    pub exchanged: Option<Exchanged>,
    /// Error of the first write that failed.
    #[serde(deserialize_with = "nullable")]
    pub first_failure: Option<String>,
    /// Number of received results.
    pub frames: u64,
    /// Number of frames of all views that the capture processes dropped.
    pub frames_dropped_by_capture: u64,
    /// Number of frames without a result. Each has a line with the reason.
    pub frames_missed: u64,
    /// Number of results that were received but not written, because writing was too slow or the disk was full.
    pub frames_not_recorded: u64,
    /// Number of results with a skeleton.
    pub frames_with_pose: u64,
    /// Number of results in which at least one view of the rig is missing.
    pub frames_with_views_missing: u64,
    /// The followed person and the other people in view, since the last start of the process.
    pub people: People,
    /// Height of people in the searched frames, in pixels, by name of the view. This is the median, over the results that used the view, of
    /// the longer side of the rectangle around a pose's parts. Null if there are none. Counted since the last start of the process.
    pub person_px: BTreeMap<String, Option<f64>>,
    /// Root mean square reprojection error over all joints, in pixels of the frame.
    #[serde(deserialize_with = "nullable")]
    pub reprojection_px: Option<f64>,
    /// Number of frames of every view that were searched in full, and number searched only near the last pose, by
    /// name, since the last start of the process.
    pub searches: BTreeMap<String, BTreeMap<String, u64>>,
    /// Number of people that the views saw, added up over views and frames, since the last start of the process.
    pub sightings: u64,
    /// Number of these sightings that were predicted, because there was no time to run the network on everybody.
    pub sightings_predicted: u64,
    /// How far the results can be trusted, since the last start of the process.
    pub trust: Trust,
    /// Number of results from which each view is missing, by name and reason.
    pub views_missing: BTreeMap<String, BTreeMap<Missing, u64>>,
    /// Number of results to which each view contributed, by name.
    pub views_present: BTreeMap<String, u64>,
    /// Number of times that each view was used, by name.
    pub views_used: Vec<(String, u64)>,
    /// Number of writes that failed.
    pub writes_failed: u64,
}

/// The people in view.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct People {
    /// All people who had a skeleton, by id.
    pub each: Vec<PersonSummary>,
    /// Rule that selects the followed person: `last`, `largest` or `clearest`.
    pub follow: String,
    /// Ids of the people who were followed, in ascending order.
    pub followed: Vec<u64>,
    /// Number of results with more than one person.
    pub frames_with_others: u64,
    /// Maximum number of people in one result.
    pub most: u32,
}

impl People {
    /// Returns a text for users, in one line.
    pub fn text(&self) -> String {
        let Self {
            each: _,
            follow,
            followed,
            frames_with_others,
            most,
        } = self;
        if *frames_with_others == 0 {
            return match followed.len() {
                0 | 1 => "no other people in view".to_owned(),
                n => format!(
                    "no other people in view; {n} people were followed, {}",
                    ids(followed)
                ),
            };
        }
        let followed = match &followed[..] {
            [] => String::new(),
            [one] => format!(": id {one}"),
            several => format!("; in turn, these were {}", ids(several)),
        };
        format!(
            "up to {most} people in view, and more than one person in {frames_with_others} frames; person.follow = \"{follow}\" selects \
             the followed person{followed}"
        )
    }
}

/// Returns a list of ids for users.
fn ids(all: &[u64]) -> String {
    let shown: Vec<String> = all.iter().take(MOST_IDS).map(u64::to_string).collect();
    let more = match all.len().saturating_sub(MOST_IDS) {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    format!("ids {}{more}", shown.join(", "))
}

/// One person over the whole run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct PersonSummary {
    /// First frame with a skeleton.
    pub first_frame: u64,
    /// Number of frames with a skeleton.
    pub frames: u64,
    /// The person's id within the run, counted from 1.
    pub id: u64,
    /// Fraction of the joints that have a position, 0 to 1, over the frames with a skeleton.
    pub joints: f64,
    /// Last frame with a skeleton.
    pub last_frame: u64,
    /// Root mean square reprojection error over all joints, in pixels of the frame.
    #[serde(deserialize_with = "nullable")]
    pub reprojection_px: Option<f64>,
    /// How far the results of this person can be trusted, since the last start of the process.
    pub trust: Trust,
}

/// How well a camera agrees with the others, over the last frames.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct CameraFit {
    /// Standard error of [`CameraFit::offset_ms`].
    #[serde(default, deserialize_with = "nullable")]
    pub offset_error_ms: Option<f64>,
    /// Time by which the camera's pictures were taken later than their timestamps state, relative to the median of all cameras, in
    /// milliseconds. Negative if they were taken earlier; unknown while there is too little motion.
    #[serde(default, deserialize_with = "nullable")]
    pub offset_ms: Option<f64>,
    /// True if, at any time of the run, the camera seemed not to be synchronised with the others.
    #[serde(default)]
    pub out_of_step: bool,
    /// Distance between the positions at which this camera and the others see the same parts, in pixels of this camera's footage. Unknown
    /// with fewer than three cameras, or while too little was seen.
    #[serde(deserialize_with = "nullable")]
    pub residual_px: Option<f64>,
    /// True if, at any time of the run, the camera seemed not to be at its calibrated position.
    pub suspected: bool,
    /// [`CameraFit::residual_px`] of the other cameras if this one is left out.
    #[serde(deserialize_with = "nullable")]
    pub without_px: Option<f64>,
}

/// Two cameras whose footage seems to be swapped.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Exchanged {
    /// Names of the two cameras.
    pub cameras: [String; 2],
    /// Median angle by which rays to the same part miss each other with the present footage, in degrees.
    pub degrees: f64,
    /// Median angle by which the rays miss each other if the footage of the two cameras is swapped, in degrees.
    pub exchanged_degrees: f64,
    /// True if it is certain that these are the two cameras. In a ring of cameras, other pairs may fit almost as well.
    pub sure: bool,
}

/// Cameras whose observations of one person contradict the rig.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Contradicted {
    /// Median angle by which rays to the same part miss each other, in degrees.
    pub degrees: f64,
    /// The two cameras for which swapping the footage fits best, if any swap improves the fit.
    #[serde(deserialize_with = "nullable")]
    pub likely: Option<[String; 2]>,
    /// Maximum angle in a normal run, in degrees.
    pub usual_degrees: f64,
}

/// Key that every version of the file has.
#[derive(Deserialize)]
struct OfVersion {
    schema_version: u64,
}

/// Key that every version of the file has.
#[derive(Deserialize)]
struct OfSession {
    session: u64,
}

impl RunSummary {
    /// Name of the file.
    pub const FILE: &'static str = "summary.json";

    /// Parses the text of the file.
    ///
    /// # Errors
    ///
    /// Returns a [`ReadError`] if the text is malformed or of another version.
    pub fn parse(text: &str) -> Result<Self, ReadError> {
        let OfVersion { schema_version } = parse(text)?;
        if schema_version != VERSION {
            return Err(ReadError {
                line: 1,
                column: 1,
                field: "schema_version".to_owned(),
                problem: format!(
                    "the file has version {schema_version}, but this program reads version {VERSION}"
                ),
            });
        }
        parse(text)
    }

    /// Returns the session of the run that the file belongs to, for any version of the file.
    ///
    /// # Errors
    ///
    /// Returns a [`ReadError`] on failure.
    pub fn parse_session(text: &str) -> Result<u64, ReadError> {
        parse::<OfSession>(text).map(|value| value.session)
    }

    /// Returns the text of the file.
    ///
    /// # Errors
    ///
    /// Never fails for this type. The error type is that of `serde_json`.
    pub fn to_text(&self) -> Result<String, serde_json::Error> {
        to_text(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_about_people_names_the_followed_ones() {
        let people = |followed: &[u64], frames_with_others: u64| {
            let people = People {
                each: Vec::new(),
                follow: "last".to_owned(),
                followed: followed.to_vec(),
                frames_with_others,
                most: 3,
            };
            people.text()
        };
        assert_eq!(people(&[2], 0), "no other people in view");
        let expected = "no other people in view; 2 people were followed, ids 2, 5";
        assert_eq!(people(&[2, 5], 0), expected);
        let ends = |followed: &[u64], end: &str| people(followed, 7).ends_with(end);
        assert!(ends(&[], "selects the followed person"));
        assert!(ends(&[2], "selects the followed person: id 2"));
        let many: Vec<u64> = (1..=10).collect();
        assert!(ends(
            &many,
            "; in turn, these were ids 1, 2, 3, 4, 5, 6, 7, 8 and 2 more"
        ));
    }
}
