//! The four steps between the frames of the cameras and the skeletons, each of which runs as a process: [`pose`] and [`quality`] once per
//! view, [`fuse`] and [`triangulate`] once or more per deployment. They exchange messages only; none of them calls another.
#![forbid(unsafe_code)]

pub mod fuse;
pub mod pose;
pub mod quality;
pub mod triangulate;
