//! Parses rigs, subjects, actions and rates from the command line.

use std::ops::RangeInclusive;

use scene::{Action, RigChoice};

pub(super) fn rig(text: &str) -> Result<RigChoice, String> {
    RigChoice::parse(text).map_err(|error| error.to_string())
}

/// Parses skews in milliseconds, for example `0,5,11,16`.
pub(super) fn skews(text: &str) -> Result<Vec<f64>, String> {
    let skews = scene::Settings::parse_skews_ms(text);
    skews.ok_or_else(|| {
        format!(
            "{text:?}: expected milliseconds from -1000 to 1000, separated by commas, for example 0,5,11,16"
        )
    })
}

/// Largest number of subjects in one command.
const MAX_SUBJECTS: usize = 10_000;

/// Parses a list of subjects, for example `3` or `1-20,25`. Keeps the order and removes duplicates.
pub(super) fn subjects(text: &str) -> Result<Vec<u64>, String> {
    let wrong = || {
        format!("{text:?}: expected numbers and ranges separated by commas, for example 1-20,25")
    };
    let range = |part: &str| -> Option<RangeInclusive<u64>> {
        let (from, to) = part.split_once('-').unwrap_or((part, part));
        let range = from.trim().parse().ok()?..=to.trim().parse().ok()?;
        (!range.is_empty()).then_some(range)
    };
    let mut subjects = Vec::new();
    for part in text.split(',') {
        for subject in range(part).ok_or_else(wrong)? {
            if subjects.len() == MAX_SUBJECTS {
                return Err(format!("at most {MAX_SUBJECTS} subjects are allowed"));
            }
            if !subjects.contains(&subject) {
                subjects.push(subject);
            }
        }
    }
    Ok(subjects)
}

/// Parses a list of actions: names separated by commas, or `all`.
pub(super) fn actions(text: &str) -> Result<Vec<Action>, String> {
    if text == "all" {
        return Ok(Action::ALL.to_vec());
    }
    let mut actions = Vec::new();
    for name in text.split(',') {
        let action = Action::by_name(name.trim()).ok_or_else(|| {
            let known = Action::ALL.map(Action::name).join(", ");
            format!("there is no action {name:?}; expected all, or some of {known}")
        })?;
        if !actions.contains(&action) {
            actions.push(action);
        }
    }
    Ok(actions)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn lists_are_parsed_without_duplicates() {
        assert_eq!(subjects("1-3,2,7").unwrap(), [1, 2, 3, 7]);
        for wrong in ["", "1,", "a", "3-1", "-1", "1-2-3", "0-99999999"] {
            subjects(wrong).unwrap_err();
        }
        let walk = [Action::Walking, Action::Boxing];
        assert_eq!(actions("walking, boxing,walking").unwrap(), walk);
        assert_eq!(actions("all").unwrap().len(), 10);
        assert!(actions("flying").unwrap_err().contains("throw-catch"));
    }

    proptest! {
        #[test]
        fn no_text_makes_the_parsers_panic(text in "[0-9,a-z -]{0,12}") {
            drop(subjects(&text));
            drop(actions(&text));
        }
    }
}
