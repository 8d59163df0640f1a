//! Layout checks of pages in a browser, if one is installed.

use std::fs;
use std::io;
use std::path::Path;
use std::process::{Command, Stdio};

/// Names under which a browser may be installed.
const BROWSERS: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// Returns the elements of a page that extend beyond its width, each as `tag.class: right edge`. Elements inside an element of the class
/// `scroll` are ignored. Returns `None` if there is no browser.
///
/// * `folder`: folder for temporary files.
/// * `width`: width of the page, in pixels.
///
/// # Errors
///
/// Fails if the files cannot be written, or the browser does not report a result.
pub fn too_wide(html: &str, folder: &Path, width: u32) -> io::Result<Option<Vec<String>>> {
    let installed = |name: &&&str| {
        let status = Command::new(name)
            .arg("--version")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        status.is_ok_and(|status| status.success())
    };
    let Some(browser) = BROWSERS.iter().find(installed) else {
        return Ok(None);
    };
    // The page is shown in an iframe, which can have exactly the given width, because windows have a minimum width.
    let inside = html.replace('&', "&amp;").replace('"', "&quot;");
    let page = format!(
        "<!doctype html><meta charset=\"utf-8\"><title>not measured</title>\n\
         <iframe style=\"width:{width}px;height:900px;border:0\" srcdoc=\"{inside}\"></iframe>\n<script>{SCRIPT}</script>\n"
    );
    let file = folder.join("framed.html");
    fs::write(&file, page)?;
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-background-networking",
            "--no-first-run",
        ])
        .args(["--dump-dom", "--virtual-time-budget=2000"])
        .arg(format!(
            "--user-data-dir={}",
            folder.join("browser").display()
        ))
        .arg(format!("file://{}", file.display()))
        .stderr(Stdio::null())
        .output()?;
    let dom = String::from_utf8_lossy(&output.stdout);
    let measured = dom
        .split("<title>measured:")
        .nth(1)
        .and_then(|rest| rest.split("</title>").next());
    let measured = measured
        .ok_or_else(|| io::Error::other(format!("the page was not measured: {dom:.300}")))?;
    Ok(Some(
        measured.split(';').filter(|part| !part.is_empty()).map(str::to_owned).collect(),
    ))
}

const SCRIPT: &str = "
addEventListener('load', () => {
  const inside = document.querySelector('iframe').contentDocument;
  const width = document.querySelector('iframe').clientWidth;
  const wide = [...inside.querySelectorAll('body *')].filter((it) => {
    const scrolled = it.parentElement.closest('.scroll');
    return !scrolled && it.getBoundingClientRect().right > width + 0.5;
  });
  const name = (it) => it.tagName.toLowerCase() + '.' + it.getAttribute('class') + ' ' + it.getBoundingClientRect().right.toFixed(0);
  document.title = 'measured:' + wide.map(name).join(';');
});
";
