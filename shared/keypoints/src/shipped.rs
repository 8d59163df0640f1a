//! The cards of published networks. They ship with Parallax; the weights of these networks do not.

/// Cards in `configs/networks`: the name of the file without its extension, and its text.
pub const SHIPPED: [(&str, &str); 9] = [
    (
        "rtmpose-coco17",
        include_str!("../../../configs/networks/rtmpose-coco17.toml"),
    ),
    (
        "rtmpose-halpe26",
        include_str!("../../../configs/networks/rtmpose-halpe26.toml"),
    ),
    (
        "vitpose-s",
        include_str!("../../../configs/networks/vitpose-s.toml"),
    ),
    (
        "hrnet-w32",
        include_str!("../../../configs/networks/hrnet-w32.toml"),
    ),
    (
        "pp-tinypose",
        include_str!("../../../configs/networks/pp-tinypose.toml"),
    ),
    (
        "movenet-lightning",
        include_str!("../../../configs/networks/movenet-lightning.toml"),
    ),
    (
        "blazepose-landmarks",
        include_str!("../../../configs/networks/blazepose-landmarks.toml"),
    ),
    (
        "lightweight-openpose",
        include_str!("../../../configs/networks/lightweight-openpose.toml"),
    ),
    (
        "cpm-lsp14",
        include_str!("../../../configs/networks/cpm-lsp14.toml"),
    ),
];

/// Cards in `configs/detectors`, in the same form as [`SHIPPED`].
pub const SHIPPED_DETECTORS: [(&str, &str); 2] = [
    (
        "rtmdet-person",
        include_str!("../../../configs/detectors/rtmdet-person.toml"),
    ),
    (
        "yolox",
        include_str!("../../../configs/detectors/yolox.toml"),
    ),
];

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::{Card, DetectorCard, joint_rows};

    #[test]
    fn every_included_card_is_valid_and_defines_all_joints() {
        for (name, text) in SHIPPED {
            let card = Card::parse(text).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert!(
                !card.weights.is_empty() && !card.licence.is_empty(),
                "{name}"
            );
            let missing =
                joint_rows(&card.names()).iter().filter(|joint_row| joint_row.is_none()).count();
            assert_eq!(missing, 0, "{name}");
        }
    }

    #[test]
    fn every_included_detector_card_is_valid() {
        for (name, text) in SHIPPED_DETECTORS {
            let card = DetectorCard::parse(text).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert!(
                !card.weights.is_empty() && !card.licence.is_empty(),
                "{name}"
            );
        }
    }

    #[test]
    fn every_file_of_the_folders_is_listed() {
        let listed = |folder: &str| {
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
            let files = std::fs::read_dir(folder).unwrap();
            let names = files.map(|file| file.unwrap().path());
            let mut names: Vec<_> = names
                .map(|name| name.file_stem().unwrap().to_str().unwrap().to_owned())
                .collect();
            names.sort();
            names
        };
        let mut networks = SHIPPED.map(|shipped| shipped.0);
        networks.sort_unstable();
        assert_eq!(listed("../../configs/networks"), networks);
        let detectors = SHIPPED_DETECTORS.map(|shipped_detector| shipped_detector.0);
        assert_eq!(listed("../../configs/detectors"), detectors);
    }
}
