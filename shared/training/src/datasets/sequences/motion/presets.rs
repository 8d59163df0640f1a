//! The built-in marker tables.

/// Names of the built-in tables, from `configs/markers`.
pub const PRESETS: [&str; 4] = ["cmu", "pose2sim", "parallax", "optitrack36"];

const TEXTS: [&str; 4] = [
    include_str!("../../../../../../configs/markers/cmu.toml"),
    include_str!("../../../../../../configs/markers/pose2sim.toml"),
    include_str!("../../../../../../configs/markers/parallax.toml"),
    include_str!("../../../../../../configs/markers/optitrack36.toml"),
];

/// The text of one of [`PRESETS`].
pub(super) fn preset(name: &str) -> Option<&'static str> {
    let place = PRESETS.iter().position(|preset| *preset == name)?;
    Some(TEXTS[place])
}
