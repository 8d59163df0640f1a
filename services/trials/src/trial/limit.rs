//! A measured number against the limit that was asked for.

use report::run::Limit;

/// Holds if the number is at least what was asked for.
pub(crate) fn at_least(what: &str, asked: f64, got: Option<f64>) -> Limit {
    limit(
        what,
        format!("at least {asked}"),
        got,
        got.is_some_and(|it| it >= asked),
    )
}

/// Holds if the number is at most what was asked for.
pub(crate) fn at_most(what: &str, asked: f64, got: Option<f64>) -> Limit {
    limit(
        what,
        format!("at most {asked}"),
        got,
        got.is_some_and(|it| it <= asked),
    )
}

/// Holds if there is nothing of it.
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

/// What was not measured has not held.
fn limit(what: &str, asked: String, got: Option<f64>, held: bool) -> Limit {
    let digits = |it: f64| usize::from(it.fract() != 0.0);
    Limit {
        what: what.to_owned(),
        asked,
        got: got.map_or_else(
            || "nothing".to_owned(),
            |it| format!("{it:.0$}", digits(it)),
        ),
        held,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_asked_for_itself_holds_and_what_was_not_measured_does_not() {
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
    fn all_that_should_not_be_there_is_named() {
        assert!(none_of("x", &[]).held);
        let got = none_of("x", &["a".to_owned(), "b".to_owned()]);
        assert_eq!((got.held, got.got.as_str()), (false, "a, b"));
    }
}
