//! Runs every fuzz target over its seeds and a few thousand mutations of the seeds, without a nightly toolchain and without a sanitizer.
//! This is a short version of the runs in `fuzz/README.md`.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(clippy::print_stdout, reason = "the input that failed is told")]

#[expect(
    clippy::expect_used,
    unreachable_pub,
    reason = "a property fails by panicking; the programs use it as a library"
)]
#[path = "fuzz/properties/mod.rs"]
mod properties;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use properties::TARGETS;

/// Number of mutations of a target's seeds.
const N_MUTATIONS: u64 = 4000;
/// Time limit for a slow target, which is then run with fewer mutations.
const LONGEST: Duration = Duration::from_secs(4);

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz")
}

fn names(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths
}

/// Changes, moves, repeats or removes some bytes of a seed, or replaces them by bytes of another seed.
fn mutate(seed: &[u8], other: &[u8], random: &mut fastrand::Rng) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..random.usize(1..6) {
        let n = bytes.len();
        let at = random.usize(0..=n);
        let end = (at + random.usize(0..20)).min(n);
        match random.u8(0..8) {
            0 => bytes.truncate(at),
            1 => drop(bytes.drain(at..end)),
            2 => drop(bytes.splice(at..at, bytes.clone()[at..end].iter().copied())),
            3 => drop(bytes.splice(at..at, (0..random.u8(1..12)).map(|_| random.u8(..)))),
            4 => bytes[at..end].fill(*random.choice(&[0, 1, 0x7f, 0x80, 0xff]).unwrap()),
            5 => {
                let from = random.usize(0..=other.len());
                drop(bytes.splice(at..end, other[from..].iter().take(40).copied()));
            }
            _ if at < n => bytes[at] = random.u8(..),
            _ => {}
        }
    }
    bytes
}

#[test]
fn every_fuzz_target_survives_its_seeds_and_their_mutations() {
    for (name, target) in TARGETS {
        let seeds: Vec<Vec<u8>> = names(&folder().join("seeds").join(name))
            .iter()
            .map(|name| fs::read(name).unwrap())
            .collect();
        assert!(!seeds.is_empty(), "{name} has no seeds");
        for seed in &seeds {
            target(seed);
        }
        let mut random = fastrand::Rng::with_seed(1);
        let begin = Instant::now();
        for nth in 0..N_MUTATIONS {
            if begin.elapsed() > LONGEST {
                break;
            }
            let seed = random.choice(&seeds).unwrap();
            let other = random.choice(&seeds).unwrap();
            let input = mutate(seed, other, &mut random);
            if let Err(panic) = std::panic::catch_unwind(|| target(&input)) {
                let text = input.escape_ascii();
                println!("{name}, mutation {nth}, {} bytes: b\"{text}\"", input.len());
                std::panic::resume_unwind(panic);
            }
        }
    }
}

#[test]
fn every_target_has_a_program_and_a_line_in_the_readme() {
    let readme = fs::read_to_string(folder().join("README.md")).unwrap();
    let manifest = fs::read_to_string(folder().join("Cargo.toml")).unwrap();
    for (name, _) in TARGETS {
        let program = folder().join("fuzz_targets").join(format!("{name}.rs"));
        let text = fs::read_to_string(program).unwrap();
        assert!(text.contains(&format!("properties::{name}(")), "{name}");
        assert!(manifest.contains(&format!("name = \"{name}\"")), "{name}");
        assert!(readme.contains(&format!("| `{name}` |")), "{name}");
    }
}
