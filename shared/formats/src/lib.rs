//! Layouts of files, read and written without any other crate of the workspace: C3D, TRC, MATLAB's level 5, and the checked header of our own binary ones.
//!
//! Own readers where libraries exist: those of MATLAB's files panic on damaged ones, and those of C3D refuse old laboratories'
//! files that hold all that is needed.
#![forbid(unsafe_code)]

pub mod c3d;
pub mod checksum;
pub mod mat5;
pub mod trc;
