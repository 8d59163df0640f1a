//! Tracks one person from frame to frame.

use nalgebra::{Point3, Vector3};
use skeleton::body::Joints;

use crate::bones::Bones;
use crate::cluster::Member;
use crate::coarse::Coarse;
use crate::colour::Colours;
use crate::distance::named;
use crate::{Frame, N, State};

/// The joints of the trunk: shoulders, hips and neck.
const TRUNK: [usize; 5] = [2, 3, 8, 9, 12];
/// Time constant of the decay of a velocity, in seconds.
const DAMPED_S: f64 = 0.3;
/// Weight of a new velocity in the stored velocity.
const NEW_VELOCITY: f64 = 0.5;
/// Maximum distance of detections from a person's expected position, in metres; the next constant is its growth for every second without a
/// sighting.
const REACH_M: f64 = 0.25;
const REACH_M_PER_S: f64 = 0.5;
const LONGEST_S: f64 = 1.0;
/// Rays that pass within this distance of a joint show it at the same position, in metres.
const SAME_PLACE_M: f64 = 0.15;
/// Interval between frames, in seconds, above which the maximum distance of detections grows by the speed of a running person.
const SOON_S: f64 = 0.1;
const FAST_M_PER_S: f64 = 4.0;
/// Fraction of the velocity that remains after a glimpse (a detection in too few views to compute the joints). The time since the joints
/// were last computed is shortened by the same fraction.
const GLIMPSED: f64 = 0.5;
/// Maximum distance by which a glimpse moves the person, in metres; it is small because one ray does not show how far away a person is.
const GLIMPSED_M: f64 = 0.1;
/// A track becomes a person after sightings in this many of the last five frames.
const FRAMES_OF_BIRTH: u32 = 3;
const RECENT: u32 = 0b1_1111;
/// A track with sightings in this many of the last eight frames is not the result of rays of two moving people that meet by chance.
const FRAMES_OF_TWO_VIEWS: u32 = 6;
const LONG: u32 = 0b1111_1111;

/// The track of a person from frame to frame.
#[derive(Debug, Clone)]
pub(crate) struct Track {
    /// The person's id; `None` until the track is confirmed to be a person.
    pub(crate) id: Option<u64>,
    pub(crate) coarse: Coarse,
    /// Velocity of the trunk, in metres per second.
    pub(crate) velocity: Vector3<f64>,
    /// Time at which the joints were last computed, and time at which any view last saw the person, in seconds.
    pub(crate) placed_s: f64,
    pub(crate) seen_s: f64,
    /// Bit `n` is set if the person was seen `n` frames ago.
    history: u32,
    pub(crate) bones: Bones,
    pub(crate) colours: Colours,
    pub(crate) members: Vec<Member>,
    pub(crate) state: State,
}

impl Track {
    /// Creates a track without any sightings.
    pub(crate) fn new(time_s: f64) -> Self {
        Self {
            id: None,
            coarse: Coarse::UNKNOWN,
            velocity: Vector3::zeros(),
            placed_s: time_s,
            seen_s: time_s,
            history: 0,
            bones: Bones::default(),
            colours: Colours::default(),
            members: Vec::new(),
            state: State::New,
        }
    }

    /// Returns the expected positions of the joints.
    pub(crate) fn expected(&self, time_s: f64) -> Joints {
        let unseen_s = (time_s - self.placed_s).max(0.0);
        let moved = self.velocity * DAMPED_S * (1.0 - (-unseen_s / DAMPED_S).exp());
        self.coarse.joints.map(|joint| joint.map(|point| point + moved))
    }

    /// Returns the maximum distance of a matching detection, in metres.
    ///
    /// * `gap_s`: time since the previous frame, in seconds.
    pub(crate) fn reach(&self, time_s: f64, gap_s: f64) -> f64 {
        let unseen_s = (time_s - self.placed_s).clamp(0.0, LONGEST_S);
        let rare_s = (gap_s - SOON_S).clamp(0.0, LONGEST_S);
        REACH_M + REACH_M_PER_S * unseen_s + FAST_M_PER_S * rare_s
    }

    /// Returns the number of views that see at least half of the joints clearly.
    ///
    /// * `least_heat`: minimum heat of a clearly visible joint, 0 to 1.
    pub(crate) fn n_clear(&self, frame: &Frame, least_heat: f64) -> usize {
        let is_clear = |member: &&Member| {
            let sights = frame.sights(member.at).iter().flatten();
            sights.filter(|sight| sight.heat >= least_heat).count() >= N / 2
        };
        self.members.iter().filter(is_clear).count()
    }

    /// Returns the number of joints that two views see clearly and at the same position.
    ///
    /// * `least_heat`: minimum heat of a clearly visible joint, 0 to 1.
    pub(crate) fn n_well_seen(&self, frame: &Frame, least_heat: f64) -> usize {
        let is_well_seen = |joint: &usize| {
            let Some(place) = self.coarse.joints[*joint] else {
                return false;
            };
            let views = self.members.iter().filter(|member| {
                let sight = &frame.sights(member.at)[named(*joint, member.is_exchanged)];
                sight.as_ref().is_some_and(|sight| {
                    sight.heat >= least_heat && sight.distance(&place) < SAME_PLACE_M
                })
            });
            views.count() >= 2
        };
        (0..N).filter(is_well_seen).count()
    }

    /// Begins a frame in which the person has not been seen yet.
    pub(crate) fn wait(&mut self) {
        self.history <<= 1;
        self.members.clear();
        self.state = State::Lost;
    }

    /// Returns true if the track may still become a person.
    pub(crate) fn is_possible(&self) -> bool {
        self.history & 0b111 != 0
    }

    /// Returns true if the track was seen in enough of the last frames to be a person.
    pub(crate) fn is_somebody(&self) -> bool {
        (self.history & RECENT).count_ones() >= FRAMES_OF_BIRTH
    }

    /// Returns true if the track was seen for so long that two views are enough.
    pub(crate) fn is_lasting(&self) -> bool {
        (self.history & LONG).count_ones() >= FRAMES_OF_TWO_VIEWS
    }

    /// Updates the track with the joints of this frame.
    pub(crate) fn place(
        &mut self,
        time_s: f64,
        frame: &Frame,
        members: Vec<Member>,
        seen: &Coarse,
    ) {
        let expected = self.expected(time_s);
        let step_s = time_s - self.placed_s;
        if let Some(moved) = moved(&self.coarse.joints, &seen.joints).filter(|_| step_s > 0.0) {
            self.velocity += NEW_VELOCITY * (moved / step_s - self.velocity);
        }
        // An unseen joint moves with the others.
        let shift = moved(&expected, &seen.joints).unwrap_or_else(Vector3::zeros);
        for (joint, expected) in expected.iter().enumerate() {
            let unseen = expected.map(|point| point + shift);
            self.coarse.joints[joint] = seen.joints[joint].or(unseen);
            if seen.covariances[joint].is_some() {
                self.coarse.covariances[joint] = seen.covariances[joint];
            }
        }
        self.bones.add(&seen.joints);
        self.colours.add(frame, &members);
        self.members = members;
        (self.placed_s, self.seen_s) = (time_s, time_s);
        self.history |= 1;
        self.state = State::Tracked;
    }

    /// Updates the track from detections that are not enough to compute the joints, such as those of a single view: moves the joints
    /// towards the rays.
    pub(crate) fn glimpse(&mut self, time_s: f64, frame: &Frame, members: Vec<Member>) {
        let expected = self.expected(time_s);
        let (mut sum, mut n) = (Vector3::zeros(), 0.0);
        for member in &members {
            let sights = frame.sights(member.at);
            for joint in 0..N {
                let sight = sights[named(joint, member.is_exchanged)];
                if let (Some(sight), Some(point)) = (sight, expected[joint]) {
                    sum += sight.nearest(&point) - point;
                    n += 1.0;
                }
            }
        }
        let shift: Vector3<f64> = if n > 0.0 { sum / n } else { sum };
        let shift = shift.cap_magnitude(GLIMPSED_M);
        self.coarse.joints = expected.map(|joint| joint.map(|point| point + shift));
        self.velocity *= GLIMPSED;
        self.placed_s += GLIMPSED * (time_s - self.placed_s);
        self.seen_s = time_s;
        self.history |= u32::from(members.len() >= 2);
        self.members = members;
        self.state = State::Unsure;
    }

    /// Returns the centre of the trunk; `None` if no joint of the trunk is known.
    pub(crate) fn trunk(&self) -> Option<Point3<f64>> {
        let points = TRUNK.iter().filter_map(|joint| self.coarse.joints[*joint]);
        let (n, sum) = points.fold((0.0, Vector3::zeros()), |(n, sum), point| {
            (n + 1.0, sum + point.coords)
        });
        (n > 0.0).then(|| Point3::from(sum / n))
    }
}

/// Returns the mean displacement of the trunk, or of all joints if no joint of the trunk is known.
fn moved(from: &Joints, to: &Joints) -> Option<Vector3<f64>> {
    let of = |joints: &[usize]| {
        let both = joints.iter().filter_map(|joint| Some(to[*joint]? - from[*joint]?));
        let (n, sum) = both.fold((0.0, Vector3::zeros()), |(n, sum), step| {
            (n + 1.0, sum + step)
        });
        (n > 0.0).then(|| sum / n)
    };
    of(&TRUNK).or_else(|| of(&core::array::from_fn::<usize, N, _>(|joint| joint)))
}
