//! A set of several people in the layout of 4D Association's Shelf: detections in every view, and the true positions of people.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::{FromStr, SplitAsciiWhitespace};

use geometry::{Camera, Intrinsics, Lens, LensModel, rotation_from_matrix};
use keypoints::{BODY_25, Way, joint_ways};
use nalgebra::{Isometry3, Matrix3, Point3, Translation3};
use people::{Detection, Keypoint, View};
use serde::Deserialize;

/// Number of keypoints in OpenPose's body-25.
const N_KEYPOINTS: usize = 25;
/// Number of joints in the truth: the first twelve of `skeleton::PARSE14`, the bottom and the top of the head, and the middle of the hips.
pub(super) const N_TRUE: usize = 15;
/// Keypoints at the two ends of each of OpenPose's 26 part affinity fields.
const FIELDS: [[usize; 26]; 2] = [
    [
        1, 9, 10, 8, 8, 12, 13, 1, 2, 3, 2, 1, 5, 6, 5, 1, 0, 0, 15, 16, 14, 19, 14, 11, 22, 11,
    ],
    [
        8, 10, 11, 9, 12, 13, 14, 2, 3, 4, 17, 5, 6, 7, 18, 0, 15, 16, 17, 18, 19, 20, 21, 22, 23,
        24,
    ],
];
/// Largest number of candidates for a keypoint, and of people in a frame.
const MOST: usize = 1000;
/// Smallest number of keypoints of a person.
const LEAST_KEYPOINTS: usize = 5;
/// Confidence of a keypoint below which it is ignored.
const LEAST_CONFIDENCE: f64 = 0.05;
/// Standard deviation of a keypoint with full confidence, as a fraction of the person's size in the picture. With lower confidence, the
/// standard deviation is larger.
const SD_SHARE: f64 = 0.02;

/// Reason why a set could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ShelfError {
    /// A file could not be read.
    #[error("cannot read {}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// The calibration does not have the expected form.
    #[error("{} is not a calibration of this layout: {reason}", path.display())]
    Calibration {
        /// The file.
        path: PathBuf,
        /// Reason for the error.
        reason: String,
    },
    /// A text file of numbers does not have the expected form.
    #[error("{}: number {number} of the file is missing or wrong: expected {expected}", path.display())]
    Number {
        /// The file.
        path: PathBuf,
        /// Position of the number in the file, counted from 1.
        number: usize,
        /// Description of the expected number.
        expected: &'static str,
    },
}

/// A true person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TruePerson {
    /// Id of the person.
    pub id: usize,
    /// The joints, in metres.
    pub joints: [Point3<f64>; N_TRUE],
}

/// Returns true if a folder has this layout.
pub fn is_one(folder: &Path) -> bool {
    ["calibration.json", "gt.txt", "detection/0.txt"]
        .iter()
        .all(|file| folder.join(file).is_file())
}

/// A set of detections with truth.
#[derive(Debug, Clone, Default)]
pub struct Shelf {
    /// The cameras.
    pub cameras: Vec<Camera>,
    /// Detections by frame and view.
    pub frames: Vec<Vec<View>>,
    /// True people by frame.
    pub truth: Vec<Vec<TruePerson>>,
}

impl Shelf {
    /// Reads a folder.
    ///
    /// # Errors
    ///
    /// Fails with [`ShelfError`].
    pub fn read(folder: &Path) -> Result<Self, ShelfError> {
        let cameras = cameras(&folder.join("calibration.json"))?;
        let mut views = Vec::with_capacity(cameras.len());
        for (view, camera) in cameras.iter().enumerate() {
            views.push(
                detections(&folder.join(format!("detection/{view}.txt")), camera)?.into_iter(),
            );
        }
        let truth = truth(&folder.join("gt.txt"))?;
        let frames = (0..truth.len())
            .map(|_| views.iter_mut().map(|view| view.next().unwrap_or_default()).collect());
        Ok(Self {
            cameras,
            frames: frames.collect(),
            truth,
        })
    }

    /// Returns the set with some of the views.
    #[must_use]
    pub fn with_views(&self, views: &[usize]) -> Self {
        Self {
            cameras: views.iter().map(|view| self.cameras[*view].clone()).collect(),
            frames: self
                .frames
                .iter()
                .map(|frame| views.iter().map(|view| frame[*view].clone()).collect())
                .collect(),
            truth: self.truth.clone(),
        }
    }
}

#[derive(Deserialize)]
struct CameraEntry {
    #[serde(rename = "K")]
    intrinsic: [f64; 9],
    #[serde(rename = "RT")]
    extrinsic: [f64; 12],
    #[serde(rename = "imgSize")]
    size: [u32; 2],
}

fn cameras(path: &Path) -> Result<Vec<Camera>, ShelfError> {
    let refuse = |reason: String| ShelfError::Calibration {
        path: path.to_owned(),
        reason,
    };
    let text = read(path)?;
    let entries: BTreeMap<usize, CameraEntry> =
        serde_json::from_str(&text).map_err(|error| refuse(error.to_string()))?;
    let camera = |(name, entry): (&usize, &CameraEntry)| {
        let [fx, _, cx, _, fy, cy, ..] = entry.intrinsic;
        let m = entry.extrinsic;
        let rotation = Matrix3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
        let rotation = rotation_from_matrix(&rotation)
            .map_err(|error| refuse(format!("RT of camera {name}: {error}")))?;
        Ok(Camera {
            name: name.to_string(),
            intrinsics: Intrinsics {
                fx,
                fy,
                cx,
                cy,
                size: entry.size,
                lens: Lens::new(LensModel::Pinhole),
            },
            camera_from_world: Isometry3::from_parts(
                Translation3::new(m[3], m[7], m[11]),
                rotation,
            ),
        })
    };
    entries.iter().map(camera).collect()
}

fn read(path: &Path) -> Result<String, ShelfError> {
    fs::read_to_string(path).map_err(|source| ShelfError::Read {
        path: path.to_owned(),
        source,
    })
}

/// Reads the numbers of a text file one by one.
struct Numbers<'a> {
    path: &'a Path,
    words: SplitAsciiWhitespace<'a>,
    n_read: usize,
}

impl<'a> Numbers<'a> {
    fn new(path: &'a Path, text: &'a str) -> Self {
        Self {
            path,
            words: text.split_ascii_whitespace(),
            n_read: 0,
        }
    }

    fn next<T: FromStr>(&mut self, expected: &'static str) -> Result<T, ShelfError> {
        let next = self.words.next();
        self.n_read += 1;
        let number = self.n_read;
        let value = next.and_then(|word| word.parse().ok());
        value.ok_or_else(|| ShelfError::Number {
            path: self.path.to_owned(),
            number,
            expected,
        })
    }

    /// Reads a count, and checks its limit.
    fn count(&mut self, expected: &'static str) -> Result<usize, ShelfError> {
        let count: usize = self.next(expected)?;
        if count <= MOST {
            return Ok(count);
        }
        Err(ShelfError::Number {
            path: self.path.to_owned(),
            number: self.n_read,
            expected,
        })
    }

    fn many(&mut self, n: usize) -> Result<Vec<f64>, ShelfError> {
        (0..n).map(|_| self.next("a number")).collect()
    }
}

/// The candidate of each keypoint that a person has.
type Group = [Option<usize>; N_KEYPOINTS];

/// The candidates of a keypoint: columns, rows and confidences.
type Candidates = Vec<[f64; 3]>;

fn detections(path: &Path, camera: &Camera) -> Result<Vec<View>, ShelfError> {
    let text = read(path)?;
    let mut numbers = Numbers::new(path, &text);
    let _kind: usize = numbers.next("4, OpenPose's body-25")?;
    let n_frames: usize = numbers.next("the number of frames")?;
    let [width, height] = camera.intrinsics.size.map(|side| f64::from(side) - 1.0);
    let mut frames = Vec::new();
    for _ in 0..n_frames {
        let mut candidates: Vec<Candidates> = Vec::with_capacity(N_KEYPOINTS);
        for _ in 0..N_KEYPOINTS {
            let n = numbers.count("a number of candidates, at most 1000")?;
            let rows = numbers.many(3 * n)?;
            candidates.push(
                (0..n)
                    .map(|i| [rows[i] * width, rows[n + i] * height, rows[2 * n + i]])
                    .collect(),
            );
        }
        let mut fields = Vec::with_capacity(FIELDS[0].len());
        for (from, to) in FIELDS[0].iter().zip(&FIELDS[1]) {
            fields.push(numbers.many(candidates[*from].len() * candidates[*to].len())?);
        }
        frames.push(grouped(&candidates, &fields));
    }
    Ok(frames)
}

/// Groups candidates into people, beginning with the strongest field between two candidates. Each person has at most one candidate for each
/// keypoint.
fn grouped(candidates: &[Candidates], fields: &[Vec<f64>]) -> View {
    struct Edge {
        strength: f64,
        ends: [(usize, usize); 2],
    }
    let mut edges = Vec::new();
    for (field, strengths) in fields.iter().enumerate() {
        let [from, to] = [FIELDS[0][field], FIELDS[1][field]];
        let n_to = candidates[to].len().max(1);
        let each = strengths.iter().enumerate().filter(|(_, strength)| **strength > 0.0);
        edges.extend(each.map(|(nth, strength)| Edge {
            strength: *strength,
            ends: [(from, nth / n_to), (to, nth % n_to)],
        }));
    }
    edges.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    let mut groups: Vec<Group> = Vec::new();
    for Edge { ends: [a, b], .. } in edges {
        let owner = |(keypoint, candidate): (usize, usize)| {
            groups.iter().position(|group| group[keypoint] == Some(candidate))
        };
        match (owner(a), owner(b)) {
            (None, None) => {
                let mut group = [None; N_KEYPOINTS];
                (group[a.0], group[b.0]) = (Some(a.1), Some(b.1));
                groups.push(group);
            }
            (Some(one), None) => _ = groups[one][b.0].get_or_insert(b.1),
            (None, Some(one)) => _ = groups[one][a.0].get_or_insert(a.1),
            (Some(one), Some(other)) if one != other => {
                let both = groups[one].iter().zip(&groups[other]);
                if both.into_iter().all(|(a, b)| a.is_none() || b.is_none()) {
                    let taken = groups.remove(other);
                    let one = if other < one { one - 1 } else { one };
                    for (own, more) in groups[one].iter_mut().zip(taken) {
                        *own = own.or(more);
                    }
                }
            }
            _ => {}
        }
    }
    groups.retain(|group| group.iter().flatten().count() >= LEAST_KEYPOINTS);
    seen(candidates, &groups)
}

/// Returns the groups as people, and the candidates that belong to no person.
fn seen(candidates: &[Candidates], groups: &[Group]) -> View {
    let ways = joint_ways(&BODY_25.map(str::to_owned));
    let sizes: Vec<f64> = groups.iter().map(|group| size(candidates, group)).collect();
    let people = groups.iter().zip(&sizes);
    let detections = people.map(|(group, size)| Detection {
        joints: core::array::from_fn(|nth| {
            let complete =
                |way: &&Way| way.row.iter().all(|(keypoint, _)| group[*keypoint].is_some());
            joint(candidates, group, ways[nth].iter().find(complete)?, *size)
        }),
        colour: None,
    });
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let loose = ways.iter().map(|ways| {
        let [Way { row, .. }] = &ways[..] else {
            return Vec::new();
        };
        let [(keypoint, _)] = row[..] else {
            return Vec::new();
        };
        let is_free =
            |candidate: &usize| groups.iter().all(|group| group[keypoint] != Some(*candidate));
        let free = (0..candidates[keypoint].len()).filter(is_free);
        free.filter_map(|candidate| placed(candidates[keypoint][candidate], largest))
            .collect()
    });
    View {
        detections: detections.collect(),
        loose: loose.collect(),
    }
}

/// Returns a candidate with its standard deviation; `None` if the confidence is too low.
///
/// * `size`: size of the person in the picture, in pixels.
fn placed([x, y, confidence]: [f64; 3], size: f64) -> Option<Keypoint> {
    let sd_px = (SD_SHARE * size / confidence.max(LEAST_CONFIDENCE).sqrt()).max(1.0);
    (confidence > LEAST_CONFIDENCE).then_some(Keypoint {
        at_px: [x, y],
        sd_px,
        heat: confidence.min(1.0),
    })
}

/// Returns a joint as the weighted sum of the keypoints in `way`.
fn joint(candidates: &[Candidates], group: &Group, way: &Way, size: f64) -> Option<Keypoint> {
    let mut joint = Keypoint {
        at_px: [0.0; 2],
        sd_px: 0.0,
        heat: 1.0,
    };
    for (keypoint, weight) in &way.row {
        let one = placed(candidates[*keypoint][group[*keypoint]?], size)?;
        joint.at_px[0] += weight * one.at_px[0];
        joint.at_px[1] += weight * one.at_px[1];
        joint.sd_px = joint.sd_px.hypot(weight * one.sd_px);
        joint.heat = joint.heat.min(one.heat);
    }
    joint.sd_px = joint.sd_px.hypot(way.spread * size);
    Some(joint)
}

/// Returns the longer side of the box around a person, in pixels.
fn size(candidates: &[Candidates], group: &Group) -> f64 {
    let side = |axis: usize| {
        let each = group
            .iter()
            .enumerate()
            .filter_map(|(keypoint, it)| Some(candidates[keypoint][(*it)?][axis]));
        let ends = each.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| {
            [low.min(at), high.max(at)]
        });
        ends[1] - ends[0]
    };
    side(0).max(side(1))
}

fn truth(path: &Path) -> Result<Vec<Vec<TruePerson>>, ShelfError> {
    let text = read(path)?;
    let mut numbers = Numbers::new(path, &text);
    let is_expected = numbers.next::<usize>("15, the number of joints")? == N_TRUE;
    if !is_expected {
        return Err(ShelfError::Number {
            path: path.to_owned(),
            number: 1,
            expected: "15, the number of joints",
        });
    }
    let n_frames: usize = numbers.next("the number of frames")?;
    let mut frames = Vec::new();
    for _ in 0..n_frames {
        let n = numbers.count("a number of people, at most 1000")?;
        let mut people = Vec::with_capacity(n);
        for _ in 0..n {
            let id = numbers.next("an identity")?;
            let rows = numbers.many(4 * N_TRUE)?;
            let at = |joint: usize| [0, 1, 2].map(|axis| rows[axis * N_TRUE + joint]);
            people.push(TruePerson {
                id,
                joints: core::array::from_fn(|joint| Point3::from(at(joint))),
            });
        }
        frames.push(people);
    }
    Ok(frames)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns two candidates of every keypoint, 100 pixels apart, for two people.
    fn candidates() -> (Vec<Candidates>, Vec<Vec<f64>>) {
        let both = |nth: usize| [100.0, 200.0].map(|x| [x, 10.0 * nth as f64, 0.9]).to_vec();
        let field = vec![0.9, 0.1, 0.1, 0.8];
        (
            (0..N_KEYPOINTS).map(both).collect(),
            vec![field; FIELDS[0].len()],
        )
    }

    #[test]
    fn the_strongest_fields_connect_joints_to_people_and_other_joints_stay_unassigned() {
        let (mut candidates, mut fields) = candidates();
        // A third right wrist, which no field connects to another keypoint.
        candidates[4].push([300.0, 40.0, 0.5]);
        for field in [8, 9].into_iter().filter(|field| FIELDS[1][*field] == 4) {
            fields[field] = vec![0.9, 0.1, 0.0, 0.1, 0.8, 0.0];
        }
        let view = grouped(&candidates, &fields);
        assert_eq!(view.detections.len(), 2);
        for detection in &view.detections {
            let x = detection.joints[0].unwrap().at_px[0];
            assert!(detection.joints.iter().all(|joint| joint.unwrap().at_px[0] == x));
        }
        assert_eq!(view.loose[6].len(), 1);
        assert_eq!(view.loose.iter().flatten().count(), 1);
    }

    #[test]
    fn the_error_for_a_truncated_file_names_the_number_of_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("gt.txt");
        fs::write(&file, "15 2 1 0 0.5 0.5").unwrap();
        let error = truth(&file).unwrap_err().to_string();
        assert!(
            error.ends_with("gt.txt: number 7 of the file is missing or wrong: expected a number"),
            "{error}"
        );
    }
}
