//! Offset and drift of the clocks of cameras, from the movement of people that they see, or from the sounds that they record.
//!
//! A joint that two cameras see at the same instant satisfies their epipolar constraint. Positions from different instants do not satisfy
//! it, because the person moves. The offset between two clocks is the value for which the constraint is satisfied best.
//!
//! Suggested reading order:
//!
//! - [`Film`]: the people in the pictures of one camera, with times of its own clock.
//! - [`estimate`]: the whole estimation.
//! - [`Outcome`]: the result, with every [`Doubt`] that forbids using it.
//!
//! | step | module |
//! |---|---|
//! | link people from frame to frame, leave out outliers, smooth positions | `track` |
//! | find the cost of every offset between a pair of cameras, by full search | `curve` |
//! | find the offsets of all cameras that agree best, and the second best | `search` |
//! | refine offsets and drifts to fractions of a frame, with standard errors | `refine` |
//! | find reasons not to trust the result | `doubt` |
//! | estimate offsets and drifts from sounds ([`estimate_by_sound`]) | `sound` |
//!
//! Times are in seconds, and positions are in pixels of the recorded picture. A time `t` on a camera's own clock is
//! `t + offset + drift * t` on the common clock, which is the clock of the reference camera. This module uses no clock, file or thread.

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
