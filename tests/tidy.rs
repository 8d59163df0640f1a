//! Rules of the code base that the compiler does not check.
//!
//! Each rule is one test. Each failure names the file and says what to do.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(clippy::print_stderr, reason = "a test that is skipped says so")]

#[path = "tidy/circles.rs"]
mod circles;
#[path = "tidy/dialect.rs"]
mod dialect;
#[path = "tidy/published.rs"]
mod published;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A crate may only depend on crates in its own row and in rows above. Cargo refuses circular dependencies.
const LAYERS: &[(&str, &[&str])] = &[
    (
        "ground",
        &["files", "formats", "kernels", "skeleton", "statistics"],
    ),
    (
        "tools",
        &[
            "calibration",
            "deployment",
            "exports",
            "failure",
            "footage",
            "geometry",
            "inference",
            "keypoints",
            "messages",
            "motion",
            "people",
            "recording",
            "runfiles",
            "scene",
            "terminal",
        ],
    ),
    ("paper", &["fmp", "gpu", "multiview", "viewquality"]),
    (
        "frame",
        &[
            "client",
            "inputs",
            "pipeline",
            "posenetwork",
            "runtime",
            "stage",
            "wire",
        ],
    ),
    (
        "processes",
        &[
            "bridge",
            "capture",
            "record",
            "results",
            "steps",
            "supervise",
        ],
    ),
    ("whole runs", &["launch", "trials", "view"]),
    ("laboratory", &["training"]),
    ("executables", &["lab", "parallax"]),
];

/// The only crates that may contain unsafe code.
const MAY_BE_UNSAFE: &[&str] = &["failure", "gpu", "kernels", "runtime"];

/// The only crates that may use the transport directly.
const MAY_KNOW_TRANSPORT: &[&str] = &["messages", "runtime"];

const MAX_LINES: usize = 500;
const MAX_MAIN_LINES: usize = 100;

#[test]
fn crates_depend_only_on_lower_layers() {
    let row = |name: &str| LAYERS.iter().position(|(_, row)| row.contains(&name));
    let laboratory = LAYERS.iter().position(|(wing, _)| *wing == "laboratory");
    for (name, dir) in crates() {
        let own = row(&name).unwrap_or_else(|| panic!("{name} has no row in LAYERS"));
        for dependency in dependencies(&dir) {
            if let Some(theirs) = row(&dependency) {
                assert!(
                    theirs <= own,
                    "{name} may not depend on {dependency}: see LAYERS"
                );
                assert!(
                    name != "parallax" || Some(theirs) != laboratory,
                    "parallax may not link {dependency}: it belongs to parallax-lab"
                );
            }
            assert_ne!(dependency, "testkit", "{name}: testkit is for tests only");
        }
    }
}

#[test]
fn steps_do_not_call_each_other() {
    let (_, dir) = crates().into_iter().find(|(name, _)| name == "steps").unwrap();
    for file in rust_files(&dir) {
        let text = fs::read_to_string(&file).unwrap();
        let inside = file.strip_prefix(dir.join("src")).unwrap().with_extension("");
        let step = inside.iter().next().unwrap().to_str().unwrap();
        let own = format!("crate::{step}::");
        let n_others = text.matches("crate::").count() - text.matches(&own).count();
        assert!(
            n_others == 0 && !text.contains("super::super"),
            "{} uses another step than {step}: processes exchange messages",
            file.display()
        );
    }
}

#[test]
fn only_the_runtime_knows_the_transport() {
    for (name, dir) in crates() {
        let knows = dependencies(&dir).iter().any(|dependency| dependency == "iceoryx2");
        assert!(
            !knows || MAY_KNOW_TRANSPORT.contains(&name.as_str()),
            "{name} may not depend on iceoryx2: go through `runtime`"
        );
    }
}

#[test]
fn only_the_client_and_what_it_needs_are_published() {
    for (name, dir) in crates() {
        assert_eq!(published::fault(&name, &dir, &dependencies(&dir)), None);
    }
}

#[test]
fn the_python_package_has_the_version_of_the_workspace() {
    let [workspace, project, module] = published::versions(&root());
    assert_eq!([&project, &module], [&workspace; 2]);
}

#[test]
fn examples_in_the_documentation_are_run_and_no_empty_runs_are_made() {
    for (name, dir) in crates() {
        let manifest = fs::read_to_string(dir.join("Cargo.toml")).unwrap();
        let is_off = manifest.contains("doctest = false");
        let is_example = |line: &str| ["/// ```", "//! ```"].contains(&line.trim());
        let has_examples = rust_files(&dir.join("src")).iter().any(|file| {
            let text = fs::read_to_string(file).unwrap();
            text.lines().any(is_example)
        });
        let is_library = dir.join("src/lib.rs").exists();
        assert!(
            !is_library || has_examples != is_off,
            "{name}: set `doctest = false` in [lib] where no doc comment has an example, and only there"
        );
    }
}

#[test]
fn unsafe_is_used_only_where_it_is_allowed() {
    for (name, dir) in crates() {
        if MAY_BE_UNSAFE.contains(&name.as_str()) {
            continue;
        }
        let root = ["src/lib.rs", "src/main.rs"]
            .iter()
            .find_map(|file| fs::read_to_string(dir.join(file)).ok())
            .unwrap();
        assert!(
            root.contains("#![forbid(unsafe_code)]"),
            "{name}: forbid unsafe_code in lib.rs"
        );
    }
}

#[test]
fn files_stay_short_and_documented() {
    for (_, dir) in crates() {
        for file in rust_files(&dir) {
            let text = fs::read_to_string(&file).unwrap();
            let main = file.ends_with("src/main.rs");
            let limit = if main { MAX_MAIN_LINES } else { MAX_LINES };
            let lines = text.lines().count();
            assert!(
                lines <= limit,
                "{} has {lines} lines, more than {limit}: split it",
                file.display()
            );
            assert!(
                text.starts_with("//! "),
                "{} has no module documentation: begin with a `//!` sentence",
                file.display()
            );
        }
    }
}

#[test]
fn files_do_not_import_each_other_in_a_circle() {
    for (name, dir) in crates() {
        let src = dir.join("src");
        let circles = circles::of_crate(&src, &rust_files(&src));
        assert_eq!(
            circles,
            Vec::<Vec<String>>::new(),
            "{name}: each of these files needs another one of them: move what several need to the file where it belongs, \
             or to one of its own that needs none of them"
        );
    }
}

/// Largest number of places in the sources that may have the style that the module `dialect` counts. It may only be decreased.
const DIALECT: usize = 49;

#[test]
fn outdated_style_decreases() {
    let files: Vec<PathBuf> = crates().iter().flat_map(|(_, dir)| rust_files(dir)).collect();
    let n = dialect::count(&files);
    assert!(
        n <= DIALECT,
        "{n} places in the old dialect, {DIALECT} before: name closure arguments, begin documentation with a name or a verb, \
         call no function `of`"
    );
    assert_eq!(
        n, DIALECT,
        "fewer places in the old dialect: write {n} into DIALECT"
    );
}

#[test]
fn no_unfinished_work_is_marked() {
    // The marks are concatenated from parts, so that the test does not find them in this file.
    let marks = [
        ["TO", "DO"].concat(),
        ["FIX", "ME"].concat(),
        ["unimpl", "emented!"].concat(),
    ];
    for (_, dir) in crates() {
        for file in rust_files(&dir) {
            let text = fs::read_to_string(&file).unwrap();
            for mark in &marks {
                assert!(
                    !text.contains(mark.as_str()),
                    "{} contains {mark}",
                    file.display()
                );
            }
        }
    }
}

#[test]
fn ignored_tests_run_in_ci() {
    let ignored = ["#[ign", "ore"].concat();
    let allowed =
        [" = \"takes long\"]", " = \"needs ../shared\"]"].map(|reason| ignored.clone() + reason);
    for (_, dir) in crates() {
        for file in rust_files(&dir) {
            let text = fs::read_to_string(&file).unwrap();
            for line in text.lines().filter(|line| line.contains(&ignored)) {
                assert!(
                    allowed.iter().any(|allowed| line.trim() == allowed),
                    "{}: {line}: a test is left out for one of two reasons: {allowed:?}",
                    file.display()
                );
            }
        }
    }
    let ci = fs::read_to_string(root().join(".ci/run")).unwrap();
    assert!(ci.contains("cargo test --workspace --tests --no-fail-fast -- --ignored"));
}

#[test]
fn user_files_are_written_through_one_crate() {
    // The code in these files writes into separate folders, creates new files exclusively, or (for the record of benchmarks) appends to a
    // file.
    let may = [
        "shared/failure/src/claim.rs",
        "shared/files/",
        "shared/runtime/",
        "services/record/src/writer.rs",
        "services/bridge/src/keys.rs",
        "services/trials/src/bench/report.rs",
    ];
    let writes = [
        "fs::write(",
        "File::create(",
        "OpenOptions::new()",
        "File::options()",
    ];
    for (_, dir) in crates() {
        for file in rust_files(&dir.join("src")) {
            let name = file.strip_prefix(root()).unwrap().display().to_string();
            if may.iter().any(|prefix| name.starts_with(prefix)) || name.contains("/test") {
                continue;
            }
            let text = fs::read_to_string(&file).unwrap();
            let code = text.split("#[cfg(test)]\nmod tests").next().unwrap();
            for way in writes {
                assert!(
                    !code.contains(way),
                    "{name} writes with {way}...): use `files`, which does not follow links"
                );
            }
        }
    }
}

#[test]
fn every_crate_is_listed_on_the_maps() {
    for group in ["services", "shared"] {
        let map = fs::read_to_string(root().join(group).join("README.md")).unwrap();
        for entry in fs::read_dir(root().join(group)).unwrap() {
            let entry = entry.unwrap();
            if entry.path().is_dir() {
                let name = entry.file_name().into_string().unwrap();
                assert!(
                    map.contains(&format!("`{name}`")),
                    "{group}/README.md does not mention `{name}`"
                );
            }
        }
    }
}

#[test]
fn the_top_folder_contains_only_the_agreed_entries() {
    let agreed = [
        ".ci",
        ".gitignore",
        ".rustfmt.toml",
        "Cargo.lock",
        "Cargo.toml",
        "LICENSE-APACHE",
        "LICENSE-MIT",
        "README.md",
        "configs",
        "docs",
        "python",
        "scripts",
        "services",
        "shared",
        "tests",
    ];
    let Ok(listing) = Command::new("git")
        .args(["ls-tree", "--name-only", "HEAD"])
        .current_dir(root())
        .output()
    else {
        eprintln!("skipped: git is absent");
        return;
    };
    for name in String::from_utf8(listing.stdout).unwrap().lines() {
        assert!(
            agreed.contains(&name),
            "{name} is in the top folder: move it"
        );
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

fn dependencies(dir: &Path) -> Vec<String> {
    let manifest: toml::Table =
        fs::read_to_string(dir.join("Cargo.toml")).unwrap().parse().unwrap();
    manifest
        .get("dependencies")
        .and_then(toml::Value::as_table)
        .into_iter()
        .flat_map(toml::Table::keys)
        .cloned()
        .collect()
}

fn crates() -> Vec<(String, PathBuf)> {
    ["services", "shared"]
        .iter()
        .flat_map(|group| fs::read_dir(root().join(group)).unwrap())
        .map(|entry| entry.unwrap())
        .filter(|entry| entry.path().join("Cargo.toml").exists())
        .map(|entry| (entry.file_name().into_string().unwrap(), entry.path()))
        .collect()
}

fn rust_files(dir: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files
}
