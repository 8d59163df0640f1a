//! Why keypoints cannot be read.

use std::io;
use std::path::PathBuf;

use crate::files::FileError;

/// Why the keypoints of a film cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum KeypointFileError {
    /// The operating system refuses.
    #[error("cannot read keypoints from {}: {source}", path.display())]
    Read {
        /// The file or the folder.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file is larger than is read.
    #[error("{} has {bytes} bytes, at most {most} are read", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its size.
        bytes: u64,
        /// The largest size.
        most: u64,
    },
    /// A file is malformed.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Error in the file.
        source: FileError,
    },
    /// A folder has no files of keypoints.
    #[error("{} has no file that ends in .json: every frame needs a file, such as cam01_000000000012_keypoints.json", path.display())]
    Empty {
        /// The folder.
        path: PathBuf,
    },
    /// The name of a file has no number, or one that is too large.
    #[error("the name of {} has no number of a frame before .json, expected one such as cam01_000000000012_keypoints.json", path.display())]
    NoNumber {
        /// The file.
        path: PathBuf,
    },
    /// Two files are of one frame.
    #[error("frame {number} has two files, {} and {}; a folder must hold the files of one camera only", paths[0].display(), paths[1].display())]
    Twice {
        /// The number in their names.
        number: u64,
        /// The files.
        paths: [PathBuf; 2],
    },
    /// The numbers of two files are too far apart.
    #[error("the files of {} are of frames {first} to {last}, at most {most} frames are read", path.display())]
    TooManyFrames {
        /// The folder.
        path: PathBuf,
        /// The lowest number.
        first: u64,
        /// The highest number.
        last: u64,
        /// Most frames.
        most: u64,
    },
    /// No file has a person, so that nothing says what keypoints are called.
    #[error("no file of {} has a person: say what the keypoints are called (`keypoint_names`)", path.display())]
    Nobody {
        /// The folder.
        path: PathBuf,
    },
    /// There are 25 keypoints, but not in the order that is usual.
    #[error(
        "{} has 25 keypoints, but not those of `body-25`: its pelvis would lie {off:.2} of people's height beside the middle of their \
         hips; say `keypoint_names = \"body-25b\"` if they are of OpenPose's experimental model, or \"body-25\" if this is right",
        path.display()
    )]
    NotBody25 {
        /// The folder or the file.
        path: PathBuf,
        /// Distance of the pelvis from the middle of the hips, share of the longer side of a person's box.
        off: f64,
    },
}
