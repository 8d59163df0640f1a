//! Exports a run to the file formats of other programs, with one module for each format, and to pages ([`report`]).
//!
//! [`Gathering`] takes the lines of a run one by one and makes a [`Trial`] of them. A trial has one entry for every instant at the frame
//! rate, including instants without a frame (gaps). [`FILES`] is the table of formats with one file per trial. Two formats have a file for
//! every view and frame ([`openpose`]) or pictures ([`annotate`]), and need a [`ViewCamera`]. [`opensim`] has several files per trial.
//!
//! | format | unit | axes | representation of a gap |
//! |---|---|---|---|
//! | [`c3d`](FILES) | mm | z up | residual -1 |
//! | `trc` | m | y up | NaN |
//! | `glb` | m | y up | a bone scaled to 0 |
//! | `bvh` | cm | y up | the last rotation, and a note: the format has no gaps |
//! | `csv`, `csv-long` | m | the rig's | empty cells |
//! | `parquet` (a feature) | m | the rig's | null |
//! | [`opensim`] | m | y up | NaN |
//! | [`openpose`] | pixels of the footage | x right, y down | `0, 0, 0` |
//!
//! This crate opens no file, and does not smooth or fill data. Each format lists in its [`Notes`] what it cannot express.
#![forbid(unsafe_code)]

pub mod report;
mod trial;

mod landmarks;
mod tree;

mod format;
mod sink;

mod bvh;
mod glb;
#[cfg(feature = "parquet")]
mod parquet;
mod points;
mod tables;

mod view;

pub mod annotate;
pub mod openpose;
pub mod opensim;

pub use format::{FILES, FileFormat, Needs};
pub use sink::{Notes, Sink};
pub use trial::{Gap, Gathering, Point, Slot, Trial, TrialError};
pub use view::{Seen, ViewCamera};

#[cfg(test)]
mod testing;
