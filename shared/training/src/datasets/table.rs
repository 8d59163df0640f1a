//! The parts of a model, and their positions between the annotated joints.

mod file;
mod published;

pub use file::SkeletonFileError;

/// The definition of a skeleton before validation.
#[derive(Debug, Clone, PartialEq)]
pub struct SkeletonSpec {
    /// Names of the parts.
    pub names: Vec<String>,
    /// Parent of every part; `None` for the root, which is part 0.
    pub parent: Vec<Option<usize>>,
    /// For each part, the part on the other side of the body; a part in the middle is its own mirror.
    pub mirror: Vec<usize>,
    /// For every part, the joints and weights of its weighted sum.
    pub weights: Vec<Vec<(usize, f64)>>,
    /// Names of the joints, in the order of the annotation.
    pub joint_names: Vec<String>,
    /// For each joint, the joint on the other side of the body; a joint in the middle is its own mirror.
    pub joint_mirror: Vec<usize>,
}

/// A validated skeleton, for which a model is trained.
///
/// * The parts form a tree: only part 0 is a root, and every other part comes after its parent.
/// * Both mirrors are their own inverses. The parent of a mirrored part is the mirrored parent, and a mirrored part is computed from the
///   mirrored joints. The parts of a mirrored person are therefore the mirrored parts.
/// * The weights of every part add up to 1.
#[derive(Debug, Clone, PartialEq)]
pub struct SkeletonTable(SkeletonSpec);

/// Reason why a skeleton is invalid. Parts and joints are numbered from 1.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TableError {
    /// There is no part, no joint, or too many of them.
    #[error("the skeleton has {got} {what}, expected 1 to {max}")]
    Number {
        /// The counted entries: parts or joints.
        what: &'static str,
        /// Number of entries found.
        got: usize,
        /// Largest accepted number of entries.
        max: usize,
    },
    /// A list does not have one entry per part or joint.
    #[error("there are {got} {what}, expected {expected}")]
    Length {
        /// Name of the entries.
        what: &'static str,
        /// Number of entries found.
        got: usize,
        /// Number of entries expected.
        expected: usize,
    },
    /// Two parts or two joints have the same name.
    #[error("{what} {first} and {second} are both called {name:?}")]
    SameName {
        /// `parts` or `joints`.
        what: &'static str,
        /// Number of the first part or joint, from 1.
        first: usize,
        /// Number of the second part or joint, from 1.
        second: usize,
        /// The duplicate name.
        name: String,
    },
    /// The first part has a parent, or another part has none.
    #[error(
        "part {part} ({name}) has {} parent: the first part, and no other, is the root",
        if *.part == 1 { "a" } else { "no" }
    )]
    Root {
        /// Number of the part, from 1.
        part: usize,
        /// Name of the part.
        name: String,
    },
    /// A parent does not come before its child.
    #[error("part {part} ({name}) has part {parent} as its parent, which does not come before it")]
    Tree {
        /// Number of the part, from 1.
        part: usize,
        /// Name of the part.
        name: String,
        /// Number of the parent, from 1.
        parent: usize,
    },
    /// A mirror that is not its own inverse.
    #[error(
        "the mirror of {what} {index} ({name}) is {what} {other}, but {what} {other} does not exist or has another mirror"
    )]
    Mirror {
        /// `part` or `joint`.
        what: &'static str,
        /// Number of the part or joint, from 1.
        index: usize,
        /// Name of the part or joint.
        name: String,
        /// Number of its mirror image, from 1.
        other: usize,
    },
    /// The parent of a mirrored part is not the mirrored parent.
    #[error("the mirror of part {part} ({name}) is not a child of the mirror of its parent")]
    MirrorTree {
        /// Number of the part, from 1.
        part: usize,
        /// Name of the part.
        name: String,
    },
    /// A part and its mirror image have different positions between the joints.
    #[error(
        "part {part} ({name}) and its mirror image {other} are not between corresponding joints"
    )]
    MirrorWeights {
        /// Number of the part, from 1.
        part: usize,
        /// Name of the part.
        name: String,
        /// Name of the mirror image.
        other: String,
    },
    /// A part refers to a joint that does not exist.
    #[error("part {part} ({name}) uses joint {joint}, but there are only {n_joints} joints")]
    Joint {
        /// Number of the part, from 1.
        part: usize,
        /// Name of the part.
        name: String,
        /// Number of the joint, from 1.
        joint: usize,
        /// Number of joints.
        n_joints: usize,
    },
    /// The weights of a part do not add up to 1.
    #[error("the weights of part {part} ({name}) add up to {sum}, expected 1")]
    Weights {
        /// Number of the part, from 1.
        part: usize,
        /// Name of the part.
        name: String,
        /// Sum of the weights.
        sum: f64,
    },
}

/// Tolerance for the sum of weights and for differences between the two sides. Fractions such as thirds are
/// written with few digits.
const TOLERANCE: f64 = 1e-3;

impl SkeletonTable {
    /// Maximum number of parts and of joints.
    pub const MAX: usize = 64;

    /// Checks `spec`.
    ///
    /// # Errors
    ///
    /// See [`TableError`].
    pub fn new(spec: SkeletonSpec) -> Result<Self, TableError> {
        check_lengths(&spec)?;
        check_names("parts", &spec.names)?;
        check_names("joints", &spec.joint_names)?;
        check_tree(&spec)?;
        check_exchange("part", &spec.mirror, &spec.names)?;
        check_exchange("joint", &spec.joint_mirror, &spec.joint_names)?;
        check_weights(&spec)?;
        check_mirror(&spec)?;
        Ok(Self(spec))
    }

    /// The definition of the skeleton.
    pub fn spec(&self) -> &SkeletonSpec {
        &self.0
    }

    /// Number of parts.
    pub fn n_parts(&self) -> usize {
        self.0.names.len()
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.0.joint_names.len()
    }

    /// Names of the parts.
    pub fn names(&self) -> &[String] {
        &self.0.names
    }

    /// Parent of every part, which precedes the part; `None` for part 0.
    pub fn parent(&self) -> &[Option<usize>] {
        &self.0.parent
    }

    /// For each part, the part on the other side of the body.
    pub fn mirror(&self) -> &[usize] {
        &self.0.mirror
    }

    /// For each joint, the joint on the other side of the body.
    pub fn joint_mirror(&self) -> &[usize] {
        &self.0.joint_mirror
    }

    /// Computes the parts of a person.
    ///
    /// * `joints`: one point per joint of the skeleton, in any unit. Parts that depend on a NaN are NaN.
    /// * Returns one point per part, in the unit of the joints.
    ///
    /// # Panics
    ///
    /// Panics if there are fewer joints than [`n_joints`](Self::n_joints).
    pub fn parts_of(&self, joints: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let part = |weights: &Vec<(usize, f64)>| {
            weights.iter().fold([0.0; 2], |sum, &(joint, weight)| {
                [0, 1].map(|axis| sum[axis] + weight * joints[joint][axis])
            })
        };
        self.0.weights.iter().map(part).collect()
    }
}

fn check_lengths(spec: &SkeletonSpec) -> Result<(), TableError> {
    let (n_parts, n_joints) = (spec.names.len(), spec.joint_names.len());
    for (what, got) in [("parts", n_parts), ("joints", n_joints)] {
        if !(1..=SkeletonTable::MAX).contains(&got) {
            let max = SkeletonTable::MAX;
            return Err(TableError::Number { what, got, max });
        }
    }
    let lists = [
        ("parents", spec.parent.len(), n_parts),
        ("mirrors of parts", spec.mirror.len(), n_parts),
        ("lists of weights", spec.weights.len(), n_parts),
        ("mirrors of joints", spec.joint_mirror.len(), n_joints),
    ];
    match lists.into_iter().find(|list| list.1 != list.2) {
        None => Ok(()),
        Some((what, got, expected)) => Err(TableError::Length {
            what,
            got,
            expected,
        }),
    }
}

fn check_names(what: &'static str, names: &[String]) -> Result<(), TableError> {
    for (second, name) in names.iter().enumerate() {
        if let Some(first) = names[..second].iter().position(|other| other == name) {
            return Err(TableError::SameName {
                what,
                first: first + 1,
                second: second + 1,
                name: name.clone(),
            });
        }
    }
    Ok(())
}

fn check_tree(spec: &SkeletonSpec) -> Result<(), TableError> {
    for (part, parent) in spec.parent.iter().enumerate() {
        let name = spec.names[part].clone();
        if parent.is_none() != (part == 0) {
            return Err(TableError::Root {
                part: part + 1,
                name,
            });
        }
        if let Some(parent) = parent.filter(|&parent| parent >= part) {
            return Err(TableError::Tree {
                part: part + 1,
                name,
                parent: parent + 1,
            });
        }
    }
    Ok(())
}

fn check_exchange(
    what: &'static str,
    mirror: &[usize],
    names: &[String],
) -> Result<(), TableError> {
    for (index, &other) in mirror.iter().enumerate() {
        if mirror.get(other) != Some(&index) {
            return Err(TableError::Mirror {
                what,
                index: index + 1,
                name: names[index].clone(),
                other: other + 1,
            });
        }
    }
    Ok(())
}

fn check_weights(spec: &SkeletonSpec) -> Result<(), TableError> {
    let n_joints = spec.joint_names.len();
    for (part, weights) in spec.weights.iter().enumerate() {
        let name = spec.names[part].clone();
        if let Some(&(joint, _)) = weights.iter().find(|weight| weight.0 >= n_joints) {
            return Err(TableError::Joint {
                part: part + 1,
                name,
                joint: joint + 1,
                n_joints,
            });
        }
        let sum: f64 = weights.iter().map(|weight| weight.1).sum();
        let is_one = (sum - 1.0).abs() <= TOLERANCE;
        if !is_one {
            return Err(TableError::Weights {
                part: part + 1,
                name,
                sum,
            });
        }
    }
    Ok(())
}

/// Checks that the mirror of every part's parent is the parent of the part's mirror, and that mirrored parts are computed from mirrored
/// joints.
fn check_mirror(spec: &SkeletonSpec) -> Result<(), TableError> {
    let n_joints = spec.joint_names.len();
    for (part, &other) in spec.mirror.iter().enumerate() {
        let name = spec.names[part].clone();
        if spec.parent[other] != spec.parent[part].map(|parent| spec.mirror[parent]) {
            return Err(TableError::MirrorTree {
                part: part + 1,
                name,
            });
        }
        let mut difference = vec![0.0; n_joints];
        for &(joint, weight) in &spec.weights[part] {
            difference[spec.joint_mirror[joint]] += weight;
        }
        for &(joint, weight) in &spec.weights[other] {
            difference[joint] -= weight;
        }
        if difference.iter().any(|value| value.abs() > TOLERANCE) {
            return Err(TableError::MirrorWeights {
                part: part + 1,
                name,
                other: spec.names[other].clone(),
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
