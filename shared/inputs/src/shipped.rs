//! The files that ship with Parallax, built into the executable.

use std::borrow::Cow;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use deployment::{SHIPPED, is_shipped};
use failure::{ExitKind, Failure, in_file};

/// A shipped file; its model card is beside it in `configs/models`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shipped {
    /// The person model.
    Model,
    /// The network that predicts the expected errors of the model's parts.
    Network,
    /// The learned multi-view consistency of the model.
    Consistency,
    /// The network that estimates the direction in which a person faces.
    Orientation,
    /// The positions of joints relative to the parts of the model.
    Joints,
    /// The network that finds joints.
    PoseNetwork,
    /// The network that finds people.
    Detector,
}

impl Shipped {
    /// All shipped files.
    const ALL: [Self; 7] = [
        Self::Model,
        Self::Network,
        Self::Consistency,
        Self::Orientation,
        Self::Joints,
        Self::PoseNetwork,
        Self::Detector,
    ];

    /// Returns the content of the file.
    pub fn bytes(self) -> &'static [u8] {
        match self {
            Self::Model => include_bytes!("../../../configs/models/person.fmp"),
            Self::Network => include_bytes!("../../../configs/models/person.quality.onnx"),
            Self::Consistency => include_bytes!("../../../configs/models/person.consistency"),
            Self::Orientation => include_bytes!("../../../configs/models/person.orientation"),
            Self::Joints => include_bytes!("../../../configs/models/person.joints"),
            Self::PoseNetwork => include_bytes!("../../../configs/models/person.pose.onnx"),
            Self::Detector => include_bytes!("../../../configs/models/person.boxes.onnx"),
        }
    }

    /// Returns a unique name, such as `shipped:model`. In settings, the name of every shipped file is `shipped`.
    pub fn name(self) -> PathBuf {
        let kind = match self {
            Self::Model => "model",
            Self::Network => "network",
            Self::Consistency => "consistency",
            Self::Orientation => "orientation",
            Self::Joints => "joints",
            Self::PoseNetwork => "pose-network",
            Self::Detector => "detector",
        };
        format!("{SHIPPED}:{kind}").into()
    }

    /// Terms of use of the shipped files.
    pub const TERMS: &str = "for research only, because the training photographs are licensed for research (PARSE, LSP-extended, INRIA \
                             Person)";

    /// Returns the shipped file with the same content as a user's file; `shipped` means the person model.
    pub fn of_file(file: &Path) -> Option<Self> {
        if is_shipped(file) {
            return Some(Self::Model);
        }
        let bytes = files::read(file, files::MODEL).ok()?;
        Self::ALL.into_iter().find(|kind| kind.bytes() == bytes)
    }

    /// Returns the shipped file with the given unique name.
    pub fn of_name(name: &Path) -> Option<Self> {
        Self::ALL.into_iter().find(|known| known.name() == name)
    }

    /// Reads a file of this kind; `shipped` means the shipped file.
    ///
    /// # Errors
    ///
    /// Fails if the file does not exist, cannot be read, or is empty.
    pub fn read(self, file: &Path) -> Result<Cow<'static, [u8]>, Failure> {
        if is_shipped(file) {
            return Ok(Cow::Borrowed(self.bytes()));
        }
        let bytes = files::read(file, files::MODEL).map_err(|error| {
            let failure = in_file(file, &error);
            let is_absent = error.kind() == ErrorKind::NotFound;
            if is_absent {
                failure.with_hint(self.hint())
            } else {
                failure
            }
        })?;
        if bytes.is_empty() {
            let message = format!("{} is empty (0 bytes)", file.display());
            return Err(Failure::new(ExitKind::Input, message).with_hint(self.hint()));
        }
        Ok(Cow::Owned(bytes))
    }

    /// Returns the hint for a missing file.
    fn hint(self) -> String {
        let [key, made_by] = match self {
            Self::Model => ["paper.model", "train fmp"],
            Self::Network => ["paper.errors", "train quality"],
            Self::Consistency => ["paper.consistency", "train consistency"],
            Self::Orientation => ["paper.orientation", "train orientation"],
            Self::Joints => ["paper.joint_map", "train joints"],
            Self::PoseNetwork => ["network.file", "train network"],
            Self::Detector => ["network.detector", "train finder"],
        };
        format!(
            "`{key}` names a file made by `parallax-lab {made_by}`, or is \"{SHIPPED}\" for the built-in file"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_included_file_has_the_right_kind() {
        let model = fmp::files::own::decode(Shipped::Model.bytes()).unwrap();
        let n_parts = model.parts.len();
        viewquality::Network::parse(Shipped::Network.bytes().to_vec(), n_parts).unwrap();
        let text = core::str::from_utf8(Shipped::Consistency.bytes()).unwrap();
        multiview::learned::Learned::parse(text).unwrap();
        viewquality::orientation::Network::from_bytes(Shipped::Orientation.bytes()).unwrap();
        let library = crate::library::Library::BuiltIn;
        let network = crate::open_network((Path::new(SHIPPED), None), &library);
        network.unwrap().fitted().unwrap();
        crate::detector::open(Path::new(SHIPPED), None).unwrap();
    }

    #[test]
    fn included_files_are_recognised_by_their_content() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs");
        let network = folder.join("models/person.pose.onnx");
        assert_eq!(Shipped::of_file(&network), Some(Shipped::PoseNetwork));
        assert_eq!(Shipped::of_file(&folder.join("synthetic.toml")), None);
    }

    #[test]
    fn the_included_joint_map_belongs_to_the_included_model() {
        let text = core::str::from_utf8(Shipped::Joints.bytes()).unwrap();
        let file = multiview::learned::JointFile::parse(text).unwrap();
        let model = formats::checksum::fnv1a(Shipped::Model.bytes());
        assert_eq!(file.model, format!("{model:016x}"));
    }
}
