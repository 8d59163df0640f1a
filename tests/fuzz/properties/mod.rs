//! Properties that every reader and decoder must have for any input. They are the bodies of all fuzz targets. An ordinary test also checks
//! them on the seeds and mutations of the seeds.

mod files;
mod hosts;
mod messages;

pub use files::{
    board_corners, calibration, consistency, deployment_text, joint_file, keypoint_files,
    model_mat, model_own, model_text, motion_c3d, network_card, people_lines, people_mat,
    quality_network, quality_table, run_files, scene_text, training_checkpoint, type_table,
};
pub use hosts::host_messages;
pub use messages::{wire_fusion, wire_messages};

/// Name of a target, and its property.
pub type Target = (&'static str, fn(&[u8]));

/// All targets.
pub const TARGETS: [Target; 22] = [
    ("board_corners", board_corners),
    ("calibration", calibration),
    ("consistency", consistency),
    ("deployment_text", deployment_text),
    ("host_messages", host_messages),
    ("joint_file", joint_file),
    ("keypoint_files", keypoint_files),
    ("network_card", network_card),
    ("model_mat", model_mat),
    ("model_own", model_own),
    ("model_text", model_text),
    ("motion_c3d", motion_c3d),
    ("people_lines", people_lines),
    ("people_mat", people_mat),
    ("quality_network", quality_network),
    ("quality_table", quality_table),
    ("run_files", run_files),
    ("scene_text", scene_text),
    ("training_checkpoint", training_checkpoint),
    ("type_table", type_table),
    ("wire_fusion", wire_fusion),
    ("wire_messages", wire_messages),
];
