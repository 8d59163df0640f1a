//! Tests that every format reads back its own output, and refuses invalid files.

use nalgebra::Vector3;
use proptest::prelude::*;

use super::*;
use crate::{
    Camera, Lens, LensModel,
    testing::{camera, ring_rig, z_up},
};

mod extremes;
mod fuzz;
mod no_place;
mod refusals;

const BARREL: LensModel = LensModel::BrownConrady {
    k: [-0.29, 0.1, 0.0, 0.0, 0.0, 0.0],
    p: [0.001, -0.002],
};

/// Two cameras in the format of CMU Panoptic, with invented numbers.
const PANOPTIC: &str = r#"{ "calibDataSource": "made up", "cameras": [
    { "name": "00_00", "type": "hd", "resolution": [1920, 1080], "panel": 0, "node": 0,
      "K": [[1500.5, 0, 950.25], [0, 1498.5, 545.75], [0, 0, 1]],
      "distCoef": [-0.25, 0.125, 0.001, -0.002, 0.0625],
      "R": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "t": [[50], [120], [300]] },
    { "name": "50_07", "type": "kinect-color", "resolution": [640, 480], "panel": 50, "node": 7,
      "K": [[745.5, 0, 367.5], [0, 745.25, 233.25], [0, 0, 1]], "distCoef": [0, 0, 0, 0, 0],
      "R": [[0, 0, -1], [0, 1, 0], [1, 0, 0]], "t": [-20.5, 110, 280] } ] }"#;

#[test]
fn panoptic_is_in_centimetres_with_y_down() {
    let path = Path::new("calibration.json");
    assert_eq!(detect(path, PANOPTIC), Some(Format::Panoptic));
    let rig = panoptic::parse(PANOPTIC, &ReadOptions::default()).expect("two cameras");
    let [a, b] = rig.cameras() else {
        panic!("{rig:?}")
    };
    assert_eq!([a.name.as_str(), &b.name], ["00_00", "50_07"]);
    assert_eq!(
        [a.intrinsics.size, b.intrinsics.size],
        [[1920, 1080], [640, 480]]
    );
    let k = [-0.25, 0.125, 0.0625, 0.0, 0.0, 0.0];
    let lens = LensModel::BrownConrady {
        k,
        p: [0.001, -0.002],
    };
    assert_eq!(*a.intrinsics.lens.model(), lens);
    assert_eq!(*b.intrinsics.lens.model(), LensModel::Pinhole);
    let at = Vector3::new(0.5, 1.2, 3.0);
    assert!((a.camera_from_world.translation.vector - at).norm() < 1e-12);
    // R maps the world's x axis to the camera's z axis; t may be a plain list of three.
    let x = b.camera_from_world * nalgebra::Point3::new(1.0, 0.0, 0.0);
    assert!(
        (x.coords - Vector3::new(-0.205, 1.1, 3.8)).norm() < 1e-12,
        "{x}"
    );
    assert_eq!(rig.up_in_world(), Some(-Vector3::y_axis()));
    // A level camera needs no roll.
    assert!(crate::upright_roll(a, &rig).expect("up").abs() < 0.02);
    let metres = ReadOptions {
        unit: Some(Unit::Metres),
        ..ReadOptions::default()
    };
    let rig = panoptic::parse(PANOPTIC, &metres).expect("two cameras");
    assert_eq!(rig.cameras()[0].camera_from_world.translation.x, 50.0);
}

/// Generates one to four cameras with names that any format can write.
fn rig() -> impl Strategy<Value = Rig> {
    prop::collection::vec((camera(), 1_u32..5000, 1_u32..5000), 1..4).prop_map(|cameras| {
        let named = |(i, (mut camera, width, height)): (usize, (Camera, u32, u32))| {
            // The names are descending, so that a reader that sorts them fails.
            camera.name = format!("cam_{:02}", 10 - i);
            camera.intrinsics.size = [width.max(400), height.max(300)];
            camera
        };
        let cameras = cameras.into_iter().enumerate().map(named).collect();
        Rig::new(cameras, Some(z_up()), "made up \"here\"\nby a test").expect("a rig")
    })
}

/// Compares cameras. A lens without distortion equals a pinhole; poses are equal up to rounding.
fn assert_same_cameras(read: &Rig, written: &Rig) {
    assert_eq!(read.cameras().len(), written.cameras().len());
    for (read, written) in read.cameras().iter().zip(written.cameras()) {
        assert_eq!(read.name, written.name);
        let plain = |camera: &Camera| {
            let lens = *camera.intrinsics.lens.model();
            if lens.is_pinhole() {
                LensModel::Pinhole
            } else {
                lens
            }
        };
        assert_eq!(plain(read), plain(written));
        let mut intrinsics = read.intrinsics;
        intrinsics.lens = written.intrinsics.lens;
        assert_eq!(intrinsics, written.intrinsics);
        let difference = read.camera_from_world.inverse() * written.camera_from_world;
        assert!(difference.translation.vector.norm() < 1e-12, "{difference}");
        assert!(difference.rotation.angle() < 1e-7, "{difference}");
    }
}

/// Returns the camera with at most `n` radial coefficients.
fn with_simpler_lens(mut camera: Camera, n: usize) -> Camera {
    let lens = match *camera.intrinsics.lens.model() {
        LensModel::BrownConrady { mut k, p } => {
            k[n..].fill(0.0);
            LensModel::BrownConrady { k, p }
        }
        LensModel::Pinhole | LensModel::KannalaBrandt { .. } => LensModel::Pinhole,
    };
    camera.intrinsics.lens = Lens::new(lens);
    camera
}

proptest! {
    #[test]
    fn the_parallax_format_reads_back_what_was_written(rig in rig()) {
        let read = own::parse(&own::write(&rig), &ReadOptions::default()).expect("our own");
        assert_same_cameras(&read, &rig);
        prop_assert_eq!(read.up_in_world(), rig.up_in_world());
        prop_assert_eq!(read.source(), rig.source());
    }

    #[test]
    fn pose2sim_reads_back_what_was_written(rig in rig()) {
        let read = pose2sim::parse(&pose2sim::write(&rig).expect("writable"), &ReadOptions::default());
        assert_same_cameras(&read.expect("as written"), &rig);
    }

    #[test]
    fn opencv_reads_back_what_was_written(rig in rig()) {
        let text = opencv::write(&rig).expect("writable");
        let read = opencv::parse(&[("", &text)], &ReadOptions::default());
        assert_same_cameras(&read.expect("as written"), &rig);
    }

    #[test]
    fn humaneva_reads_back_what_was_written(camera in camera()) {
        let camera = with_simpler_lens(camera, 3);
        let text = humaneva::write(&camera).expect("writable");
        let read = humaneva::parse("a", &text, &ReadOptions::default()).expect("as written");
        assert_same_cameras(&read, &Rig::new(vec![camera], None, "").expect("a rig"));
    }

    #[test]
    fn umpm_reads_back_what_was_written(camera in camera()) {
        let camera = with_simpler_lens(camera, 2);
        let text = umpm::write(&camera).expect("writable");
        let options = ReadOptions { size: Some([640, 480]), ..ReadOptions::default() };
        let read = umpm::parse("a", &text, &options).expect("as written");
        assert_same_cameras(&read, &Rig::new(vec![camera], None, "").expect("a rig"));
    }

    #[test]
    fn any_plain_name_is_read_back_from_toml(name in "\\PC{1,12}|[\\x00-\\x7f]{1,6}") {
        prop_assume!(!["metadata", "cameras"].contains(&name.as_str()));
        prop_assume!(crate::is_plain_name(&name));
        let mut cameras = ring_rig(1, BARREL).cameras().to_vec();
        cameras[0].name.clone_from(&name);
        let rig = Rig::new(cameras, None, "").expect("a rig");
        assert_same_cameras(&own::parse(&own::write(&rig), &ReadOptions::default()).expect("our own"), &rig);
        let text = pose2sim::write(&rig).expect("writable");
        assert_same_cameras(&pose2sim::parse(&text, &ReadOptions::default()).expect("as written"), &rig);
    }
}

#[test]
fn every_format_is_detected_and_read_from_disk() {
    let folder = tempfile::tempdir().expect("a folder");
    let rig = ring_rig(3, BARREL);
    for (format, name) in [
        (Format::Own, "own.toml"),
        (Format::Pose2Sim, "p.toml"),
        (Format::OpenCv, "o.yml"),
    ] {
        let path = folder.path().join(name);
        write(&path, format, &rig).expect("writable");
        let text = std::fs::read_to_string(&path).expect("written");
        assert_eq!(detect(&path, &text), Some(format));
        assert_eq!(detect(Path::new("no_extension"), &text), Some(format));
        assert_same_cameras(
            &read(&path, &ReadOptions::default()).expect("as written"),
            &rig,
        );
    }
    for (format, extension) in [(Format::HumanEva, "cal"), (Format::Umpm, "ini")] {
        write(folder.path(), format, &rig).expect("writable");
        let paths: Vec<_> =
            (0..3).map(|i| folder.path().join(format!("cam{i}.{extension}"))).collect();
        let paths: Vec<_> = paths.iter().map(PathBuf::as_path).collect();
        let options = ReadOptions {
            size: Some([640, 480]),
            ..ReadOptions::default()
        };
        let read = read_many(&paths, &options).expect("as written");
        assert_same_cameras(&read, &rig);
        assert_eq!(
            read.source(),
            format!("cam0.{extension}, cam1.{extension}, cam2.{extension}")
        );
        let text = std::fs::read_to_string(paths[0]).expect("written");
        assert_eq!(detect(Path::new("no_extension"), &text), Some(format));
    }
}

#[test]
fn the_two_files_of_easymocap_give_one_rig() {
    let folder = tempfile::tempdir().expect("a folder");
    let rig = ring_rig(2, BARREL);
    let text = opencv::write(&rig).expect("writable");
    let lines: Vec<&str> = text.lines().collect();
    let blocks = |wanted: &dyn Fn(&str) -> bool| {
        let mut keep = true;
        let mut out = String::new();
        for line in &lines {
            keep = if line.starts_with(' ') {
                keep
            } else {
                wanted(line)
            };
            if keep {
                out += line;
                out += "\n";
            }
        }
        out
    };
    let head =
        |line: &str| line.starts_with('%') || line.starts_with("---") || line.starts_with("names");
    let intri = blocks(&|line| head(line) || line.starts_with("K_") || line.starts_with("dist_"));
    let extri = blocks(&|line| head(line) || line.starts_with("R_") || line.starts_with("T_"));
    let paths = [
        folder.path().join("intri.yml"),
        folder.path().join("extri.yml"),
    ];
    std::fs::write(&paths[0], intri).expect("writable");
    std::fs::write(&paths[1], extri).expect("writable");
    let options = ReadOptions {
        size: Some([640, 480]),
        ..ReadOptions::default()
    };
    let read = read_many(&[&paths[0], &paths[1]], &options).expect("as written");
    assert_same_cameras(&read, &rig);
}

#[test]
fn a_file_of_the_opencv_calibration_program_is_read() {
    let text = "%YAML:1.0\n---\ncalibration_time: \"Mon 01 Jan 2024\"\nimage_width: 640\nimage_height: 480\n\
        flags: 0\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 700., 0., 320., 0.,\n       \
        705., 240., 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   \
        data: [ -1.0e-01, 2.0e-02, 1.0e-03,\n       -2.0e-03, 3.0e-03 ]\nR: !!opencv-matrix\n   rows: 3\n   cols: 1\n   \
        dt: d\n   data: [ 0., 0., 0. ]\nT: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [ 1., 2., 3. ]\n";
    let rig = opencv::parse(&[("left", text)], &ReadOptions::default()).expect("a file");
    let camera = rig.camera("left").expect("named after the file");
    let lens = LensModel::BrownConrady {
        k: [-0.1, 0.02, 0.003, 0.0, 0.0, 0.0],
        p: [0.001, -0.002],
    };
    assert_eq!(camera.intrinsics.lens.model(), &lens);
    assert_eq!(
        (camera.intrinsics.fy, camera.intrinsics.size),
        (705.0, [640, 480])
    );
    assert_eq!(
        camera.camera_from_world.translation.vector,
        Vector3::new(1.0, 2.0, 3.0)
    );
}

#[test]
fn qualisys_lengths_are_in_64ths_of_a_pixel_but_distortion_is_not() {
    let text = r#"<?xml version='1.0'?><calibration><cameras>
        <camera active="1" serial="one" viewrotation="0">
        <fov_video left="0" top="0" right="1087" bottom="1919"/>
        <transform x="1000" y="-2000" z="500" r11="1" r12="0" r13="0" r21="0" r22="0" r23="1" r31="0" r32="-1" r33="0"/>
        <intrinsic focalLengthU="64000" focalLengthV="64640" centerPointU="34816" centerPointV="61440" skew="0"
          radialDistortion1="-0.05" radialDistortion2="0.1" radialDistortion3="0" tangentalDistortion1="0.001" tangentalDistortion2="0.002"/>
        </camera></cameras></calibration>"#;
    let rig = qualisys::parse(text, &ReadOptions::default()).expect("a file");
    let camera = rig.camera("one").expect("named after its serial");
    let intrinsics = &camera.intrinsics;
    assert_eq!(
        [intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy],
        [1000.0, 1010.0, 544.0, 960.0]
    );
    assert_eq!(intrinsics.size, [1088, 1920]);
    let lens = LensModel::BrownConrady {
        k: [-0.05, 0.1, 0.0, 0.0, 0.0, 0.0],
        p: [0.001, 0.002],
    };
    assert_eq!(intrinsics.lens.model(), &lens);
    let centre = camera.centre_in_world();
    assert!((centre.coords - Vector3::new(1.0, -2.0, 0.5)).norm() < 1e-12);
    // The right of the picture is the world's x, and the top is the world's z, so the camera looks along y.
    assert!((camera.axis_in_world().into_inner() - Vector3::y()).norm() < 1e-12);
    let above = camera.project(&nalgebra::Point3::new(1.0, 3.0, 0.6)).expect("in front");
    assert!(above.y < 960.0);
}

#[test]
fn caliscope_cameras_in_a_nested_table_are_read() {
    let text = "[cameras.10]\nsize = [1280, 720]\nmatrix = [[900, 0, 620], [0, 900, 390], [0, 0, 1]]\ndistortions = [0, 0, 0, 0, 0]\n\
        rotation = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\ntranslation = [0, 0, 1]\n\
        [cameras.2]\nname = \"two\"\nsize = [1280, 720]\nmatrix = [[900, 0, 620], [0, 900, 390], [0, 0, 1]]\ndistortions = []\n\
        rotation = [0.0, 0.1, 0]\ntranslation = [0, 0, 1]\n\
        [cameras.3]\nmatrix = \"never calibrated\"\nignore = true\n[other]\nstage = 2\n";
    let rig = pose2sim::parse(
        text,
        &ReadOptions {
            unit: Some(Unit::Millimetres),
            ..ReadOptions::default()
        },
    );
    let rig = rig.expect("a file");
    let names: Vec<&str> = rig.cameras().iter().map(|camera| camera.name.as_str()).collect();
    assert_eq!(names, ["cam_10", "two"]);
    assert_eq!(rig.cameras()[0].camera_from_world.translation.z, 0.001);
    assert_eq!(
        rig.cameras()[0].intrinsics.lens.model(),
        &LensModel::Pinhole
    );
}

#[test]
fn a_correct_rig_has_no_findings_and_no_epipolar_error() {
    let rig = ring_rig(4, BARREL);
    assert_eq!(check(&rig), []);
    let points: Vec<Vec<_>> = (0..20)
        .map(|i| nalgebra::Point3::new(0.05 * f64::from(i) - 0.5, 0.3, 0.02 * f64::from(i)))
        .map(|point| rig.cameras().iter().map(|camera| camera.project(&point)).collect())
        .collect();
    let report = epipolar_check(&rig, &points);
    assert_eq!((report.pairs.len(), report.cameras.len()), (6, 4));
    assert!(report.pairs.iter().all(|pair| pair.median_px < 1e-6 && pair.n_points == 20));
}

#[test]
fn a_moved_camera_has_the_largest_epipolar_error() {
    let rig = ring_rig(4, BARREL);
    let points: Vec<Vec<_>> = (0..20)
        .map(|i| nalgebra::Point3::new(0.05 * f64::from(i) - 0.5, 0.3, 0.02 * f64::from(i)))
        .map(|point| rig.cameras().iter().map(|camera| camera.project(&point)).collect())
        .collect();
    let mut cameras = rig.cameras().to_vec();
    cameras[2].camera_from_world =
        nalgebra::Isometry3::rotation(Vector3::x() * 0.03) * cameras[2].camera_from_world;
    let moved = Rig::new(cameras, None, "").expect("a rig");
    let report = epipolar_check(&moved, &points);
    let worst = report.cameras.iter().max_by(|a, b| a.median_px.total_cmp(&b.median_px));
    assert_eq!(worst.map(|worst| worst.camera), Some(2));
}

/// Returns the findings after `spoil` changed the second of three cameras.
fn findings(spoil: impl FnOnce(&mut Camera)) -> Vec<Finding> {
    let mut cameras = ring_rig(3, BARREL).cameras().to_vec();
    spoil(&mut cameras[1]);
    check(&Rig::new(cameras, Some(z_up()), "").expect("a rig"))
}

#[test]
fn implausible_rigs_have_findings() {
    let name = || "cam1".to_owned();
    let cropped = findings(|camera| camera.intrinsics.cx = 60.0);
    assert!(
        cropped
            .iter()
            .any(|f| matches!(f, Finding::PrincipalPoint { camera, .. } if *camera == name()))
    );
    let millimetres = findings(|camera| camera.camera_from_world.translation.vector *= 1000.0);
    assert!(
        millimetres
            .iter()
            .any(|f| matches!(f, Finding::Distance { metres, .. } if *metres > 4000.0))
    );
    let stretched = findings(|camera| camera.intrinsics.fy *= 2.0);
    assert!(stretched.iter().any(|f| matches!(f, Finding::Aspect { .. })));
    let long =
        findings(|camera| (camera.intrinsics.fx, camera.intrinsics.fy) = (70_000.0, 70_000.0));
    assert!(
        long.iter()
            .any(|f| matches!(f, Finding::FieldOfView { degrees, .. } if *degrees < 1.0))
    );
    let inverted = findings(|camera| camera.camera_from_world = camera.camera_from_world.inverse());
    assert!(inverted.iter().any(|f| matches!(f, Finding::LooksElsewhere { .. })));
    let turned = findings(|camera| {
        let turn = nalgebra::Isometry3::rotation(Vector3::z() * 3.0);
        camera.camera_from_world = turn * camera.camera_from_world;
    });
    assert!(
        turned
            .iter()
            .any(|f| matches!(f, Finding::UpsideDown { camera, .. } if *camera == name()))
    );
    let folded = findings(|camera| {
        let k = [-1.5, 0.0, 0.0, 0.0, 0.0, 0.0];
        camera.intrinsics.lens = Lens::new(LensModel::BrownConrady { k, p: [0.0; 2] });
    });
    assert!(folded.iter().any(|f| matches!(f, Finding::LensRange { .. })));
    let cameras = ring_rig(2, BARREL).cameras().to_vec();
    let mut twin = cameras[0].clone();
    twin.name = "twin".to_owned();
    let same = check(&Rig::new(vec![cameras[0].clone(), twin], None, "").expect("a rig"));
    assert!(same.contains(&Finding::UpUnknown));
    assert!(same.iter().any(|f| matches!(f, Finding::SamePose { .. })));
    assert!(same.iter().all(|finding| !finding.to_string().is_empty()));
}
