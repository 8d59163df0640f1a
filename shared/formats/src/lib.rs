//! Readers and writers of file formats, independent of the other crates of the workspace: C3D, TRC, MATLAB level 5, and the header with a
//! checksum of Parallax's own binary files.
//!
//! The crate has its own readers although libraries exist. The libraries for MATLAB files panic on damaged files, and those for C3D files
//! reject many old files that contain all the data needed.
#![forbid(unsafe_code)]

pub mod c3d;
pub mod checksum;
pub mod mat5;
pub mod trc;
