//! Options whose values can apply to one of several data sets: `--only PARSE=1-100`.

use std::path::{Path, PathBuf};

use failure::{ExitKind, Failure};

/// The data sets to which the value of an option applies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Whose<'a> {
    /// All data sets, because the value does not name one.
    All(&'a str),
    /// Index of the data set, and the value for it.
    One(usize, &'a str),
}

/// Finds the data sets to which a value applies: the data set that is named in `DATASET=VALUE`, or otherwise all data sets.
///
/// If several names match, the longest one is used.
pub(super) fn whose<'a>(datasets: &[PathBuf], argument: &'a str) -> Whose<'a> {
    let value_of = |path: &Path| {
        let rest = argument.strip_prefix(path.to_str()?)?;
        rest.strip_prefix('=')
    };
    let named = datasets.iter().enumerate();
    let named = named.filter_map(|(i, path)| Some((i, value_of(path)?)));
    match named.min_by_key(|named| named.1.len()) {
        Some((it, value)) => Whose::One(it, value),
        None => Whose::All(argument),
    }
}

/// Returns the values for each data set.
///
/// * `option`: name of the option, for messages.
/// * `for_all`: true if a value may apply to several data sets.
///
/// # Errors
///
/// Fails if a value does not name a data set although it must.
pub(crate) fn deal<'a>(
    datasets: &[PathBuf],
    option: &str,
    arguments: &'a [String],
    for_all: bool,
) -> Result<Vec<Vec<&'a str>>, Failure> {
    let mut dealt = vec![Vec::new(); datasets.len()];
    for argument in arguments {
        match whose(datasets, argument) {
            Whose::One(it, value) => dealt[it].push(value),
            Whose::All(value) if for_all || datasets.len() == 1 => {
                for values in &mut dealt {
                    values.push(value);
                }
            }
            Whose::All(_) => {
                let first = datasets.first().map(|dataset| dataset.display().to_string());
                let first = first.unwrap_or_default();
                let message = format!(
                    "{option} {argument}: there are several data sets, but the option does not name one"
                );
                return Err(Failure::new(ExitKind::Usage, message).with_hint(format!(
                    "name the data set as on the command line, for example {option} {first}={argument}"
                )));
            }
        }
    }
    Ok(dealt)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(all: &[&str]) -> Vec<PathBuf> {
        all.iter().map(PathBuf::from).collect()
    }

    #[test]
    fn a_value_applies_to_the_data_set_that_it_names() {
        let datasets = paths(&["a", "a=b", "c/joints.mat"]);
        assert_eq!(whose(&datasets, "c/joints.mat=1-2"), Whose::One(2, "1-2"));
        assert_eq!(whose(&datasets, "a=1"), Whose::One(0, "1"));
        assert_eq!(whose(&datasets, "a=b=1"), Whose::One(1, "1"));
        assert_eq!(whose(&datasets, "other=1"), Whose::All("other=1"));
        assert_eq!(whose(&datasets, "ab=1"), Whose::All("ab=1"));
    }

    #[test]
    fn a_single_data_set_does_not_have_to_be_named() {
        let only = ["1-3".to_owned()];
        let dealt = deal(&paths(&["a"]), "--only", &only, false);
        assert_eq!(dealt.unwrap(), [["1-3"]]);
    }

    #[test]
    fn with_two_data_sets_a_value_without_a_name_applies_to_both() {
        let two = paths(&["a", "b"]);
        let values = ["-15,15".to_owned(), "b=7".to_owned()];
        let dealt = deal(&two, "--rotate", &values, true).unwrap();
        assert_eq!(dealt, [vec!["-15,15"], vec!["-15,15", "7"]]);
        let failure = deal(&two, "--only", &values, false).unwrap_err();
        assert_eq!(failure.kind(), ExitKind::Usage);
    }
}
