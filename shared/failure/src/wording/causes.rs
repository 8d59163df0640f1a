//! Text of an error with all its causes. Errors have their cause in `source` and never repeat it.

use core::error::Error;

/// Iterates over an error, its cause, the cause of that cause, and so on.
pub fn chain<'a>(
    error: &'a (dyn Error + 'static),
) -> impl Iterator<Item = &'a (dyn Error + 'static)> {
    core::iter::successors(Some(error), |&error| error.source())
}

/// Returns an error and its causes in one line, separated by `: `.
///
/// ```
/// let error = std::io::Error::other("the disk is full");
/// assert_eq!(failure::wording::in_one_line(&error), "the disk is full");
/// ```
pub fn in_one_line(error: &(dyn Error + 'static)) -> String {
    let texts: Vec<String> = chain(error).map(ToString::to_string).collect();
    texts.join(": ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("cannot read the model")]
    struct Outer(#[source] Inner);

    #[derive(Debug, thiserror::Error)]
    #[error("part 3 has no filter")]
    struct Inner;

    #[test]
    fn causes_are_listed_in_order() {
        let error = Outer(Inner);
        assert_eq!(chain(&error).count(), 2);
        assert_eq!(
            in_one_line(&error),
            "cannot read the model: part 3 has no filter"
        );
    }
}
