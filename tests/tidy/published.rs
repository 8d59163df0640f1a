//! Published crates, and the versions of published packages.

use std::fs;
use std::path::Path;

use toml::Table;

/// Folders of the published crates: the client and its dependencies.
pub(crate) const PUBLISHED: &[&str] = &[
    "client", "failure", "files", "formats", "messages", "runfiles", "runtime",
];

/// Returns a description of what is wrong with the publishing settings of the crate in a folder.
pub(crate) fn fault(name: &str, dir: &Path, dependencies: &[String]) -> Option<String> {
    let manifest = table(&dir.join("Cargo.toml"));
    let package = manifest["package"].as_table().unwrap();
    let publish = package["publish"].as_bool();
    if !PUBLISHED.contains(&name) {
        let fault = "is not in PUBLISHED: it needs `publish.workspace = true`";
        return publish.is_some().then(|| format!("{name} {fault}"));
    }
    let own = |dependency: &&String| {
        ["services", "shared"]
            .iter()
            .any(|group| crate::root().join(group).join(dependency).is_dir())
    };
    let kept_back = dependencies.iter().filter(own);
    let mut kept_back = kept_back.filter(|other| !PUBLISHED.contains(&other.as_str()));
    if let Some(other) = kept_back.next() {
        return Some(format!(
            "{name} is published and needs {other}, which is not"
        ));
    }
    let published = package["name"].as_str().unwrap();
    let is_named = published.starts_with("parallax-") && published.ends_with(name);
    let is_right = is_named && publish == Some(true) && package.contains_key("description");
    (!is_right).then(|| {
        format!("{name} needs a name as parallax-{name}, `publish = true` and a description")
    })
}

/// Returns the versions of the workspace and of the Python package, as written in each file.
pub(crate) fn versions(root: &Path) -> [String; 3] {
    let text = |value: &toml::Value| value.as_str().unwrap().to_owned();
    let workspace = table(&root.join("Cargo.toml"));
    let python = table(&root.join("python/pyproject.toml"));
    let module = fs::read_to_string(root.join("python/parallax_client/__init__.py")).unwrap();
    let line = module.lines().find_map(|line| line.strip_prefix("__version__ = "));
    [
        text(&workspace["workspace"]["package"]["version"]),
        text(&python["project"]["version"]),
        line.unwrap().trim_matches('"').to_owned(),
    ]
}

fn table(file: &Path) -> Table {
    fs::read_to_string(file).unwrap().parse().unwrap()
}
