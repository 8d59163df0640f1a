//! Reasons why keypoints cannot be read.

use std::io;
use std::path::PathBuf;

use crate::files::FileError;

/// Reason why the keypoints of a film cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum KeypointFileError {
    /// The operating system reports an error.
    #[error("cannot read keypoints from {}: {source}", path.display())]
    Read {
        /// Path of the file or folder.
        path: PathBuf,
        /// Cause of the error.
        source: io::Error,
    },
    /// A file is larger than the maximum.
    #[error("{} has {bytes} bytes, but at most {most} bytes can be read", path.display())]
    TooLarge {
        /// Path of the file.
        path: PathBuf,
        /// Size of the file.
        bytes: u64,
        /// Maximum size.
        most: u64,
    },
    /// A file is malformed.
    #[error("{}: {source}", path.display())]
    File {
        /// Path of the file.
        path: PathBuf,
        /// Error in the file.
        source: FileError,
    },
    /// A folder has no files of keypoints.
    #[error("{} has no file with the extension .json: every frame needs a file, such as cam01_000000000012_keypoints.json", path.display())]
    Empty {
        /// Path of the folder.
        path: PathBuf,
    },
    /// The name of a file contains no number, or a number that is too large.
    #[error("the name of {} has no frame number before .json: expected a name such as cam01_000000000012_keypoints.json", path.display())]
    NoNumber {
        /// Path of the file.
        path: PathBuf,
    },
    /// Two files have the same frame number.
    #[error("frame {number} has two files, {} and {}, but a folder must contain the files of one camera only", paths[0].display(), paths[1].display())]
    Twice {
        /// Number in the names of the files.
        number: u64,
        /// Paths of the files.
        paths: [PathBuf; 2],
    },
    /// The numbers of two files are too far apart.
    #[error("the files in {} are for the frames {first} to {last}, but at most {most} frames can be read", path.display())]
    TooManyFrames {
        /// Path of the folder.
        path: PathBuf,
        /// Lowest frame number.
        first: u64,
        /// Highest frame number.
        last: u64,
        /// Maximum number of frames.
        most: u64,
    },
    /// No file contains a person, so the names of the keypoints are unknown.
    #[error("no file in {} has a person: set the names of the keypoints (`keypoint_names`)", path.display())]
    Nobody {
        /// Path of the folder.
        path: PathBuf,
    },
    /// There are 25 keypoints, but not in the usual order.
    #[error(
        "{} has 25 keypoints, but probably not those of `body-25`: the pelvis would be {off:.2} of a person's height away from the middle \
         of the hips; set `keypoint_names = \"body-25b\"` if the keypoints are from OpenPose's experimental model, or \"body-25\" if they \
         really are from `body-25`",
        path.display()
    )]
    NotBody25 {
        /// Path of the folder or file.
        path: PathBuf,
        /// Distance of the pelvis from the middle of the hips, as a fraction of the longer side of a person's box.
        off: f64,
    },
}
