//! Converts the setting `paper.errors` of a deployment to a selection of rows in the table of expected errors.

use deployment::paper::ErrorTable;
use viewquality::Selection;

/// Returns the rows of the table that belong to the footage.
pub fn selection(table: &ErrorTable) -> Selection {
    Selection {
        subject: table.subject.clone().unwrap_or_default(),
        action: table.action.clone().unwrap_or_default(),
        frame_offset: table.frame_offset,
        frame_step: table.frame_step,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_numbered_as_in_the_prediction_file() {
        let table = ErrorTable {
            table: "t.csv".into(),
            subject: None,
            action: None,
            views: [].into(),
            frame_offset: 80,
            frame_step: 4,
        };
        assert_eq!(selection(&table).table_frame(3), Some(92));
    }
}
