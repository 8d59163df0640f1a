//! Loop unrolling in the text of a kernel, for which WGSL has no syntax.

/// Expands every `@unroll NAME FIRST END STEP { body }` to one body for each value, with `$NAME` replaced.
///
/// A malformed loop is not changed, and the WGSL parser then reports it; but all texts are part of this crate.
pub(crate) fn expand(text: &str) -> String {
    let mut out = String::with_capacity(4 * text.len());
    let mut rest = text;
    while let Some(loop_) = Loop::first(rest) {
        out.push_str(&rest[..loop_.begin]);
        for value in (loop_.first..loop_.end).step_by(loop_.step) {
            let body = loop_.body.replace(&format!("${}", loop_.name), &value.to_string());
            out.push('{');
            out.push_str(&expand(&body));
            out.push_str("}\n");
        }
        rest = loop_.after;
    }
    out.push_str(rest);
    out
}

/// A loop and the text before and after it.
struct Loop<'a> {
    begin: usize,
    name: &'a str,
    first: usize,
    end: usize,
    step: usize,
    body: &'a str,
    after: &'a str,
}

impl<'a> Loop<'a> {
    /// The first loop of a text.
    fn first(text: &'a str) -> Option<Self> {
        let begin = text.find("@unroll ")?;
        let (head, inside) = text[begin + "@unroll ".len()..].split_once('{')?;
        let mut words = head.split_whitespace();
        let name = words.next()?;
        let mut number = || words.next()?.parse().ok();
        let (first, end, step) = (number()?, number()?, number()?);
        let mut depth = 1;
        let close = inside.char_indices().find(|(_, letter)| {
            match letter {
                '{' => depth += 1,
                '}' => depth -= 1,
                _ => {}
            }
            depth == 0
        })?;
        Some(Self {
            begin,
            name,
            first,
            end,
            step,
            body: &inside[..close.0],
            after: &inside[close.0 + 1..],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nested_loops_are_expanded() {
        let text = "a; @unroll i 0 2 1 { b[$i]; @unroll j 4 9 4 { c[$i + $j]; } } d;";
        let words: Vec<String> = expand(text).split_whitespace().map(str::to_owned).collect();
        let expected =
            "a; { b[0]; { c[0 + 4]; } { c[0 + 8]; } } { b[1]; { c[1 + 4]; } { c[1 + 8]; } } d;";
        assert_eq!(words.join(" "), expected);
    }
}
