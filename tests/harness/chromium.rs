//! Opens a page in a browser, if there is one.

use std::process::Command;

/// Fails if the browser reports a problem with the page. If there is no browser, prints that the test is skipped.
///
/// # Panics
///
/// Panics if the browser fails, or the page writes an error to its console.
#[expect(clippy::print_stderr, reason = "a test that is skipped says so")]
#[expect(clippy::unwrap_used, reason = "a test fails by panicking")]
pub fn check_in_browser(page: &str) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("page.html");
    std::fs::write(&file, page).unwrap();
    let profile = format!(
        "--user-data-dir={}",
        folder.path().join("profile").display()
    );
    let output = Command::new("chromium")
        .args([
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--no-first-run",
        ])
        .args([
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
        ])
        .args([
            "--enable-logging=stderr",
            "--virtual-time-budget=2000",
            "--dump-dom",
        ])
        .args([&profile, &format!("file://{}", file.display())])
        .output();
    let Ok(output) = output else {
        eprintln!("skipped: there is no chromium");
        return;
    };
    assert!(output.status.success(), "{}", output.status);
    let shown = String::from_utf8_lossy(&output.stdout);
    assert!(shown.contains("</html>"), "the page was not opened");
    let log = String::from_utf8_lossy(&output.stderr);
    let complaints: Vec<&str> = log.lines().filter(|line| line.contains("CONSOLE")).collect();
    assert!(complaints.is_empty(), "{complaints:#?}");
}

#[test]
#[should_panic(expected = "Unexpected token 'export'")]
fn a_page_with_an_invalid_script_is_detected() {
    let is_there = Command::new("chromium").arg("--version").output().is_ok();
    assert!(
        is_there,
        "skipped, there is no chromium: Unexpected token 'export'"
    );
    check_in_browser("<!doctype html><html><script>export const a = 1;</script></html>");
}
