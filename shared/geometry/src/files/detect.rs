//! Detection of the format of a calibration file.

use std::path::Path;

use super::{Format, own, panoptic, pose2sim};

/// Detects the format from the content, or from the extension if the content is only numbers.
///
/// Returns `None` for anything that no reader accepts.
pub fn detect(path: &Path, text: &str) -> Option<Format> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let start = text.trim_start_matches('\u{feff}').trim_start();
    match extension.as_str() {
        "cal" => return Some(Format::HumanEva),
        "ini" => return Some(Format::Umpm),
        "yml" | "yaml" => return Some(Format::OpenCv),
        _ => {}
    }
    if start.starts_with("%YAML") || start.contains("<opencv_storage") {
        return Some(Format::OpenCv);
    }
    if extension == "json" || panoptic::is_panoptic(text) {
        let has_lens = ["camera_matrix", "cameraMatrix", "\"mtx\"", "\"K\""];
        return if panoptic::is_panoptic(text) {
            Some(Format::Panoptic)
        } else {
            has_lens.iter().any(|key| text.contains(key)).then_some(Format::OpenCv)
        };
    }
    if start.starts_with('<') {
        return start.contains("<camera").then_some(Format::Qualisys);
    }
    if extension == "toml" {
        return Some(if own::is_own(text) {
            Format::Own
        } else {
            Format::Pose2Sim
        });
    }
    match start.split_whitespace().map(str::parse::<f64>).collect::<Result<Vec<_>, _>>() {
        Ok(numbers) if numbers.len() == 22 => Some(Format::HumanEva),
        Ok(numbers) if numbers.len() == 19 => Some(Format::Umpm),
        _ if own::is_own(text) => Some(Format::Own),
        _ => pose2sim::is_pose2sim(text).then_some(Format::Pose2Sim),
    }
}
