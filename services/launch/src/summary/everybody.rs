//! Table of the people in a run with several people.

use core::fmt::Write as _;

use runfiles::{People, PersonSummary};

/// Maximum number of people in the table. The people with the most frames are listed.
const MOST_ROWS: usize = 8;

/// Returns the number of people, and the table.
pub(super) fn text(people: &People) -> String {
    format!("  people        {}\n{}", people.text(), table(people))
}

/// Returns the table with a row per person, by id. Returns an empty text if there is only one person.
fn table(people: &People) -> String {
    if people.each.len() < 2 {
        return String::new();
    }
    let mut shown: Vec<&PersonSummary> = people.each.iter().collect();
    shown.sort_by_key(|person| (core::cmp::Reverse(person.frames), person.id));
    let n_left_out = shown.len().saturating_sub(MOST_ROWS);
    shown.truncate(MOST_ROWS);
    shown.sort_by_key(|person| person.id);
    let mut text = format!(
        "    {:>6} {:>8} {:>8} {:>8} {:>8} {:>8}  trust\n",
        "person", "frames", "first", "last", "joints", "px"
    );
    for person in shown {
        let px = person.reprojection_px.map_or_else(|| "-".to_owned(), |px| format!("{px:.1}"));
        let joints = format!("{:.1} %", 100.0 * person.joints);
        // Writing to a string cannot fail.
        let _infallible = writeln!(
            text,
            "    {:>6} {:>8} {:>8} {:>8} {joints:>8} {px:>8}  {}",
            person.id,
            person.frames,
            person.first_frame,
            person.last_frame,
            verdict(person, people.followed.contains(&person.id))
        );
    }
    if n_left_out > 0 {
        let _infallible = writeln!(
            text,
            "    and {n_left_out} with fewer frames: see `people` in summary.json"
        );
    }
    text
}

fn verdict(person: &PersonSummary, is_followed: bool) -> String {
    let doubts = if is_followed {
        person.trust.doubts()
    } else {
        person.trust.doubts_of_another()
    };
    if !doubts.is_empty() {
        let doubts: Vec<String> = doubts.iter().map(ToString::to_string).collect();
        return format!("may be wrong: {}", doubts.join("; "));
    }
    if person.trust.frames < runfiles::Trust::MIN_FRAMES {
        "too few frames to judge".to_owned()
    } else {
        "no reason for doubt".to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn people(n: u64) -> People {
        let person = |id| PersonSummary {
            id,
            frames: 100 - id,
            last_frame: 120,
            joints: 0.985,
            reprojection_px: (id > 1).then_some(4.25),
            trust: runfiles::Trust {
                frames: 100,
                jumps: if id == 2 { 0.3 } else { 0.0 },
                ..runfiles::Trust::default()
            },
            ..PersonSummary::default()
        };
        People {
            each: (1..=n).map(person).collect(),
            ..People::default()
        }
    }

    #[test]
    fn each_of_several_people_has_a_row_with_a_verdict() {
        assert_eq!(table(&people(1)), "");
        let text = table(&people(10));
        let rows: Vec<&str> = text.lines().collect();
        assert_eq!(rows.len(), 10, "{text}");
        let one = "         1       99        0      120   98.5 %        -  no reason for doubt";
        assert_eq!(rows[1], one);
        assert!(rows[2].contains("4.2  may be wrong: "), "{text}");
        assert!(rows[9].contains("and 2 with fewer frames"), "{text}");
    }
}
