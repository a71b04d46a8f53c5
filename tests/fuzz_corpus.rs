//! Replays what the fuzzers found worth keeping, and mutates it.

use std::path::PathBuf;

use brickmend::mesh::shapes::Random;

use crate::support::targets::TARGETS;
use crate::support::testdata;

/// Mutations of each corpus; of whole repairs, which take longer, fewer.
const MUTATIONS: usize = 10_000;
const MUTATED_REPAIRS: usize = 300;

/// The files of a corpus, by name.
fn corpus(name: &str) -> Vec<Vec<u8>> {
    let folder = testdata("fuzz").join(name);
    let entries = std::fs::read_dir(&folder).expect("every target has a corpus");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("listable").path()).collect();
    paths.sort();
    assert!(!paths.is_empty(), "{name}: an empty corpus");
    paths.into_iter().map(|path| std::fs::read(path).expect("readable")).collect()
}

/// Words that readers take notice of.
const WORDS: [&[u8]; 16] = [
    b"4294967295",
    b"-1",
    b"1e308",
    b"nan",
    b"\n",
    b"\\\n",
    b"f 1 2 3\n",
    b"v ",
    b"element ",
    b"property list ",
    b"end_header\n",
    b"solid",
    b"OFF",
    b"\xff\xff\xff\xff",
    b"\0\0\0\0",
    b"\x1f\x8b\x08",
];

/// One to four changes, each to a place by chance.
fn mutate(seed: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..1 + random.below(4) {
        let at = random.below(bytes.len() + 1);
        match random.below(7) {
            0 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
            1 if at < bytes.len() => bytes[at] = random.below(256) as u8,
            2 => bytes.truncate(at),
            3 => drop(bytes.splice(at..at, WORDS[random.below(WORDS.len())].iter().copied())),
            4 => {
                let end = (at + random.below(20)).min(bytes.len());
                bytes.drain(at..end);
            }
            5 => {
                let end = (at + random.below(200)).min(bytes.len());
                let again = bytes[at..end].to_vec();
                bytes.splice(at..at, again);
            }
            _ => {
                let from = random.below(other.len() + 1);
                bytes.truncate(at);
                bytes.extend_from_slice(&other[from..]);
            }
        }
    }
    bytes
}

#[test]
fn corpora_and_their_mutations_end_in_answers() {
    for (name, target) in TARGETS {
        let seeds = corpus(name);
        seeds.iter().for_each(|seed| target(seed));
        let mut random = Random::new(name.len() as u64 + 71);
        let count = if name == "soup" { MUTATED_REPAIRS } else { MUTATIONS };
        for number in 0..count {
            let other = &seeds[random.below(seeds.len())];
            target(&mutate(&seeds[number % seeds.len()], other, &mut random));
        }
    }
}
