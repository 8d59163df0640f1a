//! The paper's evaluation: compares versions of the method on the same sequence.
//!
//! [`Film`] supplies the frames of a sequence. [`Bench`] solves each frame once in every view, and then by every [`Version`]. [`Record`]
//! stores the results, so that a run can be resumed. [`score()`] compares them with the ground truth. [`Summary`] aggregates the scores, as
//! JSON and as LaTeX ([`latex()`]), with the paper's own numbers beside ours ([`published()`]).
//!
//! [`Pictures`] are single pictures of annotated people. [`joints_by`] solves a frame from the keypoints of a network by each of the
//! compared methods. [`Stress`] is a disturbance that is added on purpose.
//!
//! Solving and scoring are separate, so results can be scored again with other thresholds or another ground truth.

pub mod page;

mod version;

mod bench;
mod by_network;
mod film;
mod plain;
mod stress;
mod truth;

mod predicted;
mod record;
mod score;
mod summary;

mod latex;
mod pictures;
mod published;

#[cfg(test)]
mod testing;

pub use bench::{Bench, ErrorPredictor, Expectation, Setup, SingleView, Trial};
pub use by_network::{Method, NetworkView, joints_by, name_sides};
pub use film::{Film, FilmError, FilmSettings};
pub use latex::{latex, number, overall, pictures_latex};
pub use pictures::{Intervals, Judged, Pictures, Table};
pub use plain::{Sighting, dropping, linear};
pub use predicted::{Judgement, Predicted, judge};
pub use published::published;
pub use record::{FrameResult, Header, Record, RecordError, read_records};
pub use score::{FrameScore, Joints, projected, score};
pub use stress::{Stress, UnknownStress, cover_half};
pub use summary::{ChangesOf, Group, Measured, Numbers, Summary, summarise};
pub use truth::{parse14, part_errors, part_errors_and_facing, size, tenth_of};
pub use version::{Combining, Terms, Version, VersionError};
