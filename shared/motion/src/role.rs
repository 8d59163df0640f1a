//! The role of a joint, derived from its name in the results.

/// A side of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Side {
    /// The person's right side.
    Right,
    /// The person's left side.
    Left,
}

impl Side {
    /// Both sides.
    pub const BOTH: [Self; 2] = [Self::Right, Self::Left];

    /// Returns the name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Left => "left",
        }
    }

    fn other(self) -> Self {
        match self {
            Self::Right => Self::Left,
            Self::Left => Self::Right,
        }
    }
}

/// Role of a joint: which joint of the body it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[expect(missing_docs, reason = "the names of joints")]
pub enum Role {
    Head,
    Neck,
    Pelvis,
    Shoulder(Side),
    Elbow(Side),
    Wrist(Side),
    Hip(Side),
    Knee(Side),
    Ankle(Side),
    Heel(Side),
    BigToe(Side),
    SmallToe(Side),
}

/// Names that do not begin with the side: those of `skeleton::HUMANEVA20`, and those used by networks. If `HumanEva` has two names for one
/// joint, which is an end of two limbs, only one of them is listed.
const NAMES: [(&str, Role); 19] = [
    ("head", Role::Head),
    ("neck", Role::Neck),
    ("thorax", Role::Neck),
    ("pelvis", Role::Pelvis),
    ("hip", Role::Pelvis),
    ("headDistal", Role::Head),
    ("torsoProximal", Role::Neck),
    ("torsoDistal", Role::Pelvis),
    ("upperLArmProximal", Role::Shoulder(Side::Left)),
    ("upperLArmDistal", Role::Elbow(Side::Left)),
    ("lowerLArmDistal", Role::Wrist(Side::Left)),
    ("upperRArmProximal", Role::Shoulder(Side::Right)),
    ("upperRArmDistal", Role::Elbow(Side::Right)),
    ("lowerRArmDistal", Role::Wrist(Side::Right)),
    ("upperLLegProximal", Role::Hip(Side::Left)),
    ("upperLLegDistal", Role::Knee(Side::Left)),
    ("lowerLLegDistal", Role::Ankle(Side::Left)),
    ("upperRLegProximal", Role::Hip(Side::Right)),
    ("upperRLegDistal", Role::Knee(Side::Right)),
];

impl Role {
    /// Returns the role of a joint, by its name; `None` for a keypoint without a role, such as a finger.
    pub fn of(name: &str) -> Option<Self> {
        let whole = NAMES.iter().find(|known| known.0 == name);
        if let Some((_, role)) = whole {
            return Some(*role);
        }
        if name == "lowerRLegDistal" {
            return Some(Self::Ankle(Side::Right));
        }
        let (side, joint) = name.split_once(' ')?;
        let side = Side::BOTH.into_iter().find(|known| known.name() == side)?;
        let role = match joint {
            "shoulder" => Self::Shoulder(side),
            "elbow" => Self::Elbow(side),
            "wrist" => Self::Wrist(side),
            "hip" => Self::Hip(side),
            "knee" => Self::Knee(side),
            "ankle" => Self::Ankle(side),
            "heel" => Self::Heel(side),
            "big toe" | "toes" | "foot index" => Self::BigToe(side),
            "small toe" => Self::SmallToe(side),
            _ => return None,
        };
        Some(role)
    }

    /// Returns the same role on the other side; `None` for a role without a side.
    pub fn mirrored(self) -> Option<Self> {
        Some(match self {
            Self::Head | Self::Neck | Self::Pelvis => return None,
            Self::Shoulder(it) => Self::Shoulder(it.other()),
            Self::Elbow(it) => Self::Elbow(it.other()),
            Self::Wrist(it) => Self::Wrist(it.other()),
            Self::Hip(it) => Self::Hip(it.other()),
            Self::Knee(it) => Self::Knee(it.other()),
            Self::Ankle(it) => Self::Ankle(it.other()),
            Self::Heel(it) => Self::Heel(it.other()),
            Self::BigToe(it) => Self::BigToe(it.other()),
            Self::SmallToe(it) => Self::SmallToe(it.other()),
        })
    }
}

/// Returns the name of the joint on the other side. It works for any name that contains the side as a separate word or in the style of
/// `HumanEva`.
pub fn mirrored_name(name: &str) -> Option<String> {
    if let Some(rest) = name.strip_prefix("left ") {
        return Some(format!("right {rest}"));
    }
    if let Some(rest) = name.strip_prefix("right ") {
        return Some(format!("left {rest}"));
    }
    let limb = ["upper", "lower"]
        .iter()
        .find_map(|prefix| Some((*prefix, name.strip_prefix(*prefix)?)));
    let (part, rest) = limb?;
    if let Some(rest) = rest.strip_prefix('L') {
        return Some(format!("{part}R{rest}"));
    }
    rest.strip_prefix('R').map(|rest| format!("{part}L{rest}"))
}

/// Pairs of joints with a constant distance: the segments of the limbs.
///
/// Distances across the trunk are not included, because they change by centimetres when shoulders move or the back bends.
pub const RIGID: [[Role; 2]; 9] = [
    [Role::Hip(Side::Right), Role::Knee(Side::Right)],
    [Role::Knee(Side::Right), Role::Ankle(Side::Right)],
    [Role::Hip(Side::Left), Role::Knee(Side::Left)],
    [Role::Knee(Side::Left), Role::Ankle(Side::Left)],
    [Role::Hip(Side::Right), Role::Hip(Side::Left)],
    [Role::Shoulder(Side::Right), Role::Elbow(Side::Right)],
    [Role::Elbow(Side::Right), Role::Wrist(Side::Right)],
    [Role::Shoulder(Side::Left), Role::Elbow(Side::Left)],
    [Role::Elbow(Side::Left), Role::Wrist(Side::Left)],
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn left_and_right_roles_are_counterparts() {
        for name in [
            "left ankle",
            "right big toe",
            "upperLArmDistal",
            "lowerRLegDistal",
            "left ring finger",
        ] {
            let other = mirrored_name(name).unwrap();
            assert_ne!(other, name);
            assert_eq!(mirrored_name(&other).as_deref(), Some(name));
            if let Some(role) = Role::of(name) {
                assert_eq!(Role::of(&other), role.mirrored());
            }
        }
        for name in ["head", "neck", "torsoProximal", "upper", "left", ""] {
            assert_eq!(mirrored_name(name), None, "{name}");
        }
    }
}
