//! Texts that TOML reads differently from what the user meant, and files of other programs given as a deployment.

/// Returns the message for a text that is not a deployment; `None` if it may be one.
pub(super) fn other_file(text: &str) -> Option<&'static str> {
    let begins =
        |head: &str| text.lines().any(|line| line.trim_end() == head || line.starts_with(head));
    if begins("format = \"parallax-rig\"") {
        return Some(
            "this is a rig file: give the deployment file whose key `rig` names this rig file",
        );
    }
    // Sections of Pose2Sim's Config.toml.
    let sections = [
        "[project]",
        "[pose]",
        "[synchronization]",
        "[personAssociation]",
        "[triangulation]",
        "[filtering]",
        "[kinematics]",
    ];
    let n = sections.iter().filter(|section| begins(section)).count();
    (n >= 3 && !begins("[[camera]]")).then_some(
        "this is a configuration of Pose2Sim, but a deployment is expected, which names the cameras, their videos and the calibration. \
         `parallax new FOLDER \
         --camera cam01=videos/cam01.mp4 --camera cam02=videos/cam02.mp4 --rig calibration/Calib.toml` writes a deployment for these files",
    )
}

/// Returns the message for a line that the reader refuses; `None` if the mistake is not a common one.
pub(super) fn of_line(line: &str) -> Option<&'static str> {
    let value = line.split_once('=').map_or(line, |parts| parts.1).trim();
    if value.starts_with('"') && value.contains('\\') {
        return Some(ESCAPE);
    }
    let inside = value.strip_prefix('[')?.split(']').next()?;
    let mut words = inside.split_whitespace();
    let is_number = |text: &str| text.parse::<f64>().is_ok();
    let has_no_commas = inside.split_whitespace().count() > 1 && words.all(is_number);
    has_no_commas.then_some("the numbers of a list need commas between them: [0, 0, 1]")
}

/// Message for a path with control characters, which a backslash produces in double quotes.
pub(super) const ESCAPE: &str = "a backslash in \"...\" begins a special character: write / instead, as in \"C:/videos/a.mp4\", or put the \
    path in single quotes, 'C:\\videos\\a.mp4'";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn common_mistakes_are_explained() {
        assert_eq!(of_line(r#"source = "C:\Users\me\a.mp4""#), Some(ESCAPE));
        assert!(of_line("up = [0 0 1]").is_some());
        for fine in [
            "up = [0, 0, 1]",
            "source = 'C:\\a.mp4'",
            "up = [1]",
            "x",
            "",
        ] {
            assert_eq!(of_line(fine), None, "{fine}");
        }
    }

    #[test]
    fn files_of_other_programs_are_recognised() {
        let pose2sim =
            "[project]\nmulti_person = false\n[pose]\n[synchronization]\n[triangulation]\n";
        assert!(other_file(pose2sim).is_some_and(|hint| hint.contains("Pose2Sim")));
        assert_eq!(other_file("[pose]\nthreads = 2\n[[camera]]\n"), None);
    }
}
