//! Results of each frame, in the form stored on disk for resuming a run.

use serde::{Deserialize, Serialize};
use statistics::score::Point;

use crate::evaluation::Predicted;

/// The first line of a file of records.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Always `parallax-eval`.
    pub format: String,
    /// Version of the format: 1.
    pub version: u32,
    /// Name of the sequence.
    pub sequence: String,
    /// All settings that the results depend on; a run is resumed only with the same settings.
    pub settings: String,
    /// The versions, in the order of [`Record::found`].
    pub versions: Vec<String>,
}

impl Header {
    /// Creates a header of the current format.
    pub fn new(sequence: &str, settings: &str, versions: Vec<String>) -> Self {
        Self {
            format: "parallax-eval".to_owned(),
            version: 1,
            sequence: sequence.to_owned(),
            settings: settings.to_owned(),
            versions,
        }
    }
}

/// Results of one frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// Number of the frame in the data set.
    pub frame: u64,
    /// The result of each version.
    pub found: Vec<FrameResult>,
    /// Expected and true errors of each view; empty without a network.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub predicted: Vec<Option<Predicted>>,
}

/// The result of one version on one frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameResult {
    /// Joints of the sequence's joint set, in metres; `None` for a joint that could not be triangulated.
    pub joints: Vec<Option<Point>>,
    /// For each view, the 14 joints of `skeleton::PARSE14`, in pixels of the footage; left and right are sides of
    /// the body. `None` if no person was found.
    pub views: Vec<Option<Vec<[f64; 2]>>>,
    /// Number of single-view solutions for each pair of views (or for all views at once).
    pub iterations: Vec<u32>,
    /// Number of pairs of views (or of solutions of all views at once) that did not converge.
    pub unsettled: u32,
    /// Total number of single-view solutions, including those of rejected hypotheses.
    pub solutions: u32,
    /// Fraction of the consistency terms that were switched on; `None` if there were no terms.
    pub on: Option<f64>,
}

/// Reason why records cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The first line is not a header.
    #[error("line 1 is not the header of a records file")]
    Header(#[source] serde_json::Error),
    /// The records are from a run with other settings.
    #[error("the records are from a run with other settings or versions")]
    Other,
    /// A line before the last is damaged.
    #[error("line {line}")]
    Line {
        /// Number of the line, counted from 1.
        line: usize,
        /// Cause of the error.
        source: serde_json::Error,
    },
}

/// Reads records.
///
/// A truncated last line is left out.
///
/// * Returns the records and their length in bytes, so that a resumed run can truncate the file there.
///
/// # Errors
///
/// Fails with [`RecordError`], but never for an empty text.
pub fn read_records(text: &str, expected: &Header) -> Result<(Vec<Record>, usize), RecordError> {
    let mut records = Vec::new();
    let mut n_bytes = 0;
    for (nth, line) in text.split_inclusive('\n').enumerate() {
        if !line.ends_with('\n') {
            break;
        }
        if nth == 0 {
            let header: Header = serde_json::from_str(line).map_err(RecordError::Header)?;
            if header != *expected {
                return Err(RecordError::Other);
            }
        } else {
            let line_number = nth + 1;
            let record = serde_json::from_str(line).map_err(|source| RecordError::Line {
                line: line_number,
                source,
            })?;
            records.push(record);
        }
        n_bytes += line.len();
    }
    Ok((records, n_bytes))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn header() -> Header {
        Header::new("S1 Walking", "alpha 1", vec!["fmp".to_owned()])
    }

    fn record(frame: u64) -> Record {
        Record {
            frame,
            found: vec![FrameResult {
                joints: vec![Some([0.1 * frame as f64, 1.0 / 3.0, -2.0]), None],
                views: vec![None, Some(vec![[3.25, 1e-9]])],
                iterations: vec![4, 5],
                unsettled: 0,
                solutions: 18,
                on: Some(0.75),
            }],
            predicted: vec![
                None,
                Some(Predicted {
                    sigma_px: vec![0.1],
                    tau_px: Vec::new(),
                    error_px: vec![3.5],
                }),
            ],
        }
    }

    fn text(n: u64) -> String {
        let mut text = serde_json::to_string(&header()).unwrap() + "\n";
        for frame in 0..n {
            text += &(serde_json::to_string(&record(frame)).unwrap() + "\n");
        }
        text
    }

    #[test]
    fn records_survive_a_round_trip_bit_for_bit() {
        let (got, n_bytes) = read_records(&text(3), &header()).unwrap();
        assert_eq!(got, [record(0), record(1), record(2)]);
        assert_eq!(n_bytes, text(3).len());
    }

    #[test]
    fn records_of_another_run_are_refused() {
        let other = Header::new("S1 Walking", "alpha 2", vec!["fmp".to_owned()]);
        assert!(matches!(
            read_records(&text(1), &other),
            Err(RecordError::Other)
        ));
    }

    #[test]
    fn damage_before_the_end_is_named() {
        let broken = text(3).replacen("\"frame\":1", "\"frame\":x", 1);
        let got = read_records(&broken, &header());
        assert!(
            matches!(got, Err(RecordError::Line { line: 3, .. })),
            "{got:?}"
        );
    }

    proptest! {
        #[test]
        fn a_truncated_run_is_resumed_after_its_last_complete_line(share in 0.0..1.0_f64) {
            let whole = text(4);
            let cut = &whole[..(share * whole.len() as f64) as usize];
            let (records, n_bytes) = read_records(cut, &header()).unwrap();
            prop_assert!(cut[..n_bytes].is_empty() || cut[..n_bytes].ends_with('\n'));
            let n_lines = cut.matches('\n').count();
            prop_assert_eq!(records.len(), n_lines.saturating_sub(1));
        }
    }
}
