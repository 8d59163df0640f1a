//! Tests of files with the lens of a camera but not its pose, and of unusual units.

use super::*;

const LENSES: ReadOptions = ReadOptions {
    unit: None,
    up: None,
    size: None,
    lenses_suffice: true,
};

/// Output of `OpenCV`'s calibration program for one lens, with invented numbers.
const LENS: &str = "%YAML:1.0\n---\ncalibration_time: \"Mon\"\nimage_width: 1280\nimage_height: 720\nflags: 0\nfisheye_model: 0
camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 900., 0., 618., 0., 900., 390., 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix\n   rows: 4\n   cols: 1\n   dt: d\n   data: [ -0.33, 0.046, -0.0043, 0.0041 ]\n";

const PLACE: &str = "R: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [ 0., 0., 0. ]
T: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [ 0., 0., 0. ]\n";

/// A `camera_info` of ROS, whose `R` rectifies.
const ROS: &str = "image_width: 640\nimage_height: 480\ncamera_name: left\ndistortion_model: equidistant\nD: [-0.33, 0.046, -0.0043, 0.0041]
K: [500.0, 0.0, 320.0, 0.0, 500.0, 240.0, 0.0, 0.0, 1.0]\nR: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [500.0, 0.0, 320.0, 0.0, 0.0, 500.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0]\n";

const XML: &str = "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_width>1280</image_width>\n<image_height>720</image_height>
<camera_matrix type_id=\"opencv-matrix\">\n  <rows>3</rows>\n  <cols>3</cols>\n  <dt>d</dt>\n  <data>\n    900. 0. 618. 0. 900. 390. 0. 0. 1.</data></camera_matrix>
<distortion_coefficients type_id=\"opencv-matrix\"><rows>4</rows><cols>1</cols><dt>d</dt><data>-0.33 0.046 -0.0043 0.0041</data></distortion_coefficients>
</opencv_storage>\n";

const FISHEYE: LensModel = LensModel::KannalaBrandt {
    k: [-0.33, 0.046, -0.0043, 0.0041],
};
const BENT: LensModel = LensModel::BrownConrady {
    k: [-0.33, 0.046, 0.0, 0.0, 0.0, 0.0],
    p: [-0.0043, 0.0041],
};

/// Reads a file with the option `lenses_suffice`. Returns the rig, and the error that the file gives without this option.
fn read_lens(name: &str, text: &str) -> (Rig, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    let refused = read(&path, &ReadOptions::default()).unwrap_err();
    let why = std::error::Error::source(&refused).unwrap().to_string();
    (read(&path, &LENSES).unwrap(), why)
}

#[test]
fn a_camera_without_a_pose_is_accepted_if_only_the_lens_is_needed() {
    let json = r#"{"camera_matrix": [[900, 0, 618], [0, 900, 390], [0, 0, 1]], "dist_coeff": [[-0.33, 0.046, -0.0043, 0.0041]],
        "image_width": 1280, "image_height": 720}"#;
    for (name, text, lens) in [
        ("lens.yml", LENS, BENT),
        ("lens.xml", XML, BENT),
        ("lens.json", json, BENT),
        ("left.yaml", ROS, FISHEYE),
    ] {
        let (rig, why) = read_lens(name, text);
        assert_eq!(*rig.cameras()[0].intrinsics.lens.model(), lens, "{name}");
        assert_eq!(rig.left_out().len(), 1);
        assert!(
            why.contains("a lens but no pose") && why.contains("calibrate board"),
            "{why}"
        );
        // The same is true for Parallax's own format.
        let (again, _) = read_lens("rig.toml", &own::write(&rig));
        assert_same_cameras(&again, &rig);
    }
}

#[test]
fn keys_of_opencv_and_ros_files_identify_fisheye_lenses() {
    let fisheye = LENS.replace("fisheye_model: 0", "fisheye_model: 1") + PLACE;
    let lens = |text: &str| {
        let rig = opencv::parse(&[("a", text)], &LENSES).unwrap();
        *rig.cameras()[0].intrinsics.lens.model()
    };
    assert_eq!(lens(&fisheye), FISHEYE);
    assert_eq!(lens(&(LENS.to_owned() + PLACE)), BENT);
    assert_eq!(lens(&ROS.replace("equidistant", "plumb_bob")), BENT);
    let odd = ROS.replace("equidistant", "omnidirectional");
    let refused = opencv::parse(&[("a", &odd)], &LENSES).unwrap_err();
    assert!(refused.to_string().contains("omnidirectional"), "{refused}");
    // An incomplete pose is a mistake.
    let half = LENS.to_owned() + &PLACE[PLACE.find("T:").unwrap()..];
    let refused = opencv::parse(&[("a", &half)], &LENSES).unwrap_err();
    assert!(refused.to_string().contains("is missing"), "{refused}");
}

#[test]
fn cameras_without_a_pose_are_left_out_of_a_rig() {
    let camera = |name: &str, place: &str| {
        format!(
            "[cameras.{name}]\nsize = [1280, 720]\nmatrix = [[900.0, 0.0, 640.0], [0.0, 900.0, 360.0], [0.0, 0.0, 1.0]]
distortions = [0.0, 0.0, 0.0, 0.0]\n{place}\n"
        )
    };
    let placed = "rotation = [0.0, 0.0, 0.0]\ntranslation = [0.0, 0.0, 1.0]";
    for missing in ["", "rotation = \"null\"\ntranslation = \"null\""] {
        let text = camera("0", placed) + &camera("1", missing);
        let rig = pose2sim::parse(&text, &ReadOptions::default()).unwrap();
        assert_eq!(rig.cameras().len(), 1);
        assert_eq!(rig.left_out()[0].camera, "cam_1");
        let notes: Vec<String> = check(&rig).iter().map(ToString::to_string).collect();
        assert!(notes[0].contains("cam_1 is left out"), "{notes:?}");
        assert!(rig.lacks("cam_1").contains("a lens but no pose"));
        assert!(rig.lacks("cam_9").contains("it has cam_0"));
        let both = pose2sim::parse(&text, &LENSES).unwrap();
        assert_eq!(both.cameras().len(), 2);
    }
    let half = camera("0", "rotation = [0.0, 0.0, 0.0]");
    let refused = pose2sim::parse(&half, &ReadOptions::default()).unwrap_err();
    assert!(
        refused.to_string().contains("translation is missing"),
        "{refused}"
    );
}

#[test]
fn a_camera_without_a_pose_has_a_name_of_its_own() {
    let camera = |key: &str, rest: &str| {
        format!(
            "[{key}]\nname = \"a\"\nsize = [1280, 720]\nmatrix = [[900.0, 0.0, 640.0], [0.0, 900.0, 360.0], [0.0, 0.0, 1.0]]\n\
             distortions = [0.0, 0.0, 0.0, 0.0]\n{rest}\n"
        )
    };
    let placed = camera(
        "first",
        "rotation = [0.0, 0.0, 0.0]\ntranslation = [0.0, 0.0, 1.0]",
    );
    let alone = pose2sim::parse(&camera("second", ""), &LENSES).unwrap();
    assert_eq!((alone.cameras().len(), alone.left_out().len()), (1, 1));
    for options in [LENSES, ReadOptions::default()] {
        let refused = pose2sim::parse(&(placed.clone() + &camera("second", "")), &options);
        let Err(ParseError::Rig(crate::RigError::DuplicateName { name })) = refused else {
            panic!("{refused:?}");
        };
        assert_eq!(name, "a");
    }
}

#[test]
fn units_are_given_by_name_or_as_a_length() {
    let metres = |text: &str| text.parse().map(|unit: Unit| 1.0 / unit.per_metre());
    for (text, expected) in [
        ("m", 1.0),
        ("cm", 0.01),
        ("mm", 0.001),
        ("ft", 0.3048),
        ("in", 0.0254),
        ("30mm", 0.03),
        ("2.5 cm", 0.025),
        ("1in", 0.0254),
    ] {
        assert!((metres(text).unwrap() - expected).abs() < 1e-12, "{text}");
    }
    for wrong in ["", "foot", "30", "0mm", "-1m", "1e9m", "..mm", "mm30"] {
        let refused = wrong.parse::<Unit>().unwrap_err().to_string();
        assert!(refused.contains("30mm"), "{refused}");
    }
}
