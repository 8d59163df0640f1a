//! The paper's evaluation: versions of the method side by side on one sequence, scored, and reported.
//!
//! [`Film`] gives the frames of a sequence, [`Bench`] solves each of them once in every view and then
//! by every [`Version`], [`Record`] keeps what was found (so that a run can go on), [`score()`] compares
//! it with the truth, and [`Summary`] adds up: as JSON and as LaTeX ([`latex()`]), the paper's own numbers
//! beside ours ([`published()`]).
//!
//! [`Pictures`] are single pictures of annotated people. [`joints_by`] solves a frame on the keypoints of a network in the ways
//! that are compared, and [`Stress`] is what goes wrong in it on purpose.
//!
//! Solving and scoring are separate: other thresholds or another ground truth need no second run.

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
