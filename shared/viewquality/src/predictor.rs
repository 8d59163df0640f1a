//! The expected errors of one view, frame by frame.

use std::collections::BTreeMap;

use crate::Table;

/// Selects the sequence of a table that corresponds to a deployment, and converts frame numbers.
///
/// By default, the table and the deployment use the same frame numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Selection {
    /// Subject in the table; empty if the table has no subjects.
    pub subject: String,
    /// Action in the table; empty if the table has no actions.
    pub action: String,
    /// Frame of the table that corresponds to frame 0 of the deployment.
    pub frame_offset: i64,
    /// Number of table frames per frame of the deployment.
    pub frame_step: u32,
}

impl Default for Selection {
    fn default() -> Self {
        Self {
            subject: String::new(),
            action: String::new(),
            frame_offset: 0,
            frame_step: 1,
        }
    }
}

impl Selection {
    /// The table's frame for a frame of the deployment; `None` on overflow.
    pub fn table_frame(&self, frame: u64) -> Option<i64> {
        let steps = i64::try_from(frame).ok()?.checked_mul(i64::from(self.frame_step))?;
        self.frame_offset.checked_add(steps)
    }
}

/// The table has no rows for the requested sequence.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "the table has no rows for subject `{subject}`, action `{action}`, view `{view}`; it has {known}"
)]
pub struct NoPredictions {
    /// The requested subject.
    pub subject: String,
    /// The requested action.
    pub action: String,
    /// The requested view.
    pub view: String,
    /// The first sequences of the table.
    pub known: String,
}

/// Returns the expected errors of one view.
#[derive(Debug, Clone, PartialEq)]
pub enum Predictor {
    /// The errors are looked up in a table.
    Table {
        /// The numbering of frames in the table.
        selection: Selection,
        /// Expected errors by frame of the table, in pixels, one per part.
        rows: BTreeMap<i64, Vec<f32>>,
    },
}

impl Predictor {
    /// Takes the rows of a view from a table.
    ///
    /// # Errors
    ///
    /// Fails with [`NoPredictions`] if there are no such rows; the error lists the sequences of the table.
    pub fn from_table(
        table: &Table,
        selection: Selection,
        view: &str,
    ) -> Result<Self, NoPredictions> {
        match table.series(&selection.subject, &selection.action, view) {
            Some(rows) => Ok(Self::Table {
                rows: rows.clone(),
                selection,
            }),
            None => Err(NoPredictions {
                known: known(table),
                subject: selection.subject,
                action: selection.action,
                view: view.to_owned(),
            }),
        }
    }

    /// Expected error of every part in a frame of the deployment, in pixels. Returns `None` if there is no prediction. In this case, every
    /// part counts as usable.
    pub fn sigma_px(&self, frame: u64) -> Option<&[f32]> {
        match self {
            Self::Table { selection, rows } => {
                let row = rows.get(&selection.table_frame(frame)?)?;
                Some(row)
            }
        }
    }
}

/// The first few sequences of a table.
fn known(table: &Table) -> String {
    const SHOWN: usize = 12;
    let mut names: Vec<String> =
        table.names().take(SHOWN + 1).map(|name| format!("`{name}`")).collect();
    if names.len() > SHOWN {
        names.truncate(SHOWN);
        names.push("...".to_owned());
    }
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn selection(frame_offset: i64, frame_step: u32) -> Selection {
        Selection {
            subject: "S1".to_owned(),
            action: "Box".to_owned(),
            frame_offset,
            frame_step,
        }
    }

    fn table() -> Table {
        Table::parse("S1,Box,6,C1,8.5\nS1,Box,8,C1,1\nS1,Jog,6,C2,3\n", 1).unwrap()
    }

    #[test]
    fn frames_are_numbered_by_offset_and_step() {
        let predictor = Predictor::from_table(&table(), selection(6, 2), "C1").unwrap();
        assert_eq!(predictor.sigma_px(0), Some(&[8.5][..]));
        assert_eq!(predictor.sigma_px(1), Some(&[1.0][..]));
        assert_eq!(predictor.sigma_px(2), None);
    }

    #[test]
    fn by_default_frame_numbers_are_equal() {
        assert_eq!(Selection::default().table_frame(7), Some(7));
    }

    #[test]
    fn frames_beyond_the_range_of_numbers_have_no_prediction() {
        let predictor = Predictor::from_table(&table(), selection(i64::MAX, 2), "C1").unwrap();
        for frame in [1, u64::MAX, i64::MAX as u64] {
            assert_eq!(predictor.sigma_px(frame), None);
        }
        let predictor = Predictor::from_table(&table(), selection(6, 4), "C1").unwrap();
        assert_eq!(predictor.sigma_px(1 << 62), None);
    }

    #[test]
    fn a_missing_sequence_is_reported_with_those_that_exist() {
        let said = Predictor::from_table(&table(), selection(0, 1), "C2").unwrap_err();
        assert_eq!(
            said.to_string(),
            "the table has no rows for subject `S1`, action `Box`, view `C2`; it has `S1 Box C1`, \
             `S1 Jog C2`"
        );
    }

    #[test]
    fn a_long_list_of_sequences_is_shortened() {
        let rows: Vec<String> = (0..20).map(|i| format!("S,A,1,view{i},2")).collect();
        let table = Table::parse(&rows.join("\n"), 1).unwrap();
        let said = Predictor::from_table(&table, selection(0, 1), "C1").unwrap_err();
        assert!(said.known.ends_with(", ..."));
        assert_eq!(said.known.matches('`').count(), 24);
    }
}
