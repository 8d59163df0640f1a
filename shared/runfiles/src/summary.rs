//! `summary.json`: what was seen and what was missed, over the whole run.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::nullable::nullable;
use crate::read::{parse, to_text};
use crate::{LatencyReport, Missing, ReadError, Trust, VERSION};

/// The file `summary.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunSummary {
    /// Frames of the footage per second, where known.
    #[serde(deserialize_with = "nullable")]
    pub frame_rate_hz: Option<f64>,
    /// Name of the set of joints.
    pub joints: String,
    /// Where the time went.
    pub latency: LatencyReport,
    /// [`VERSION`] of all files of the run.
    pub schema_version: u64,
    /// The run.
    pub session: u64,
    /// Counts of what was seen and what was missed.
    pub summary: Summary,
    /// Meaning of the axes of `pose3d.trc`, in words.
    pub trc_axes: String,
    /// The views, as they are numbered in messages.
    pub views: Vec<ViewSummary>,
}

/// One view of the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ViewSummary {
    /// Width and height of the frames that were searched, pixels.
    pub frame_size: [u32; 2],
    /// The camera.
    pub name: String,
    /// From pixels of those frames to pixels of the footage: two rows of an affine map.
    pub source_from_frame: [[f64; 3]; 2],
}

/// Counts of what was seen and what was missed, over the whole run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Summary {
    /// How well every camera fits the others, by name; since the process was started last.
    pub calibration: BTreeMap<String, CameraFit>,
    /// Cameras that do not see one person where the rig says, for another reason or one that is not clear.
    #[serde(deserialize_with = "nullable")]
    pub contradicted: Option<Contradicted>,
    /// Evidence that a view handed on in shared memory, mean bytes per frame, by name; since the
    /// process was started last.
    pub evidence_bytes_per_frame: BTreeMap<String, u64>,
    /// Two cameras that look as if each had the footage of the other.
    #[serde(deserialize_with = "nullable")]
    pub exchanged: Option<Exchanged>,
    /// The first of the writes that failed.
    #[serde(deserialize_with = "nullable")]
    pub first_failure: Option<String>,
    /// Results that were received.
    pub frames: u64,
    /// Frames of all views that the cameras' side dropped.
    pub frames_dropped_by_capture: u64,
    /// Frames without a result; each has a line with the reason.
    pub frames_missed: u64,
    /// Results that came but were not written, because writing was too slow or the disk was full.
    pub frames_not_recorded: u64,
    /// Results with a skeleton.
    pub frames_with_pose: u64,
    /// Results without every view of the rig.
    pub frames_with_views_missing: u64,
    /// Who is followed, and how many others are in view; since the process was started last.
    pub people: People,
    /// How high people are in the frames that were searched, pixels, by name: the median over the results that used the view, of
    /// the longer side of the rectangle around a pose's parts; null without any. Since the process was started last.
    pub person_px: BTreeMap<String, Option<f64>>,
    /// Root mean square reprojection error over all joints, pixels of the frame.
    #[serde(deserialize_with = "nullable")]
    pub reprojection_px: Option<f64>,
    /// How many frames of every view were searched in full and how many near the last pose only, by
    /// name; since the process was started last.
    pub searches: BTreeMap<String, BTreeMap<String, u64>>,
    /// How far the results can be trusted; since the process was started last.
    pub trust: Trust,
    /// Number of results from which every view is missing, by name, for every reason.
    pub views_missing: BTreeMap<String, BTreeMap<Missing, u64>>,
    /// How many results every view has a part in, by name.
    pub views_present: BTreeMap<String, u64>,
    /// How often every view was used, by name.
    pub views_used: Vec<(String, u64)>,
    /// Writes that failed.
    pub writes_failed: u64,
}

/// The people in view.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct People {
    /// Everybody who had a skeleton, by id.
    pub each: Vec<PersonSummary>,
    /// Which of several is followed: `last`, `largest` or `clearest`.
    pub follow: String,
    /// How many people were followed, one after the other.
    pub followed: u64,
    /// Results with more than one.
    pub frames_with_others: u64,
    /// The most in one result.
    pub most: u32,
}

impl People {
    /// For people, in one line.
    pub fn text(&self) -> String {
        let Self {
            each: _,
            follow,
            followed,
            frames_with_others,
            most,
        } = self;
        let followed = if *followed > 1 {
            format!("; {followed} people were followed, one after the other")
        } else {
            String::new()
        };
        if *frames_with_others == 0 {
            return format!("no others in view{followed}");
        }
        format!(
            "up to {most} in view, more than one in {frames_with_others} frames; person.follow = \"{follow}\" chooses{followed}"
        )
    }
}

/// One person over the whole run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct PersonSummary {
    /// The first frame with a skeleton.
    pub first_frame: u64,
    /// Frames with a skeleton.
    pub frames: u64,
    /// Identity within the run, from 1.
    pub id: u64,
    /// Share of the joints that have a place, 0 to 1, of the frames with a skeleton.
    pub joints: f64,
    /// The last frame with a skeleton.
    pub last_frame: u64,
    /// Root mean square reprojection error over all joints, pixels of the frame.
    #[serde(deserialize_with = "nullable")]
    pub reprojection_px: Option<f64>,
    /// Trust in the results of this person, since the process was started last.
    pub trust: Trust,
}

/// How well a camera fits the others, over the last frames.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct CameraFit {
    /// Standard error of [`CameraFit::offset_ms`].
    #[serde(default, deserialize_with = "nullable")]
    pub offset_error_ms: Option<f64>,
    /// How much later its pictures were taken than their times say, against the median of all cameras, milliseconds; negative for
    /// earlier. Unknown while too little has moved.
    #[serde(default, deserialize_with = "nullable")]
    pub offset_ms: Option<f64>,
    /// True if it was found, at any time of the run, to be out of step with the others.
    #[serde(default)]
    pub out_of_step: bool,
    /// How far apart cameras see the same parts if it is one of them, pixels of its footage; unknown of
    /// fewer than three cameras, and while too little was seen.
    #[serde(deserialize_with = "nullable")]
    pub residual_px: Option<f64>,
    /// True if it was found, at any time of the run, not to stand where the calibration says.
    pub suspected: bool,
    /// [`CameraFit::residual_px`] of the others without it.
    #[serde(deserialize_with = "nullable")]
    pub without_px: Option<f64>,
}

/// Two cameras that look as if each had the footage of the other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Exchanged {
    /// The two.
    pub cameras: [String; 2],
    /// Amount by which rays to the same part miss each other as it is, degrees: the median.
    pub degrees: f64,
    /// The same with the two exchanged.
    pub exchanged_degrees: f64,
    /// True if it is certainly these two: of cameras in a ring others may fit almost as well.
    pub sure: bool,
}

/// Cameras that do not see one person where the rig says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Contradicted {
    /// Amount by which rays to the same part miss each other, degrees: the median.
    pub degrees: f64,
    /// The two cameras whose exchange fits best, if any fits better.
    #[serde(deserialize_with = "nullable")]
    pub likely: Option<[String; 2]>,
    /// Largest usual value, degrees.
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

    /// Reads the file.
    ///
    /// # Errors
    ///
    /// [`ReadError`]; a file of another version is one, too.
    pub fn parse(text: &str) -> Result<Self, ReadError> {
        let OfVersion { schema_version } = parse(text)?;
        if schema_version != VERSION {
            return Err(ReadError {
                line: 1,
                column: 1,
                field: "schema_version".to_owned(),
                problem: format!("found version {schema_version}, this program reads {VERSION}"),
            });
        }
        parse(text)
    }

    /// The run that the file is of, whatever its version.
    ///
    /// # Errors
    ///
    /// [`ReadError`].
    pub fn parse_session(text: &str) -> Result<u64, ReadError> {
        parse::<OfSession>(text).map(|value| value.session)
    }

    /// The file.
    ///
    /// # Errors
    ///
    /// None; those of `serde_json`.
    pub fn to_text(&self) -> Result<String, serde_json::Error> {
        to_text(self)
    }
}
