//! Build script of both executables: passes the version, the commit of the build, and the enabled optional features to the command.

use std::process::Command;

/// Cargo features that `--version` reports.
const FEATURES: [&str; 5] = ["gpu", "hosts", "libtorch", "ort", "parquet"];

fn main() {
    for file in ["HEAD", "logs/HEAD"] {
        println!("cargo::rerun-if-changed=../../.git/{file}");
    }
    let commit = git(&["rev-parse", "--short=10", "HEAD"]);
    let commit = commit.unwrap_or_else(|| "commit unknown".to_owned());
    let has = |feature: &&str| {
        let variable = feature.to_uppercase().replace('-', "_");
        std::env::var_os(format!("CARGO_FEATURE_{variable}")).is_some()
    };
    let features: Vec<&str> = FEATURES.into_iter().filter(has).collect();
    let features = if features.is_empty() {
        "none".to_owned()
    } else {
        features.join(", ")
    };
    let version = env!("CARGO_PKG_VERSION");
    println!(
        "cargo::rustc-env=PARALLAX_VERSION={version} ({commit}), optional features: {features}"
    );
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    let text = text.trim();
    (output.status.success() && !text.is_empty()).then(|| text.to_owned())
}
