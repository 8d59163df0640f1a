//! The ground truth of a sequence, as lines of JSON. It contains the joints and their projections in every camera.
//!
//! The format is documented in `TRUTH.md` beside this crate.

use serde::{Deserialize, Serialize};
use skeleton::JointSet;

/// The format name in the first line of a file.
const FORMAT: &str = "parallax-truth";
const VERSION: u32 = 2;

/// Number of joints in `skeleton::PARSE14`.
pub const N_JOINTS: usize = 14;

/// The first line: the description of the sequence.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// The format name, `"parallax-truth"`.
    pub format: String,
    /// The format version, 2.
    pub version: u32,
    /// Number of the subject.
    pub subject: u64,
    /// Name of the action.
    pub action: String,
    /// Seed of the random choices.
    pub seed: u64,
    /// Number of frames per second.
    pub frame_rate_hz: f64,
    /// Upward direction in the world, as a unit vector.
    pub up: [f64; 3],
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Names of the cameras.
    pub cameras: Vec<String>,
}

/// One frame of all cameras.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Frame {
    /// Number of the frame, counted from 0.
    pub frame: u64,
    /// Nominal time in seconds, `frame / frame_rate_hz`.
    pub seconds: f64,
    /// The joints of `skeleton::PARSE14` at that time, in metres in the world.
    pub joints: [[f64; 3]; N_JOINTS],
    /// The joints of every other person at that time, in metres in the world.
    pub others: Vec<[[f64; 3]; N_JOINTS]>,
    /// The pictures, one for every camera of the header.
    pub views: Vec<View>,
}

/// The truth of one picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct View {
    /// Name of the camera.
    pub camera: String,
    /// Time at which the picture was taken, in seconds.
    pub seconds: f64,
    /// True if the camera dropped this frame, so that an earlier picture is repeated.
    pub repeated: bool,
    /// True if the person's back is turned to the camera.
    pub from_behind: bool,
    /// The joints in the picture, in pixels, at the time at which the picture was taken; `None` for a joint behind the camera.
    pub pixels: [Option<[f64; 2]>; N_JOINTS],
    /// For every joint, true if it is visible.
    pub visible: [bool; N_JOINTS],
    /// Bounding box of the visible part of the person, `[x1, y1, x2, y2]` in pixels.
    #[serde(rename = "box")]
    pub outline: Option<[f64; 4]>,
}

/// Reason why a line is invalid.
#[derive(Debug, thiserror::Error)]
pub enum TruthError {
    /// The line is not JSON, or does not have the required keys.
    #[error("not a line of a truth file")]
    Syntax(#[from] serde_json::Error),
    /// The file has another format or version.
    #[error("{format:?} version {version}, expected {FORMAT:?} version {VERSION}")]
    Version {
        /// The format in the line.
        format: String,
        /// The version in the line.
        version: u32,
    },
    /// The joints differ from those of `skeleton::PARSE14`.
    #[error("joint {nth} is {got:?}, expected {expected:?}")]
    Joint {
        /// Position of the joint, counted from 1.
        nth: usize,
        /// The name in the line; empty if there are too few names.
        got: String,
        /// The name in `skeleton::PARSE14`; empty if there are too many names in the line.
        expected: String,
    },
    /// The views differ from the cameras in number or name.
    #[error("the views of frame {frame} do not match the cameras of the header")]
    Views {
        /// Number of the frame.
        frame: u64,
    },
}

impl Header {
    /// Creates a header with the joints of `skeleton::PARSE14`.
    pub fn new(subject: u64, action: &str, seed: u64) -> Self {
        Self {
            format: FORMAT.to_owned(),
            version: VERSION,
            subject,
            action: action.to_owned(),
            seed,
            frame_rate_hz: 0.0,
            up: [0.0, 0.0, 1.0],
            joints: names().map(str::to_owned).collect(),
            cameras: Vec::new(),
        }
    }

    /// Reads the first line of a file.
    ///
    /// # Errors
    ///
    /// [`TruthError`], except `Views`.
    pub fn parse(line: &str) -> Result<Self, TruthError> {
        let header: Self = serde_json::from_str(line)?;
        if (header.format.as_str(), header.version) != (FORMAT, VERSION) {
            return Err(TruthError::Version {
                format: header.format,
                version: header.version,
            });
        }
        let n = header.joints.len().max(N_JOINTS);
        for nth in 0..n {
            let got = header.joints.get(nth).cloned().unwrap_or_default();
            let expected = names().nth(nth).unwrap_or_default().to_owned();
            if got != expected {
                return Err(TruthError::Joint {
                    nth: nth + 1,
                    got,
                    expected,
                });
            }
        }
        Ok(header)
    }

    /// Returns the header as a line of text, without a line break.
    ///
    /// # Errors
    ///
    /// Fails if a number is not finite.
    pub fn to_line(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string(self)
    }
}

impl Frame {
    /// Reads a line.
    ///
    /// # Errors
    ///
    /// [`TruthError::Syntax`], and [`TruthError::Views`] if there is not exactly one view for every camera.
    pub fn parse(line: &str, header: &Header) -> Result<Self, TruthError> {
        let frame: Self = serde_json::from_str(line)?;
        let cameras = frame.views.iter().map(|view| &view.camera);
        if !cameras.eq(&header.cameras) {
            return Err(TruthError::Views { frame: frame.frame });
        }
        Ok(frame)
    }

    /// Returns the frame as a line of text, without a line break.
    ///
    /// # Errors
    ///
    /// Fails if a number is not finite.
    pub fn to_line(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string(self)
    }

    /// Returns the joints of another set, in metres in the world.
    pub fn in_set(&self, set: &JointSet) -> Vec<[f64; 3]> {
        in_set(&self.joints, set)
    }
}

impl View {
    /// Returns the joints of another set in the picture; `None` if any joint is behind the camera.
    pub fn in_set(&self, set: &JointSet) -> Option<Vec<[f64; 2]>> {
        let mut joints = [[0.0; 2]; N_JOINTS];
        for (joint, pixel) in joints.iter_mut().zip(self.pixels) {
            *joint = pixel?;
        }
        Some(in_set(&joints, set))
    }
}

fn names() -> impl Iterator<Item = &'static str> {
    skeleton::PARSE14.joints.iter().map(|joint| joint.name)
}

/// Converts joints to another set, by way of the body parts from which the joints of every set are computed.
fn in_set<const D: usize>(joints: &[[f64; D]; N_JOINTS], set: &JointSet) -> Vec<[f64; D]> {
    let mut parts = [[0.0; D]; skeleton::N_PARTS];
    for (joint, at) in skeleton::PARSE14.joints.iter().zip(joints) {
        for part in joint.parts {
            parts[*part] = *at;
        }
    }
    set.from_parts(&parts)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use skeleton::{HUMANEVA20, PARSE14, UMPM15};

    use super::*;

    fn header() -> Header {
        Header {
            cameras: vec!["a".to_owned()],
            frame_rate_hz: 30.0,
            ..Header::new(3, "walking", 7)
        }
    }

    fn frame() -> Frame {
        Frame {
            frame: 2,
            seconds: 0.1,
            joints: core::array::from_fn(|i| [i as f64, 0.5, -1.0]),
            others: vec![[[0.5; 3]; N_JOINTS]],
            views: vec![View {
                camera: "a".to_owned(),
                seconds: 0.1,
                repeated: false,
                from_behind: true,
                pixels: core::array::from_fn(|i| (i != 3).then_some([i as f64, 2.5])),
                visible: core::array::from_fn(|i| i % 2 == 0),
                outline: None,
            }],
        }
    }

    #[test]
    fn every_joint_of_every_set_is_computed_from_the_fourteen_joints() {
        let known: Vec<usize> =
            PARSE14.joints.iter().flat_map(|joint| joint.parts).copied().collect();
        for set in JointSet::ALL {
            for joint in set.joints {
                assert!(
                    joint.parts.iter().all(|part| known.contains(part)),
                    "{}",
                    joint.name
                );
            }
        }
        let frame = frame();
        assert_eq!(frame.in_set(&PARSE14), frame.joints);
        assert_eq!(
            frame.in_set(&UMPM15)[0],
            [2.5, 0.5, -1.0],
            "the middle of the hips"
        );
        assert_eq!(frame.in_set(&HUMANEVA20)[19], frame.joints[13], "head");
        assert_eq!(
            frame.views[0].in_set(&UMPM15),
            None,
            "a joint is behind the camera"
        );
    }

    #[test]
    fn written_lines_are_read_back_and_invalid_ones_refused() {
        let line = header().to_line().unwrap();
        assert_eq!(Header::parse(&line).unwrap(), header());
        for (from, to) in [
            ("parallax-truth", "other"),
            ("\"version\":2", "\"version\":1"),
            ("right knee", "right hip"),
            ("\"seed\"", "\"sede\""),
        ] {
            Header::parse(&line.replace(from, to)).unwrap_err();
        }
        let line = frame().to_line().unwrap();
        assert_eq!(Frame::parse(&line, &header()).unwrap(), frame());
        for (from, to) in [
            ("\"a\"", "\"b\""),
            ("\"box\"", "\"bax\""),
            ("[0.0,0.5,-1.0],", ""),
        ] {
            Frame::parse(&line.replace(from, to), &header()).unwrap_err();
        }
    }

    proptest! {
        #[test]
        fn no_text_panics(line: String) {
            drop(Header::parse(&line));
            drop(Frame::parse(&line, &header()));
        }

        #[test]
        fn a_changed_line_is_parsed_or_refused(at in 0_usize..900, to in "[a-z0-9\\[\\]{},:.\"-]{0,4}") {
            let mut line = frame().to_line().unwrap();
            if at < line.len() {
                line.replace_range(at..(at + 2).min(line.len()), &to);
            }
            drop(Frame::parse(&line, &header()));
        }
    }
}
