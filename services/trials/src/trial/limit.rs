//! Compares measured numbers with limits.

use exports::report::run::Limit;

/// Returns a limit that is met if the number is at least the given number.
pub(crate) fn at_least(what: &str, asked: f64, got: Option<f64>) -> Limit {
    limit(
        what,
        format!("at least {asked}"),
        got,
        got.is_some_and(|value| value >= asked),
    )
}

/// Returns a limit that is met if the number is at most the given number.
pub(crate) fn at_most(what: &str, asked: f64, got: Option<f64>) -> Limit {
    limit(
        what,
        format!("at most {asked}"),
        got,
        got.is_some_and(|value| value <= asked),
    )
}

/// Returns a limit that is met if the list is empty.
pub(crate) fn none_of(what: &str, got: &[String]) -> Limit {
    Limit {
        what: what.to_owned(),
        asked: "none".to_owned(),
        got: if got.is_empty() {
            "none".to_owned()
        } else {
            got.join(", ")
        },
        held: got.is_empty(),
    }
}

/// * `got`: the measured number. If it is missing, the limit counts as missed.
fn limit(what: &str, asked: String, got: Option<f64>, held: bool) -> Limit {
    let digits = |value: f64| usize::from(value.fract() != 0.0);
    Limit {
        what: what.to_owned(),
        asked,
        got: got.map_or_else(
            || "nothing".to_owned(),
            |value| format!("{value:.0$}", digits(value)),
        ),
        held,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_equal_to_the_limit_passes_and_a_missing_value_fails() {
        for (got, least, most) in [
            (Some(2.0), true, true),
            (Some(2.5), true, false),
            (Some(1.5), false, true),
            (None, false, false),
        ] {
            assert_eq!(at_least("x", 2.0, got).held, least, "{got:?}");
            assert_eq!(at_most("x", 2.0, got).held, most, "{got:?}");
        }
    }

    #[test]
    fn entries_of_a_list_that_should_be_empty_are_shown() {
        assert!(none_of("x", &[]).held);
        let got = none_of("x", &["a".to_owned(), "b".to_owned()]);
        assert_eq!((got.held, got.got.as_str()), (false, "a, b"));
    }
}
