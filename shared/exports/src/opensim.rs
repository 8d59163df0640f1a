//! Files for `OpenSim`: the points over time, their positions on a model, and the settings for scaling and inverse kinematics.
//!
//! The bodies have the names of the full-body models of Rajagopal et al. (2016) and of their descendants, such as Pose2Sim's. Joints are
//! placed at the joint centres of the model. Neck, head, nose, heels and big toes are placed near the points of a run of a synthetic person
//! on the scaled model (`parallax-lab synth --rig ring:4 --subjects 503`); small toes are placed by eye.

use core::fmt::Write as _;
use std::io;

use crate::landmarks::plain_name;
use crate::{Trial, points};

/// A marker on the model. Markers of the left side are mirrored: z has the opposite sign.
struct Marker {
    /// Name of the landmark or keypoint, without the side.
    point: &'static str,
    /// Body to which the marker is fixed, without the side. Bodies on the midline have no sides.
    body: &'static str,
    /// Position in the body's frame, in metres: x forwards, y up, z to the right.
    at: [f64; 3],
    /// Weight in inverse kinematics.
    weight: f64,
}

const fn marker(point: &'static str, body: &'static str, at: [f64; 3], weight: f64) -> Marker {
    Marker {
        point,
        body,
        at,
        weight,
    }
}

/// Markers on the midline.
const MIDDLE: [Marker; 4] = [
    marker("pelvis", "pelvis", [-0.071, -0.066, 0.0], 2.0),
    marker("neck", "torso", [0.0, 0.4, 0.0], 3.0),
    marker("head", "head", [0.02, 0.17, 0.0], 3.0),
    marker("nose", "head", [0.125, 0.045, 0.0], 1.0),
];

/// Markers of the right side.
const SIDES: [Marker; 9] = [
    marker("hip", "pelvis", [-0.071, -0.066, 0.084], 10.0),
    marker("knee", "femur", [-0.004, -0.404, 0.0], 5.0),
    marker("ankle", "tibia", [0.0, -0.425, 0.0], 10.0),
    marker("heel", "calcn", [-0.005, 0.01, 0.0], 2.0),
    marker("big toe", "toes", [0.075, 0.01, -0.015], 2.0),
    marker("small toe", "toes", [0.03, 0.01, 0.03], 1.0),
    marker("shoulder", "torso", [0.003, 0.371, 0.17], 10.0),
    marker("elbow", "humerus", [0.013, -0.286, -0.01], 5.0),
    marker("wrist", "radius", [-0.009, -0.236, 0.014], 10.0),
];

/// Distances between markers that give the scale of bodies, for a side: name, pairs of markers, bodies, and axes. `?` stands for the letter
/// of the side.
const LIMBS: [Measure; 5] = [
    ("thigh", &[["?Hip", "?Knee"]], &["femur_?"], "X Y Z"),
    ("shank", &[["?Knee", "?Ankle"]], &["tibia_?"], "X Y Z"),
    (
        "foot",
        &[["?Heel", "?BigToe"]],
        &["talus_?", "calcn_?", "toes_?"],
        "X Y Z",
    ),
    (
        "upper arm",
        &[["?Shoulder", "?Elbow"]],
        &["humerus_?"],
        "X Y Z",
    ),
    (
        "forearm",
        &[["?Elbow", "?Wrist"]],
        &["ulna_?", "radius_?", "hand_?"],
        "X Y Z",
    ),
];

/// The same for the trunk and the head.
const TRUNK: [Measure; 4] = [
    ("pelvis", &[["LHip", "RHip"]], &["pelvis"], "Z"),
    (
        "trunk",
        &[["RShoulder", "RHip"], ["LShoulder", "LHip"]],
        &["pelvis", "torso"],
        "X Y",
    ),
    ("shoulders", &[["LShoulder", "RShoulder"]], &["torso"], "Z"),
    ("head", &[["Neck", "Head"]], &["head"], "X Y Z"),
];

/// Name, pairs of markers, bodies, and axes.
type Measure = (
    &'static str,
    &'static [[&'static str; 2]],
    &'static [&'static str],
    &'static str,
);

/// Name of the file of points over time.
const POINTS: &str = "markers.trc";
/// Name of the file of markers on the model.
const MARKERS: &str = "markers.xml";
/// Name of the settings for scaling.
const SCALING: &str = "scaling.xml";
/// Name of the settings for inverse kinematics.
const KINEMATICS: &str = "kinematics.xml";
/// Name of the model that the user adds.
pub const MODEL: &str = "model.osim";

/// A marker of a trial.
struct Placed {
    name: String,
    body: String,
    at: [f64; 3],
    weight: f64,
}

/// Returns the names and contents of the files of a trial.
///
/// # Errors
///
/// Fails if the frame rate is not known.
pub fn files(trial: &Trial) -> io::Result<[(&'static str, String); 4]> {
    let markers = placed(trial);
    let mut points = Vec::new();
    let names = trial.names().map(label).collect();
    points::labelled_trc(trial, names, &mut points)?;
    let points = String::from_utf8(points).map_err(io::Error::other)?;
    let last_s = trial.time_s(trial.slots.len().saturating_sub(1)).unwrap_or(0.0);
    let range = format!("{} {last_s}", trial.time_s(0).unwrap_or(0.0));
    Ok([
        (POINTS, points),
        (MARKERS, marker_set(&markers)),
        (SCALING, scaling(&markers, &range)),
        (KINEMATICS, kinematics(&markers, &range)),
    ])
}

/// Returns the name of a marker: `RAnkle` for `right ankle`, `Hip` for the pelvis.
fn label(name: &str) -> String {
    let name = plain_name(name);
    if name == "pelvis" {
        return "Hip".to_owned();
    }
    let mut words: Vec<&str> = name.split([' ', '_']).filter(|part| !part.is_empty()).collect();
    if let [side @ ("left" | "right"), _, ..] = &mut words[..] {
        *side = if *side == "left" { "l" } else { "r" };
    }
    let capital = |word: &str| {
        let mut rest = word.chars();
        let first = rest.next().map(|letter| letter.to_uppercase().to_string());
        first.unwrap_or_default() + rest.as_str()
    };
    words.into_iter().map(capital).collect()
}

/// Returns the markers for the points of a trial. Points without a place on the model, such as the ears, have none.
fn placed(trial: &Trial) -> Vec<Placed> {
    let all = trial.names().filter_map(|name| {
        let point = plain_name(name);
        let side = point.split_once(' ').filter(|(side, _)| ["left", "right"].contains(side));
        let (marker, body, mirror) = match side {
            None => {
                let marker = MIDDLE.iter().find(|marker| marker.point == point)?;
                (marker, marker.body.to_owned(), 1.0)
            }
            Some((side, point)) => {
                let marker = SIDES.iter().find(|marker| marker.point == point)?;
                let body = match marker.body {
                    middle @ ("pelvis" | "torso") => middle.to_owned(),
                    body => format!("{body}_{}", &side[..1]),
                };
                (marker, body, if side == "left" { -1.0 } else { 1.0 })
            }
        };
        let [x, y, z] = marker.at;
        Some(Placed {
            name: label(name),
            body,
            at: [x, y, mirror * z],
            weight: marker.weight,
        })
    });
    all.collect()
}

fn document(content: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<OpenSimDocument Version=\"40000\">\n{content}</OpenSimDocument>\n"
    )
}

fn marker_set(markers: &[Placed]) -> String {
    let mut all = String::new();
    for Placed { name, body, at, .. } in markers {
        let [x, y, z] = at;
        // Writing to a string cannot fail.
        let _infallible = writeln!(
            all,
            "    <Marker name=\"{name}\">\n      \
             <socket_parent_frame>/bodyset/{body}</socket_parent_frame>\n      \
             <location>{x} {y} {z}</location>\n      \
             <fixed>true</fixed>\n    </Marker>"
        );
    }
    document(&format!(
        "<MarkerSet name=\"parallax\">\n  <objects>\n{all}  </objects>\n</MarkerSet>\n"
    ))
}

/// Returns the settings for scaling. Distances whose markers are missing are left out: those bodies keep their size.
fn scaling(markers: &[Placed], range: &str) -> String {
    let has = |name: &str| markers.iter().any(|marker| marker.name == name);
    let mut all = String::new();
    let limbs = LIMBS.iter().flat_map(|measure| ["R", "L"].map(|side| (measure, side)));
    for ((name, pairs, bodies, axes), side) in
        TRUNK.iter().map(|measure| (measure, "")).chain(limbs)
    {
        let named = |name: &str| {
            let is_body = name.contains('_');
            name.replace(
                '?',
                &if is_body {
                    side.to_lowercase()
                } else {
                    side.to_owned()
                },
            )
        };
        let pairs: Vec<[String; 2]> = pairs.iter().map(|pair| pair.map(named)).collect();
        if !pairs.iter().flatten().all(|name| has(name)) {
            continue;
        }
        let pairs = pairs
            .iter()
            .map(|[from, to]| format!("<MarkerPair><markers>{from} {to}</markers></MarkerPair>"));
        let bodies = bodies.iter().map(|body| {
            let body = named(body);
            format!("<BodyScale name=\"{body}\"><axes>{axes}</axes></BodyScale>")
        });
        let [pairs, bodies] = [pairs.collect::<Vec<_>>(), bodies.collect()].map(|all| all.concat());
        let name = format!("{name} {side}");
        let _infallible = writeln!(
            all,
            "      <Measurement name=\"{}\">\n        <apply>true</apply>\n        \
             <MarkerPairSet><objects>{pairs}</objects></MarkerPairSet>\n        \
             <BodyScaleSet><objects>{bodies}</objects></BodyScaleSet>\n      </Measurement>",
            name.trim()
        );
    }
    document(&format!(
        "<ScaleTool name=\"scaled\">\n  \
         <!-- The mass is not measured: -1 keeps that of the model. Set it, in kg, before you compute forces. -->\n  \
         <mass>-1</mass>\n  <height>-1</height>\n  <age>-1</age>\n  \
         <GenericModelMaker>\n    <model_file>{MODEL}</model_file>\n    \
         <marker_set_file>{MARKERS}</marker_set_file>\n  </GenericModelMaker>\n  \
         <ModelScaler>\n    <apply>true</apply>\n    <scaling_order>measurements</scaling_order>\n    \
         <MeasurementSet>\n    <objects>\n{all}    </objects>\n    </MeasurementSet>\n    \
         <marker_file>{POINTS}</marker_file>\n    <time_range>{range}</time_range>\n    \
         <preserve_mass_distribution>true</preserve_mass_distribution>\n    \
         <output_model_file>scaled.osim</output_model_file>\n  </ModelScaler>\n  \
         <MarkerPlacer>\n    <apply>false</apply>\n  </MarkerPlacer>\n</ScaleTool>\n"
    ))
}

fn kinematics(markers: &[Placed], range: &str) -> String {
    let mut all = String::new();
    for Placed { name, weight, .. } in markers {
        let _infallible = writeln!(
            all,
            "    <IKMarkerTask name=\"{name}\"><apply>true</apply><weight>{weight}</weight></IKMarkerTask>"
        );
    }
    document(&format!(
        "<InverseKinematicsTool name=\"kinematics\">\n  <model_file>scaled.osim</model_file>\n  \
         <constraint_weight>20</constraint_weight>\n  <accuracy>1e-5</accuracy>\n  \
         <IKTaskSet>\n  <objects>\n{all}  </objects>\n  </IKTaskSet>\n  \
         <marker_file>{POINTS}</marker_file>\n  <time_range>{range}</time_range>\n  \
         <report_errors>true</report_errors>\n  <output_motion_file>motion.mot</output_motion_file>\n\
         </InverseKinematicsTool>\n"
    ))
}

#[cfg(test)]
mod tests {
    use keypoints::HALPE_26;
    use skeleton::JointSet;

    use super::*;
    use crate::testing;

    #[test]
    fn labels_equal_those_of_the_marker_set_of_pose2sim() {
        // These are the names of Markers_Halpe26.xml of Pose2Sim 0.10, which does not have eyes and ears.
        let due = "Nose LEye REye LEar REar LShoulder RShoulder LElbow RElbow LWrist RWrist LHip RHip LKnee RKnee LAnkle RAnkle \
                   Head Neck Hip LBigToe RBigToe LSmallToe RSmallToe LHeel RHeel";
        let own = HALPE_26.map(|name| if name == "head top" { "head" } else { name });
        let own = own.map(label);
        assert_eq!(own.join(" "), due);
    }

    #[test]
    fn joints_of_every_set_have_different_labels() {
        for set in JointSet::ALL {
            let names: Vec<String> = set.joints.iter().map(|joint| label(joint.name)).collect();
            for (nth, name) in names.iter().enumerate() {
                assert!(!names[..nth].contains(name), "{}: {name} twice", set.name);
                assert!(!name.contains(' '), "{name}");
            }
            for due in ["RAnkle", "LKnee", "RShoulder", "LWrist", "Head"] {
                assert!(
                    names.iter().any(|name| name == due),
                    "{}: {names:?}",
                    set.name
                );
            }
        }
    }

    #[test]
    fn the_files_are_well_formed_and_only_name_markers_of_the_trial() {
        let mut trial = testing::walker(30);
        for feet in [false, true] {
            if feet {
                trial.extras = [
                    "left heel",
                    "left big toe",
                    "right heel",
                    "right big toe",
                    "left ear",
                ]
                .map(ToOwned::to_owned)
                .to_vec();
            }
            let [points, markers, scaling, kinematics] = files(&trial).unwrap();
            let trc = formats::trc::Trc::parse(&points.1).unwrap();
            assert_eq!(trc.frames.len(), 30);
            let [markers, scaling, kinematics] = [&markers, &scaling, &kinematics]
                .map(|file| roxmltree::Document::parse(&file.1).unwrap());
            let of_tag = |document: &roxmltree::Document<'_>, tag: &str| -> Vec<String> {
                let all = document.descendants().filter(|node| node.has_tag_name(tag));
                all.map(|node| node.attribute("name").unwrap_or_default().to_owned()).collect()
            };
            let known = of_tag(&markers, "Marker");
            let due = if feet { 18 } else { 14 };
            assert_eq!(known.len(), due, "{known:?}");
            assert!(
                known.iter().all(|name| trc.markers.contains(name)),
                "{known:?}"
            );
            assert_eq!(of_tag(&kinematics, "IKMarkerTask"), known);
            let pairs = scaling.descendants().filter(|node| node.has_tag_name("markers"));
            for pair in pairs {
                let pair: Vec<&str> = pair.text().unwrap().split(' ').collect();
                assert!(
                    pair.iter().all(|name| known.iter().any(|own| own == name)),
                    "{pair:?}"
                );
            }
            let measured = of_tag(&scaling, "Measurement");
            assert_eq!(
                measured.contains(&"foot L".to_owned()),
                feet,
                "{measured:?}"
            );
            assert!(of_tag(&scaling, "BodyScale").iter().any(|body| body == "femur_l"));
        }
    }
}
