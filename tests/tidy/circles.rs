//! Finds circular dependencies between files of a crate: files that depend on one another, so that none can be understood before the
//! others.
//!
//! A file depends on the files to which its `use` declarations and the paths in its code (`crate::`, `self::`, `super::`) refer. Re-exports
//! are followed to the file that defines the name. Tests are left out: items after `#[cfg(test)]`, and the files of such modules.
//!
//! A parent module and the modules below it count as one place, because the parent declares its children and these may use its items.
//! Therefore, the search does not find circles that lead from a parent to one of its children and back, or circles through the root of the
//! crate. Names behind `*` and names in macros are not found either. In an inline module of a file, `super` means the file.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Path of a module below the crate's root; empty for `lib.rs` and `main.rs`.
type Module = Vec<String>;

/// For each name that a module re-exports, the module that defines it, and its name in that module.
type Exports = BTreeMap<String, (Module, String)>;

/// One name of a `use` declaration.
struct Import {
    path: Vec<String>,
    /// Last component of the path, or its new name after `as`.
    name: String,
    is_public: bool,
}

/// Returns the circular dependencies among the files of a crate, each as a list of module paths.
///
/// * `src`: the folder of the crate's root.
/// * `files`: all files in this folder.
pub(crate) fn of_crate(src: &Path, files: &[PathBuf]) -> Vec<Vec<String>> {
    let sources = sources(src, files);
    let exports: BTreeMap<&Module, Exports> =
        sources.iter().map(|(module, text)| (module, exports(module, text))).collect();
    let needs: BTreeMap<&Module, BTreeSet<&Module>> = sources
        .iter()
        .map(|(module, text)| {
            let needed = paths(text)
                .into_iter()
                .filter_map(|path| resolve(&path, module, &sources, &exports))
                .filter_map(|target| Some(sources.get_key_value(&target)?.0))
                .filter(|target| !target.starts_with(module) && !module.starts_with(target));
            (module, needed.collect())
        })
        .collect();
    circles(&needs)
}

/// Returns the code of every module, without tests.
fn sources(src: &Path, files: &[PathBuf]) -> BTreeMap<Module, String> {
    let mut sources = BTreeMap::new();
    let mut of_tests: Vec<Module> = Vec::new();
    for file in files {
        let (code, tests) = code(&fs::read_to_string(file).unwrap());
        let module = module_of(file.strip_prefix(src).unwrap());
        let below = |name| module.iter().cloned().chain([name]).collect();
        of_tests.extend(tests.into_iter().map(below));
        sources.insert(module, code);
    }
    sources.retain(|module, _| !of_tests.iter().any(|prefix| module.starts_with(prefix)));
    sources
}

fn module_of(file: &Path) -> Module {
    let name = file.with_extension("");
    let mut parts: Module = name.iter().map(|part| part.to_string_lossy().into_owned()).collect();
    let is_root = parts.len() == 1 && ["lib", "main"].contains(&parts[0].as_str());
    if is_root || parts.last().is_some_and(|part| part == "mod") {
        parts.pop();
    }
    parts
}

/// Returns the text without comments and tests, and the names of the test modules.
fn code(text: &str) -> (String, Vec<String>) {
    let mut tests = Vec::new();
    let mut kept = String::new();
    let mut lines = text.lines().map(|line| line.split("//").next().unwrap_or_default().trim_end());
    while let Some(line) = lines.next() {
        let indent = line.len() - line.trim_start().len();
        if line.trim() != "#[cfg(test)]" {
            kept.push_str(line);
            kept.push('\n');
            continue;
        }
        // The item ends in its first line, or with the closing bracket at the same indentation.
        let mut is_first = true;
        for line in lines.by_ref() {
            let item = line.get(indent..).unwrap_or_default();
            if item.starts_with("#[") || item == ")]" {
                is_first = true;
                continue;
            }
            if is_first
                && let Some((_, name)) = item.split_once("mod ")
                && let Some(name) = name.strip_suffix(';')
            {
                tests.push(name.to_owned());
            }
            let ends_here = is_first && item.ends_with([';', '}']);
            let closes = item.starts_with(['}', ')', ']']) && !item.ends_with('{');
            if ends_here || closes {
                break;
            }
            is_first = false;
        }
    }
    (kept, tests)
}

/// Returns the names in the `use` declarations of a text, and the text without these declarations.
fn imports(text: &str) -> (Vec<Import>, String) {
    let (mut found, mut others) = (Vec::new(), String::new());
    let mut rest = text;
    while let Some(at) = rest.find("use ") {
        let line = rest[..at].rfind('\n').map_or(0, |value| value + 1);
        let before = rest[line..at].trim();
        let Some(end) = rest[at..].find(';') else {
            break;
        };
        let is_public = before.starts_with("pub");
        let end = if before.is_empty() || is_public {
            let tree = rest[at + 4..at + end].replace(" as ", "=");
            let tree: String = tree.chars().filter(|c| !c.is_whitespace()).collect();
            branch(&[], &tree, is_public, &mut found);
            others.push_str(&rest[..line]);
            at + end
        } else {
            others.push_str(&rest[..at + 4]);
            at + 4
        };
        rest = &rest[end..];
    }
    others.push_str(rest);
    (found, others)
}

/// Finds the names in a `use` tree that starts with `prefix`.
fn branch(prefix: &[String], tree: &str, is_public: bool, found: &mut Vec<Import>) {
    let (mut depth, mut begin) = (0, 0);
    let mut parts = Vec::new();
    for (at, c) in tree.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&tree[begin..at]);
                begin = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&tree[begin..]);
    for part in parts.into_iter().filter(|part| !part.is_empty()) {
        let (path, inner) = match part.split_once('{') {
            Some((path, rest)) => (path, rest.strip_suffix('}')),
            None => (part, None),
        };
        let (path, alias) = path.split_once('=').unwrap_or((path, ""));
        let names = path.split("::").filter(|name| !name.is_empty());
        let mut path = prefix.to_vec();
        path.extend(names.map(str::to_owned));
        if let Some(inner) = inner {
            branch(&path, inner, is_public, found);
        } else if let Some(last) = path.last() {
            let name = if alias.is_empty() { last } else { alias }.to_owned();
            found.push(Import {
                path,
                name,
                is_public,
            });
        }
    }
}

/// Returns the names that a module re-exports, and where they come from.
fn exports(module: &Module, text: &str) -> Exports {
    let public = imports(text).0.into_iter().filter(|import| import.is_public);
    public
        .filter_map(|import| {
            let (name, from) = import.path.split_last()?;
            Some((import.name, (absolute(from, module), name.clone())))
        })
        .collect()
}

fn absolute(path: &[String], module: &Module) -> Module {
    let mut base = module.clone();
    let mut path = path;
    match path.first().map(String::as_str) {
        Some("crate") => {
            base.clear();
            path = &path[1..];
        }
        Some("self") => path = &path[1..],
        _ => {}
    }
    while path.first().is_some_and(|name| name == "super") {
        base.pop();
        path = &path[1..];
    }
    base.extend(path.iter().cloned());
    base
}

/// Returns the paths that a module uses: those in its `use` declarations, and those in its code that start within the crate.
fn paths(text: &str) -> Vec<Vec<String>> {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let (imports, text) = imports(text);
    let mut all: Vec<Vec<String>> = imports.into_iter().map(|import| import.path).collect();
    for start in ["crate::", "self::", "super::"] {
        for (at, _) in text.match_indices(start) {
            let is_start = !text[..at].ends_with(|c: char| is_name(c) || c == ':' || c == '$');
            let end = text[at..].find(|c: char| !(is_name(c) || c == ':'));
            let path = &text[at..end.map_or(text.len(), |value| at + value)];
            let names = path.split("::").filter(|name| !name.is_empty());
            if is_start {
                all.push(names.map(str::to_owned).collect());
            }
        }
    }
    all
}

/// Returns the module to which a path refers, following re-exports.
fn resolve(
    path: &[String],
    module: &Module,
    sources: &BTreeMap<Module, String>,
    exports: &BTreeMap<&Module, Exports>,
) -> Option<Module> {
    let first = path.first()?;
    let is_own = ["crate", "self", "super"].contains(&first.as_str());
    let child: Module = module.iter().chain([first]).cloned().collect();
    if !is_own && !sources.contains_key(&child) {
        return None;
    }
    let mut current = Module::new();
    for mut name in absolute(path, module) {
        // Names that are re-exported in a circle do not compile. The limit on the number of steps protects against unfinished files.
        for _ in 0..10 {
            let below: Module = current.iter().chain([&name]).cloned().collect();
            if sources.contains_key(&below) {
                current = below;
                break;
            }
            let export = exports.get(&current).and_then(|names| names.get(&name));
            match export.filter(|(from, _)| *from != current && sources.contains_key(from)) {
                Some(origin) => (current, name) = origin.clone(),
                None => return Some(current),
            }
        }
    }
    Some(current)
}

/// Returns the sets of modules that depend on one another.
fn circles(needs: &BTreeMap<&Module, BTreeSet<&Module>>) -> Vec<Vec<String>> {
    let reach = |from: &Module| {
        let mut reached: BTreeSet<&Module> = BTreeSet::new();
        let mut waiting: Vec<&Module> = needs[from].iter().copied().collect();
        while let Some(module) = waiting.pop() {
            if reached.insert(module) {
                waiting.extend(&needs[module]);
            }
        }
        reached
    };
    let reached: BTreeMap<&Module, BTreeSet<&Module>> =
        needs.keys().map(|module| (*module, reach(module))).collect();
    let mut seen: BTreeSet<&Module> = BTreeSet::new();
    let mut circles = Vec::new();
    for (module, reachable) in &reached {
        if seen.contains(module) || !reachable.contains(module) {
            continue;
        }
        let others = reachable.iter().copied();
        let circle: Vec<&Module> = others.filter(|other| reached[other].contains(module)).collect();
        circles.push(circle.iter().map(|circle| circle.join("/")).collect());
        seen.extend(circle);
    }
    circles
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the circular dependencies of a crate with these files.
    fn circles_in(files: &[(&str, &str)]) -> Vec<Vec<String>> {
        let folder = tempfile::tempdir().unwrap();
        let write = |(name, text): &(&str, &str)| {
            let file = folder.path().join(name);
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(&file, text).unwrap();
            file
        };
        let files: Vec<PathBuf> = files.iter().map(write).collect();
        of_crate(folder.path(), &files)
    }

    #[test]
    fn files_that_import_each_other_form_a_circle() {
        let files = [
            ("lib.rs", "mod a;\nmod b;\nmod c;\nmod d;\n"),
            ("a.rs", "use crate::b::{self, B};\n"),
            (
                "b.rs",
                "use std::fmt;\n\nuse super::c::{\n    C as Other,\n};\n",
            ),
            ("c.rs", "fn f() -> u8 {\n    crate::a::g()\n}\n"),
            ("d.rs", "use crate::a::A;\n"),
        ];
        assert_eq!(circles_in(&files), [["a", "b", "c"]]);
        assert!(circles_in(&files[..3]).is_empty(), "no way back");
    }

    #[test]
    fn names_are_followed_to_the_files_that_define_them() {
        let files = [
            ("lib.rs", "mod a;\nmod b;\npub use b::Bee as B;\n"),
            ("a.rs", "use crate::B;\n"),
            ("b.rs", "mod inner;\npub use inner::{Bee, Other};\n"),
            ("b/inner.rs", "use crate::a::A;\n"),
        ];
        assert_eq!(circles_in(&files), [["a", "b/inner"]]);
    }

    #[test]
    fn a_parent_module_and_its_children_count_as_one() {
        let child = "use super::A;\nfn f(_: super::super::a::A) {}\n";
        for parent in ["a.rs", "a/mod.rs"] {
            let files = [
                ("lib.rs", "mod a;\npub use a::A;\n"),
                (parent, "mod b;\nuse b::B;\n"),
                ("a/b.rs", child),
            ];
            assert!(circles_in(&files).is_empty(), "{parent}");
        }
    }

    #[test]
    fn comments_tests_and_other_crates_do_not_count() {
        let files = [
            (
                "lib.rs",
                "mod a;\nmod b;\n#[cfg(test)]\npub(crate) mod c;\n",
            ),
            ("a.rs", "use crate::b::B;\nuse other_crate::b::f;\n"),
            (
                "b.rs",
                "//! See crate::a::A.\n#[cfg(test)]\n#[expect(unused)]\nfn f(\n    a: crate::a::A,\n) -> u8 {\n    \
                 crate::a::g()\n}\nuse other_crate::a::f;\n#[cfg(test)]\nmod tests {\n    use crate::a::A;\n}\n",
            ),
            ("c.rs", "use crate::a::A;\nuse crate::b::B;\n"),
            ("c/d.rs", "use crate::b::B;\n"),
        ];
        assert!(circles_in(&files).is_empty());
        let back = format!("{}use super::a::A;\n", files[2].1);
        let files = [files[0], files[1], ("b.rs", &back)];
        assert_eq!(
            circles_in(&files),
            [["a", "b"]],
            "what comes after the tests counts"
        );
    }
}
