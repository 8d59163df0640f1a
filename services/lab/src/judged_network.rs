//! Evaluation of a network on pictures of people with known joints.

use crate::evaluation::{Joints, Pictures};
use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use keypoints::Keypoint;
use posenetwork::{
    Detector, JointMaps, LookMemory, Looker, MapSettings, PoseNetwork, Turn, outline_of,
};
use training::datasets::{People, Person, Picture, Sides};

use crate::judged::{pictures, truth};

/// Index of the neck in `skeleton::PARSE14`.
const NECK: usize = 12;
/// Index of the top of the head in `skeleton::PARSE14`.
const HEAD: usize = 13;

/// A network, and the method that finds the boxes for its input.
#[derive(Debug)]
pub struct NetworkReader {
    /// The network.
    pub network: PoseNetwork,
    /// Meaning of left and right in the labels.
    pub sides: Sides,
    /// Detector that finds the boxes. Without it, the boxes around the marked joints are used.
    pub finder: Option<Detector>,
}

/// Joints that a network found on people.
#[derive(Debug)]
pub struct Seen {
    /// The joints at the maxima of the maps, which are the first entries of [`Pictures::found`].
    pub pictures: Pictures,
    /// Errors of the joints with a mark and a maximum, for each person.
    pub errors: Vec<Vec<JointError>>,
}

/// True and expected error of a joint at the maximum of its map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointError {
    /// Expected error ([`JointMaps::expected_px`]), as a fraction of the height of the network's window.
    pub expected: f64,
    /// True error, as a fraction of the same height.
    pub error: f64,
    /// True error in head lengths, from the marked top of the head to the marked neck.
    pub in_heads: f64,
}

impl JointError {
    /// Returns true if the true error is more than half a head length.
    pub fn is_far(&self) -> bool {
        self.in_heads > 0.5
    }
}

/// Evaluates a network on people. The input of the network is the box around each person's marked joints, or the detector's box.
///
/// * `stop`: checked before every person.
/// * `console`: shows every person who was left out, and the progress.
///
/// # Errors
///
/// Fails if an image cannot be read, if the network fails on an image, or on a stop request ([`ExitKind::Interrupted`]).
pub fn judged(
    reader: &NetworkReader,
    people: &People,
    stop: &Stop,
    console: &dyn Console,
) -> Result<Seen, Failure> {
    let mut errors = Vec::new();
    let mut memory = LookMemory::default();
    let mut maps = JointMaps::default();
    let find = |person: &Person| {
        stop.check("interrupted")?;
        let found = reader.find(person, &mut memory, &mut maps)?;
        if found[0].is_some() {
            errors.push(errors_of(&maps, &truth(person)));
        }
        console.advance(1);
        Ok(found)
    };
    let pictures = pictures("", people, console, |people| {
        people.iter().map(find).collect()
    })?;
    Ok(Seen { pictures, errors })
}

/// Returns the errors of a person's joints; empty if the length of the head is 0.
fn errors_of(maps: &JointMaps, truth: &Joints) -> Vec<JointError> {
    let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let head = distance(truth[NECK], truth[HEAD]);
    let [_, top, _, bottom] = maps.extent();
    let both = maps.peaks().iter().zip(truth).enumerate();
    let each = both.filter_map(|(joint, (peak, truth))| {
        let expected_px = maps.expected_px(joint)?;
        let off = distance((*peak)?.at, *truth);
        (off.is_finite() && head > 0.0).then(|| JointError {
            expected: expected_px / (bottom - top),
            error: off / (bottom - top),
            in_heads: off / head,
        })
    });
    each.collect()
}

impl NetworkReader {
    fn find(
        &self,
        person: &Person,
        memory: &mut LookMemory,
        maps: &mut JointMaps,
    ) -> Result<[Option<Joints>; 2], Failure> {
        let picture = Picture::read(&person.image).or_fail(ExitKind::Input)?;
        let looker = Looker {
            network: &self.network,
            settings: &MapSettings::default(),
        };
        let image = picture.view();
        let look = match (&self.finder, outline_of(truth(person))) {
            (Some(finder), _) => {
                let found = finder.people(image, &mut Vec::new());
                let found = found.or_fail(ExitKind::Input)?.into_iter();
                let outlines: Vec<[f64; 4]> = found.map(|person| person.outline).collect();
                looker.best_of((image, &outlines), Turn::Up, memory, maps)
            }
            (None, Some(outline)) => looker.look((image, outline), memory, maps),
            (None, None) => Ok(None),
        };
        let Some(look) = look.or_fail(ExitKind::Input)? else {
            return Ok([None, None]);
        };
        if self.sides == Sides::Marked {
            maps.name_sides(&self.network, look.front);
        }
        Ok([Some(at_peaks(maps.peaks())), None])
    }
}

/// Returns the joints at the maxima of their maps. A joint that the keypoints do not determine is not finite.
fn at_peaks(peaks: &[Option<Keypoint>]) -> Joints {
    core::array::from_fn(|joint| {
        let peak = peaks.get(joint).copied().flatten();
        peak.map_or([f64::NAN; 2], |peak| peak.at)
    })
}
