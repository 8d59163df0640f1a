//! What the command line says about who does what, and before which cameras.

use std::ops::RangeInclusive;

use scene::{Action, RigChoice};

pub(super) fn rig(text: &str) -> Result<RigChoice, String> {
    RigChoice::parse(text).map_err(|it| it.to_string())
}

/// Most subjects of one command.
const MOST: usize = 10_000;

/// `3`, or `1-20,25`, each once, in the order in which they are said.
pub(super) fn subjects(text: &str) -> Result<Vec<u64>, String> {
    let wrong =
        || format!("{text:?}: expected numbers and ranges with commas, for example 1-20,25");
    let range = |part: &str| -> Option<RangeInclusive<u64>> {
        let (from, to) = part.split_once('-').unwrap_or((part, part));
        let range = from.trim().parse().ok()?..=to.trim().parse().ok()?;
        (!range.is_empty()).then_some(range)
    };
    let mut subjects = Vec::new();
    for part in text.split(',') {
        for subject in range(part).ok_or_else(wrong)? {
            if subjects.len() == MOST {
                return Err(format!("more than {MOST} subjects"));
            }
            if !subjects.contains(&subject) {
                subjects.push(subject);
            }
        }
    }
    Ok(subjects)
}

/// Names with commas, or `all`.
pub(super) fn actions(text: &str) -> Result<Vec<Action>, String> {
    if text == "all" {
        return Ok(Action::ALL.to_vec());
    }
    let mut actions = Vec::new();
    for name in text.split(',') {
        let action = Action::by_name(name.trim()).ok_or_else(|| {
            let known = Action::ALL.map(Action::name).join(", ");
            format!("there is no action {name:?}, expected all, or some of {known}")
        })?;
        if !actions.contains(&action) {
            actions.push(action);
        }
    }
    Ok(actions)
}

/// Frames a second, for the command line.
pub(crate) fn rate(text: &str) -> Result<f64, String> {
    let rate: Option<f64> = text.parse().ok();
    let rate = rate.filter(|it| (0.1..=1000.0).contains(it));
    rate.ok_or_else(|| "expected 0.1 to 1000 frames a second".to_owned())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn lists_are_what_they_say_each_once() {
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
        fn any_text_is_a_list_or_an_error(text in "[0-9,a-z -]{0,12}") {
            drop(subjects(&text));
            drop(actions(&text));
            drop(rate(&text));
        }
    }
}
