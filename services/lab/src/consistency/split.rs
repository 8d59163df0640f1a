//! Split of sequences into training and held-out sequences.

use failure::{ExitKind, Failure};
use training::datasets::sequences::Sequence;

/// Splits sequences into training sequences and held-out sequences, on which the weights are chosen.
pub(super) fn split(
    all: Vec<Sequence>,
    hold_out: &[String],
) -> Result<(Vec<Sequence>, Vec<Sequence>), Failure> {
    let mut subjects: Vec<&str> = all.iter().map(|sequence| sequence.subject.as_str()).collect();
    subjects.sort_by_key(|subject| (subject.len(), *subject));
    subjects.dedup();
    if let Some(unknown) = hold_out.iter().find(|subject| !subjects.contains(&subject.as_str())) {
        let known = subjects.join(", ");
        let message =
            format!("--hold-out: there is no subject {unknown:?}; the subjects are {known}");
        return Err(Failure::new(ExitKind::Usage, message));
    }
    let held: Vec<String> = if hold_out.is_empty() {
        let n = subjects.len().div_ceil(4);
        let last = subjects.iter().rev().take(n);
        last.map(|subject| (*subject).to_owned()).collect()
    } else {
        hold_out.to_vec()
    };
    let (held, train): (Vec<_>, Vec<_>) =
        all.into_iter().partition(|sequence| held.contains(&sequence.subject));
    if train.is_empty() {
        let message = "all subjects are held out: no subject is left for training";
        let failure = Failure::new(ExitKind::Usage, message);
        return Err(failure.with_hint("sequences of at least two subjects are needed"));
    }
    Ok((train, held))
}

/// Checks that all sequences have the same cameras.
pub(super) fn one_rig(all: &[&Sequence], rig: &str) -> Result<(), Failure> {
    let cameras = |sequence: &Sequence| -> Vec<String> {
        let views = sequence.views.iter();
        views.map(|view| view.camera.clone()).collect()
    };
    for pair in all.windows(2) {
        if cameras(pair[0]) != cameras(pair[1]) {
            let other = pair[1];
            let message = format!(
                "--rig {rig}: {} {} does not have the same cameras as the previous sequence",
                other.dataset, other.name
            );
            return Err(Failure::new(ExitKind::Usage, message));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use geometry::Rig;
    use skeleton::PARSE14;

    use super::*;

    /// A rig with one camera, whose image size does not matter here.
    fn rig() -> Rig {
        let camera = geometry::Camera {
            name: "c1".to_owned(),
            intrinsics: geometry::Intrinsics {
                fx: 300.0,
                fy: 300.0,
                cx: 160.0,
                cy: 120.0,
                size: [320, 240],
                lens: geometry::Lens::default(),
            },
            camera_from_world: nalgebra::Isometry3::identity(),
        };
        Rig::new(vec![camera], None, "made up").unwrap()
    }

    fn sequence(subject: &str) -> Sequence {
        Sequence {
            name: subject.to_owned(),
            dataset: String::new(),
            subject: subject.to_owned(),
            action: String::new(),
            rig: rig(),
            views: Vec::new(),
            frame_rate_hz: None,
            joints: &PARSE14,
            frames: Vec::new(),
        }
    }

    fn held(subjects: &[&str], hold_out: &[&str]) -> Result<Vec<String>, String> {
        let all = subjects.iter().map(|subject| sequence(subject)).collect();
        let hold_out: Vec<String> =
            hold_out.iter().map(|hold_out| (*hold_out).to_owned()).collect();
        let (_, held) = split(all, &hold_out).map_err(|error| error.to_string())?;
        Ok(held.into_iter().map(|held| held.subject).collect())
    }

    #[test]
    fn the_last_quarter_of_the_subjects_is_held_out() {
        let subjects = ["s1", "s2", "s3", "s9", "s10", "s10", "s4", "s5"];
        assert_eq!(held(&subjects, &[]).unwrap(), ["s9", "s10", "s10"]);
        assert_eq!(held(&["s1", "s2"], &["s1"]).unwrap(), ["s1"]);
    }

    #[test]
    fn at_least_one_subject_must_remain_for_training() {
        assert!(held(&["s1"], &[]).unwrap_err().contains("no subject is left"));
        let said = held(&["s1", "s2"], &["s3"]).unwrap_err();
        assert!(
            said.contains("no subject \"s3\"; the subjects are s1, s2"),
            "{said}"
        );
    }
}
