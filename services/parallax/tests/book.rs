//! Tests of the book (README.md, docs/ and the other Markdown files): commands parse, marked commands run, links and names exist.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(clippy::print_stderr, reason = "a test that cannot run says so")]

mod blocks;
mod command;
mod links;
mod names;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use blocks::{Block, blocks};
use command::{Line, Program, lines};

/// Keys that an incomplete deployment file may leave out.
const BASE: &str = r#"
name = "book"
rig = "rig.toml"
output = "out"
[[camera]]
name = "left"
source = "left.mp4"
[[camera]]
name = "right"
source = "right.mp4"
"#;

#[test]
fn every_command_line_in_the_book_is_accepted_by_the_executable() {
    let mut n = 0;
    for (place, line) in command_lines() {
        let Some(command) = line.ours() else {
            continue;
        };
        n += 1;
        if let Err(problem) = command::check(command) {
            panic!("{place}: `{line}`\n{problem}");
        }
    }
    assert!(n > 50, "only {n} command lines were found");
}

#[test]
fn a_wrong_command_line_in_the_book_is_detected() {
    let wrong = [
        ("parallax runn my.toml", "a subcommand that is not there"),
        ("parallax run my.toml --no-such-flag", "a flag"),
        ("parallax top --every", "a flag without its value"),
        ("parallax demo --frames many", "a value of another kind"),
        ("parallax replay run.mcap --from nowhere", "no such choice"),
        ("parallax run", "an argument is missing"),
        ("parallax record my.toml", "a required option is missing"),
        ("parallax run one.toml two.toml", "one argument too many"),
        ("parallax-lab train", "a subcommand is missing"),
        ("parallax eval out", "a command of the other executable"),
        (
            "cargo run --release --features nothing -- demo",
            "a feature",
        ),
    ];
    for (text, what) in wrong {
        let line = lines(text).pop().unwrap();
        let refused = line.cargo_problem().is_some()
            || line.ours().is_some_and(|command| command::check(command).is_err());
        assert!(refused, "`{text}` is taken: {what}");
    }
    for text in [
        "parallax calib convert C1.cal C2.cal --size 640 480 --up 0 0 1 --out rig.toml   # with a remark",
        "parallax detect photo.jpg --threshold -0.5 > people.jsonl",
    ] {
        let line = lines(text).pop().unwrap();
        assert_eq!(command::check(line.ours().unwrap()), Ok(()), "{text}");
    }
}

#[test]
fn files_that_commands_name_exist_in_the_repository() {
    for (place, line) in command_lines() {
        if let Some(problem) = line.cargo_problem() {
            panic!("{place}: `{line}`: {problem}");
        }
        for path in line.repository_paths() {
            assert!(
                root().join(&path).exists(),
                "{place}: `{line}`: there is no {path}"
            );
        }
    }
}

#[test]
fn blocks_marked_to_run_succeed_in_an_empty_folder() {
    let (mut n, mut n_files) = (0, 0);
    for (place, block) in all_blocks() {
        if !block.is("sh", "run") {
            continue;
        }
        n += 1;
        let folder = tempfile::tempdir().unwrap();
        for line in lines(&block.text) {
            let (program, arguments) = line
                .ours()
                .unwrap_or_else(|| panic!("{place}: `{line}` is no command of parallax"));
            let ended = run(program, folder.path(), arguments);
            assert!(
                ended.status.success(),
                "{place}: `{line}` ended with {}\n{}",
                ended.status,
                String::from_utf8_lossy(&ended.stderr)
            );
            rename_deployments(folder.path());
        }
        n_files += results_are_described(folder.path());
    }
    assert!(n > 0, "no block is marked");
    assert!(n_files > 0, "no block runs a deployment");
}

/// Returns the number of files that a run has left. All of them must be described in the reference.
fn results_are_described(folder: &Path) -> usize {
    let reference = fs::read_to_string(root().join("docs/reference/files.md")).unwrap();
    let is_result = |file: &PathBuf| file.parent().is_some_and(|folder| folder.ends_with("out"));
    let files: Vec<PathBuf> = files_below(folder, "").into_iter().filter(is_result).collect();
    for file in &files {
        let name = file.file_name().unwrap().to_str().unwrap();
        assert!(
            reference.contains(&format!("`{name}`")),
            "docs/reference/files.md does not describe {name}"
        );
    }
    files.len()
}

#[test]
fn the_reference_has_every_exit_code() {
    let help = run(Program::Parallax, &root(), &["--help".to_owned()]).stdout;
    let help = String::from_utf8(help).unwrap();
    let (_, table) = help.split_once("Exit codes:").unwrap();
    let codes = table.lines().skip(1).map_while(|line| {
        let code = line.split_whitespace().next()?;
        code.parse::<u8>().ok()
    });
    let codes: Vec<u8> = codes.collect();
    assert!(codes.len() > 5, "{codes:?}");
    let page = fs::read_to_string(root().join("docs/reference/exit-codes.md")).unwrap();
    for code in codes {
        assert!(page.contains(&format!("\n| {code} |")), "no row for {code}");
    }
}

#[test]
fn the_reference_has_every_topic_in_its_version() {
    let source = root().join("shared/messages/src/topic.rs");
    let source = fs::read_to_string(source).unwrap();
    let page = fs::read_to_string(root().join("docs/reference/messages.md")).unwrap();
    let quoted = source.split('"').skip(1).step_by(2);
    let topics: Vec<&str> = quoted
        .filter_map(|text| text.contains("/v").then(|| text.split('{').next())?)
        .collect();
    assert!(topics.len() > 5, "{topics:?}");
    for topic in topics {
        assert!(page.contains(&format!("| `{topic}")), "no row for {topic}");
    }
}

#[test]
fn deployment_examples_are_accepted() {
    let mut n = 0;
    for (place, block) in all_blocks() {
        if !block.is("toml", "deployment") {
            continue;
        }
        n += 1;
        let ended = show(&block.text);
        assert!(
            ended.status.success(),
            "{place}: {}",
            String::from_utf8_lossy(&ended.stderr)
        );
    }
    assert!(n > 3, "only {n} blocks are marked");
    let refused = show("[paper]\nalfa = 1\n");
    assert_eq!(refused.status.code(), Some(3), "an unknown key is accepted");
}

#[test]
fn links_lead_to_existing_files_and_headings() {
    let problems = links::broken(&root(), &markdown_files());
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn every_page_is_in_the_summary() {
    let summary = fs::read_to_string(root().join("docs/SUMMARY.md")).unwrap();
    for file in markdown_files() {
        if let Ok(page) = file.strip_prefix(root().join("docs")) {
            let page = page.to_str().unwrap();
            assert!(
                page == "SUMMARY.md" || summary.contains(&format!("]({page})")),
                "docs/SUMMARY.md does not name {page}"
            );
        }
    }
}

/// If `mdbook` is installed, `mdbook build` prints no warnings, and creates every page.
#[test]
fn the_book_renders() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new("mdbook");
    command
        .arg("build")
        .arg(root().join("docs"))
        .arg("--dest-dir")
        .arg(folder.path());
    let Ok(built) = command.output() else {
        eprintln!("skipped: mdbook is not installed");
        return;
    };
    let said = String::from_utf8_lossy(&built.stderr);
    let is_clean = !said.contains("WARN") && !said.contains("ERROR");
    assert!(built.status.success() && is_clean, "{said}");
    let docs = root().join("docs");
    for page in files_below(&docs, "md").iter().filter(|page| !page.ends_with("SUMMARY.md")) {
        let rendered = folder.path().join(page.strip_prefix(&docs).unwrap());
        assert!(
            rendered.with_extension("html").exists(),
            "{}",
            page.display()
        );
    }
}

#[test]
fn functions_and_types_named_on_pages_exist_in_their_crates() {
    let mut n = 0;
    for file in markdown_files() {
        if !file.starts_with(root().join("docs")) {
            continue;
        }
        let text = fs::read_to_string(&file).unwrap();
        for name in names::paths(&text) {
            n += 1;
            assert!(
                names::exists(&root(), &name),
                "{} names `{name}`, which is not there",
                shown(&file)
            );
        }
    }
    assert!(n > 40, "only {n} names were found");
    assert!(!names::exists(&root(), "multiview::no_such_function"));
}

#[test]
fn the_start_page_of_the_api_leads_to_every_crate_and_to_nothing_else() {
    let page = fs::read_to_string(root().join("services/parallax/src/main.rs")).unwrap();
    let mut linked: Vec<&str> = page
        .split("](../")
        .skip(1)
        .filter_map(|rest| rest.split("/index.html)").next())
        .map(|library| library.trim_start_matches("parallax_"))
        .collect();
    linked.sort_unstable();
    linked.dedup();
    let mut crates: Vec<String> = ["services", "shared"]
        .iter()
        .flat_map(|group| fs::read_dir(root().join(group)).unwrap())
        .map(|entry| entry.unwrap())
        .filter(|entry| entry.path().join("Cargo.toml").exists())
        .map(|entry| entry.file_name().into_string().unwrap())
        .filter(|name| name != "parallax")
        .collect();
    crates.sort();
    assert_eq!(linked, crates, "services/parallax/src/main.rs");
}

/// Checks a complete or incomplete deployment file with `config show`.
fn show(text: &str) -> Output {
    let folder = tempfile::tempdir().unwrap();
    let is_whole =
        text.lines().any(|line| line.starts_with("name = ")) && !text.trim_start().starts_with('[');
    let base = if is_whole { "" } else { BASE };
    // Keys without a section come before the first camera.
    let sections = if text.starts_with('[') {
        0
    } else {
        text.find("\n[").unwrap_or(text.len())
    };
    let (top, sections) = text.split_at(sections);
    fs::write(
        folder.path().join("my.toml"),
        format!("{top}\n{base}\n{sections}"),
    )
    .unwrap();
    let arguments = ["config", "show", "my.toml"].map(str::to_owned);
    run(Program::Parallax, folder.path(), &arguments)
}

/// Renames every deployment that a command has written, so that no other test uses the name.
fn rename_deployments(folder: &Path) {
    let mark = format!("-book-{}\"", std::process::id());
    for file in files_below(folder, "deployment.toml") {
        let text = fs::read_to_string(&file).unwrap();
        if !text.contains(&mark) {
            let renamed = text.lines().map(|line| {
                let is_name = line.starts_with("name = \"synth-");
                match line.strip_suffix('"').filter(|_| is_name) {
                    Some(name) => format!("{name}{mark}\n"),
                    None => format!("{line}\n"),
                }
            });
            fs::write(&file, renamed.collect::<String>()).unwrap();
        }
    }
}

fn run(program: Program, folder: &Path, arguments: &[String]) -> Output {
    Command::new(program.file())
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).unwrap().to_owned()
}

fn shown(file: &Path) -> String {
    let file = file.strip_prefix(root()).unwrap_or(file);
    file.display().to_string()
}

/// Returns all Markdown files of the repository.
fn markdown_files() -> Vec<PathBuf> {
    let mut files = vec![root().join("README.md")];
    for folder in ["configs", "docs", "services", "shared", "tests"] {
        files.extend(files_below(&root().join(folder), ".md"));
    }
    files
}

fn files_below(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(files_below(&path, ending));
        } else if path.to_string_lossy().ends_with(ending) {
            files.push(path);
        }
    }
    files.sort();
    files
}

/// Returns every fenced block, with its location.
fn all_blocks() -> Vec<(String, Block)> {
    let of_file = |file: &PathBuf| {
        let text = fs::read_to_string(file).unwrap();
        let name = shown(file);
        let with_place = |block: Block| (format!("{name}:{}", block.line), block);
        blocks(&text).into_iter().map(with_place).collect::<Vec<_>>()
    };
    markdown_files().iter().flat_map(of_file).collect()
}

/// Returns every command line of every `sh` block, with its location.
fn command_lines() -> Vec<(String, Line)> {
    let of_block = |(place, block): (String, Block)| {
        let found = if block.info.first().is_some_and(|info| info == "sh") {
            lines(&block.text)
        } else {
            Vec::new()
        };
        found.into_iter().map(move |line| (place.clone(), line))
    };
    all_blocks().into_iter().flat_map(of_block).collect()
}
