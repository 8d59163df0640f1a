//! Properties of every reader of files, for any content.

use deployment::{AnyMachine, Loaded, Stage, Topology};
use exports::{FILES, Gathering, Trial};
use fmp::Model;
use fmp::files::{describe, mat, own, text};
use formats::c3d::C3d;
use geometry::files::{ReadOptions, humaneva, opencv, panoptic, pose2sim, qualisys, umpm};
use keypoints::files::{NameSet, SeenKeypoints, coco, openpose};
use motion::{Joint, Recorded, Role};
use multiview::Compatibility;
use multiview::learned::{Appearance, JointFile, Learned};
use rigs::boards::{corners_text, parse_corners};
use runfiles::{
    FrameLine, LatencyReport, Line, RunSummary, Running, SmoothReport, TimesLine, ViewLine,
};
use scene::Address;
use scene::truth::{Frame, Header};
use training::Checkpoint;
use training::datasets::{SkeletonTable, parse_joints, parse_labels, parse_line, to_line};
use viewquality::{Card, Network, Table, Tau};

/// Returns a payload after our own header of version 1.
fn with_checksum(magic: [u8; 8], payload: &[u8]) -> Vec<u8> {
    formats::checksum::Envelope { magic, version: 1 }.seal(payload)
}
/// Deployment files; the first line may be an option of the command line.
///
/// If a text is accepted, all its keys can be shown, it is accepted again after it is written, and its processes and topics are consistent.
pub fn deployment_text(input: &[u8]) {
    let Ok(input) = core::str::from_utf8(input) else {
        return;
    };
    let file = std::path::Path::new("deployment.toml");
    let option = input.lines().next().and_then(|line| line.strip_prefix("#--set "));
    let set: Vec<String> = option.map(str::to_owned).into_iter().collect();
    let loaded = match Loaded::parse(input, file, &set, &AnyMachine) {
        Ok(it) => it,
        Err(error) => {
            let told = error.to_string();
            let place = ["deployment.toml", "--set"];
            assert!(place.iter().any(|begin| told.starts_with(begin)), "{told}");
            return;
        }
    };
    assert_eq!(
        loaded.entries().expect("keys").len(),
        deployment::keys().len()
    );
    let again = Loaded::again(&loaded.deployment, &[], |_| None, &AnyMachine).expect("as it was");
    assert_eq!(again.deployment, loaded.deployment);
    let topology = Topology::new(&loaded.deployment, None, None);
    let all = topology.processes();
    let sends =
        |topic: &String| all.iter().filter(|process| process.outputs.contains(topic)).count();
    for topic in all.iter().flat_map(|process| &process.inputs) {
        assert_eq!(sends(topic), 1, "{topic}");
    }
    for stage in Stage::ALL {
        let n = all.iter().filter(|process| process.service == stage.name()).count();
        let most = if stage == Stage::Fuse {
            topology.n_workers()
        } else {
            topology.n_views()
        };
        assert!(n <= most, "{stage:?}");
    }
}

/// The authors' text models.
pub fn model_text(input: &[u8]) {
    let Ok(input) = core::str::from_utf8(input) else {
        return;
    };
    if let Ok(Ok(model)) = text::parse(input).map(Model::new) {
        let bytes = own::encode(&model).expect("small models fit");
        assert_eq!(own::decode(&bytes).as_ref().ok(), Some(model.spec()));
    }
}

/// Yang & Ramanan's MATLAB models.
pub fn model_mat(input: &[u8]) {
    if let Ok(Ok(model)) = mat::parse(input).map(Model::new) {
        assert!(describe(&model).n_filters > 0);
    }
}

/// Payload of our own model files, with a correct checksum.
pub fn model_own(payload: &[u8]) {
    let file = with_checksum(own::MAGIC, payload);
    if let Ok(Ok(model)) = own::decode(&file).map(Model::new) {
        let again = own::encode(&model).expect("small models fit");
        assert_eq!(own::decode(&again).as_ref().ok(), Some(model.spec()));
    }
}

/// Tables of expected errors, and thresholds.
pub fn quality_table(input: &[u8]) {
    let Ok(input) = core::str::from_utf8(input) else {
        return;
    };
    if let Ok(table) = Table::parse(input, 2) {
        assert!(table.n_rows() > 0);
    }
    if let Ok(tau) = Tau::parse(input, 2) {
        assert!(tau.px().iter().all(|value| value.is_finite()));
    }
}

/// Networks that predict errors: the metadata of their files, and the files themselves.
pub fn quality_network(input: &[u8]) {
    if let Ok(text) = core::str::from_utf8(input) {
        let entries = text.lines().filter_map(|line| line.split_once('='));
        if let Ok(card) = Card::parse(entries, 2) {
            let entries = card.entries();
            let entries = entries.iter().map(|(name, value)| (*name, value.as_str()));
            assert_eq!(Card::parse(entries, 2), Ok(card));
        }
    }
    let _outcome = Network::parse(input.to_vec(), 2);
}

/// Part-type tables, each alone and joined with another table.
pub fn type_table(input: &[u8]) {
    let Ok(input) = core::str::from_utf8(input) else {
        return;
    };
    let (there, back) = input.split_once('#').unwrap_or((input, input));
    let tables = [there, back].map(|text| Compatibility::parse(text, &[2, 3]));
    if let [Ok(there), Ok(back)] = tables {
        let (_, disagreement) =
            Compatibility::joint_from_conditionals(&there, &back).expect("the same types");
        assert!((0.0..1.000_001).contains(&disagreement));
    }
}

/// The file of learned consistency between views, and the tables made from it.
pub fn consistency(input: &[u8]) {
    let Ok(input) = core::str::from_utf8(input) else {
        return;
    };
    let Ok(learned) = Learned::parse(input) else {
        return;
    };
    let again = learned.write().expect("its numbers are finite");
    assert_eq!(Learned::parse(&again).expect("it was written"), learned);
    for appearance in [Appearance::Joint, Appearance::Lift] {
        let tables = learned.by_angle(appearance);
        for angle in [-3.5, -1.0, 0.0, 1.0, 3.5] {
            if let Some(it) = tables.at(angle) {
                assert!(it.joint.value(0, 0, 0).is_finite());
            }
        }
        for rig in &learned.rigs {
            let _tables = learned.of_rig(&rig.name, &["c1", "c2"], appearance);
        }
    }
}

/// Card of a network or of a detector. If a card is accepted, its numbers can be used in computations, and its input window can be filled
/// from the given box.
pub fn network_card(input: &[u8]) {
    let Ok(input) = core::str::from_utf8(input) else {
        return;
    };
    if let Ok(card) = keypoints::DetectorCard::parse(input) {
        let mut values = vec![f32::NAN; 3 * card.input.width * card.input.height];
        let step = card.fill(&[200; 3 * 7 * 5], [7, 5], &mut values);
        assert!(step > 0.0 && values.iter().all(|value| !value.is_nan()));
        let _outcome = card.boxes(&values[..15], &[1, 3, 5]);
        if let keypoints::Boxes::Centres { stride, .. } = card.output {
            let [rows, columns] = [card.input.height, card.input.width].map(|side| side / stride);
            let n = 5 * rows * columns;
            let found = card.boxes(&values[..n.min(values.len())], &[1, 5, rows, columns]);
            assert!(n > values.len() || found.is_ok_and(|boxes| boxes.len() <= rows * columns));
        }
        return;
    }
    let Ok(card) = keypoints::Card::parse(input) else {
        return;
    };
    let names = card.names();
    assert!(!names.is_empty());
    for row in keypoints::joint_rows(&names).into_iter().flatten() {
        assert!((row.iter().map(|row| row.1).sum::<f64>() - 1.0).abs() < 1e-9);
    }
    let window = keypoints::Window::new(&card, [2.0, 1.0, 9.0, 12.0]).expect("a box");
    let mut values = vec![f32::NAN; 3 * card.input.width * card.input.height];
    window.fill(&card, &[200; 3 * 7 * 5], [7, 5], &mut values);
    assert!(values.iter().all(|value| !value.is_nan()));
}

/// Keypoints from other programs, in both layouts. If data is accepted, it has as many keypoints as names, and their values are within the
/// limits.
pub fn keypoint_files(input: &[u8]) {
    let given = NameSet::of_set("mpii-16").expect("a set");
    let check = |people: &[SeenKeypoints], n: usize| {
        assert!(people.len() <= keypoints::files::MAX_PEOPLE);
        for person in people {
            assert_eq!(person.keypoints.len(), n);
            for it in person.keypoints.iter().flatten() {
                let [x, y] = it.at;
                assert!(x.abs() <= 1e6 && y.abs() <= 1e6 && (0.0..=1.0).contains(&it.score));
            }
            if let Some(outline) = person.outline() {
                let window = keypoints::Window::grid(outline, 1.25, 64).expect("a box");
                let [columns, rows] = window.input();
                assert!((8..=64).contains(&rows) && (8..=257).contains(&columns));
            }
        }
    };
    for names in [None, Some(&given)] {
        if let Ok(frame) = openpose::parse(input, names) {
            check(&frame.people, frame.names.map_or(0, |name| name.n()));
        }
        if let Ok(film) = coco::parse(input, names) {
            assert!(film.n_frames <= keypoints::files::MAX_FRAMES);
            for (number, people) in &film.frames {
                assert!(*number < film.n_frames);
                check(people, film.names.n());
            }
        }
    }
}

/// The file of a map from the parts of a model to joints, and the maps to every joint set made from it. If all parts are at one point, all
/// joints are at this point.
pub fn joint_file(input: &[u8]) {
    let Ok(input) = core::str::from_utf8(input) else {
        return;
    };
    let Ok(file) = JointFile::parse(input) else {
        return;
    };
    let again = file.write().expect("its numbers are finite");
    assert_eq!(JointFile::parse(&again).expect("it was written"), file);
    let centres = [[3.0, -5.0]; skeleton::N_PARTS];
    for set in [&skeleton::PARSE14, &skeleton::UMPM15, &skeleton::HUMANEVA20] {
        let map = file.map(set).expect("sets are made of these joints");
        for [x, y] in map.from_parts(&centres) {
            assert!((x - 3.0).abs() < 1e-3 && (y + 5.0).abs() < 1e-3);
        }
    }
}

/// Every calibration format that consists of one text file.
pub fn calibration(input: &[u8]) {
    let Ok(input) = core::str::from_utf8(input) else {
        return;
    };
    let options = ReadOptions {
        size: Some([640, 480]),
        ..ReadOptions::default()
    };
    if let Ok(rig) = geometry::files::own::parse(input, &options) {
        let again = geometry::files::own::write(&rig);
        let _rig = geometry::files::own::parse(&again, &options).expect("it was written");
    }
    let _pose2sim = pose2sim::parse(input, &options);
    let _qualisys = qualisys::parse(input, &options);
    let _humaneva = humaneva::parse("C1", input, &options);
    let _umpm = umpm::parse("l", input, &options);
    let _panoptic = panoptic::parse(input, &options);
    let _opencv = opencv::parse(&[("cam01", input)], &options);
}

/// Tables of board corners, as other programs write them.
///
/// If a table is accepted, it is unchanged after it is written and read again.
pub fn board_corners(input: &[u8]) {
    let Ok(input) = core::str::from_utf8(input) else {
        return;
    };
    let names = ["cam_0".to_owned(), "cam_1".to_owned()];
    if let Ok((sights, _)) = parse_corners(input, &names) {
        let text = corners_text(&sights, &names);
        let (again, _) = parse_corners(&text, &names).expect("it was written");
        assert_eq!(corners_text(&again, &names), text);
    }
}

/// Our own annotation file, line by line, and skeleton tables.
pub fn people_lines(input: &[u8]) {
    let Ok(input) = core::str::from_utf8(input) else {
        return;
    };
    for line in input.lines() {
        if let Ok((person, name)) = parse_line(line) {
            let again = to_line(&person, name.as_deref()).expect("it was Unicode");
            let (again, same_name) = parse_line(&again).expect("it was written");
            assert_eq!(
                (again.image, again.visible, same_name),
                (person.image, person.visible, name)
            );
            assert_eq!(
                format!("{:?}", again.joints),
                format!("{:?}", person.joints)
            );
        }
    }
    if let Ok(table) = SkeletonTable::parse(input) {
        let joints = vec![[1.0, 2.0]; table.n_joints()];
        assert_eq!(table.parts_of(&joints).len(), table.n_parts());
    }
}

/// The MATLAB annotations of PARSE and LSP.
pub fn people_mat(input: &[u8]) {
    for people in [parse_labels(input), parse_joints(input)].into_iter().flatten() {
        for (joints, visible) in people {
            assert_eq!(joints.len(), visible.len());
        }
    }
}

/// Payload of training checkpoints, with a correct checksum.
pub fn training_checkpoint(payload: &[u8]) {
    let file = with_checksum(*b"PLXTRAIN", payload);
    if let Ok((checkpoint, stamp)) = Checkpoint::from_bytes(&file) {
        let again = checkpoint.to_bytes(stamp).expect("small checkpoints fit");
        let (_, same) = Checkpoint::from_bytes(&again).expect("it was written");
        assert_eq!(same, stamp);
    }
}

/// C3D files, in all encodings.
pub fn motion_c3d(input: &[u8]) {
    if let Ok(trial) = C3d::parse(input) {
        let n_points = trial.n_frames() * trial.n_points();
        assert!(8 * n_points <= input.len() || trial.n_points() == 0);
        for frame in 0..trial.n_frames() {
            assert_eq!(trial.frame(frame).len(), trial.n_points());
        }
    }
}

/// Addresses of scenes, and lines of their truth files.
pub fn scene_text(input: &[u8]) {
    let Ok(input) = core::str::from_utf8(input) else {
        return;
    };
    if let Ok(address) = Address::parse(input) {
        assert_eq!(
            Address::parse(&address.to_string()).expect("it was written"),
            address
        );
    }
    let mut lines = input.lines();
    if let Some(Ok(header)) = lines.next().map(Header::parse) {
        for line in lines {
            if let Ok(frame) = Frame::parse(line, &header) {
                let again = frame.to_line().expect("numbers of JSON are finite");
                assert_eq!(
                    Frame::parse(&again, &header).expect("it was written"),
                    frame
                );
            }
        }
    }
}

/// Checks that every export format either writes the lines of a run, or refuses them.
fn exported(input: &str) {
    let mut all = Gathering::default();
    for line in runfiles::lines::<FrameLine>(input).flatten().take(20) {
        if all.push(&line).is_err() {
            return;
        }
    }
    let Ok(trials) = all.finish("x", Some(30.0)) else {
        return;
    };
    trials.iter().for_each(written);
}

/// Checks that every single-file format either writes a trial, or refuses it.
fn written(trial: &Trial) {
    // Frames may be very far apart; the slots between them are empty.
    for format in FILES.iter().filter(|_| trial.slots.len() < 1000) {
        let mut file = Vec::new();
        if (format.write)(trial, &mut file).is_ok() && format.name == "c3d" {
            let read = C3d::parse(&file).expect("it was written");
            assert_eq!(read.n_frames(), trial.slots.len());
        }
    }
}

/// Smooths lines of results as the motion of one person. Smoothed values are finite, however wrong the measurements are.
fn smoothed(input: &str) {
    let mut recorded = Recorded::default();
    for line in runfiles::lines::<FrameLine>(input).flatten() {
        let at = recorded.times.len();
        let (Some(time_s), Some(person)) = (line.time_s, line.followed()) else {
            continue;
        };
        recorded.times.push(time_s);
        recorded.sides.push(motion::lines::sides(person));
        for (name, it) in &person.joints {
            let known = recorded.joints.iter().position(|joint| joint.name == *name);
            let nth = known.unwrap_or(recorded.joints.len());
            if known.is_none() {
                let (name, role) = (name.clone(), Role::of(name));
                let measured = Vec::new();
                recorded.joints.push(Joint {
                    name,
                    role,
                    measured,
                });
            }
            let measured = &mut recorded.joints[nth].measured;
            measured.resize(at, None);
            measured.push(motion::lines::measured(it));
        }
    }
    for joint in &mut recorded.joints {
        joint.measured.resize(recorded.times.len(), None);
    }
    if recorded.check().is_err() {
        return;
    }
    let constant_bones = true;
    for settings in [
        motion::Settings::default(),
        motion::Settings {
            fill_s: 1e3,
            constant_bones,
        },
    ] {
        let motion = motion::smooth(&recorded, &settings);
        for it in motion.joints.iter().flatten().flatten() {
            assert!(it.position.iter().all(|value| value.is_finite()), "{it:?}");
        }
    }
}

/// Files that a run leaves behind. If data is accepted, writing it, reading it and writing it again gives the same text.
pub fn run_files(input: &[u8]) {
    fn lines<L: Line>(input: &str) {
        for line in runfiles::lines::<L>(input).flatten() {
            let written = runfiles::to_line(&line).expect("it was read");
            let again = runfiles::lines::<L>(&written).next();
            let again = again.expect("a line").expect("it was written");
            assert_eq!(runfiles::to_line(&again).expect("it was read"), written);
        }
    }
    let Ok(input) = core::str::from_utf8(input) else {
        return;
    };
    lines::<FrameLine>(input);
    exported(input);
    smoothed(input);
    lines::<ViewLine>(input);
    lines::<TimesLine>(input);
    if let Ok(report) = SmoothReport::parse(input) {
        let written = report.to_text().expect("it was read");
        let again = SmoothReport::parse(&written).expect("it was written");
        assert_eq!(again, report);
    }
    if let Ok(run) = RunSummary::parse(input) {
        let written = run.to_text().expect("it was read");
        let again = RunSummary::parse(&written).expect("it was written");
        assert_eq!(again, run);
    }
    if let Ok(report) = LatencyReport::parse(input) {
        let written = report.to_text().expect("it was read");
        let again = LatencyReport::parse(&written).expect("it was written");
        assert_eq!(again, report);
    }
    if let Ok(running) = Running::read(input) {
        assert_eq!(running.format, Running::VERSION);
    }
}
