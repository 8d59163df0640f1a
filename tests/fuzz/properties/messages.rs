//! Properties of every decoder of messages. Each property starts from valid messages, which it changes as the input describes. A change has
//! ten bytes: field, entry, and value.

use std::sync::{Arc, OnceLock};

use fmp::{
    Edge, Filter, Layout, Model, ModelSpec, N_CHANNELS, PartSpec, Placement, Pose, Spring, Springs,
};
use geometry::{Camera, Intrinsics, Lens};
use kernels::Rgb8View;
use messages::{
    EvidenceHeader, FrameHeader, MAX_CANDIDATES, MAX_JOINTS, MAX_KEYPOINTS, MAX_LEVELS, MAX_PARTS,
    MAX_PEOPLE, MAX_VIEWS, PairPose, PoseMessage, Sightings, Skeletons, Stamp, Status, Timing,
    ViewQuality,
};
use multiview::{Settings, ViewPlan};
use nalgebra::Isometry3;
use pipeline::{Following, FuseStep, PairTables, SkeletonSettings, SkeletonStep, ViewResult};
use wire::Expected;

const SIZE: [usize; 2] = [80, 60];
const EXPECTED: Expected = Expected {
    session: 7,
    view: 0,
    now_nanos: 1_000_000_000,
};

/// A change of one number in a message.
#[derive(Clone, Copy)]
struct Change {
    field: u8,
    entry: u8,
    value: u64,
}

impl Change {
    fn all(input: &[u8]) -> impl Iterator<Item = Self> {
        let (changes, _) = input.as_chunks::<10>();
        changes.iter().map(|&[field, entry, ref value @ ..]| Self {
            field,
            entry,
            value: u64::from_le_bytes(*value),
        })
    }

    /// Returns an index below `n`.
    fn below(self, n: usize) -> usize {
        usize::from(self.entry) % n
    }

    fn float(self) -> f32 {
        f32::from_bits(self.value as u32)
    }

    fn double(self) -> f64 {
        f64::from_bits(self.value)
    }
}

/// A chain of three parts with one, two and three types, seen by two cameras.
struct World {
    model: Arc<Model>,
    plans: Vec<Arc<ViewPlan>>,
    fuse: FuseStep,
}

fn world() -> &'static World {
    static WORLD: OnceLock<World> = OnceLock::new();
    WORLD.get_or_init(|| {
        let model = Arc::new(model());
        let layout = Arc::new(Layout::new(&model, SIZE[0], SIZE[1]).expect("it fits"));
        let plans: Vec<_> = [0.0, 1.0]
            .map(|x| ViewPlan::new(camera(x), Arc::clone(&model), Arc::clone(&layout)))
            .map(Arc::new)
            .into();
        let settings = Settings {
            facing: false,
            ..Settings::default()
        };
        World {
            fuse: FuseStep::new(
                Arc::clone(&model),
                settings,
                plans.clone(),
                PairTables::default(),
            ),
            model,
            plans,
        }
    })
}

fn camera(x: f64) -> Camera {
    Camera {
        name: format!("at {x}"),
        intrinsics: Intrinsics {
            fx: 80.0,
            fy: 80.0,
            cx: 39.5,
            cy: 29.5,
            size: SIZE.map(|size| size as u32),
            lens: Lens::default(),
        },
        camera_from_world: Isometry3::translation(x, 0.0, 3.0),
    }
}

fn model() -> Model {
    let filter = |seed: usize| Filter {
        rows: 3,
        cols: 3,
        weights: (0..9 * N_CHANNELS).map(|i| ((seed + i) % 7) as f64 * 0.1).collect(),
    };
    let spring = Spring {
        w: [0.01, 0.0, 0.02, 0.0],
        anchor: [0, 1],
    };
    let part = |part: usize, first: usize| PartSpec {
        name: format!("part {part}"),
        filter_of_type: (first..=first + part).collect(),
        edge: (part > 0).then(|| Edge {
            parent: part - 1,
            bias: vec![vec![0.0; part + 1]; part],
            springs: Springs::PerChildType(vec![spring; part + 1]),
        }),
    };
    let spec = ModelSpec {
        name: "chain".to_owned(),
        parts: vec![part(0, 0), part(1, 1), part(2, 3)],
        filters: (0..6).map(filter).collect(),
        root_bias: 0.0,
        interval: 2,
        cell_px: 4,
        threshold: -1.0,
        mirror: None,
    };
    Model::new(spec).expect("it is a tree")
}

fn pose() -> Pose {
    let place = |mixture: u8| Placement {
        x: 2,
        y: 2,
        mixture,
    };
    Pose {
        score: 1.0,
        level: 0,
        parts: vec![place(0), place(1), place(2)],
    }
}

fn stamp() -> (Stamp, Timing) {
    let stamp = Stamp {
        session: EXPECTED.session,
        frame: 3,
        captured_at_nanos: 900_000_000,
        view: 0,
        epoch: 0,
    };
    (stamp, Timing::default())
}

fn change_stamp(stamp: &mut Stamp, timing: &mut Timing, it: Change) {
    match it.entry % 6 {
        0 => stamp.session = it.value,
        1 => stamp.frame = it.value,
        2 => stamp.captured_at_nanos = it.value,
        3 => stamp.view = it.value as u32,
        4 => timing.received_at_nanos = it.value,
        _ => timing.sent_at_nanos = it.value,
    }
}

fn change_pose(pose: &mut PoseMessage, field: u8, it: Change) {
    let part = it.below(MAX_PARTS);
    match field {
        0 => pose.score = it.float(),
        1 => pose.level = it.value as u16,
        2 => pose.n_parts = it.value as u16,
        3 => pose.x[part] = it.value as u16,
        4 => pose.y[part] = it.value as u16,
        _ => pose.mixture[part] = it.value as u8,
    }
}

/// Decodes frames, and every message that is copied. In an accepted message, the data is at the stated positions.
pub fn wire_messages(input: &[u8]) {
    frame(input);
    candidates(input);
    expected_errors(input);
    pair(input);
    result(input);
}

fn frame(input: &[u8]) {
    let (stamp, timing) = stamp();
    let mut header = FrameHeader {
        stamp,
        timing,
        width: 4,
        height: 3,
        ..FrameHeader::default()
    };
    let mut pixels = vec![0; 36];
    for it in Change::all(input) {
        match it.field % 6 {
            0 => change_stamp(&mut header.stamp, &mut header.timing, it),
            1 => header.width = it.value as u32,
            2 => header.height = it.value as u32,
            3 => header.status = Status(it.value as u32),
            4 => header.n_dropped = it.value,
            _ => pixels.resize(usize::from(it.value as u16), 0),
        }
    }
    let is_good = wire::check_frame(&header, pixels.len(), &EXPECTED).is_ok();
    if is_good && header.status == Status::OK {
        let size = [header.width as usize, header.height as usize];
        let image = Rgb8View::new(size[0], size[1], &pixels).expect("its pixels fill it");
        assert_eq!([image.width(), image.height()], size);
    }
}

/// Returns valid candidates with changes.
fn sightings(input: &[u8]) -> Sightings {
    let mut message = wire::candidates_to_message(&[pose(), pose()], SIZE).expect("they fit");
    let extras = [Some(([3.0, 4.0], 1.0)), None, Some(([5.0, 6.0], 2.0)), None];
    wire::extras_to_message(&mut message, 2, &extras).expect("they fit");
    for it in Change::all(input) {
        let candidate = it.value.to_le_bytes()[7];
        let candidate = &mut message.candidates[usize::from(candidate) % MAX_CANDIDATES];
        match it.field % 17 {
            field @ 0..6 => change_pose(candidate, field, it),
            6 => message.status = Status(it.value as u32),
            7 => message.n_candidates = it.value as u32,
            8 => message.width = it.value as u32,
            9 => message.height = it.value as u32,
            10 => message.local[it.below(MAX_PARTS)].margin = it.float(),
            11 => message.front[it.below(MAX_CANDIDATES)][1] = it.float(),
            12 => message.n_keypoints = it.value as u32,
            13 => message.keypoints[it.below(4)][it.below(3)] = it.float(),
            14 => message.heats[it.below(2)][it.below(MAX_JOINTS)] = it.float(),
            15 => message.joints[it.below(2)][it.below(MAX_JOINTS)][it.below(2)] = it.float(),
            _ => change_stamp(&mut message.stamp, &mut message.timing, it),
        }
    }
    message
}

fn candidates(input: &[u8]) {
    let World { model, plans, .. } = world();
    let message = sightings(input);
    if let Ok(poses) = wire::candidates_from_message(&message, model, plans[0].layout()) {
        let centres = poses.iter().flat_map(|pose| pose.centres(model, plans[0].layout()));
        assert!(centres.flatten().all(f64::is_finite));
    }
    if let Ok(front) = wire::front_from_message(&message, message.n_candidates as usize) {
        assert!(front.as_flattened().iter().all(|value| value.is_finite()));
    }
    if let Ok(Some(seen)) = wire::sightings_from_message(&message, 2) {
        let joints = seen.people.iter().flat_map(|person| person.joints).flatten();
        assert!(joints.flatten().all(f32::is_finite));
    }
    let extras = wire::extras_from_message(&message, 2, message.n_candidates as usize);
    if let Ok(extras) = extras {
        let found = extras.iter().flatten();
        assert!(found.flat_map(|extra| [extra.0[0], extra.0[1], extra.1]).all(f64::is_finite));
    }
    if let Ok(scores) = wire::local_from_message(&message, model.n_parts()) {
        assert!(scores.iter().all(|score| score.margin.is_finite()));
    }
}

/// Returns valid expected errors with changes.
fn view_quality(input: &[u8]) -> ViewQuality {
    let mut message = wire::sigma_to_message(Some(&[1.0, 2.0, 3.0])).expect("they fit");
    for it in Change::all(input) {
        match it.field % 5 {
            0 => message.status = Status(it.value as u32),
            1 => message.n_parts = it.value as u32,
            2 => message.sigma_px[it.below(MAX_PARTS)] = it.float(),
            3 => message.n_thresholds = it.value as u32,
            _ => message.tau_px[it.below(MAX_PARTS)] = it.float(),
        }
    }
    message
}

fn expected_errors(input: &[u8]) {
    let message = view_quality(input);
    for n_parts in [3, message.n_parts as usize] {
        let sigma = wire::sigma_from_message(&message, n_parts).ok().flatten();
        let tau = wire::tau_from_message(&message, n_parts).ok().flatten();
        for px in sigma.into_iter().chain(tau) {
            assert!(
                px.len() == n_parts && px.iter().all(|value| value.is_finite() && *value >= 0.0)
            );
        }
    }
}

/// Returns a valid result of a pair with changes.
fn pair_pose(input: &[u8]) -> PairPose {
    let mut message = wire::pair_to_message([0, 1], None, 3).expect("it fits");
    (message.stamp, message.timing) = stamp();
    (message.status, message.n_hypotheses) = (Status::OK, 2);
    for it in &mut message.hypotheses {
        it.poses = [pose(), pose()].map(|pose| wire::pose_to_message(&pose).expect("it fits"));
    }
    for it in Change::all(input) {
        let place = it.value.to_le_bytes()[7];
        let hypothesis = &mut message.hypotheses[usize::from(place & 1)];
        match it.field % 15 {
            field @ 0..6 => {
                change_pose(
                    &mut hypothesis.poses[usize::from(place >> 1 & 1)],
                    field,
                    it,
                );
            }
            6 => message.status = Status(it.value as u32),
            7 => message.n_hypotheses = it.value as u32,
            8 => message.views[it.below(2)] = it.value as u32,
            9 => hypothesis.energy = it.double(),
            10 => hypothesis.start[it.below(2)] = it.value as u8,
            11 => hypothesis.active_parts = it.value,
            12 => hypothesis.exchanged = it.value as u32 & 1,
            13 => {
                let side = usize::from(place & 1);
                message.sigma_age[side] = it.value as u16;
                message.sigma_px[side][it.below(MAX_PARTS)] =
                    f32::from_bits((it.value >> 16) as u32);
            }
            _ => change_stamp(&mut message.stamp, &mut message.timing, it),
        }
    }
    message
}

fn pair(input: &[u8]) {
    let World { plans, .. } = world();
    let message = pair_pose(input);
    let checked = EXPECTED.check_pair(&message.stamp, &message.timing, 1);
    if checked.is_ok() && wire::check_views(&message, &[[0, 1]]).is_ok() {
        assert_eq!((message.stamp.view, message.views), (0, [0, 1]));
    }
    if let Ok(Some(answer)) = wire::pair_from_message(&message, plans) {
        assert!(answer.views[0] < answer.views[1] && answer.views[1] < plans.len());
        assert!(answer.hypotheses.iter().all(|hypothesis| hypothesis.energy.is_finite()));
    }
    for side in 0..2 {
        if let Ok(Some((_, sigma))) = wire::sigma_from_pair(&message, side, 3) {
            assert!(sigma.iter().all(|value| value.is_finite() && *value >= 0.0));
        }
    }
}

fn result(input: &[u8]) {
    let (stamp, timing) = stamp();
    let mut message = Box::<Skeletons>::default();
    (message.stamp, message.timing) = (stamp, timing);
    message.n_people = 2;
    for (nth, person) in message.people.iter_mut().enumerate() {
        (person.id, person.n_joints, person.n_views) = (nth as u64 + 1, 14, 2);
        person.n_keypoints = 2;
    }
    for it in Change::all(input) {
        let person = &mut message.people[it.below(MAX_PEOPLE)];
        match it.field % 10 {
            0 => person.n_joints = it.value as u32,
            1 => person.n_views = it.value as u32,
            2 => person.views[it.below(MAX_VIEWS)].n_parts = it.value as u32,
            3 => person.joints[it.below(MAX_JOINTS)].in_world[0] = it.double(),
            4 => person.views[it.below(MAX_VIEWS)].centres_px[0][1] = it.double(),
            5 => person.n_keypoints = it.value as u32,
            6 => person.keypoints[it.below(MAX_KEYPOINTS)].in_world[1] = it.double(),
            7 => person.id = it.value,
            8 => message.n_people = it.value as u32,
            _ => message.status = Status(it.value as u32),
        }
    }
    if wire::check_skeletons(&message, 2, 14).is_ok() {
        let people = message.listed();
        assert_eq!(people.len(), message.n_people as usize);
        for (nth, person) in people.iter().enumerate() {
            assert!(people[..nth].iter().all(|other| other.id != person.id));
            assert_eq!((person.n_views, person.n_joints), (2, 14));
            let keypoints = &person.keypoints[..person.n_keypoints as usize];
            let points = person.joints[..14].iter().chain(keypoints);
            let mut found = points.filter(|point| point.status == Status::OK);
            assert!(found.all(|point| point.in_world.iter().all(|value| value.is_finite())));
        }
    }
}

/// Evidence, candidates, expected errors and pairs of one frame, processed up to the skeleton. Messages that are accepted must be usable in
/// the computation.
pub fn wire_fusion(input: &[u8]) {
    let World { model, plans, fuse } = world();
    let (input, pairs) = input.split_at(input.len() / 2);
    let message = sightings(input);
    let Ok(candidates) = wire::candidates_from_message(&message, model, plans[0].layout()) else {
        return;
    };
    if candidates.is_empty() {
        return;
    }
    let quality = view_quality(input);
    let sigma = wire::sigma_from_message(&quality, model.n_parts());
    let front = wire::front_from_message(&message, candidates.len());
    let changed = ViewResult {
        candidates,
        front: front.unwrap_or_default(),
        sigma_px: sigma.ok().flatten(),
        tau_px: None,
        skew_s: 0.0,
    };
    let expected = wire::sigma_from_pair(&pair_pose(pairs), 1, model.n_parts());
    let whole = ViewResult {
        candidates: vec![pose()],
        front: vec![[0.5, -2.0]],
        sigma_px: expected.ok().flatten().map(|(_, sigma)| sigma),
        tau_px: None,
        skew_s: 0.0,
    };
    let answers = [Some(changed), Some(whole)];
    let mut found = Vec::new();
    let (header, values) = evidence(input);
    let (whole_header, whole_values) = evidence(&[]);
    if let Ok(maps) = wire::maps_from_message(&header, &values) {
        assert!(maps.iter().all(|map| map.at(3, [9.0, 9.0]).is_finite()));
    }
    let read = wire::evidence_from_message(&header, &values, plans[0].layout());
    let other = wire::evidence_from_message(&whole_header, &whole_values, plans[1].layout());
    if let (Ok(first), Ok(second)) = (read, other) {
        let others = Following::default().others(plans, &answers);
        let start = fuse.start(&answers, &others);
        let evidence = [&first.responses(), &second.responses()];
        let answer = fuse.pair([0, 1], &answers, evidence, &start);
        let sent = wire::pair_to_message([0, 1], answer.as_ref(), 3);
        // Responses that are not finite can give an energy that is not finite. Such a result is not sent.
        if let Some(read) = sent.ok().map(|sent| wire::pair_from_message(&sent, plans)) {
            found.extend(read.expect("it was written"));
        }
    }
    found.extend(wire::pair_from_message(&pair_pose(pairs), plans).ok().flatten());
    let mut step = SkeletonStep::new(plans.clone(), None, settings());
    let skeleton = step.run(&answers, &found);
    let person = wire::SolvedPerson {
        id: 1,
        skeleton: &skeleton,
        keypoints: &[],
    };
    let message = wire::skeletons_to_message(&[person], 1, 3).expect("it fits");
    assert_eq!(message.people[0].n_views, 2);
}

/// In these settings, every part is a joint, because the joint sets of people need more parts than this chain has.
fn settings() -> SkeletonSettings {
    static PARTS: [skeleton::Joint; 3] = [
        skeleton::Joint {
            name: "a",
            parts: &[0],
        },
        skeleton::Joint {
            name: "b",
            parts: &[1],
        },
        skeleton::Joint {
            name: "c",
            parts: &[2],
        },
    ];
    static CHAIN: skeleton::JointSet = skeleton::JointSet {
        name: "chain",
        joints: &PARTS,
        limbs: &[],
    };
    SkeletonSettings {
        joints: &CHAIN,
        ..SkeletonSettings::default()
    }
}

/// Returns valid response maps with changes.
fn evidence(input: &[u8]) -> (EvidenceHeader, Vec<f32>) {
    let layout = world().plans[0].layout();
    let n_levels = layout.levels.len();
    let mut header = EvidenceHeader {
        width: SIZE[0] as u32,
        height: SIZE[1] as u32,
        n_levels: n_levels as u32,
        x: [0, SIZE[0] as u32],
        y: [0, SIZE[1] as u32],
        scope_levels: [0, n_levels as u16],
        ..EvidenceHeader::default()
    };
    for level in 0..n_levels {
        header.levels[level] = level as u16;
        (header.best[level], header.size[level]) = (f32::INFINITY, 1e3);
    }
    let n = layout.n_responses();
    let mut values: Vec<f32> = (0..n).map(|i| (i * 37 % 101) as f32 * 0.01).collect();
    for it in Change::all(input) {
        let level = it.below(MAX_LEVELS);
        match it.field % 14 {
            0 => header.width = it.value as u32,
            1 => header.n_levels = it.value as u32,
            2 => header.x[it.below(2)] = it.value as u32,
            3 => header.y[it.below(2)] = it.value as u32,
            4 => header.scope_levels[it.below(2)] = it.value as u16,
            5 => header.levels[level] = it.value as u16,
            6 => header.best[level] = it.float(),
            7 => header.size[level] = it.float(),
            8 => values.truncate(it.value as usize),
            9 => values.fill(it.float()),
            10 => header.n_people = it.value as u32,
            11 => header.people[it.below(MAX_CANDIDATES)].size[it.below(2)] = it.value as u32,
            12 => header.people[it.below(MAX_CANDIDATES)].cell_px[it.below(2)] = it.double(),
            _ => {
                let n = values.len().max(1);
                if let Some(value) = values.get_mut((it.value >> 32) as usize % n) {
                    *value = it.float();
                }
            }
        }
    }
    (header, values)
}
