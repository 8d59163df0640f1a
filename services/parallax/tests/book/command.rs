//! Checks that the executables accept the command lines of the book.

use core::fmt;
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::sync::{Mutex, PoisonError};

use crate::common::started::built;

/// Folders of the repository that a command may name.
const FOLDERS: [&str; 6] = [
    "configs/",
    "docs/",
    "scripts/",
    "services/",
    "shared/",
    "tests/",
];

/// One of the executables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Program {
    /// `parallax`.
    Parallax,
    /// `parallax-lab`.
    Lab,
}

impl Program {
    /// Returns the path of the executable.
    pub(crate) fn file(self) -> PathBuf {
        built(match self {
            Self::Parallax => "parallax",
            Self::Lab => "parallax-lab",
        })
    }
}

/// One command of a block.
#[derive(Debug)]
pub(crate) struct Line(Vec<String>);

impl fmt::Display for Line {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(&self.0.join(" "))
    }
}

impl Line {
    /// Returns the executable and its arguments, if the command runs one of Parallax's executables.
    pub(crate) fn ours(&self) -> Option<(Program, &[String])> {
        match self.0.first()?.as_str() {
            "parallax" | "target/release/parallax" => Some((Program::Parallax, &self.0[1..])),
            "parallax-lab" | "target/release/parallax-lab" => Some((Program::Lab, &self.0[1..])),
            "cargo" if self.0.get(1)? == "run" => {
                let at = self.0.iter().position(|word| word == "--")?;
                let is_lab = self.0[..at].iter().any(|word| word == "parallax-lab");
                let program = if is_lab {
                    Program::Lab
                } else {
                    Program::Parallax
                };
                Some((program, &self.0[at + 1..]))
            }
            _ => None,
        }
    }

    /// Returns the package or feature that the command passes to cargo and that does not exist.
    pub(crate) fn cargo_problem(&self) -> Option<String> {
        if self.0.first()? != "cargo" {
            return None;
        }
        let own = self.0.iter().take_while(|word| *word != "--");
        let own: Vec<&str> = own.map(String::as_str).collect();
        let value = |names: [&str; 2]| {
            let at = own.iter().position(|word| names.contains(word))?;
            own.get(at + 1).copied()
        };
        let folders = match value(["-p", "--package"]) {
            None => vec!["services/parallax".to_owned()],
            Some("system-tests") => vec!["tests".to_owned()],
            Some("parallax-lab") => vec!["services/lab".to_owned()],
            Some(name) => vec![format!("shared/{name}"), format!("services/{name}")],
        };
        let manifests = folders.iter().map(|folder| super::root().join(folder).join("Cargo.toml"));
        let Some(manifest) =
            manifests.into_iter().find_map(|manifest| fs::read_to_string(manifest).ok())
        else {
            return Some("there is no such package".to_owned());
        };
        let feature = value(["--features", "-F"])?;
        let declared = manifest.lines().any(|line| line.starts_with(&format!("{feature} = ")));
        (!declared).then(|| format!("there is no feature {feature}"))
    }

    /// Returns the paths in the repository that the command names.
    pub(crate) fn repository_paths(&self) -> Vec<String> {
        let words = self.0.iter().map(|word| word.trim_end_matches('/'));
        words
            .filter(|word| FOLDERS.iter().any(|folder| word.starts_with(folder)))
            .map(str::to_owned)
            .collect()
    }
}

/// Returns the commands of a block. Comments are removed, continued lines are joined, and lines are split at `&&`. A command ends at a pipe
/// or a redirection.
pub(crate) fn lines(text: &str) -> Vec<Line> {
    let joined = text.replace("\\\n", " ");
    let commands = joined.lines().flat_map(|line| {
        let words = words(line);
        let parts = words.split(|word| word == "&&").map(|part| {
            let end = part.iter().position(|word| ["|", ">", "<", ";"].contains(&word.as_str()));
            Line(part[..end.unwrap_or(part.len())].to_vec())
        });
        parts.collect::<Vec<_>>()
    });
    commands.filter(|line| !line.0.is_empty()).collect()
}

/// Splits a line into words like a shell, up to a comment.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None);
    for letter in line.chars() {
        match (quote, letter) {
            (Some(mark), _) if mark == letter => quote = None,
            (None, '"' | '\'') => {
                quote = Some(letter);
                word.get_or_insert_default();
            }
            (None, '#') if word.is_none() => break,
            (None, _) if letter.is_whitespace() => words.extend(word.take()),
            _ => word.get_or_insert_default().push(letter),
        }
    }
    words.extend(word);
    words
}

/// Checks that the executable accepts these arguments.
///
/// The executable parses them itself, followed by `--help`. It refuses unknown arguments and wrong values before it prints the help. With
/// `--help`, missing arguments are not refused, so the arguments are also compared with the usage line.
pub(crate) fn check((program, arguments): (Program, &[String])) -> Result<(), String> {
    let mut asked = arguments.to_vec();
    asked.push("--help".to_owned());
    let (succeeded, said) = run(program, &asked);
    if !succeeded {
        return Err(said);
    }
    if arguments.iter().any(|word| word == "--help") {
        return Ok(());
    }
    let mut path: Vec<String> = Vec::new();
    let mut help = help_of(program, &path)?;
    let mut rest = arguments;
    while help.lines().any(|line| line == "Commands:") {
        let Some((name, others)) = rest.split_first() else {
            // An optional subcommand is on a separate line.
            let asks = |text: &str| text.starts_with("Usage: ") && text.ends_with("<COMMAND>");
            let is_optional = !path.is_empty() && !help.lines().any(asks);
            return if is_optional {
                Ok(())
            } else {
                Err("a subcommand is missing".to_owned())
            };
        };
        if name.starts_with('-') {
            return Ok(()); // `parallax --version` and the like
        }
        path.push(name.clone());
        (help, rest) = (help_of(program, &path)?, others);
    }
    let usage = Usage::parse(&help, path.len())?;
    usage.compare(rest)
}

/// Arguments that the usage line of a command requires.
struct Usage<'a> {
    help: &'a str,
    /// Minimum and maximum number of positional arguments.
    n_arguments: [usize; 2],
    required: Vec<&'a str>,
}

impl<'a> Usage<'a> {
    fn parse(help: &'a str, depth: usize) -> Result<Self, String> {
        let line = help.lines().find_map(|line| line.strip_prefix("Usage: "));
        let mut words = line.ok_or("there is no usage line")?.split(' ').skip(1 + depth).peekable();
        let (mut least, mut most, mut required) = (0, 0_usize, Vec::new());
        while let Some(word) = words.next() {
            let n = if word.ends_with("...") { usize::MAX } else { 1 };
            if word == "[OPTIONS]" {
                continue;
            }
            if word.starts_with("--") {
                required.push(word);
                words.next_if(|next| next.starts_with('<'));
            } else {
                least += usize::from(word.starts_with('<'));
                most = most.saturating_add(n);
            }
        }
        Ok(Self {
            help,
            n_arguments: [least, most],
            required,
        })
    }

    fn compare(&self, arguments: &[String]) -> Result<(), String> {
        let mut n = 0;
        let mut words = arguments.iter().peekable();
        while let Some(word) = words.next() {
            let is_option = word.starts_with("--") || (word.len() == 2 && word.starts_with('-'));
            if !is_option {
                n += 1;
            } else if !word.contains('=') {
                for _ in 0..self.n_values(word) {
                    words.next();
                }
            }
        }
        let [least, most] = self.n_arguments;
        if !(least..=most).contains(&n) {
            return Err(format!(
                "{n} arguments, but the command takes {least} to {most}"
            ));
        }
        let is_given = |option: &&&str| {
            arguments
                .iter()
                .any(|word| word == **option || word.starts_with(&format!("{option}=")))
        };
        match self.required.iter().find(|option| !is_given(option)) {
            Some(option) => Err(format!("{option} is missing")),
            None => Ok(()),
        }
    }

    /// Returns the number of values of an option, according to the help.
    fn n_values(&self, option: &str) -> usize {
        let shown = self.help.lines().find_map(|line| {
            let line = line.trim_start();
            let long = line.split_once(", ").map_or(line, |(_, long)| long);
            let rest = [line, long].into_iter().find_map(|text| text.strip_prefix(option))?;
            rest.starts_with([' ', '\n']).then_some(rest)
        });
        let shown = shown.unwrap_or_default().trim_start_matches(' ');
        let values = shown.split(' ').take_while(|word| word.starts_with('<'));
        values.count()
    }
}

/// Returns the short help of a command. Each help is only requested once.
fn help_of(program: Program, path: &[String]) -> Result<String, String> {
    static KNOWN: Mutex<BTreeMap<(Program, Vec<String>), String>> = Mutex::new(BTreeMap::new());
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(help) = known.get(&(program, path.to_vec())) {
        return Ok(help.clone());
    }
    let (succeeded, said) = run(program, &[path, &["-h".to_owned()]].concat());
    if !succeeded {
        return Err(said);
    }
    known.insert((program, path.to_vec()), said.clone());
    Ok(said)
}

/// Runs a program. Returns true on success, and the printed text: standard output on success, otherwise standard error.
fn run(program: Program, arguments: &[String]) -> (bool, String) {
    let ended = Command::new(program.file()).args(arguments).output().unwrap();
    let said = if ended.status.success() {
        ended.stdout
    } else {
        ended.stderr
    };
    (
        ended.status.success(),
        String::from_utf8_lossy(&said).into_owned(),
    )
}
