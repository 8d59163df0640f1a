//! The 26 parts of the published models, their tree and their mirror image.

/// Number of parts of the published models.
pub const N_PARTS: usize = 26;

/// Names of the parts, root (top of the head) first.
///
/// Source: the released models' part order (head, neck, right side 3..14, left side 15..26).
pub const PART_NAMES: [&str; N_PARTS] = [
    "head",
    "neck",
    "right shoulder",
    "right upper arm",
    "right elbow",
    "right forearm",
    "right wrist",
    "right upper trunk",
    "right lower trunk",
    "right hip",
    "right thigh",
    "right knee",
    "right shin",
    "right ankle",
    "left shoulder",
    "left upper arm",
    "left elbow",
    "left forearm",
    "left wrist",
    "left upper trunk",
    "left lower trunk",
    "left hip",
    "left thigh",
    "left knee",
    "left shin",
    "left ankle",
];

/// Parent of every part; `None` for the root.
pub const PARENT: [Option<usize>; N_PARTS] = [
    None,
    Some(0),
    Some(1),
    Some(2),
    Some(3),
    Some(4),
    Some(5),
    Some(2),
    Some(7),
    Some(8),
    Some(9),
    Some(10),
    Some(11),
    Some(12),
    Some(1),
    Some(14),
    Some(15),
    Some(16),
    Some(17),
    Some(14),
    Some(19),
    Some(20),
    Some(21),
    Some(22),
    Some(23),
    Some(24),
];

/// The same part on the other side of the body; head and neck map to themselves.
pub const MIRROR: [usize; N_PARTS] = [
    0, 1, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mirror_of_the_mirror_is_the_part() {
        for part in 0..N_PARTS {
            assert_eq!(MIRROR[MIRROR[part]], part);
        }
    }

    #[test]
    fn mirroring_keeps_the_tree() {
        for part in 0..N_PARTS {
            assert_eq!(
                PARENT[MIRROR[part]],
                PARENT[part].map(|parent| MIRROR[parent])
            );
        }
    }

    #[test]
    fn mirroring_swaps_left_and_right_in_the_names() {
        for part in 0..N_PARTS {
            let exchanged = PART_NAMES[part]
                .replace("right", "RIGHT")
                .replace("left", "right")
                .replace("RIGHT", "left");
            assert_eq!(PART_NAMES[MIRROR[part]], exchanged);
        }
    }

    #[test]
    fn parents_come_before_their_children() {
        for (part, parent) in PARENT.iter().enumerate() {
            assert!(parent.is_none_or(|parent| parent < part), "part {part}");
        }
    }
}
