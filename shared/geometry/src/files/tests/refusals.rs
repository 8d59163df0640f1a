//! Tests of invalid files: every error names the file, the field and the number.

use std::error::Error as _;

use super::*;

/// Asserts that a text is refused with an error that contains all of `words`.
fn refused(result: Result<Rig, ParseError>, words: &[&str]) {
    let text = failure::wording::in_one_line(&result.expect_err("must be refused"));
    for word in words {
        assert!(text.contains(word), "{word:?} is not in {text:?}");
    }
}

fn own_text() -> String {
    own::write(&ring_rig(2, BARREL))
}

fn edited(text: &str, key: &str, line: &str) -> String {
    let mut done = false;
    let swap = |old: &str| {
        if !done && old.starts_with(key) {
            done = true;
            return format!("{line}\n");
        }
        format!("{old}\n")
    };
    let text = text.lines().map(swap).collect();
    assert!(done, "no line starts with {key}");
    text
}

#[test]
fn errors_of_the_parallax_format_name_the_field() {
    let with = |key: &str, line: &str| {
        own::parse(&edited(&own_text(), key, line), &ReadOptions::default())
    };
    refused(with("size_px", ""), &["size_px"]);
    refused(with("size_px", "size = [1, 2]"), &["unknown field `size`"]);
    refused(
        with("focal_px", "focal_px = [nan, 700.0]"),
        &["cam0", "focal_px", "NaN"],
    );
    refused(
        with("focal_px", "focal_px = [-3.0, 700.0]"),
        &["cam0", "-3"],
    );
    refused(
        with("radial", "radial = [1, 2, 3, 4, 5, 6, 7]"),
        &["cam0", "radial", "7 numbers"],
    );
    refused(with("lens", "lens = \"pinhole\""), &["cam0", "tangential"]);
    refused(
        with("rotation_rad", ""),
        &["cam0", "rotation_rad is missing"],
    );
    refused(
        with(
            "rotation_rad",
            "rotation = [[1, 0, 0], [0, 1, 0], [0, 0, -1]]",
        ),
        &["cam0", "rotation", "the determinant is -1"],
    );
    refused(
        with("translation_metres", "translation_metres = [1, inf, 0]"),
        &["cam0", "translation_metres", "inf"],
    );
    refused(
        with("name", "name = \"cam1\""),
        &["two cameras are named \"cam1\""],
    );
    refused(with("up", "up = [0, 0, 0]"), &["up is 0"]);
    refused(with("up", "up = [0, 0, 1e200]"), &["up is inf"]);
    refused(with("format", "format = \"other\""), &["format", "other"]);
    refused(
        own::parse("format = \"parallax-rig\"", &ReadOptions::default()),
        &["no camera"],
    );
}

/// Returns a Pose2Sim file with one line replaced.
fn pose2sim_with(key: &str, line: &str) -> Result<Rig, ParseError> {
    let text = pose2sim::write(&ring_rig(2, BARREL)).expect("writable");
    pose2sim::parse(&edited(&text, key, line), &ReadOptions::default())
}

#[test]
fn errors_of_pose2sim_intrinsics_name_the_field() {
    let with = pose2sim_with;
    refused(with("size", ""), &["cam0.size is missing"]);
    refused(with("size", "size = [640.5, 480]"), &["cam0.size", "640.5"]);
    refused(with("size", "size = [640]"), &["cam0.size", "1 numbers"]);
    let k = |line: &str| with("matrix", &format!("matrix = {line}"));
    refused(
        k("[[700, 3, 320], [0, 700, 240], [0, 0, 1]]"),
        &["cam0.matrix[0][1]", "3", "skew"],
    );
    refused(
        k("[[700, 0, 320], [0, 700, 240], [0, 0, 2]]"),
        &["cam0.matrix[2][2]", "2"],
    );
    refused(
        k("[[700, 0, \"x\"], [0, 700, 240], [0, 0, 1]]"),
        &["cam0.matrix[0][2]", "x"],
    );
    refused(k("[[700, 0, 320]]"), &["cam0.matrix", "1 rows"]);
    let distortions = |line: &str| with("distortions", &format!("distortions = {line}"));
    refused(distortions("[0.1, 0.2, 0.3]"), &["cam0.distortions", "0.3"]);
    refused(distortions("[inf, 0, 0, 0]"), &["cam0.distortions", "inf"]);
    let five = pose2sim::write(&ring_rig(1, BARREL)).expect("writable");
    let five = edited(
        &edited(&five, "distortions", "distortions = [0, 0, 0, 0, 0]"),
        "fisheye",
        "fisheye = true",
    );
    refused(
        pose2sim::parse(&five, &ReadOptions::default()),
        &["cam0.distortions", "fisheye", "5 numbers"],
    );
}

#[test]
fn errors_of_pose2sim_poses_name_the_field() {
    let with = pose2sim_with;
    refused(
        with("rotation", "rotation = [[2, 0, 0], [0, 1, 0], [0, 0, 1]]"),
        &["cam0.rotation", "not a rotation"],
    );
    refused(
        with("rotation", "rotation = [0, 0, 12000]"),
        &["cam0.rotation", "12000", "radians"],
    );
    refused(
        with("translation", "translation = 3"),
        &["cam0.translation", "integer"],
    );
    refused(with("name", "name = 3"), &["cam0.name", "integer"]);
    refused(
        pose2sim::parse("[a]\nb = 1", &ReadOptions::default()),
        &["no camera"],
    );
    refused(
        pose2sim::parse("[a\nb = 1", &ReadOptions::default()),
        &["TOML", "line 1"],
    );
}

#[test]
fn errors_of_number_lists_name_the_count_and_the_line() {
    let cal = humaneva::write(&ring_rig(1, BARREL).cameras()[0]).expect("writable");
    let read = |text: &str| humaneva::parse("C1", text, &ReadOptions::default());
    refused(read(&(cal.clone() + "1\n")), &["22 numbers", "23 numbers"]);
    refused(read(""), &["22 numbers", "0 numbers"]);
    refused(read("1 2 3 4"), &["4 numbers"]);
    refused(
        read(&cal.replacen("700.0", "seven", 1)),
        &["line 1", "seven"],
    );
    refused(read(&cal.replacen("700.0", "nan", 1)), &["line 1", "NaN"]);
    let skewed: Vec<&str> = cal
        .lines()
        .enumerate()
        .map(|(i, line)| if i == 4 { "0.01" } else { line })
        .collect();
    refused(read(&skewed.join("\n")), &["skew", "7"]);
    let ini = umpm::write(&ring_rig(1, BARREL).cameras()[0]);
    let ini = ini.expect("writable");
    let read = |text: &str| umpm::parse("l", text, &ReadOptions::default());
    refused(read(&(ini.clone() + "1")), &["19 numbers", "20 numbers"]);
    refused(read("1"), &["1 numbers"]);
    refused(
        read(&ini.replacen("241.0", "-9e9", 1)),
        &["\"l\"", "-9000000000"],
    );
}

#[test]
fn errors_of_opencv_name_the_field() {
    let text = opencv::write(&ring_rig(1, BARREL)).expect("writable");
    let read = |text: &str| opencv::parse(&[("x", text)], &ReadOptions::default());
    refused(read(&edited(&text, "W_cam0", "")), &["W_cam0 is missing"]);
    refused(read(&edited(&text, "W_cam0", "W_cam0: wide")), &["W_cam0"]);
    refused(
        read(&edited(&text, "K_cam0", "Q: !!opencv-matrix")),
        &["K_cam0 is missing"],
    );
    refused(
        read(&edited(&text, "   rows: 3", "   rows: 4")),
        &["K_cam0", "9 numbers for 4 rows and 3 columns"],
    );
    refused(read("%YAML:1.0\n---\nnames: 3\n"), &["names"]);
    refused(read("%YAML:1.0\n---\nnames: []\n"), &["no camera"]);
    refused(read("{ not yaml"), &["YAML"]);
    refused(read("a: 1"), &["camera_matrix"]);
    refused(read(""), &[]);
}

#[test]
fn errors_of_qualisys_name_the_field() {
    let text = |transform: &str, rest: &str| {
        format!(
            r#"<calibration><cameras><camera active="1" serial="one" viewrotation="0"><fov_video left="0" top="0" right="1087" bottom="1919"/>
            <transform x="1000" y="-2000" z="500" r11="1" r12="0" r13="0" r21="0" r22="0" r23="1" r31="0" {transform}/>
            <intrinsic focalLengthU="64000" focalLengthV="64640" centerPointU="34816" centerPointV="61440"
            radialDistortion1="0" radialDistortion2="0" radialDistortion3="0" tangentalDistortion1="0" tangentalDistortion2="0" {rest}/>
            </camera></cameras></calibration>"#
        )
    };
    let good = r#"r32="-1" r33="0""#;
    let read = |text: &str| qualisys::parse(text, &ReadOptions::default());
    read(&text(good, "")).expect("nothing is wrong");
    refused(
        read(&text(r#"r32="1" r33="0""#, "")),
        &["one", "r11 to r33", "the determinant is -1"],
    );
    refused(
        read(&text(r#"r32="x" r33="0""#, "")),
        &["one", "transform r32", "x"],
    );
    refused(
        read(&text(r#"r32="-1""#, "")),
        &["transform r33 is missing"],
    );
    refused(read(&text(good, r#"skew="2""#)), &["intrinsic skew", "2"]);
    refused(
        read(&text(good, "").replace("viewrotation=\"0\"", "viewrotation=\"90\"")),
        &["viewrotation", "90"],
    );
    refused(
        read(&text(good, "").replace("right=\"1087\"", "right=\"-1\"")),
        &["fov_video", "0"],
    );
    refused(
        read(&text(good, "").replace("active=\"1\"", "active=\"0\"")),
        &["no camera"],
    );
    refused(read("<calibration>"), &["XML"]);
}

#[test]
fn errors_of_panoptic_name_the_field() {
    let with = |from: &str, to: &str| {
        assert!(PANOPTIC.contains(from), "{from}");
        panoptic::parse(&PANOPTIC.replacen(from, to, 1), &ReadOptions::default())
    };
    refused(
        with("[0, 1498.5,", "[3, 1498.5,"),
        &["00_00", "K[1][0]", "3"],
    );
    refused(
        with("1500.5, 0,", "1500.5, 0.5,"),
        &["00_00", "K[0][1]", "skew"],
    );
    refused(
        with("[1920, 1080]", "[1920, 0]"),
        &["00_00", "resolution", "0"],
    );
    refused(with("-0.25, 0.125, ", ""), &["00_00", "distCoef"]);
    refused(
        with("[[1, 0, 0]", "[[2, 0, 0]"),
        &["00_00", "R", "not a rotation"],
    );
    refused(
        with("[[50], [120], [300]]", "[50, 120]"),
        &["JSON", "three numbers"],
    );
    refused(
        with("\"50_07\"", "\"00_00\""),
        &["two cameras are named \"00_00\""],
    );
    refused(with("\"K\"", "\"k\""), &["JSON", "missing field `K`"]);
    let none = r#"{ "cameras": [] }"#;
    refused(
        panoptic::parse(none, &ReadOptions::default()),
        &["no camera"],
    );
}

#[test]
fn errors_name_the_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("broken.cal");
    std::fs::write(&path, "1 2 3").expect("writable");
    let options = ReadOptions::default();
    let text = failure::wording::in_one_line(&read(&path, &options).expect_err("3 numbers"));
    assert!(
        text.contains("broken.cal") && text.contains("3 numbers"),
        "{text}"
    );
    let text = failure::wording::in_one_line(
        &read(&folder.path().join("absent.toml"), &options).expect_err("absent"),
    );
    assert!(text.contains("absent.toml"), "{text}");
    let other = folder.path().join("notes.txt");
    std::fs::write(&other, "hello").expect("writable");
    assert!(matches!(
        read(&other, &options),
        Err(RigFileError::UnknownFormat { .. })
    ));
    let own = folder.path().join("own.toml");
    std::fs::write(&own, own_text()).expect("writable");
    assert!(matches!(
        read_many(&[&own, &path], &options),
        Err(RigFileError::Mixed { .. })
    ));
    assert!(matches!(
        read_many(&[], &options),
        Err(RigFileError::NoFiles)
    ));
    let twice = read_many(&[&own, &own], &options).expect_err("two of a name");
    assert!(
        failure::wording::in_one_line(&twice).contains("two cameras are named"),
        "{twice}"
    );
    let large = folder.path().join("large.toml");
    std::fs::File::create(&large)
        .and_then(|file| file.set_len(LARGEST_FILE + 1))
        .expect("sparse");
    assert!(matches!(
        read(&large, &options),
        Err(RigFileError::TooLarge { .. })
    ));
    std::fs::write(&other, [0xff, 0xfe]).expect("writable");
    assert!(matches!(
        read(&other, &options),
        Err(RigFileError::Read { .. })
    ));
}

#[test]
fn writing_a_rig_that_the_format_cannot_describe_is_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let fisheye = ring_rig(1, LensModel::KannalaBrandt { k: [0.1; 4] });
    let cause = |format: Format, rig: &Rig| {
        let error = write(folder.path(), format, rig).expect_err("cannot be described");
        error.source().map(ToString::to_string).unwrap_or_default()
    };
    assert!(cause(Format::HumanEva, &fisheye).contains("Kannala-Brandt"));
    assert!(cause(Format::Umpm, &fisheye).contains("Kannala-Brandt"));
    assert!(cause(Format::Qualisys, &fisheye).contains("not written"));
    assert!(cause(Format::Panoptic, &fisheye).contains("not written"));
    let named = |name: &str| {
        let mut cameras = ring_rig(1, BARREL).cameras().to_vec();
        cameras[0].name = name.to_owned();
        Rig::new(cameras, None, "").expect("a rig")
    };
    assert!(cause(Format::OpenCv, &named("a b")).contains("a b"));
    assert!(cause(Format::Pose2Sim, &named("metadata")).contains("metadata"));
    let mut cameras = ring_rig(1, BARREL).cameras().to_vec();
    "../C1".clone_into(&mut cameras[0].name);
    let refused = Rig::new(cameras, None, "").expect_err("the name leaves the folder");
    assert!(refused.to_string().contains("../C1"));
    let absent = folder.path().join("no/such/folder.toml");
    assert!(matches!(
        write(&absent, Format::Own, &fisheye),
        Err(RigFileError::Write { .. })
    ));
}
