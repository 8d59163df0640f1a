//! Names of the topics of a deployment.
//!
//! The number in a name is the version of the message type. Views, pairs and processes are named by index or by role,
//! so that topic names never contain text from the user.

/// Returns the topic for the pixels of a view: `[u8]` with [`FrameHeader`](crate::FrameHeader).
#[must_use]
pub fn frame(view: usize) -> String {
    format!("frame/v1/{view}")
}

/// Returns the topic for the original pictures of the live camera of a view, for recordings: `[u8]` with
/// [`PictureHeader`](crate::PictureHeader).
#[must_use]
pub fn picture(view: usize) -> String {
    format!("picture/v1/{view}")
}

/// Returns the topic for the single-view candidates of a view: [`Sightings`](crate::Sightings).
#[must_use]
pub fn sightings(view: usize) -> String {
    format!("sightings/v1/{view}")
}

/// Returns the topic for the response maps of a view: `[f32]` with [`EvidenceHeader`](crate::EvidenceHeader).
#[must_use]
pub fn evidence(view: usize) -> String {
    format!("evidence/v5/{view}")
}

/// Returns the topic for the expected errors of a view: [`ViewQuality`](crate::ViewQuality).
#[must_use]
pub fn view_quality(view: usize) -> String {
    format!("view-quality/v2/{view}")
}

/// Returns the topic for the results of one fusion worker: [`PairPose`](crate::PairPose).
#[must_use]
pub fn pair_pose(worker: usize) -> String {
    format!("pair-pose/v3/{worker}")
}

/// Returns the topic for the people in every frame: [`People`](crate::People).
#[must_use]
pub fn people() -> String {
    "people/v1".to_owned()
}

/// Returns the topic for the final result: [`Skeletons`](crate::Skeletons).
#[must_use]
pub fn skeletons() -> String {
    "skeletons/v1".to_owned()
}

/// Returns the topic for the heartbeats of a process: [`Health`](crate::Health).
///
/// * `process`: its unique name in the deployment, for example `pose-2`.
#[must_use]
pub fn health(process: &str) -> String {
    format!("health/v5/{process}")
}

/// Returns the topic for the times and counts of a process: [`Metrics`](crate::Metrics).
///
/// * `process`: its unique name in the deployment.
#[must_use]
pub fn metrics(process: &str) -> String {
    format!("{METRICS}{process}")
}

/// Returns the process whose [`metrics`] are sent on a topic; `None` for other topics.
#[must_use]
pub fn process_of_metrics(topic: &str) -> Option<&str> {
    topic.strip_prefix(METRICS)
}

const METRICS: &str = "metrics/v1/";
