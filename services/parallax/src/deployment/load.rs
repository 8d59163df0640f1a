//! From a file and the options of the command line to a deployment.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::de::DeTable;
use toml::{Table, Value};

use super::lists::fits;
use super::places::{malformed, of_set};
use super::{ConfigError, Deployment, rules};

/// A deployment, and what of it was said by whom.
#[derive(Debug)]
pub(crate) struct Loaded {
    /// What it says, paths resolved, defaults filled in.
    pub deployment: Deployment,
    /// What the file says, as it stands there.
    pub in_file: Table,
    /// What the command line says.
    pub on_command_line: Table,
}

impl Loaded {
    /// Reads a deployment file; `set` are `key=value` pairs that replace what it says.
    ///
    /// Relative paths are relative to the file, whoever says them.
    pub(crate) fn read(file: &Path, set: &[String]) -> Result<Self, ConfigError> {
        let text = fs::read_to_string(file).map_err(|source| ConfigError::Read {
            file: file.to_owned(),
            source,
        })?;
        Self::parse(&text, file, set)
    }

    /// The same of a text.
    ///
    /// * `file`: where it stands.
    fn parse(text: &str, file: &Path, set: &[String]) -> Result<Self, ConfigError> {
        let malformed = |error: &toml::de::Error| malformed(file, text, error);
        let mut deployment: Deployment = toml::from_str(text).map_err(|it| malformed(&it))?;
        let in_file: Table = toml::from_str(text).map_err(|it| malformed(&it))?;
        let on_command_line = overrides(set)?;
        let mut said = in_file.clone();
        if !on_command_line.is_empty() {
            merge(&mut said, on_command_line.clone());
            let read = said.clone().try_into();
            deployment = read.map_err(|error| of_set(&error))?;
        }
        fits(&deployment, &said).map_err(|it| {
            let at = place(file, text, span_of(text, &it.key));
            it.at(at)
        })?;
        deployment.resolve(&base(file));
        let checked = rules::check(&deployment).and_then(|()| rules::fits_machine(&deployment));
        checked.map_err(|it| {
            let at = place(file, text, span_of(text, &it.key));
            it.at(at)
        })?;
        Ok(Self {
            deployment,
            in_file,
            on_command_line,
        })
    }
}

impl Loaded {
    /// A deployment that was read before, with other values.
    ///
    /// * `refused`: says what may not be replaced, by its dotted key, and why.
    ///
    /// Relative paths in `set` are relative to the working folder.
    pub(crate) fn again(
        deployment: &Deployment,
        set: &[String],
        refused: impl Fn(&str) -> Option<String>,
    ) -> Result<Self, ConfigError> {
        let on_command_line = overrides(set)?;
        for argument in set {
            let key = argument.split('=').next().unwrap_or_default().trim();
            if let Some(message) = refused(key) {
                let place = format!("--set {argument}");
                return Err(ConfigError::Malformed { place, message });
            }
        }
        let in_file = Table::try_from(deployment)
            .map_err(|error| ConfigError::explain("--set".to_owned(), &error.to_string(), None))?;
        let mut table = in_file.clone();
        merge(&mut table, on_command_line.clone());
        let read: Result<Deployment, toml::de::Error> = table.try_into();
        let mut deployment = read.map_err(|error| of_set(&error))?;
        fits(&deployment, &on_command_line).map_err(|it| it.at("--set".to_owned()))?;
        deployment.resolve(&base(Path::new("")));
        rules::check(&deployment).map_err(|it| it.at("--set".to_owned()))?;
        Ok(Self {
            deployment,
            in_file,
            on_command_line,
        })
    }
}

/// What stands in the place of a file that only the defaults are asked of.
const NO_FILE: &str = "name = \"\"\nrig = \"\"\noutput = \"\"\ncamera = []\n";

impl Loaded {
    /// The defaults alone; the keys that have none are empty.
    pub(crate) fn defaults(set: &[String]) -> Result<Self, ConfigError> {
        let mut table = Table::new();
        let on_command_line = overrides(set)?;
        let explain = |error: toml::de::Error| of_set(&error);
        merge(&mut table, NO_FILE.parse().map_err(explain)?);
        merge(&mut table, on_command_line.clone());
        Ok(Self {
            deployment: table.try_into().map_err(explain)?,
            in_file: Table::new(),
            on_command_line,
        })
    }
}

/// The folder of a file, absolute where the working folder is known.
fn base(file: &Path) -> PathBuf {
    let folder = file.parent().unwrap_or(Path::new(""));
    let folder = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned())
}

/// `file:line` of a span; the file alone where there is none.
pub(super) fn place(file: &Path, text: &str, span: Option<Range<usize>>) -> String {
    let Some(before) = span.and_then(|it| text.get(..it.start)) else {
        return file.display().to_string();
    };
    let line = 1 + before.matches('\n').count();
    format!("{}:{line}", file.display())
}

/// Where a dotted key stands in `text`; where its section does if the key itself is not there.
fn span_of(text: &str, key: &str) -> Option<Range<usize>> {
    let document = DeTable::parse(text).ok()?;
    let mut table = document.into_inner();
    let mut found = None;
    for name in key.split('.') {
        let (name, value) = table.into_iter().find(|(it, _)| it.get_ref() == name)?;
        found = Some(name.span());
        match value.into_inner() {
            toml::de::DeValue::Table(inner) => table = inner,
            _ => break,
        }
    }
    found
}

/// What `--set section.key=value` says, as a table.
///
/// A value that is not TOML is taken as text, so that `--set fuse.energy=released` needs no quotes.
fn overrides(set: &[String]) -> Result<Table, ConfigError> {
    let mut table = Table::new();
    for argument in set {
        let malformed = |message: &str| ConfigError::Malformed {
            place: format!("--set {argument}"),
            message: message.to_owned(),
        };
        let (key, value) = argument
            .split_once('=')
            .ok_or_else(|| malformed("expected key=value, for example fuse.workers=2"))?;
        let value = format!("it = {value}")
            .parse::<Table>()
            .ok()
            .and_then(|mut it| it.remove("it"))
            .unwrap_or_else(|| Value::String(value.to_owned()));
        let nested = key.trim().rsplit('.').fold(value, |inner, name| {
            Value::Table(Table::from_iter([(name.to_owned(), inner)]))
        });
        if let Value::Table(nested) = nested {
            merge(&mut table, nested);
        }
    }
    Ok(table)
}

/// Puts what `over` says in the place of what `table` says, key by key.
fn merge(table: &mut Table, over: Table) {
    for (key, value) in over {
        match (table.get_mut(&key), value) {
            (Some(Value::Table(inner)), Value::Table(over)) => merge(inner, over),
            (_, value) => {
                table.insert(key, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::keys::KEYS;
    use super::*;

    const SHORT: &str = r#"
name = "two"
rig = "rig.toml"
model = "/models/m.mat"
output = "out"

[[camera]]
name = "a"
source = "videos/a.mp4"

[[camera]]
name = "b"
source = "/videos/b.mp4"

[fuse]
workers = 2
"#;

    fn read(text: &str, set: &[&str]) -> Result<Loaded, ConfigError> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("deployment.toml");
        fs::write(&file, text).unwrap();
        let set: Vec<String> = set.iter().map(|it| (*it).to_owned()).collect();
        Loaded::read(&file, &set)
    }

    fn refused(text: &str, set: &[&str]) -> String {
        let error = read(text, set).unwrap_err().to_string();
        error.split_once("deployment.toml").map_or_else(
            || error.clone(),
            |(_, rest)| format!("deployment.toml{rest}"),
        )
    }

    #[test]
    fn a_short_file_is_enough() {
        let got = read(SHORT, &[]).unwrap().deployment;
        assert_eq!(got.fuse.workers, 2);
        assert_eq!(got.pose, pose::Config::default());
        assert_eq!(got.cameras.len(), 2);
    }

    #[test]
    fn relative_paths_are_relative_to_the_file() {
        let loaded = read(SHORT, &[]).unwrap();
        let folder = loaded.deployment.rig.parent().unwrap();
        assert!(folder.is_absolute() && loaded.deployment.rig.ends_with("rig.toml"));
        assert_eq!(
            loaded.deployment.model.as_deref(),
            Some(Path::new("/models/m.mat"))
        );
        assert!(Path::new(&loaded.deployment.cameras[0].source).starts_with(folder));
        assert_eq!(loaded.deployment.cameras[1].source, "/videos/b.mp4");
    }

    #[test]
    fn the_command_line_wins_over_the_file() {
        let set = [
            "fuse.workers=3",
            "fuse.energy=released",
            "capture.n_frames=7",
        ];
        let got = read(SHORT, &set).unwrap().deployment;
        assert_eq!(got.fuse.workers, 3);
        assert_eq!(got.fuse.energy, fuse::Energy::Released);
        assert_eq!(got.capture.n_frames, Some(7));
    }

    #[test]
    fn a_list_that_is_too_long_is_refused_and_a_shorter_one_may_replace_a_longer() {
        let text = SHORT.replace("workers = 2", "pairs = [['a', 'b'], ['b', 'a']]");
        let one = read(&text, &["fuse.pairs=[['a', 'b']]"]).unwrap();
        assert_eq!(one.deployment.fuse.pairs.len(), 1);
        let pairs = text.replace("['b', 'a']", "['b', 'a', 'c']");
        let got = refused(&pairs, &[]);
        assert!(
            got.ends_with("`fuse.pairs` is a list of 3 values, expected 2"),
            "{got}"
        );
        let size = format!("{SHORT}\n[capture]\nsize = [64, 48, 3]\n");
        let got = refused(&size, &[]);
        assert!(
            got.ends_with("`capture.size` is a list of 3 values, expected 2"),
            "{got}"
        );
    }

    #[test]
    fn an_unknown_key_is_named_with_its_line_and_a_suggestion() {
        let text = SHORT.replace("workers", "wrokers");
        assert_eq!(
            refused(&text, &[]),
            "deployment.toml:16: unknown key `wrokers`, did you mean `workers`?"
        );
    }

    #[test]
    fn an_unknown_key_of_the_command_line_is_named_too() {
        assert_eq!(
            refused(SHORT, &["fuse.wrokers=3"]),
            "--set: unknown key `wrokers`, did you mean `workers`?"
        );
    }

    #[test]
    fn a_missing_key_is_named() {
        let text = SHORT.replace("rig = ", "# rig = ");
        assert!(refused(&text, &[]).contains("missing key `rig`"));
    }

    #[test]
    fn a_value_of_another_kind_is_refused_with_its_line() {
        let text = SHORT.replace("workers = 2", "workers = \"two\"");
        let got = refused(&text, &[]);
        assert!(got.starts_with("deployment.toml:16: "), "{got}");
    }

    #[test]
    fn a_value_that_cannot_be_is_refused_with_its_line() {
        let text = SHORT.replace("workers = 2", "workers = 0");
        assert_eq!(
            refused(&text, &[]),
            "deployment.toml:16: `fuse.workers` is 0, expected 1 to 16"
        );
    }

    #[test]
    fn what_has_no_meaning_for_all_views_at_once_is_refused() {
        let text = SHORT.replace("workers = 2", "views = \"all\"");
        read(&text, &[]).unwrap();
        for (set, expected) in [
            ("fuse.energy=released", "`fuse.energy` is \"released\""),
            ("fuse.pairs=[['a', 'b']]", "`fuse.pairs` is given"),
            (
                "triangulate.combine=consensus",
                "`triangulate.combine` is \"consensus\"",
            ),
        ] {
            let got = refused(&text, &[set]);
            assert!(got.contains(expected), "{got}");
            read(&text, &["fuse.views=pairs", set]).unwrap();
        }
    }

    #[test]
    fn a_precision_that_the_machine_lacks_is_refused_with_what_it_lacks() {
        let set = ["pose.precision=bf16"];
        match kernels::Amx::detect() {
            Ok(_) => {
                let pose = read(SHORT, &set).unwrap().deployment.pose;
                assert_eq!(pose.precision, fmp::Precision::Bf16);
            }
            Err(why) => {
                let got = refused(SHORT, &set);
                assert!(got.contains("`pose.precision` is \"bf16\""), "{got}");
                assert!(got.contains(&why.to_string()), "{got}");
            }
        }
        assert!(refused(SHORT, &["pose.precision=f16"]).contains("`bf16`"));
    }

    #[test]
    fn text_that_is_not_toml_is_refused_with_its_line() {
        let got = refused(&SHORT.replace("[fuse]", "[fuse"), &[]);
        assert!(got.starts_with("deployment.toml:15: "), "{got}");
    }

    #[test]
    fn a_file_that_is_not_there_is_named() {
        let error = Loaded::read(Path::new("/nowhere/d.toml"), &[]).unwrap_err();
        assert!(error.to_string().contains("/nowhere/d.toml"));
    }

    /// Whether a text and an option are taken; what is refused is said with its place.
    fn is_taken(text: &str, set: &str) -> bool {
        let file = Path::new("deployment.toml");
        match Loaded::parse(text, file, &[set.to_owned()]) {
            Ok(loaded) => {
                loaded.entries().unwrap();
                true
            }
            Err(error) => {
                let said = error.to_string();
                let begin = ["deployment.toml", "--set"];
                assert!(begin.iter().any(|it| said.starts_with(it)), "{said}");
                assert!(!said.contains('\n'), "{said}");
                false
            }
        }
    }

    proptest! {
        #[test]
        fn any_text_is_a_deployment_or_an_error_with_its_place(text: String, set: String) {
            is_taken(&text, &set);
        }

        #[test]
        fn a_changed_deployment_is_one_or_an_error_with_its_place(
            at in 0..SHORT.len(),
            n in 0_usize..6,
            to in "[a-z0-9=\\[\\]{}.,\"'\n -]{0,8}",
        ) {
            let mut text = SHORT.to_owned();
            text.replace_range(at..(at + n).min(SHORT.len()), &to);
            is_taken(&text, "fuse.workers=3");
        }

        #[test]
        fn any_value_of_a_known_key_is_taken_or_refused(
            key in prop::sample::select(KEYS.iter().map(|it| it.0).collect::<Vec<_>>()),
            value in prop::sample::select(vec![
                "-1", "0", "1", "99999999999", "1e308", "nan", "-inf", "''", "'x'", "[]", "[1]",
                "[nan]", "{}", "[[1]]", "{ file = 3 }", "{ a = 'b' }", "true", "1979-05-27", "=",
            ]),
        ) {
            is_taken(SHORT, &format!("{key}={value}"));
        }
    }

    #[test]
    fn an_override_without_a_value_is_refused() {
        assert!(refused(SHORT, &["fuse.workers"]).contains("expected key=value"));
    }
}
