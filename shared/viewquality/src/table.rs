//! Expected errors that were predicted by another program, read from a CSV file.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use csv::StringRecord;

/// Expected errors by subject, action, view and frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    n_parts: usize,
    series: BTreeMap<Name, BTreeMap<i64, Vec<f32>>>,
}

/// Identifies one sequence of one view in a table.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Name {
    pub(crate) subject: String,
    pub(crate) action: String,
    pub(crate) view: String,
}

/// Reason why a text was rejected as a table.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The table has no rows.
    #[error("the table has no rows")]
    Empty,
    /// The header has an unknown or duplicate column.
    #[error("line {line}, column {column}: `{got}` is {problem}; expected {KNOWN}")]
    Header {
        /// Number of the line, from 1.
        line: u64,
        /// Number of the column, from 1.
        column: usize,
        /// Name of the column.
        got: String,
        /// Fault of the name.
        problem: &'static str,
    },
    /// The header lacks a column.
    #[error("line {line}: the header has no column `{column}`; expected {KNOWN}")]
    MissingColumn {
        /// Number of the line, from 1.
        line: u64,
        /// Name of the missing column.
        column: String,
    },
    /// The number of fields of a row differs from the number of columns.
    #[error("line {line}: {got} columns, expected {expected}")]
    Columns {
        /// Number of the line, from 1.
        line: u64,
        /// Number of fields in the row.
        got: usize,
        /// Number of columns of the table.
        expected: usize,
    },
    /// An expected error is not a valid number of pixels.
    #[error(
        "line {line}, column {column}: the expected error of part {part} is `{got}`, but must be a finite number of at least 0 (in pixels)"
    )]
    Number {
        /// Number of the line, from 1.
        line: u64,
        /// Number of the column, from 1.
        column: usize,
        /// Number of the part, from 1.
        part: usize,
        /// Text of the field.
        got: String,
    },
    /// A frame is not a whole number.
    #[error("line {line}, column {column}: frame `{got}` is not a whole number")]
    Frame {
        /// Number of the line, from 1.
        line: u64,
        /// Number of the column, from 1.
        column: usize,
        /// Text of the field.
        got: String,
    },
    /// Two rows have the same frame of the same view.
    #[error("line {line}: frame {frame} of {what} occurs twice")]
    Duplicate {
        /// Number of the line, from 1.
        line: u64,
        /// Number of the frame.
        frame: i64,
        /// Subject, action and view.
        what: String,
    },
    /// The text is not CSV.
    #[error("the table is not CSV")]
    Csv(#[from] csv::Error),
}

const KNOWN: &str =
    "`subject`, `action`, `frame`, `view` (or `camera`) and `part_1`, `part_2`, ...";

impl Table {
    /// Reads a table of expected errors, in pixels of the frame.
    ///
    /// Columns are separated by commas:
    /// * With a header, the columns are `frame`, `view` (or `camera`) and `part_1` to `part_n`, in any order. If the table
    ///   contains several sequences, it also has `subject` and `action`. Without these columns, the names are
    ///   empty.
    /// * Without a header, as in the authors' files, the columns are subject, action, frame, view, and the parts
    ///   in order.
    ///
    /// The first line is a header if one of its fields is `frame`.
    ///
    /// # Errors
    ///
    /// Fails with [`TableError`], naming line and column.
    pub fn parse(text: &str, n_parts: usize) -> Result<Self, TableError> {
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let mut records = reader.records().peekable();
        let columns = match records.peek() {
            Some(Ok(first)) if first.iter().any(|field| field == "frame") => {
                let columns = Columns::from_header(first, n_parts)?;
                records.next();
                columns
            }
            _ => Columns::released(n_parts),
        };
        let mut table = Self {
            n_parts,
            series: BTreeMap::new(),
        };
        for record in records {
            table.insert(&columns, &record?)?;
        }
        if table.series.is_empty() {
            return Err(TableError::Empty);
        }
        Ok(table)
    }

    /// Number of parts in every row.
    pub fn n_parts(&self) -> usize {
        self.n_parts
    }

    /// Number of rows.
    pub fn n_rows(&self) -> usize {
        self.series.values().map(BTreeMap::len).sum()
    }

    /// Expected errors of a frame of a view, in pixels, one per part.
    ///
    /// * `subject`, `action`: empty for tables without these columns.
    pub fn get(&self, subject: &str, action: &str, frame: i64, view: &str) -> Option<&[f32]> {
        let rows = self.series(subject, action, view)?;
        rows.get(&frame).map(Vec::as_slice)
    }

    pub(crate) fn series(
        &self,
        subject: &str,
        action: &str,
        view: &str,
    ) -> Option<&BTreeMap<i64, Vec<f32>>> {
        self.series.get(&Name {
            subject: subject.to_owned(),
            action: action.to_owned(),
            view: view.to_owned(),
        })
    }

    pub(crate) fn names(&self) -> impl Iterator<Item = &Name> {
        self.series.keys()
    }

    fn insert(&mut self, columns: &Columns, record: &StringRecord) -> Result<(), TableError> {
        let line = record.position().map_or(0, csv::Position::line);
        if record.len() != columns.count {
            return Err(TableError::Columns {
                line,
                got: record.len(),
                expected: columns.count,
            });
        }
        let frame = &record[columns.frame];
        let frame = frame.parse().map_err(|_error| TableError::Frame {
            line,
            column: columns.frame + 1,
            got: shortened(frame),
        })?;
        let mut row = Vec::with_capacity(self.n_parts);
        for (part, &column) in columns.parts.iter().enumerate() {
            match record[column].parse() {
                Ok(px) if (0.0..=f32::MAX).contains(&px) => row.push(px),
                _ => {
                    return Err(TableError::Number {
                        line,
                        column: column + 1,
                        part: part + 1,
                        got: shortened(&record[column]),
                    });
                }
            }
        }
        let field = |column: Option<usize>| column.map_or("", |column| &record[column]).to_owned();
        let name = Name {
            subject: field(columns.subject),
            action: field(columns.action),
            view: field(Some(columns.view)),
        };
        let what = name.to_string();
        match self.series.entry(name).or_default().entry(frame) {
            Entry::Vacant(place) => {
                place.insert(row);
                Ok(())
            }
            Entry::Occupied(_) => Err(TableError::Duplicate { line, frame, what }),
        }
    }
}

impl std::fmt::Display for Name {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let names = [&self.subject, &self.action, &self.view];
        let given: Vec<&str> =
            names.into_iter().map(String::as_str).filter(|name| !name.is_empty()).collect();
        f.write_str(&given.join(" "))
    }
}

/// The index of every column.
struct Columns {
    subject: Option<usize>,
    action: Option<usize>,
    frame: usize,
    view: usize,
    parts: Vec<usize>,
    count: usize,
}

impl Columns {
    fn released(n_parts: usize) -> Self {
        Self {
            subject: Some(0),
            action: Some(1),
            frame: 2,
            view: 3,
            parts: (4..4 + n_parts).collect(),
            count: 4 + n_parts,
        }
    }

    fn from_header(header: &StringRecord, n_parts: usize) -> Result<Self, TableError> {
        let line = header.position().map_or(0, csv::Position::line);
        let mut columns: BTreeMap<String, usize> = BTreeMap::new();
        for (column, name) in header.iter().enumerate() {
            let known = match name {
                "camera" => "view",
                "subject" | "action" | "frame" | "view" => name,
                _ if part_of(name).is_some_and(|part| part <= n_parts) => name,
                _ => "",
            };
            let problem = match known {
                "" => "not a column for this number of parts",
                _ if columns.contains_key(known) => "given twice",
                _ => {
                    columns.insert(known.to_owned(), column);
                    continue;
                }
            };
            return Err(TableError::Header {
                line,
                column: column + 1,
                got: shortened(name),
                problem,
            });
        }
        let required = |name: &str| {
            let column = columns.get(name).copied();
            column.ok_or_else(|| TableError::MissingColumn {
                line,
                column: name.to_owned(),
            })
        };
        Ok(Self {
            subject: columns.get("subject").copied(),
            action: columns.get("action").copied(),
            frame: required("frame")?,
            view: required("view")?,
            parts: (1..=n_parts)
                .map(|part| required(&format!("part_{part}")))
                .collect::<Result<_, _>>()?,
            count: header.len(),
        })
    }
}

/// Number of the part of a column `part_n`, from 1.
fn part_of(name: &str) -> Option<usize> {
    let number = name.strip_prefix("part_")?;
    let part = number.parse().ok().filter(|&part| part > 0)?;
    (format!("{part}") == number).then_some(part)
}

fn shortened(field: &str) -> String {
    field.chars().take(24).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const RELEASED: &str = "S1,Box,6,C1,8.5,6.25\nS1,Box,7,C1,1,2\nS1,Box,6,C2,3,4\n";

    fn outcome(text: &str) -> String {
        match Table::parse(text, 2) {
            Ok(table) => format!("fine: {}", table.n_rows()),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn reads_the_format_of_the_authors() {
        let table = Table::parse(RELEASED, 2).unwrap();
        assert_eq!(table.get("S1", "Box", 6, "C1"), Some(&[8.5, 6.25][..]));
        assert_eq!(table.get("S1", "Box", 6, "C2"), Some(&[3.0, 4.0][..]));
        assert_eq!(table.get("S1", "Box", 8, "C1"), None);
        assert_eq!(table.get("S2", "Box", 6, "C1"), None);
        assert_eq!((table.n_rows(), table.n_parts()), (3, 2));
    }

    #[test]
    fn with_a_header_the_columns_may_be_in_any_order() {
        let text = "part_2,frame,camera,part_1\n6.25, 6 ,C1,8.5\n";
        let table = Table::parse(text, 2).unwrap();
        assert_eq!(table.get("", "", 6, "C1"), Some(&[8.5, 6.25][..]));
        let text = "subject,action,frame,view,part_1,part_2\n".to_owned() + RELEASED;
        assert_eq!(
            Table::parse(&text, 2).unwrap(),
            Table::parse(RELEASED, 2).unwrap()
        );
    }

    #[test]
    fn rejects_invalid_expected_errors() {
        for bad in ["NaN", "nan", "inf", "-0.5", "1e39", "", "x"] {
            let expected = format!(
                "line 2, column 6: the expected error of part 2 is `{bad}`, but must be a finite number of at least 0 (in pixels)"
            );
            assert_eq!(
                outcome(&format!("S,A,1,C,1,2\nS,A,2,C,1,{bad}\n")),
                expected
            );
        }
    }

    #[test]
    fn reports_the_line_with_a_wrong_number_of_columns() {
        let error = outcome("S,A,1,C,1,2\nS,A,2,C,1\n");
        assert_eq!(error, "line 2: 5 columns, expected 6");
        let error = outcome("frame,view,part_1,part_2\n1,C,1,2,3\n");
        assert_eq!(error, "line 2: 5 columns, expected 4");
    }

    #[test]
    fn rejects_fractional_and_duplicate_frames() {
        let error = outcome("S,A,1.5,C,1,2\n");
        assert_eq!(error, "line 1, column 3: frame `1.5` is not a whole number");
        let error = outcome("S,A,1,C,1,2\n\nS,A,1,D,1,2\nS,A,1,C,3,4\n");
        assert_eq!(error, "line 4: frame 1 of S A C occurs twice");
    }

    #[test]
    fn the_header_must_have_a_column_for_every_part() {
        assert_eq!(
            outcome("frame,view,part_1\n"),
            format!("line 1: the header has no column `part_2`; expected {KNOWN}")
        );
        assert_eq!(
            outcome("frame,part_1,part_2\n"),
            format!("line 1: the header has no column `view`; expected {KNOWN}")
        );
        for bad in ["part_3", "part_0", "part_01", "sigma"] {
            let problem = "not a column for this number of parts";
            assert_eq!(
                outcome(&format!("frame,view,part_1,part_2,{bad}\n")),
                format!("line 1, column 5: `{bad}` is {problem}; expected {KNOWN}")
            );
        }
        assert_eq!(
            outcome("frame,view,camera\n"),
            format!("line 1, column 3: `camera` is given twice; expected {KNOWN}")
        );
    }

    #[test]
    fn a_table_without_rows_is_rejected() {
        for empty in ["", "\n\n", "frame,view,part_1,part_2\n"] {
            assert_eq!(outcome(empty), "the table has no rows");
        }
    }

    proptest! {
        #[test]
        fn a_changed_table_never_panics(at in 0..RELEASED.len(), to in "[0-9a-z.,\"\\n-]{0,8}") {
            let mut text = RELEASED.to_owned();
            text.replace_range(at..(at + 3).min(RELEASED.len()), &to);
            let _outcome = outcome(&text);
        }

        #[test]
        fn any_text_is_a_table_or_an_error(text: String) {
            let _outcome = outcome(&text);
        }
    }
}
