//! Costs of a run, read from the report that it printed.

use std::path::Path;

use failure::{ExitKind, Failure};
use lab::forecast::Costs;
use serde_json::Value;

use super::DEFAULT;

/// Reads the costs of a run: the processor time of its stages, and the costs of the link from `hosts.json` in its folder, if this file
/// exists.
///
/// # Errors
///
/// Fails if the file is not the report of a run, or the run processed no frame.
pub(super) fn costs(file: &Path) -> Result<Costs, Failure> {
    let refused = |what: &str| {
        let failure = Failure::new(ExitKind::Input, format!("{}: {what}", file.display()));
        failure.with_hint("write it with `parallax run my.toml --json > run.json`")
    };
    let text = failure::read_text(file)?;
    let report: Value = serde_json::from_str(&text).map_err(|error| refused(&error.to_string()))?;
    let folder = report["output"].as_str();
    let hosts = folder.and_then(|folder| {
        files::read_text(&Path::new(folder).join("hosts.json"), files::SETTINGS).ok()
    });
    let hosts: Option<Value> = hosts.and_then(|host| serde_json::from_str(&host).ok());
    of_run(&report, hosts.as_ref()).map_err(|what| refused(&what))
}

fn of_run(report: &Value, hosts: Option<&Value>) -> Result<Costs, String> {
    let spent = report["processor_s"].as_object();
    let spent = spent.ok_or("`processor_s` is missing: this is not the report of a run")?;
    let n_views = report["views"].as_array().map_or(0, Vec::len);
    let n_frames = report["frames_in_footage"].as_f64().unwrap_or(0.0);
    if n_views == 0 || n_frames < 1.0 {
        return Err(format!(
            "the report has {n_frames} frames of {n_views} views, so no costs can be computed"
        ));
    }
    // Mean time that a process of this service takes for a frame, in milliseconds.
    let mean = |service: &str| {
        let is_meant = |name: &str| {
            let rest = name.strip_prefix(service);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
        };
        let own = spent.iter().filter(|(name, _)| is_meant(name));
        let all: Vec<f64> = own.filter_map(|entry| entry.1.as_f64()).collect();
        let sum: f64 = all.iter().sum();
        (!all.is_empty()).then(|| 1e3 * sum / (all.len() as f64 * n_frames))
    };
    let needed =
        |service: &str| mean(service).ok_or_else(|| format!("the report has no process {service}"));
    let workers = spent.keys().filter(|key| key.starts_with("fuse-")).count() as f64;
    let fused = mean("fuse").map_or(0.0, |value| value * workers)
        + needed("triangulate")?
        + mean("results").unwrap_or(0.0);
    let costs = Costs {
        capture_ms: needed("capture")?,
        pose_ms: mean("pose").unwrap_or(DEFAULT.pose_ms) + mean("quality").unwrap_or(0.0),
        fuse_ms_per_view: fused / n_views as f64,
        fuse_ms: 0.0,
        ..DEFAULT
    };
    let n_pose = spent.keys().filter(|key| key.starts_with("pose-")).count();
    // If hosts send poses, some of the pose processes run on other hosts.
    let carries_poses = n_pose > 0 && n_pose < n_views;
    Ok(hosts.map_or(costs, |hosts| with_link(costs, hosts, carries_poses)))
}

/// Adds the measured costs of the link.
///
/// * `hosts`: content of `hosts.json`.
/// * `carries_poses`: true if hosts send poses instead of frames.
fn with_link(mut costs: Costs, hosts: &Value, carries_poses: bool) -> Costs {
    let far = hosts["hosts"].as_array().into_iter().flatten();
    let far = far.filter_map(|value| value["views"].as_array()).flatten();
    let far: Vec<&Value> = far.filter(|far| far["used"].as_f64() > Some(0.0)).collect();
    let over_views = |value: &dyn Fn(&Value) -> Option<f64>| {
        let all: Vec<f64> = far.iter().filter_map(|view| value(view)).collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    };
    if let Some(bytes) = over_views(&|view| Some(view["bytes"].as_f64()? / view["used"].as_f64()?))
    {
        if carries_poses {
            costs.pose_bytes = bytes;
        } else {
            costs.frame_bytes = bytes;
        }
    }
    let median = |key: &str| over_views(&|value: &Value| value[key]["p50_ms"].as_f64());
    if !carries_poses {
        costs.encode_ms = median("encode").unwrap_or(costs.encode_ms);
        costs.decode_ms = median("decode").unwrap_or(costs.decode_ms);
    }
    costs.network_ms = median("network").unwrap_or(costs.network_ms);
    costs
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn report() -> Value {
        json!({
            "frames_in_footage": 100, "views": [{}, {}, {}],
            "processor_s": {
                "capture-0": 1.0, "capture-1": 2.0, "pose-0": 3.0, "pose-1": 5.0, "pose-2": 4.0,
                "fuse-0": 0.5, "triangulate": 0.4, "results": 0.3, "bridge": 9.0,
            },
        })
    }

    #[test]
    fn costs_are_per_frame_and_view() {
        let got = of_run(&report(), None).unwrap();
        let off = |a: f64, b: f64| (a - b).abs() < 1e-9;
        assert!(
            off(got.capture_ms, 15.0) && off(got.pose_ms, 40.0),
            "{got:?}"
        );
        assert!(
            off(got.fuse_ms_per_view, 4.0) && got.fuse_ms == 0.0,
            "{got:?}"
        );
        assert_eq!(got.frame_bytes, DEFAULT.frame_bytes);
    }

    #[test]
    fn link_costs_are_computed_from_the_views_that_arrived() {
        let view = |used: u32| {
            json!({ "used": used, "bytes": 2000, "encode": { "p50_ms": 1.5 },
            "network": { "p50_ms": 0.25 }, "decode": { "p50_ms": 0.5 } })
        };
        let hosts = json!({ "hosts": [{ "views": [view(10), view(0)] }] });
        let got = of_run(&report(), Some(&hosts)).unwrap();
        assert_eq!(
            [
                got.frame_bytes,
                got.encode_ms,
                got.decode_ms,
                got.network_ms
            ],
            [200.0, 1.5, 0.5, 0.25]
        );
        let mut poses = report();
        poses["processor_s"].as_object_mut().unwrap().remove("pose-2");
        let got = of_run(&poses, Some(&hosts)).unwrap();
        assert_eq!(
            [got.pose_bytes, got.frame_bytes],
            [200.0, DEFAULT.frame_bytes]
        );
    }

    #[test]
    fn files_that_are_not_a_report_are_refused() {
        let refused = |change: &dyn Fn(&mut Value)| {
            let mut it = report();
            change(&mut it);
            of_run(&it, None).unwrap_err()
        };
        assert!(refused(&|value| value["processor_s"] = json!(null)).contains("not the report"));
        assert!(
            refused(&|value| value["frames_in_footage"] = json!(0)).contains("0 frames of 3 views")
        );
        assert!(refused(&|value| value["processor_s"] = json!({})).contains("no process"));
    }
}
