//! The state with which a tracker continues the work of another; it can be converted to plain numbers.

use nalgebra::{Matrix3, Point3, Vector3};
use skeleton::body::{Covariances, Joints, Kind};

use crate::bones::Bones;
use crate::colour::Colours;
use crate::track::Track;
use crate::{N, State};

/// Number of kinds of bones.
const KINDS: usize = Kind::ALL.len();
/// Numbers of a person: id, joints, covariances, velocity, time, lengths and counts of the bones, colour.
const NUMBERS_OF_PERSON: usize = 1 + 3 * N + 9 * N + 3 + 1 + 2 * KINDS + 3;

/// A person stored in a [`Memory`].
#[derive(Debug, Clone, PartialEq)]
pub struct Remembered {
    /// The person's id.
    pub id: u64,
    /// Positions of the joints, in metres in the world.
    pub joints: Joints,
    /// Covariances of the joints, in square metres.
    pub covariances: Covariances,
    /// Velocity of the trunk, in metres per second.
    pub velocity: Vector3<f64>,
    /// Time at which the joints were seen, in seconds.
    pub seen_s: f64,
    /// Bone lengths of the person.
    pub bones: Bones,
    /// Colour of the person's trunk.
    pub colour: Option<[f64; 3]>,
}

/// The state with which a tracker continues the work of another.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Memory {
    /// Highest id used so far; the next new person gets a higher id.
    pub last_id: u64,
    /// Time at which the last frame was taken, in seconds; `None` before the first frame.
    pub last_s: Option<f64>,
    /// The people, including those who have left.
    pub people: Vec<Remembered>,
}

impl Memory {
    /// Returns the memory as plain numbers, for a file or a message: the last id, the last time, then the people.
    pub fn to_numbers(&self) -> Vec<f64> {
        let mut numbers = vec![self.last_id as f64, self.last_s.unwrap_or(f64::NAN)];
        for person in &self.people {
            person.push_to(&mut numbers);
        }
        numbers
    }

    /// Reads the numbers written by [`to_numbers`](Self::to_numbers); `None` if they are not a valid memory.
    pub fn from_numbers(numbers: &[f64]) -> Option<Self> {
        let (&[last_id, last_s], people) = numbers.split_first_chunk()?;
        let (people, []) = people.as_chunks::<NUMBERS_OF_PERSON>() else {
            return None;
        };
        let people = people.iter().map(Remembered::read);
        Some(Self {
            last_id: id(last_id)?,
            last_s: Some(last_s).filter(|last_s| last_s.is_finite()),
            people: people.collect::<Option<_>>()?,
        })
    }
}

impl Remembered {
    /// Appends the person's numbers; an unknown position, covariance or colour is stored as NaN.
    fn push_to(&self, numbers: &mut Vec<f64>) {
        numbers.push(self.id as f64);
        for joint in self.joints {
            numbers.extend(joint.map_or([f64::NAN; 3], |point| point.coords.into()));
        }
        for covariance in &self.covariances {
            match covariance {
                Some(covariance) => numbers.extend(covariance),
                None => numbers.extend([f64::NAN; 9]),
            }
        }
        numbers.extend(&self.velocity);
        numbers.push(self.seen_s);
        numbers.extend(self.bones.mean_m);
        numbers.extend(self.bones.n);
        numbers.extend(self.colour.unwrap_or([f64::NAN; 3]));
    }

    fn read(numbers: &[f64; NUMBERS_OF_PERSON]) -> Option<Self> {
        let mut rest = &numbers[..];
        let mut take = |n: usize| -> Option<&[f64]> { rest.split_off(..n) };
        let known = |numbers: &[f64]| numbers.iter().all(|number| number.is_finite());
        let person = Self {
            id: id(take(1)?[0])?,
            joints: joints(take(3 * N)?),
            covariances: covariances(take(9 * N)?),
            velocity: Vector3::from_column_slice(take(3)?),
            seen_s: take(1)?[0],
            bones: Bones {
                mean_m: take(KINDS)?.try_into().ok()?,
                n: take(KINDS)?.try_into().ok()?,
            },
            colour: <[f64; 3]>::try_from(take(3)?).ok().filter(|colour| known(colour)),
        };
        let is_sound = known(person.velocity.as_slice()) && person.seen_s.is_finite();
        is_sound.then_some(person)
    }
}

/// Converts a number to an id; `None` if it is not a valid id.
fn id(number: f64) -> Option<u64> {
    let is_id = number.fract() == 0.0 && (0.0..=2.0_f64.powi(53)).contains(&number);
    is_id.then_some(number as u64)
}

fn joints(numbers: &[f64]) -> Joints {
    core::array::from_fn(|joint| {
        let place = &numbers[3 * joint..][..3];
        let is_known = place.iter().all(|number| number.is_finite());
        is_known.then(|| Point3::from_slice(place))
    })
}

fn covariances(numbers: &[f64]) -> Covariances {
    core::array::from_fn(|joint| {
        let covariance = &numbers[9 * joint..][..9];
        let is_known = covariance.iter().all(|number| number.is_finite());
        is_known.then(|| Matrix3::from_column_slice(covariance))
    })
}

pub(crate) fn remembered(track: &Track) -> Option<Remembered> {
    Some(Remembered {
        id: track.id?,
        joints: track.coarse.joints,
        covariances: track.coarse.covariances,
        velocity: track.velocity,
        seen_s: track.seen_s,
        bones: track.bones,
        colour: track.colours.overall(),
    })
}

pub(crate) fn revived(person: &Remembered) -> Track {
    let mut track = Track::new(person.seen_s);
    track.id = Some(person.id);
    track.coarse.joints = person.joints;
    track.coarse.covariances = person.covariances;
    track.velocity = person.velocity;
    track.bones = person.bones;
    track.colours = Colours::remembered(person.colour);
    track.state = State::Lost;
    track
}
