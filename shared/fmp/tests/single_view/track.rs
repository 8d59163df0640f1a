//! Tests which part of the next frame is searched.

use fmp::{FrameTime, Layout, Model, Placement, Pose, Scope, TrackSettings, Tracker};

use crate::common::{Noise, tree};

const TRACK: TrackSettings = TrackSettings {
    levels: 2,
    margin: 0.5,
    full_every: 5,
    max_gap: 2,
    max_drop: 0.25,
    speed: 2.0,
    max_gap_s: 0.25,
    full_every_s: 0.5,
};

struct Scene {
    model: std::sync::Arc<Model>,
    layout: Layout,
    tracker: Tracker,
}

impl Scene {
    fn new(settings: Option<TrackSettings>) -> Self {
        let mut noise = Noise(3);
        let mut spec = tree(&mut noise, 3).spec().clone();
        spec.interval = 5;
        let model = std::sync::Arc::new(Model::new(spec).unwrap());
        Self {
            layout: Layout::new(&model, 300, 200).unwrap(),
            model,
            tracker: Tracker::new(settings),
        }
    }

    /// Returns true if a frame is searched in full, given the score that is found in it.
    fn is_full(&mut self, at: impl Into<FrameTime>, score: Option<f32>) -> bool {
        let (at, whole) = (at.into(), Scope::whole(&self.layout));
        let mut scope = self.tracker.scope(&self.layout, at);
        let pose = score.map(pose);
        if self.tracker.needs_full_search(&self.layout, &scope, pose.as_ref()) {
            scope = whole;
        }
        let of = (&*self.model, &self.layout);
        self.tracker.update(of, (at, &scope), pose.as_ref());
        scope == whole
    }

    /// Returns which of ten frames, at a given frame rate, are searched in full if all scores equal the first score.
    fn full_at(rate_hz: f64) -> Vec<u64> {
        let mut scene = Self::new(Some(TrackSettings {
            full_every: 1000,
            ..TRACK
        }));
        let at = |frame: u64| FrameTime {
            frame,
            seconds: Some(frame as f64 / rate_hz),
        };
        (0..10).filter(|i| scene.is_full(at(*i), Some(1.0))).collect()
    }
}

/// Returns a pose with parts in columns 10 to 20 and rows 15 to 16 of level 4.
fn pose(score: f32) -> Pose {
    let at = |x: u16, y: u16| Placement { x, y, mixture: 0 };
    Pose {
        score,
        level: 4,
        parts: vec![at(10, 15), at(20, 16), at(14, 15)],
    }
}

#[test]
fn without_settings_every_frame_is_searched_in_full() {
    let mut scene = Scene::new(None);
    assert!((0..20).all(|frame| scene.is_full(frame, Some(1.0))));
}

#[test]
fn the_first_frame_and_every_nth_frame_are_searched_in_full() {
    let mut scene = Scene::new(Some(TRACK));
    let full: Vec<u64> = (7..30).filter(|&i| scene.is_full(i, Some(1.0))).collect();
    assert_eq!(full, [7, 12, 17, 22, 27]);
}

#[test]
fn a_frame_without_a_pose_is_searched_in_full_and_so_is_the_next() {
    let mut scene = Scene::new(Some(TRACK));
    let found = [Some(1.0), Some(1.0), None, Some(1.0), Some(1.0)];
    let full: Vec<bool> =
        (0..).zip(found).map(|(frame, score)| scene.is_full(frame, score)).collect();
    assert_eq!(full, [true, false, true, true, false]);
}

/// At one frame per second, the person can be anywhere in the next frame.
#[test]
fn at_low_rates_every_frame_is_searched_in_full_and_otherwise_two_per_second() {
    assert_eq!(Scene::full_at(1.0), (0..10).collect::<Vec<_>>());
    assert_eq!(Scene::full_at(3.9), (0..10).collect::<Vec<_>>());
    assert_eq!(Scene::full_at(5.0), [0, 3, 6, 9]);
    assert_eq!(Scene::full_at(10.0), [0, 5]);
    assert_eq!(Scene::full_at(30.0), [0]);
}

#[test]
fn the_search_margin_grows_with_the_time_since_the_last_pose() {
    let mut scene = Scene::new(Some(TRACK));
    let at = |seconds: f64| FrameTime {
        frame: 1,
        seconds: Some(seconds),
    };
    let first = FrameTime {
        frame: 0,
        seconds: Some(0.0),
    };
    let pose = pose(1.0);
    let whole = Scope::whole(&scene.layout);
    let of = (&*scene.model, &scene.layout);
    scene.tracker.update(of, (first, &whole), Some(&pose));
    let [x1, _, x2, _] = pose.bounding_box(&scene.model, &scene.layout);
    // The search distance is one side of the box per half second, but at least half a side.
    for (seconds, share) in [(0.01, 0.5), (0.2, 0.5), (0.25, 0.5)] {
        let scope = scene.tracker.scope(&scene.layout, at(seconds));
        let begin = (x1 - share * (x2 - x1)).floor().max(0.0);
        assert_eq!(f64::from(scope.region().x[0]), begin, "{seconds} s");
    }
    scene.tracker = Tracker::new(Some(TrackSettings {
        margin: 0.1,
        ..TRACK
    }));
    scene.tracker.update(of, (first, &whole), Some(&pose));
    let begin = |seconds: f64| scene.tracker.scope(&scene.layout, at(seconds)).region().x[0];
    assert!(begin(0.2) < begin(0.1) && begin(0.1) < begin(0.06));
    assert_eq!(begin(0.05), begin(0.0), "the margin at least");
}

#[test]
fn a_frame_after_a_gap_or_out_of_order_is_searched_in_full() {
    let mut scene = Scene::new(Some(TRACK));
    let frames = [0, 2, 5, 6, 6, 4, 5];
    let full = frames.map(|frame| scene.is_full(frame, Some(1.0)));
    assert_eq!(full, [true, false, true, false, true, true, false]);
}

#[test]
fn a_drop_of_the_score_triggers_a_full_search_of_the_same_frame() {
    let mut scene = Scene::new(Some(TRACK));
    // A gradual drop of the score causes a full search as well; its result is the new reference.
    let scores = [1.0, 0.875, 0.75, 0.625, 0.5, 0.375];
    let full: Vec<bool> = (0..)
        .zip(scores)
        .map(|(frame, score)| scene.is_full(frame, Some(score)))
        .collect();
    assert_eq!(full, [true, false, false, true, false, false]);
}

#[test]
fn levels_and_a_margin_around_the_last_pose_are_searched() {
    let mut scene = Scene::new(Some(TRACK));
    assert!(scene.is_full(0, Some(1.0)));
    let scope = scene.tracker.scope(&scene.layout, 1);
    assert_eq!(scope.levels(), 2..7);
    let [x1, y1, x2, y2] = pose(1.0).bounding_box(&scene.model, &scene.layout);
    let margin = (x2 - x1) / 2.0;
    let region = scope.region();
    assert_eq!(
        region.x.map(f64::from),
        [(x1 - margin).floor(), (x2 + margin).ceil() + 1.0]
    );
    assert_eq!(
        region.y.map(f64::from),
        [(y1 - margin).floor(), (y2 + margin).ceil() + 1.0]
    );
    let window = scene.layout.window(&scope, 4);
    assert!(window.contains_all(&pose(1.0)));
}

#[test]
fn the_scope_is_limited_by_the_image_and_the_levels() {
    let track = TrackSettings {
        levels: 100,
        margin: 9.0,
        ..TRACK
    };
    let mut scene = Scene::new(Some(track));
    assert!(scene.is_full(0, Some(1.0)));
    assert!(scene.is_full(1, Some(1.0)), "near is everywhere");
}

#[test]
fn a_pose_outside_of_the_image_is_not_tracked() {
    let mut scene = Scene::new(Some(TRACK));
    let scope = Scope::whole(&scene.layout);
    let mut beside = pose(1.0);
    for part in &mut beside.parts {
        *part = Placement {
            x: u16::MAX,
            y: 0,
            mixture: 0,
        };
    }
    let of = (&*scene.model, &scene.layout);
    scene.tracker.update(of, (0, &scope), Some(&beside));
    assert!(scene.is_full(1, None));
}
