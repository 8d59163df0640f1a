//! Tests of the setting `device`, which chooses where frames are searched.

use crate::common::{Case, PLAIN};

fn case(name: &str, device: &str) -> Case {
    let case = Case::new(name, &[2; 2], PLAIN);
    let both = format!("method = \"paper\"\ndevice = \"{device}\"");
    case.edit("deployment.toml", "method = \"paper\"", &both);
    // The test model shares filters between parts, which is not supported on the GPU.
    case.edit("deployment.toml", "model = \"model.plx\"\n", "");
    case
}

#[test]
fn a_gpu_that_this_build_cannot_use_is_refused_before_anything_starts() {
    if gpu::IS_BUILT {
        return;
    }
    let ended = case("no-gpu", "gpu").run().ends(3);
    let advice = "build it with --features gpu";
    ended.says(advice);
}

#[cfg(feature = "gpu")]
#[test]
fn a_run_on_software_vulkan_finds_the_poses_of_a_run_on_the_processor() {
    if gpu::adapters().is_empty() {
        return;
    }
    let runs = ["software", "cpu"].map(|device| {
        let case = case(device, device);
        let ended = case.run();
        ended.says("device: ");
        let summary: serde_json::Value = serde_json::from_str(&ended.stdout).unwrap();
        assert_eq!(
            summary["without_gpu"],
            serde_json::json!({}),
            "{}",
            ended.stderr
        );
        let lines = case.lines("pose2d.jsonl");
        assert_eq!(lines.len(), 4, "{}", ended.stderr);
        let single = |line: &serde_json::Value| line["single"]["parts"].clone();
        lines.iter().map(single).collect::<Vec<_>>()
    });
    assert!(runs[0].iter().all(serde_json::Value::is_array), "{runs:?}");
    assert_eq!(runs[0], runs[1]);
}
