//! Annotated people: reading, validation, rotation and mirroring, and the parts of a model from their joints.
//!
//! [`read`] takes the folder of a data set (PARSE, LSP, LSP-extended) or a file of JSON lines and returns
//! [`People`]: the valid ones, and a [`Problem`] for each of the others, with file and row. A
//! [`Sample`] is a person with the pixels; a [`SkeletonTable`] converts joints to parts.
//!
//! Pixels: the centre of the top-left pixel is `(0, 0)`; the MATLAB files count from 1, which is undone
//! when they are read.
//!
//! # The annotation file of Parallax
//!
//! One JSON object per line, one person each; empty lines are ignored:
//!
//! ```json
//! {"image": "photos/7.jpg", "joints": [[31.5, 80.0], null, [40.0, 61.25]], "visible": [true, false, true], "name": "ann"}
//! ```
//!
//! | key | meaning |
//! |---|---|
//! | `image` | path of the image, relative to the annotation file |
//! | `joints` | `[x, y]` in pixels, or `null` where the joint is not known; the order is that of the skeleton table |
//! | `visible` | optional, one `true` or `false` per joint; without it, all known joints are visible |
//! | `name` | optional, no two people of a file may have the same |
//!
//! Other keys are refused.

mod person;
pub mod sequences;

mod check;
mod lines;
mod mat_files;
mod options;
mod read;
mod select;

mod picture;
mod sample;
mod sides;

mod table;

pub use lines::{parse_line, to_line};
pub use mat_files::{Annotation, MatLayoutError, parse_joints, parse_labels};
pub use options::ReadOptions;
pub use person::{Fault, FaultKind, People, Person, Problem};
pub use picture::Picture;
pub use read::{DatasetError, read};
pub use sample::Sample;
pub use select::{SelectError, Selection};
pub use sides::{Sides, UnknownSides};
pub use table::{SkeletonFileError, SkeletonSpec, SkeletonTable, TableError};
