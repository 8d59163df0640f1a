//! A skeleton as a TOML file.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::{SkeletonSpec, SkeletonTable, TableError};

/// Reason why a skeleton file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SkeletonFileError {
    /// The file cannot be read.
    #[error("cannot read the skeleton {}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The text is not TOML, or has unknown keys.
    #[error("not a skeleton")]
    Syntax(#[from] toml::de::Error),
    /// The name of a part or joint is unknown.
    #[error("{whose} names the {what} {name:?}, which does not exist")]
    NoSuch {
        /// Description of the place where the name is used.
        whose: String,
        /// `part`, or `joint`.
        what: &'static str,
        /// The unknown name.
        name: String,
    },
    /// A joint is in two mirror pairs.
    #[error("the joint {name:?} is in two pairs of `joint_mirror`")]
    MirroredTwice {
        /// Name of the joint.
        name: String,
    },
    /// The skeleton in the file is invalid.
    #[error("the skeleton is invalid")]
    Table(#[from] TableError),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Skeleton {
    joints: Vec<String>,
    #[serde(default)]
    joint_mirror: Vec<[String; 2]>,
    part: Vec<Part>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Part {
    name: String,
    parent: Option<String>,
    mirror: Option<String>,
    joints: BTreeMap<String, f64>,
}

impl SkeletonTable {
    /// Reads a TOML file; see [`parse`](Self::parse).
    ///
    /// # Errors
    ///
    /// Fails with [`SkeletonFileError`].
    pub fn read(path: &Path) -> Result<Self, SkeletonFileError> {
        let text = fs::read_to_string(path).map_err(|source| SkeletonFileError::Io {
            path: path.to_owned(),
            source,
        })?;
        Self::parse(&text)
    }

    /// Parses the text of a TOML file.
    ///
    /// `joints` lists the names of the joints in the order of the annotation. `joint_mirror` lists the pairs of joints that are mirror
    /// images of each other. Every `[[part]]` has a `name`, a `parent` (except the first), and the `joints` with the weights that determine
    /// its position. A part that is not its own mirror image also has a `mirror`. Names must match exactly.
    ///
    /// # Errors
    ///
    /// Fails with [`SkeletonFileError`].
    ///
    /// ```
    /// let table = training::datasets::SkeletonTable::parse(
    ///     r#"
    ///     joints = ["left hand", "right hand", "head"]
    ///     joint_mirror = [["left hand", "right hand"]]
    ///
    ///     [[part]]
    ///     name = "head"
    ///     joints = { head = 1.0 }
    ///
    ///     [[part]]
    ///     name = "middle of the hands"
    ///     parent = "head"
    ///     joints = { "left hand" = 0.5, "right hand" = 0.5 }
    ///     "#,
    /// )?;
    /// let parts = table.parts_of(&[[0.0, 4.0], [8.0, 4.0], [3.0, 1.0]]);
    /// assert_eq!(parts, [[3.0, 1.0], [4.0, 4.0]]);
    /// # Ok::<(), training::datasets::SkeletonFileError>(())
    /// ```
    pub fn parse(text: &str) -> Result<Self, SkeletonFileError> {
        let file: Skeleton = toml::from_str(text)?;
        let names: Vec<String> = file.part.iter().map(|part| part.name.clone()).collect();
        let mut spec = SkeletonSpec {
            parent: Vec::new(),
            mirror: Vec::new(),
            weights: Vec::new(),
            joint_mirror: joint_mirror(&file.joints, &file.joint_mirror)?,
            joint_names: file.joints,
            names,
        };
        for (own, part) in file.part.into_iter().enumerate() {
            let find = |what, names: &[String], name: &str| {
                index_of(names, name).ok_or_else(|| SkeletonFileError::NoSuch {
                    whose: format!("the part {:?}", part.name),
                    what,
                    name: name.to_owned(),
                })
            };
            let part_named = |text: &String| find("part", &spec.names, text);
            let parent = part.parent.as_ref().map(part_named).transpose()?;
            let mirror = part.mirror.as_ref().map(part_named).transpose()?;
            let mut weights = Vec::new();
            for (joint, weight) in &part.joints {
                weights.push((find("joint", &spec.joint_names, joint)?, *weight));
            }
            weights.sort_unstable_by_key(|weight| weight.0);
            spec.parent.push(parent);
            spec.mirror.push(mirror.unwrap_or(own));
            spec.weights.push(weights);
        }
        Ok(Self::new(spec)?)
    }
}

fn joint_mirror(joints: &[String], pairs: &[[String; 2]]) -> Result<Vec<usize>, SkeletonFileError> {
    let mut mirror: Vec<usize> = (0..joints.len()).collect();
    for [a, b] in pairs {
        let find = |name: &String| {
            index_of(joints, name).ok_or_else(|| SkeletonFileError::NoSuch {
                whose: "`joint_mirror`".to_owned(),
                what: "joint",
                name: name.clone(),
            })
        };
        let (at, other) = (find(a)?, find(b)?);
        for (own, its, name) in [(at, other, a), (other, at, b)] {
            if mirror[own] != own {
                return Err(SkeletonFileError::MirroredTwice { name: name.clone() });
            }
            mirror[own] = its;
        }
    }
    Ok(mirror)
}

fn index_of(names: &[String], name: &str) -> Option<usize> {
    names.iter().position(|known| known == name)
}
