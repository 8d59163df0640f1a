//! Tests of complete training runs on drawn figures.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use crate::datasets::Picture;
use fmp::{CandidateSettings, Extractor, Layout, Model, Responses, Solver};
use rayon::ThreadPoolBuilder;

use super::{Checkpoint, CheckpointError, TrainError, Trainer};
use crate::album::{Album, AlbumError};
use crate::origin::Origin;
use crate::plan::{Plan, Tree};
use crate::settings::Settings;
use crate::testing::noise;
use crate::watch::{Event, Step, Watch};

/// Figures of three parts: bright squares with stripes on noise.
struct Figures {
    n_people: usize,
    n_backgrounds: usize,
}

impl Figures {
    /// Centres of the parts of a person.
    fn parts(person: usize) -> Vec<[f64; 2]> {
        let mut random = fastrand::Rng::with_seed(person as u64);
        let [x, y] = [30.0, 22.0].map(|value| value + 8.0 * random.f64());
        let lean = if person.is_multiple_of(2) { 7.0 } else { -5.0 };
        vec![[x, y], [x + 1.0, y + 18.0], [x + lean, y + 36.0]]
    }

    fn drawn(person: usize) -> Picture {
        let mut picture = noise(70, 90, 1000 + person as u64);
        let width = picture.size().width;
        for (part, [x, y]) in Self::parts(person).into_iter().enumerate() {
            for (at, pixel) in picture.rgb_mut().chunks_exact_mut(3).enumerate() {
                let dx = (at % width) as f64 - x;
                let dy = (at / width) as f64 - y;
                if dx.abs().max(dy.abs()) <= 8.5 {
                    let dark = match part {
                        0 => dx.hypot(dy) < 5.0,
                        1 => (dx / 4.0).floor() as i64 % 2 == 0,
                        _ => (dy / 4.0).floor() as i64 % 2 == 0,
                    };
                    pixel.fill(if dark { 20 } else { 230 });
                }
            }
        }
        picture
    }
}

impl Album for Figures {
    fn person(&self, person: usize) -> Result<Picture, AlbumError> {
        Ok(Self::drawn(person))
    }

    fn n_backgrounds(&self) -> usize {
        self.n_backgrounds
    }

    fn background(&self, image: usize) -> Result<Picture, AlbumError> {
        if image == 13 {
            return Err("a picture that cannot be read".into());
        }
        Ok(noise(80, 80, 5000 + image as u64))
    }
}

/// A watch that stops the training after a given number of calls of `go_on`.
struct Quiet {
    left: AtomicUsize,
    placed: AtomicBool,
}

impl Quiet {
    fn endless() -> Self {
        Self::after(usize::MAX)
    }

    fn after(questions: usize) -> Self {
        Self {
            left: AtomicUsize::new(questions),
            placed: AtomicBool::new(false),
        }
    }
}

impl Watch for Quiet {
    fn tell(&self, event: Event) {
        if let Event::Placed { n_lost: 0, .. } = event {
            self.placed.store(true, Ordering::Relaxed);
        }
    }

    fn go_on(&self) -> bool {
        self.left.fetch_sub(1, Ordering::Relaxed) > 0
    }
}

fn settings() -> Settings {
    Settings {
        n_types: 2,
        cluster_starts: 5,
        max_filter_cells: 4,
        interval: 4,
        batch: 4,
        per_image: 40,
        passes: 1,
        cost: 0.02,
        pose_weight: 2.0,
        ..Settings::default()
    }
}

fn figures() -> Figures {
    Figures {
        n_people: 10,
        n_backgrounds: 8,
    }
}

fn plan(settings: &Settings) -> Plan {
    let tree = Tree {
        names: ["head", "trunk", "leg"].map(str::to_owned).to_vec(),
        parents: vec![None, Some(0), Some(1)],
        mirror: None,
    };
    let people: Vec<_> = (0..figures().n_people).map(Figures::parts).collect();
    Plan::new("figures", &tree, &people, settings).unwrap()
}

fn trained(settings: &Settings) -> Model {
    let (plan, watch) = (plan(settings), Quiet::endless());
    let album = figures();
    let mut trainer = Trainer::new(&plan, settings, &album, &watch).unwrap();
    while trainer.step().unwrap() {}
    assert!(watch.placed.load(Ordering::Relaxed));
    trainer.model().unwrap()
}

/// Largest distance between a part of the best pose and the position at which the part was drawn, in pixels.
fn off(model: &Model, person: usize) -> f64 {
    let model = std::sync::Arc::new(model.clone());
    let picture = Figures::drawn(person);
    let layout = Layout::new(&model, 70, 90).unwrap();
    let mut values = vec![0.0; layout.n_responses()];
    Extractor::new(std::sync::Arc::clone(&model)).responses(picture.view(), &layout, &mut values);
    let levels: Vec<_> = (0..layout.levels.len() as u16).collect();
    let evidence = Responses::new(&layout, &values, &levels);
    let settings = CandidateSettings {
        threshold: model.detection_threshold() as f32,
        overlap: 0.3,
        max: 1,
    };
    let poses = Solver::new(std::sync::Arc::clone(&model)).candidates(&evidence, &settings);
    let centres = poses[0].centres(&model, &layout);
    let parts = Figures::parts(person);
    let off = centres.iter().zip(&parts);
    off.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0.0, f64::max)
}

#[test]
fn figures_outside_the_training_set_are_found() {
    let model = trained(&settings());
    let worst = (100..120).map(|i| off(&model, i)).fold(0.0, f64::max);
    assert!(worst < 6.0, "{worst} px");
    assert!(
        model.spec().threshold > 0.0,
        "people score above the middle"
    );
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let [one, three] = [1, 3].map(|n| {
        let pool = ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| trained(&settings()))
    });
    assert_eq!(one, three);
}

#[test]
fn an_interrupted_training_gives_the_same_model() {
    let settings = settings();
    let (plan, album, watch) = (plan(&settings), figures(), Quiet::endless());
    let whole = trained(&settings);
    let mut trainer = Trainer::new(&plan, &settings, &album, &watch).unwrap();
    let mut checkpoints = vec![trainer.checkpoint()];
    while trainer.step().unwrap() {
        checkpoints.push(trainer.checkpoint());
    }
    for checkpoint in checkpoints {
        let done = checkpoint.n_done();
        let mut trainer = resume(&plan, &settings, checkpoint).unwrap();
        while trainer.step().unwrap() {}
        assert_eq!(trainer.model().unwrap(), whole, "after {done} steps");
    }
}

fn resume<'a>(
    plan: &'a Plan,
    settings: &'a Settings,
    checkpoint: Checkpoint,
) -> Result<Trainer<'a>, CheckpointError> {
    static ALBUM: Figures = Figures {
        n_people: 10,
        n_backgrounds: 8,
    };
    static WATCH: std::sync::LazyLock<Quiet> = std::sync::LazyLock::new(Quiet::endless);
    Trainer::resume((plan, settings), &ALBUM, &*WATCH, checkpoint)
}

#[test]
fn a_checkpoint_of_other_settings_is_refused() {
    let (mine, album, watch) = (settings(), figures(), Quiet::endless());
    let others = Settings {
        seed: 2,
        ..mine.clone()
    };
    let plans = [plan(&mine), plan(&others)];
    let trainer = Trainer::new(&plans[0], &mine, &album, &watch).unwrap();
    let refused = resume(&plans[1], &others, trainer.checkpoint());
    assert!(matches!(refused, Err(CheckpointError::Other)));
}

#[test]
fn every_step_can_be_stopped() {
    let (settings, album) = (settings(), figures());
    let plan = plan(&settings);
    for questions in [0, 3, 12, 40] {
        let watch = Quiet::after(questions);
        let mut trainer = Trainer::new(&plan, &settings, &album, &watch).unwrap();
        let ended = loop {
            match trainer.step() {
                Ok(true) => {}
                ended => break ended,
            }
        };
        assert!(matches!(ended, Err(TrainError::Stopped)), "{questions}");
    }
}

#[test]
fn an_unreadable_background_is_named() {
    let (settings, watch) = (settings(), Quiet::endless());
    let album = Figures {
        n_people: 10,
        n_backgrounds: 14,
    };
    let plan = plan(&settings);
    let mut trainer = Trainer::new(&plan, &settings, &album, &watch).unwrap();
    let error = loop {
        if let Err(error) = trainer.step() {
            break error;
        }
    };
    assert!(
        matches!(error, TrainError::Background { image: 14, .. }),
        "{error:?}"
    );
}

#[test]
fn training_without_backgrounds_is_refused() {
    let (settings, watch) = (settings(), Quiet::endless());
    let album = Figures {
        n_people: 10,
        n_backgrounds: 0,
    };
    let plan = plan(&settings);
    let refused = Trainer::new(&plan, &settings, &album, &watch);
    assert!(matches!(refused, Err(TrainError::NoBackgrounds)));
}

#[test]
fn examples_of_people_stay_in_the_working_set_even_if_well_separated() {
    let (album, watch) = (figures(), Quiet::endless());
    // With these settings, hardly any example whose share is 0 is kept.
    let settings = Settings {
        room: 0.0,
        cache_mib: 1,
        ..settings()
    };
    let plan = plan(&settings);
    let mut trainer = Trainer::new(&plan, &settings, &album, &watch).unwrap();
    let mut n_idle = 0;
    while trainer.step().unwrap() {
        if trainer.right.iter().any(Option::is_some) {
            let right = |entry: &(&Origin, f64)| matches!(entry.0, Origin::Right { .. });
            let people: Vec<_> = trainer.machine.entries().filter(right).collect();
            assert_eq!(people.len(), album.n_people);
            n_idle += people.iter().filter(|person| person.1 == 0.0).count();
        }
    }
    assert!(
        n_idle > album.n_people,
        "only {n_idle} could have been lost"
    );
}

#[test]
fn negatives_in_the_working_set_do_not_hide_others() {
    let (album, watch) = (figures(), Quiet::endless());
    let settings = Settings {
        per_image: 1,
        ..settings()
    };
    let plan = plan(&settings);
    let mut trainer = Trainer::new(&plan, &settings, &album, &watch).unwrap();
    trainer.step().unwrap();
    let mut held = Vec::new();
    for _ in 0..5 {
        let found = trainer.hard_negatives(&[0], &held.iter().collect());
        held.extend(found.unwrap());
    }
    let different: std::collections::BTreeSet<_> = held.iter().collect();
    assert_eq!(different.len(), 5);
}

#[test]
fn every_background_is_searched_in_every_pass() {
    let (settings, album, watch) = (settings(), figures(), Quiet::endless());
    let plan = plan(&settings);
    let trainer = Trainer::new(&plan, &settings, &album, &watch).unwrap();
    let learn = |step: &&Step| matches!(step, Step::Learn { .. });
    assert_eq!(
        trainer.steps().iter().filter(learn).count(),
        2 * 2,
        "8 images by 4, twice"
    );
    assert_eq!(trainer.steps().first(), Some(&Step::Filters));
    assert_eq!(trainer.steps().last(), Some(&Step::Judge));
}
