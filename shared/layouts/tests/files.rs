//! The files of other languages are those that the layouts make, and a C compiler agrees with them.
#![expect(clippy::print_stderr, reason = "a test that is skipped says so")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn the_layouts_of_python_are_those_of_the_messages() {
    let file = root().join("python/parallax_client/messages.json");
    let text = fs::read_to_string(file).unwrap_or_default();
    assert!(
        text == layouts::json(),
        "out of date: cargo run -- messages --json > python/parallax_client/messages.json"
    );
}

#[test]
fn a_compiler_lays_the_structs_of_the_header_out_as_this_one_does() {
    let folder = tempfile::tempdir().unwrap();
    let header = folder.path().join("parallax_messages.h");
    fs::write(&header, layouts::c_header()).unwrap();
    // The header holds the assertions; the program sees that values arrive.
    let program = "#include \"parallax_messages.h\"\n#include <string.h>\n\
        int main(void) { ParallaxPose3d pose; memset(&pose, 0, sizeof pose); pose.joints[3].in_world[2] = 1.5;\n\
        return pose.joints[3].in_world[2] == 1.5 && PARALLAX_STATUS_OK == 0 ? 0 : 1; }\n";
    for (compiler, file, standard) in [("cc", "a.c", "-std=c11"), ("c++", "a.cpp", "-std=c++11")] {
        let source = folder.path().join(file);
        fs::write(&source, program).unwrap();
        let made = folder.path().join(compiler);
        let run = Command::new(compiler)
            .args([standard, "-Wall", "-Wextra", "-Werror", "-pedantic", "-o"])
            .args([&made, &source])
            .output();
        let Ok(run) = run else {
            eprintln!("skipped: there is no {compiler}");
            continue;
        };
        let said = String::from_utf8_lossy(&run.stderr).into_owned();
        assert!(run.status.success(), "{compiler}: {said}");
        assert!(Command::new(&made).status().unwrap().success());
    }
}

#[test]
fn a_header_with_a_wrong_size_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("a.c");
    let text = layouts::c_header();
    assert!(text.contains("uint64_t captured_at_nanos;"));
    let text = text.replace("uint64_t captured_at_nanos;", "uint32_t captured_at_nanos;");
    fs::write(&source, text).unwrap();
    let run = Command::new("cc")
        .args(["-std=c11", "-fsyntax-only"])
        .arg(&source)
        .output();
    match run {
        Ok(run) => {
            let said = String::from_utf8_lossy(&run.stderr).into_owned();
            assert!(!run.status.success() && said.contains("Stamp"), "{said}");
        }
        Err(_) => eprintln!("skipped: there is no cc"),
    }
}
