//! Tests with damaged, foreign and valid checkpoints.

use footage::Size;
use formats::checksum::Envelope;
use proptest::prelude::*;
use training::datasets::Picture;
use training::{Album, AlbumError, Event, Plan, Settings, Trainer, Tree, Watch};

use super::*;

/// Number of bytes before the payload of a checkpoint.
const HEADER: usize = 28;

/// Largest size of the stamp and the fingerprint: two numbers, each of which takes up to nine bytes.
const WHOSE: usize = 18;

struct Noise;

impl Noise {
    fn picture(seed: usize) -> Picture {
        let mut random = fastrand::Rng::with_seed(seed as u64);
        let size = Size::new(64, 64);
        let rgb = (0..size.rgb_bytes()).map(|_| random.u8(..)).collect();
        Picture::new(size, rgb).unwrap()
    }
}

impl Album for Noise {
    fn person(&self, person: usize) -> Result<Picture, AlbumError> {
        Ok(Self::picture(person))
    }

    fn n_backgrounds(&self) -> usize {
        2
    }

    fn background(&self, image: usize) -> Result<Picture, AlbumError> {
        Ok(Self::picture(100 + image))
    }
}

impl Watch for Noise {
    fn tell(&self, _: Event) {}

    fn go_on(&self) -> bool {
        true
    }
}

fn plan() -> (Plan, Settings) {
    let settings = Settings {
        n_types: 2,
        cluster_starts: 1,
        interval: 2,
        per_image: 2,
        batch: 1,
        latent_rounds: 0,
        ..Settings::default()
    };
    let tree = Tree {
        names: vec!["a".to_owned(), "b".to_owned()],
        parents: vec![None, Some(0)],
        mirror: None,
    };
    let person = |value: f64| vec![[28.0 + value, 24.0], [30.0, 40.0 - value]];
    let people: Vec<_> = (0..4).map(|i| person(f64::from(i))).collect();
    (Plan::new("m", &tree, &people, &settings).unwrap(), settings)
}

/// Returns the bytes of a checkpoint with examples of all kinds.
fn bytes_of(plan: &Plan, settings: &Settings) -> Vec<u8> {
    let mut trainer = Trainer::new(plan, settings, &Noise, &Noise).unwrap();
    for _ in 0..4 {
        assert!(trainer.step().unwrap());
    }
    trainer.checkpoint().to_bytes(7).unwrap()
}

/// Returns the same file with another payload and its correct checksum.
fn with_payload(bytes: &[u8], payload: &[u8]) -> Vec<u8> {
    let magic = *bytes.first_chunk().unwrap();
    Envelope { magic, version: 1 }.seal(payload)
}

#[test]
fn a_model_is_written_by_one_training_at_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("person.fmp");
    let first = Store::new(&out, false).unwrap();
    let second = Store::new(&out, false).unwrap_err().to_string();
    assert!(
        second.contains("another training is writing this file"),
        "{second}"
    );
    drop(first);
    drop(Store::new(&out, false).unwrap());
    let left = fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, 0, "nothing stays behind");
}

#[test]
fn a_training_that_continues_from_a_checkpoint_has_identical_bytes() {
    let (plan, settings) = plan();
    let bytes = bytes_of(&plan, &settings);
    let (checkpoint, stamp) = Checkpoint::from_bytes(&bytes).unwrap();
    assert_eq!((checkpoint.n_done(), stamp), (4, 7));
    assert_eq!(checkpoint.to_bytes(7).unwrap(), bytes);
    let resumed = Trainer::resume((&plan, &settings), &Noise, &Noise, checkpoint).unwrap();
    assert_eq!(resumed.checkpoint().to_bytes(7).unwrap(), bytes);
}

#[test]
fn no_truncated_or_changed_file_is_accepted() {
    let (plan, settings) = plan();
    let bytes = bytes_of(&plan, &settings);
    for length in (0..bytes.len()).step_by(7) {
        assert!(
            Checkpoint::from_bytes(&bytes[..length]).is_err(),
            "{length}"
        );
    }
    for at in (0..bytes.len()).step_by(11) {
        let mut changed = bytes.clone();
        changed[at] ^= 1;
        assert!(Checkpoint::from_bytes(&changed).is_err(), "{at}");
    }
    let mut longer = bytes[HEADER..].to_vec();
    longer.push(0);
    let longer = Checkpoint::from_bytes(&with_payload(&bytes, &longer));
    assert!(matches!(
        longer.unwrap_err(),
        CheckpointBytesError::Left { left: 1 }
    ));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn other_bytes_never_panic(bytes: Vec<u8>) {
        let (plan, settings) = plan();
        drop(Checkpoint::from_bytes(&bytes));
        let fine = bytes_of(&plan, &settings);
        drop(Checkpoint::from_bytes(&with_payload(&fine, &bytes)));
    }

    /// Tests damage to poses, shares and counts with a correct checksum.
    #[test]
    fn a_damaged_checkpoint_never_panics(
        all in prop::collection::vec(
            prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
            40,
        ),
    ) {
        let (plan, settings) = plan();
        let fine = bytes_of(&plan, &settings);
        for changes in all {
            let mut payload = fine[HEADER..].to_vec();
            // The vector of the model is in the middle of the payload, and the poses are at the end.
            let n_poses = payload.len().min(1500);
            let start = (payload.len() - n_poses).max(WHOSE);
            for (at, value) in changes {
                let at = start + at.index(payload.len() - start);
                payload[at] = value;
            }
            let read = Checkpoint::from_bytes(&with_payload(&fine, &payload));
            let Ok((checkpoint, _)) = read else { continue };
            let resumed = Trainer::resume((&plan, &settings), &Noise, &Noise, checkpoint);
            if let Ok(mut trainer) = resumed {
                drop(trainer.step());
            }
        }
    }
}
