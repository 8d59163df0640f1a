//! Annotated people: reading, validation, rotation and mirroring, and the conversion of their joints to the parts of a model.
//!
//! [`read`] takes the folder of a data set (PARSE, LSP, LSP-extended) or a file of JSON lines. It returns [`People`]: the valid people, and
//! a [`Problem`] with file and row for each invalid one. A [`Sample`] is a person with the pixels of the image; a [`SkeletonTable`]
//! converts joints to parts.
//!
//! In pixel coordinates, the centre of the top-left pixel is `(0, 0)`. The MATLAB files count from 1, so their coordinates are
//! converted when they are read.
//!
//! # The annotation file of Parallax
//!
//! Each line is one JSON object and describes one person; empty lines are ignored:
//!
//! ```json
//! {"image": "photos/7.jpg", "joints": [[31.5, 80.0], null, [40.0, 61.25]], "visible": [true, false, true], "name": "ann"}
//! ```
//!
//! | key | meaning |
//! |---|---|
//! | `image` | path of the image, relative to the annotation file |
//! | `joints` | `[x, y]` in pixels, or `null` if the joint is unknown; the order is that of the skeleton table |
//! | `visible` | optional, one `true` or `false` per joint; without it, all known joints are visible |
//! | `name` | optional; must be unique in the file |
//!
//! Other keys are errors.

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
