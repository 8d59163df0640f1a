//! Texts for the user about how far the results can be trusted.

use core::fmt::Write as _;

use runfiles::{Summary, Trust};

/// Returns true if cameras contradict each other or the calibration.
pub(super) fn are_cameras_doubtful(summary: &Summary) -> bool {
    let mut fits = summary.calibration.values();
    summary.exchanged.is_some()
        || summary.contradicted.is_some()
        || fits.any(|fit| fit.suspected || fit.out_of_step)
}

/// Returns the reasons not to trust the results, which were found in the results themselves: first those for the followed person.
pub(super) fn doubts(summary: &Summary) -> Vec<String> {
    let people = &summary.people;
    let others = people.each.iter().filter(|person| !people.followed.contains(&person.id));
    let of_others = others.flat_map(|person| {
        let doubts = person.trust.doubts_of_another().into_iter();
        doubts.map(|doubt| format!("person {}: {doubt}", person.id))
    });
    let own = summary.trust.doubts();
    own.iter().map(ToString::to_string).chain(of_others).collect()
}

/// Returns the verdict on the results.
pub(super) fn verdict(summary: &Summary, doubts: &[String]) -> &'static str {
    if !doubts.is_empty() || are_cameras_doubtful(summary) {
        "the results may be wrong"
    } else if summary.trust.frames < Trust::MIN_FRAMES {
        "too few frames to judge"
    } else {
        "no reason to doubt the results"
    }
}

/// Returns the reprojection error, the verdict in one line, and a line for every reason to doubt the results.
pub(super) fn text(summary: &Summary, doubts: &[String]) -> String {
    let trust = &summary.trust;
    let verdict = verdict(summary, doubts);
    let mut text = summary.reprojection_px.map_or_else(String::new, |px| {
        format!("  reprojection  {px:.2} px (rms over all joints)\n")
    });
    // Writing to a string cannot fail.
    let _infallible = writeln!(text, "  trust         {verdict}: {}", trust.text());
    for doubt in doubts {
        let _infallible = writeln!(text, "    {doubt}");
    }
    text
}

#[cfg(test)]
mod tests {
    use runfiles::{People, PersonSummary};

    use super::*;

    #[test]
    fn a_person_who_is_not_followed_can_be_doubtful() {
        let person = |id, reprojection| PersonSummary {
            id,
            trust: Trust {
                frames: 100,
                reprojection: Some(reprojection),
                ..Trust::default()
            },
            ..PersonSummary::default()
        };
        let summary = |reprojection| Summary {
            people: People {
                each: vec![person(1, 0.2), person(2, reprojection)],
                followed: vec![1],
                ..People::default()
            },
            ..Summary::default()
        };
        // The numbers of the followed person are those of the whole run.
        assert_eq!(doubts(&summary(0.09)), Vec::<String>::new());
        let doubts = doubts(&summary(0.11));
        assert_eq!(doubts.len(), 1);
        assert!(
            doubts[0].starts_with("person 2: 3D joints are 11 % of"),
            "{doubts:?}"
        );
        assert_eq!(verdict(&summary(0.11), &doubts), "the results may be wrong");
    }
}
