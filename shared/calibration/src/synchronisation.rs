//! Offset and drift of the clocks of cameras, from the movement of people that they see, or from the sounds that they hear.
//!
//! A joint that two cameras see at one instant fulfils their epipolar constraint; at two instants it does not, because the
//! person moves. The offset between two clocks is where the constraint holds best.
//!
//! Reading order: [`Film`] (what a camera saw, by its own clock), [`estimate`] (the whole), [`Outcome`] (what came out, and
//! every [`Doubt`] that forbids to use it).
//!
//! | step | module |
//! |---|---|
//! | people linked from frame to frame, outliers left out, positions smoothed | `track` |
//! | cost of a pair of cameras over its offset, by full search | `curve` |
//! | the offsets of all cameras that agree best, and the second best | `search` |
//! | offsets and drifts to fractions of a frame, with standard errors | `refine` |
//! | why an answer is not to be trusted | `doubt` |
//! | all of this from sounds ([`estimate_by_sound`]) | `sound` |
//!
//! Times are seconds, places pixels of the recorded picture. A camera's time `t` by its own clock is
//! `t + offset + drift * t` on the common clock, which is that of the reference camera. Pure: no clock, file or thread.

mod curve;
mod doubt;
mod estimate;
mod film;
mod pair;
mod refine;
mod search;
mod sound;
mod track;

#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

pub use curve::Curve;
pub use doubt::Doubt;
pub use estimate::{CameraClock, Outcome, PairReport, Settings, estimate};
pub use film::{Film, FilmError, Joint, Person, Shot};
pub use sound::{Sound, SoundSettings, estimate_by_sound};
pub use track::{Place, Track, tracks};
