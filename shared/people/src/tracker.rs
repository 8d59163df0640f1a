//! Tracks people from frame to frame under lasting ids.

use geometry::Camera;
use skeleton::body::Joints;

use crate::assignment::{NEVER, assign};
use crate::bones::LEAST_KINDS;
use crate::cluster::{Member, clusters};
use crate::coarse::{Coarse, agree};
use crate::colour::difference;
use crate::distance::{of_people, to_person};
use crate::frame::Place;
use crate::memory::{Memory, Remembered, remembered, revived};
use crate::settings::Settings;
use crate::track::Track;
use crate::{Frame, N, Person, State, View};

/// Minimum number of joints of a new person, not counting the head.
const LEAST_CORE: usize = 6;
/// Minimum number of joints, not counting the head, from which the position of a known person is updated.
const LEAST_SEEN: usize = 5;
/// Two people whose trunks are closer than this cannot be distinguished, in metres.
const ONE_M: f64 = 0.3;
/// Distance, in metres, that is added to the maximum distance for single detections if an unseen person is searched for.
const TAKEN_UP_M: f64 = 0.25;
/// Maximum distance, in metres, at which a new person is taken for a person who was lost; the next constant is the maximum mean difference
/// of the logarithms of the bone lengths.
const MISSED_M: f64 = 1.5;
const OTHER_BONES: f64 = 0.15;
/// A person is dropped after this time without being seen, in seconds.
const DEATH_S: f64 = 1.0;
/// A person can be recognised for this time after being dropped, in seconds.
const REMEMBERED_S: f64 = 60.0;
/// Limits for recognising a person: maximum mean difference of the logarithms of the bone lengths, minimum number of bones of one kind, and
/// maximum difference of the trunk colours.
const SAME_BONES: f64 = 0.06;
const BONES_TO_KNOW: f64 = 20.0;
const SAME_COLOUR: f64 = 0.2;
/// Factor in the cost of a detection whose colour fits another person nearby better, in metres per unit of colour difference; the next
/// constant is the maximum distance of that other person, in metres.
const COLOUR_M: f64 = 2.0;
const RIVAL_M: f64 = 2.0;
/// A person is left without a detection rather than given one that costs more than this multiple of the largest reach.
const UNSEEN: f64 = 2.0;
/// A missed person is recognised by the colour of the trunk within [`MISSED_M`], if the colours differ by less than this.
const SAME_CLOTHES: f64 = 0.12;
/// Number of views that must see a new person; in a smaller rig, all views must.
const VIEWS_AT_ONCE: usize = 3;

/// Identifies people frame by frame.
///
/// 1. The tracker predicts the position of every known person.
/// 2. In every view, it assigns detections to the people whose joints are nearest to the detections' rays.
/// 3. It groups the remaining detections: detections of different views whose rays pass close to each other are one person.
/// 4. A detection that contradicts its person goes back to step 3, at most once. A group whose bone lengths are impossible for a person is
///    rejected.
/// 5. A new person must be seen by three views, or by all views if there are fewer. The person is confirmed after three of five frames, or
///    at once if no known person is seen. A person who was not seen for a second is dropped. Within a minute, the tracker can recognise
///    this person by the bones and the colour of the trunk.
#[derive(Debug, Clone)]
pub struct Tracker {
    cameras: Vec<Camera>,
    /// The views, sorted by the names of their cameras.
    order: Vec<usize>,
    settings: Settings,
    tracks: Vec<Track>,
    gone: Vec<Remembered>,
    last_id: u64,
    /// Time at which the last frame was taken, in seconds.
    last_s: Option<f64>,
}

/// The current frame, with the expected positions of known people.
struct Now<'a> {
    frame: &'a Frame,
    time_s: f64,
    /// Time since the previous frame, in seconds.
    gap_s: f64,
    expected: &'a [Joints],
}

impl Tracker {
    /// Creates a tracker that knows no people yet.
    ///
    /// * `cameras`: the cameras of the views, in the order of the views passed to [`step`](Self::step).
    pub fn new(cameras: Vec<Camera>, settings: Settings) -> Self {
        Self::resume(cameras, settings, &Memory::default())
    }

    /// Creates a tracker that continues the work of another tracker. Only the people whom that tracker was still following are expected;
    /// the others can be recognised.
    pub fn resume(cameras: Vec<Camera>, settings: Settings, memory: &Memory) -> Self {
        let mut order: Vec<usize> = (0..cameras.len()).collect();
        order.sort_by(|a, b| cameras[*a].name.cmp(&cameras[*b].name));
        let last_id = memory.people.iter().map(|person| person.id).max();
        let last_s = memory.last_s;
        let is_gone =
            |person: &&Remembered| last_s.is_some_and(|last_s| last_s - person.seen_s > DEATH_S);
        let (gone, followed): (Vec<_>, Vec<_>) = memory.people.iter().partition(is_gone);
        Self {
            cameras,
            order,
            settings,
            tracks: followed.into_iter().map(revived).collect(),
            gone: gone.into_iter().cloned().collect(),
            last_id: memory.last_id.max(last_id.unwrap_or(0)),
            last_s,
        }
    }

    /// Returns the state that another tracker needs to continue from here.
    pub fn memory(&self) -> Memory {
        let known = self.tracks.iter().filter_map(remembered);
        Memory {
            last_id: self.last_id,
            last_s: self.last_s,
            people: known.chain(self.gone.iter().cloned()).collect(),
        }
    }

    /// Returns the people of the next frame, in the order of their ids.
    ///
    /// * `time_s`: time at which the frame was taken, in seconds; not before that of the last frame.
    /// * `views`: one view per camera, in the order of the cameras; a missing view has no detections.
    pub fn step(&mut self, time_s: f64, views: &[View]) -> Vec<Person> {
        let frame = Frame::new(&self.cameras, &self.order, views, self.settings.as_seen);
        let expected: Vec<Joints> =
            self.tracks.iter().map(|track| track.expected(time_s)).collect();
        let mut free: Vec<Vec<Place>> =
            (0..frame.n_views()).map(|view| frame.places(view).collect()).collect();
        let now = Now {
            frame: &frame,
            time_s,
            gap_s: self.last_s.map_or(0.0, |last| time_s - last),
            expected: &expected,
        };
        self.tracks.iter_mut().for_each(Track::wait);
        let mut members = vec![Vec::new(); self.tracks.len()];
        for is_known in [true, false] {
            self.follow(&now, &mut free, &mut members, is_known);
        }
        self.place(&now, members, &mut free);
        // Detections that contradict a group get a second chance to form a group.
        for _ in 0..2 {
            self.group(&now, &mut free);
        }
        self.bury(time_s);
        let births = self.births(&frame, time_s);
        self.last_s = Some(time_s);
        self.mark_near();
        self.people(&frame, &births)
    }

    /// Returns true if a track gets detections with the same priority as a known person. If detections are doubtful, this includes tracks
    /// that have been seen for some frames. Otherwise, a known person who is hidden would take the detections of a person nearby.
    fn is_established(&self, track: &Track) -> bool {
        track.id.is_some() || self.settings.is_doubtful() && track.is_somebody()
    }

    /// Assigns the detections of every view to the known people.
    fn follow(
        &self,
        now: &Now<'_>,
        free: &mut [Vec<Place>],
        members: &mut [Vec<Member>],
        is_known: bool,
    ) {
        let frame = now.frame;
        let rows: Vec<usize> = (0..self.tracks.len())
            .filter(|nth| self.is_established(&self.tracks[*nth]) == is_known)
            .collect();
        let reaches = rows.iter().map(|track| self.tracks[*track].reach(now.time_s, now.gap_s));
        let unseen = UNSEEN * reaches.fold(0.0, f64::max);
        for free in free.iter_mut() {
            let fit = |row: usize, column: usize| {
                let track = rows[row];
                let fit = to_person(
                    frame.sights(free[column]),
                    &now.expected[track],
                    frame.as_seen,
                );
                let fit = fit
                    .filter(|fit| fit.distance < self.tracks[track].reach(now.time_s, now.gap_s))?;
                Some((fit, fit.distance + self.by_colour(now, track, free[column])))
            };
            let fits: Vec<_> = (0..rows.len())
                .map(|row| (0..free.len()).map(|column| fit(row, column)).collect::<Vec<_>>())
                .collect();
            let n = free.len();
            let cost = |row: usize, column: usize| {
                if column < n {
                    fits[row][column].map_or(NEVER, |(_, cost)| cost)
                } else {
                    unseen
                }
            };
            let assigned = assign(rows.len(), n + rows.len(), cost);
            let mut taken = Vec::new();
            for (row, column) in assigned.into_iter().enumerate() {
                let Some((column, (fit, _))) = column
                    .filter(|column| *column < n)
                    .and_then(|column| Some((column, fits[row][column]?)))
                else {
                    continue;
                };
                members[rows[row]].push(Member {
                    at: free[column],
                    is_exchanged: fit.is_exchanged,
                });
                taken.push(free[column]);
            }
            free.retain(|at| !taken.contains(at));
        }
    }

    /// Returns the cost in metres of a detection whose colour fits another person nearby better than the track.
    fn by_colour(&self, now: &Now<'_>, track: usize, at: Place) -> f64 {
        let frame = now.frame;
        let Some(own) = self.tracks[track].colours.difference(frame, at) else {
            return 0.0;
        };
        let others = self.tracks.iter().zip(now.expected).enumerate();
        let others = others.filter_map(|(nth, (other, expected))| {
            let by = other.colours.difference(frame, at).filter(|_| nth != track)?;
            let fit = to_person(frame.sights(at), expected, frame.as_seen)?;
            (fit.distance < RIVAL_M).then_some(by)
        });
        let other = others.fold(f64::INFINITY, f64::min);
        COLOUR_M * (own - other).max(0.0)
    }

    /// Updates the people for whom detections were assigned.
    fn place(&mut self, now: &Now<'_>, members: Vec<Vec<Member>>, free: &mut [Vec<Place>]) {
        let &Now {
            frame,
            time_s,
            gap_s,
            ..
        } = now;
        let each = self.tracks.iter_mut().zip(members).zip(now.expected);
        for ((track, members), expected) in each {
            let agreed = agree(frame, members, Some(expected));
            give_back(free, &agreed.refused);
            let n = agreed.members.len();
            // The rays of two views that pass close to this person can meet at another one.
            let moved = of_people(expected, &agreed.person.joints).filter(|_| n == 2);
            if moved.is_some_and(|moved| moved > track.reach(time_s, gap_s) + TAKEN_UP_M) {
                give_back(free, &agreed.members);
                continue;
            }
            let is_placed =
                n >= self.settings.min_views.max(2) && agreed.person.n_core() >= LEAST_SEEN;
            // Rays to two different people can also meet.
            let is_nobody =
                is_placed && n == 2 && self.settings.is_doubtful() && !agreed.person.is_body();
            if is_placed && !is_nobody {
                track.place(time_s, frame, agreed.members, &agreed.person);
            } else if n >= 1 && !is_nobody && track.id.is_some() {
                track.glimpse(time_s, frame, agreed.members);
            } else {
                give_back(free, &agreed.members);
            }
        }
    }

    /// Groups the unassigned detections into people.
    fn group(&mut self, now: &Now<'_>, free: &mut [Vec<Place>]) {
        let frame = now.frame;
        let all: Vec<Place> = free.iter().flatten().copied().collect();
        for members in clusters(frame, &all) {
            let agreed = agree(frame, members, None);
            let person = agreed.person;
            let is_one = agreed.members.len() >= self.settings.min_views.max(2)
                && person.n_core() >= LEAST_CORE
                && person.is_body();
            if !is_one {
                continue;
            }
            for member in &agreed.members {
                free[member.at.view].retain(|at| *at != member.at);
            }
            self.take(now, agreed.members, &person);
        }
    }

    /// Assigns a group to the person that it shows: a person already found in this frame, a missed person, or a new one.
    fn take(&mut self, now: &Now<'_>, members: Vec<Member>, person: &Coarse) {
        let &Now {
            frame,
            time_s,
            gap_s,
            ..
        } = now;
        let is_placed = |track: &Track| track.state == State::Tracked;
        let twin = self.tracks.iter_mut().find(|track| {
            let distance = of_people(&track.coarse.joints, &person.joints);
            is_placed(track) && distance.is_some_and(|distance| distance < ONE_M)
        });
        if let Some(twin) = twin {
            let is_free =
                |member: &Member| twin.members.iter().all(|own| own.at.view != member.at.view);
            let more: Vec<Member> = members.into_iter().filter(is_free).collect();
            let agreed = agree(frame, [twin.members.clone(), more].concat(), None);
            if agreed.members.len() > twin.members.len() {
                twin.coarse = Coarse {
                    joints: core::array::from_fn(|joint| {
                        agreed.person.joints[joint].or(twin.coarse.joints[joint])
                    }),
                    covariances: core::array::from_fn(|joint| {
                        agreed.person.covariances[joint].or(twin.coarse.covariances[joint])
                    }),
                };
                twin.members = agreed.members;
            }
            return;
        }
        let missed = self.tracks.iter().zip(now.expected).enumerate();
        let missed = missed.filter(|(_, (track, _))| !is_placed(track));
        let near = missed.filter_map(|(nth, (track, expected))| {
            let distance = of_people(expected, &person.joints)?;
            let colour = track.colours.mean_difference(frame, &members);
            let is_alike = colour.is_some_and(|colour| colour < SAME_CLOTHES);
            let reach = track.reach(time_s, gap_s) + TAKEN_UP_M;
            let is_near = distance < if is_alike { reach.max(MISSED_M) } else { reach };
            is_near.then_some((track.id.is_none(), distance, nth))
        });
        let nearest = near.min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        if let Some((_, _, nth)) = nearest {
            self.tracks[nth].place(time_s, frame, members, person);
        } else {
            let mut track = Track::new(time_s);
            track.place(time_s, frame, members, person);
            self.tracks.push(track);
        }
    }

    /// Drops people who have not been seen for too long.
    fn bury(&mut self, time_s: f64) {
        let (alive, dead) = self.tracks.drain(..).partition(|track: &Track| match track.id {
            Some(_) => time_s - track.seen_s <= DEATH_S,
            None => track.is_possible(),
        });
        self.tracks = alive;
        self.gone.extend(dead.iter().filter_map(remembered));
        self.gone.retain(|person| time_s - person.seen_s <= REMEMBERED_S);
    }

    /// Gives ids to the tracks that are now confirmed to be people.
    fn births(&mut self, frame: &Frame, time_s: f64) -> Vec<u64> {
        let is_known = |track: &Track| track.id.is_some() && track.state != State::Lost;
        let is_empty = !self.tracks.iter().any(is_known);
        let needed = VIEWS_AT_ONCE.min(frame.n_seeing()).max(2);
        // If the detector reports people everywhere, a new person must be seen with high confidence.
        let is_doubtful = self.settings.is_doubtful();
        let is_rich = frame.n_seeing() > VIEWS_AT_ONCE;
        let clear = if is_rich { VIEWS_AT_ONCE } else { 2 };
        let mut births = Vec::new();
        for nth in 0..self.tracks.len() {
            let track = &self.tracks[nth];
            // If only two of many views see a person, there is often nobody: rays to two different people can also meet.
            let (needed, clear) = if track.is_lasting() {
                (2, 2)
            } else {
                (needed, clear)
            };
            let is_clear = track.members.len() >= needed
                && track.n_clear(frame, self.settings.least_heat) >= clear
                && track.n_well_seen(frame, self.settings.least_heat) >= N / 2;
            let is_there =
                |track: &&Track| track.id.is_some() && (!is_doubtful || track.is_possible());
            let n_known = self.tracks.iter().filter(is_there).count();
            let is_born = track.id.is_none()
                && track.state == State::Tracked
                && (is_clear || !is_doubtful)
                && (is_empty && is_clear || track.is_somebody())
                && n_known < self.settings.max;
            if !is_born {
                continue;
            }
            let id = self.identity(nth, time_s);
            self.last_id = self.last_id.max(id);
            self.tracks[nth].id = Some(id);
            births.push(id);
        }
        births
    }

    /// Returns the id for a new track: that of a missed or recognised person, whose bone lengths are then reused, or the next free id.
    fn identity(&mut self, nth: usize, time_s: f64) -> u64 {
        if let Some(missed) = self.missed(&self.tracks[nth]) {
            let bones = self.tracks[missed].bones;
            let id = self.tracks[missed].id.take();
            self.tracks[nth].bones = bones;
            return id.unwrap_or(self.last_id + 1);
        }
        let gone = self.known_again(&self.tracks[nth], time_s);
        gone.map_or(self.last_id + 1, |gone| {
            let known = self.gone.remove(gone);
            self.tracks[nth].bones = known.bones;
            known.id
        })
    }

    /// Returns the nearest missed person who is close enough to be the new person.
    fn missed(&self, new: &Track) -> Option<usize> {
        let trunk = new.trunk()?;
        let each = self.tracks.iter().enumerate().filter_map(|(nth, track)| {
            let is_missed = track.id.is_some() && !track.is_possible();
            let distance = (track.trunk()? - trunk).norm();
            let is_another = track.bones.difference(&new.bones).is_some_and(|by| by > OTHER_BONES);
            (is_missed && distance < MISSED_M && !is_another).then_some((nth, distance))
        });
        each.min_by(|a, b| a.1.total_cmp(&b.1)).map(|nearest| nearest.0)
    }

    /// Returns the dropped person with the same bones and the same colour.
    fn known_again(&self, track: &Track, time_s: f64) -> Option<usize> {
        let each = self.gone.iter().enumerate().filter_map(|(nth, person)| {
            let n_known = person.bones.n.iter().filter(|n| **n >= BONES_TO_KNOW).count();
            let bones = track.bones.difference(&person.bones)?;
            let colour = track.colours.overall().zip(person.colour);
            let colour = colour.map_or(0.0, |(new, old)| difference(new, old));
            let is_same = n_known >= LEAST_KINDS && bones < SAME_BONES && colour < SAME_COLOUR;
            let is_past = time_s > person.seen_s;
            (is_same && is_past).then_some((nth, bones / SAME_BONES + colour / SAME_COLOUR))
        });
        each.min_by(|a, b| a.1.total_cmp(&b.1)).map(|nearest| nearest.0)
    }

    /// Marks people who are too close to each other to be distinguished.
    fn mark_near(&mut self) {
        let trunks: Vec<_> = self
            .tracks
            .iter()
            .map(|track| track.trunk().filter(|_| track.state == State::Tracked))
            .collect();
        for (nth, track) in self.tracks.iter_mut().enumerate() {
            let is_near = trunks.iter().enumerate().any(|(other, trunk)| {
                other != nth && trunks[nth].zip(*trunk).is_some_and(|(a, b)| (a - b).norm() < ONE_M)
            });
            if is_near {
                track.state = State::Unsure;
            }
        }
    }

    /// Returns the people in the order of their ids.
    fn people(&self, frame: &Frame, births: &[u64]) -> Vec<Person> {
        let person = |track: &Track| {
            let id = track.id?;
            let mut detections = vec![None; self.cameras.len()];
            let mut is_exchanged = vec![false; self.cameras.len()];
            for member in &track.members {
                let view = self.order[member.at.view];
                detections[view] = Some(frame.given(member.at));
                is_exchanged[view] = member.is_exchanged;
            }
            let is_new = births.contains(&id);
            Some(Person {
                id,
                state: if is_new { State::New } else { track.state },
                detections,
                is_exchanged,
                joints: track.coarse.joints,
                covariances: track.coarse.covariances,
                velocity: track.velocity,
            })
        };
        let mut people: Vec<Person> = self.tracks.iter().filter_map(person).collect();
        people.sort_by_key(|person| person.id);
        people
    }
}

/// Makes detections available again.
fn give_back(free: &mut [Vec<Place>], members: &[Member]) {
    for member in members {
        let free = &mut free[member.at.view];
        free.push(member.at);
        free.sort_unstable();
    }
}
