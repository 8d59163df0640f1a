//! YAML form of an `OpenCV` storage, and its JSON form, which is also YAML.

use std::collections::{BTreeMap, HashMap};

use granit_parser::{Event, Parser, ScalarStyle, ScanError, Span, StrInput};

use super::Entry;

/// Maximum depth of nested lists and tables.
const MAX_DEPTH: usize = 64;
/// Maximum number of entries in a file; aliases could create any number of entries in a few lines.
const MAX_ENTRIES: usize = 1 << 20;

/// Reason why a text cannot be read.
#[derive(Debug, thiserror::Error)]
pub(super) enum YamlError {
    /// The text is not valid YAML.
    #[error(transparent)]
    Scan(#[from] ScanError),
    /// The text is YAML, but not a storage.
    #[error("found {found} at line {line}, expected {expected}")]
    Shape {
        found: String,
        line: usize,
        expected: &'static str,
    },
    /// The text has too many entries.
    #[error("more than {MAX_ENTRIES} entries before line {line}")]
    TooLong { line: usize },
}

/// Reads the table of a document.
pub(super) fn parse(text: &str) -> Result<BTreeMap<String, Entry>, YamlError> {
    let options = granit_parser::options! {
        flow_nesting_limit: MAX_DEPTH,
        block_nesting_limit: MAX_DEPTH,
    };
    let mut reader = Reader {
        parser: Parser::new_from_str_with_options(text, options),
        anchors: HashMap::new(),
        n_left: MAX_ENTRIES,
    };
    reader.document()
}

/// Builds entries from the events of a parser. Tags such as `!!opencv-matrix` are ignored, because the entries contain the same
/// information.
struct Reader<'t> {
    parser: Parser<'t, StrInput<'t>>,
    /// Entries that an alias may repeat.
    anchors: HashMap<usize, Entry>,
    n_left: usize,
}

impl<'t> Reader<'t> {
    fn document(&mut self) -> Result<BTreeMap<String, Entry>, YamlError> {
        let mut table = None;
        loop {
            let (event, at) = self.next()?;
            match event {
                Event::StreamEnd => return Ok(table.unwrap_or_default()),
                Event::StreamStart | Event::DocumentStart(..) | Event::DocumentEnd => {}
                _ if table.is_some() => {
                    return Err(shape("a second document", at, "one"));
                }
                event => match self.entry(event, at)? {
                    Entry::Map(map) => table = Some(map),
                    Entry::Nothing => {}
                    _ => {
                        return Err(shape(
                            "a value without a name",
                            at,
                            "a table of names and values",
                        ));
                    }
                },
            }
        }
    }

    fn next(&mut self) -> Result<(Event<'t>, Span), YamlError> {
        let event = self.parser.next().transpose()?;
        Ok(event.unwrap_or((Event::StreamEnd, Span::default())))
    }

    /// Reads the entry that begins with an event.
    fn entry(&mut self, event: Event<'t>, at: Span) -> Result<Entry, YamlError> {
        self.count(1, at)?;
        let (entry, anchor) = match event {
            Event::Scalar(text, ScalarStyle::Plain, anchor, _) => (plain(&text), anchor),
            Event::Scalar(text, _, anchor, _) => (Entry::Text(text.into_owned()), anchor),
            Event::SequenceStart(_, anchor, _) => (Entry::List(self.list()?), anchor),
            Event::MappingStart(_, anchor, _) => (Entry::Map(self.map()?), anchor),
            Event::Alias(anchor) => {
                // An alias inside its own anchor has no entry yet.
                let entry = self.anchors.get(&anchor).cloned();
                let entry = entry.ok_or_else(|| {
                    shape(
                        "an alias inside the list that it names",
                        at,
                        "an alias of an earlier list",
                    )
                })?;
                self.count(len(&entry), at)?;
                (entry, 0)
            }
            _ => return Err(shape("an end", at, "a value")),
        };
        if anchor != 0 {
            self.anchors.insert(anchor, entry.clone());
        }
        Ok(entry)
    }

    fn list(&mut self) -> Result<Vec<Entry>, YamlError> {
        let mut list = Vec::new();
        loop {
            match self.next()? {
                (Event::SequenceEnd, _) => return Ok(list),
                (event, at) => list.push(self.entry(event, at)?),
            }
        }
    }

    fn map(&mut self) -> Result<BTreeMap<String, Entry>, YamlError> {
        let mut map = BTreeMap::new();
        loop {
            let (key, at) = match self.next()? {
                (Event::MappingEnd, _) => return Ok(map),
                (Event::Scalar(key, ..), at) => (key.into_owned(), at),
                (_, at) => return Err(shape("a list, a table or an alias", at, "a name")),
            };
            let (event, value_at) = self.next()?;
            let entry = self.entry(event, value_at)?;
            if map.contains_key(&key) {
                return Err(shape(
                    &format!("{key:?} again"),
                    at,
                    "each name at most once",
                ));
            }
            map.insert(key, entry);
        }
    }

    fn count(&mut self, n: usize, at: Span) -> Result<(), YamlError> {
        let line = at.start.line();
        self.n_left = self.n_left.checked_sub(n).ok_or(YamlError::TooLong { line })?;
        Ok(())
    }
}

fn shape(found: &str, at: Span, expected: &'static str) -> YamlError {
    YamlError::Shape {
        found: found.to_owned(),
        line: at.start.line(),
        expected,
    }
}

/// Returns the number of entries in an entry, including itself.
fn len(entry: &Entry) -> usize {
    1 + match entry {
        Entry::List(list) => list.iter().map(len).sum(),
        Entry::Map(map) => map.values().map(len).sum(),
        _ => 0,
    }
}

/// Returns the value of a scalar without quotes (YAML 1.2.2, 10.3.2).
fn plain(text: &str) -> Entry {
    match text {
        "" | "~" | "null" | "Null" | "NULL" => Entry::Nothing,
        "true" | "True" | "TRUE" => Entry::Number(1.0),
        "false" | "False" | "FALSE" => Entry::Number(0.0),
        ".nan" | ".NaN" | ".NAN" | ".Nan" => Entry::Number(f64::NAN),
        _ => number(text).map_or_else(|| Entry::Text(text.to_owned()), Entry::Number),
    }
}

fn number(text: &str) -> Option<f64> {
    let (sign, size) = match text.strip_prefix('-') {
        Some(size) => (-1.0, size),
        None => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    if matches!(size, ".inf" | ".Inf" | ".INF") {
        return Some(sign * f64::INFINITY);
    }
    // Words such as `nan` and `infinity` are text in YAML.
    size.starts_with(|first: char| first.is_ascii_digit() || first == '.')
        .then(|| text.parse().ok())?
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(entry: &Entry) -> Vec<f64> {
        entry.numbers("x").unwrap()
    }

    #[test]
    fn every_number_notation_is_parsed() {
        let text = "# by hand\nflow: [1, 2.5, -3e-2,\n  .5, 7., +4]\nblock:\n- 1\n-   2\nrows:\n- - 1\n  - 2\n- [3, 4]\n\
            json: {\"rows\": 1, \"cols\": 2, \"data\": [5, 6]}\nodd: [.nan, -.Inf, .inf]\n";
        let map = parse(text).unwrap();
        assert_eq!(numbers(&map["flow"]), [1.0, 2.5, -0.03, 0.5, 7.0, 4.0]);
        assert_eq!(numbers(&map["block"]), [1.0, 2.0]);
        assert_eq!(numbers(&map["rows"]), [1.0, 2.0, 3.0, 4.0]);
        assert_eq!(numbers(&map["json"]), [5.0, 6.0]);
        let odd = numbers(&map["odd"]);
        assert!(odd[0].is_nan() && odd[1..] == [f64::NEG_INFINITY, f64::INFINITY]);
    }

    #[test]
    fn texts_numbers_and_empty_values_are_distinguished() {
        let text = "a: '01'\nb: 01\nc: Mon 01 Jan\nd: nan\ne: ~\nf:\ng: true\nh: \"x\\ty\"\ni: 2024-01-02\nj: 0x10\n";
        let map = parse(text).unwrap();
        let text = |text: &str| Entry::Text(text.to_owned());
        let values = [
            ("a", text("01")),
            ("b", Entry::Number(1.0)),
            ("c", text("Mon 01 Jan")),
            ("d", text("nan")),
            ("e", Entry::Nothing),
            ("f", Entry::Nothing),
            ("g", Entry::Number(1.0)),
            ("h", text("x\ty")),
            ("i", text("2024-01-02")),
            ("j", text("0x10")),
        ];
        for (key, value) in values {
            assert_eq!(map[key], value, "{key}");
        }
    }

    #[test]
    fn aliases_repeat_their_anchors_within_limits() {
        use core::fmt::Write as _;

        let map = parse("a: &one [1, 2]\nb: *one\nc: [*one, *one]\n").unwrap();
        assert_eq!(numbers(&map["b"]), [1.0, 2.0]);
        assert_eq!(numbers(&map["c"]), [1.0, 2.0, 1.0, 2.0]);
        let mut bomb = "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1]\n".to_owned();
        for nth in 1..30 {
            let before = vec![format!("*a{}", nth - 1); 8].join(", ");
            writeln!(bomb, "a{nth}: &a{nth} [{before}]").unwrap();
        }
        let error = parse(&bomb).unwrap_err();
        assert!(matches!(error, YamlError::TooLong { .. }), "{error}");
        parse("a: &a [*a]\n").unwrap_err();
    }

    #[test]
    fn errors_name_the_line() {
        for (text, words) in [
            ("a: 1\nb: [1, 2\nc: 3\n", "line"),
            ("a: 1\nb: 2\na: 3\n", "\"a\" again at line 3"),
            ("a: 1\n---\nb: 2\n", "a second document at line 3"),
            ("- 1\n- 2\n", "a value without a name at line 1"),
            ("a: 1\n? [1]\n: 2\n", "at line 2, expected a name"),
        ] {
            let error = parse(text).unwrap_err().to_string();
            assert!(error.contains(words), "{text:?}: {error}");
        }
        let deep = format!("a: {}", "[".repeat(1000));
        parse(&deep).unwrap_err();
        assert_eq!(parse("").unwrap(), BTreeMap::new());
        assert_eq!(parse("%YAML:1.0\n---\n").unwrap(), BTreeMap::new());
    }
}
