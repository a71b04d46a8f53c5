//! Twins: the same bytes come out whatever the threads, the memory, the share and the backing.

use brickmend::mesh::shapes::{Corners, Random, sphere};
use brickmend::repair::{Limits, Settings};
use brickmend::store::Backing;

use crate::support::breakage::{Breakage, duplicate};
use crate::support::run::{Encoding, Workshop, at_depth};
use crate::support::soups::random_triangles;
use crate::support::surface::Surface;

/// A share so small that every sort and table spills.
const SPILLING_SHARE_BYTES: u64 = 16 << 10;

fn variants() -> Vec<(&'static str, Limits)> {
    let plain = Limits::default();
    let share_bytes = Some(SPILLING_SHARE_BYTES);
    let small = 64 << 20;
    vec![
        ("in memory", Limits { backing: Backing::Memory, ..plain.clone() }),
        ("two threads", Limits { threads: 2, ..plain.clone() }),
        ("eight threads", Limits { threads: 8, ..plain.clone() }),
        ("64 MiB", Limits { max_memory_bytes: small, ..plain.clone() }),
        ("16 KiB a share", Limits { share_bytes, ..plain.clone() }),
        ("all at once", Limits { threads: 8, max_memory_bytes: small, share_bytes, ..plain }),
    ]
}

/// Whether the variant with this name is held to its name.
fn assert_twins(soup: &[Corners], settings: &Settings, extension: &str, bricks: u64) {
    let workshop = Workshop::new();
    let input = workshop.write(soup, Encoding::Obj);
    let repair = |limits: &Limits| {
        let repaired = workshop.repair(&input, extension, settings, limits).expect("a result");
        let bytes = std::fs::read(&repaired.path).expect("a file");
        (repaired, bytes)
    };
    let (first, expected) = repair(&Limits::default());
    assert!(first.outcome.sign.bricks >= bricks, "{} bricks", first.outcome.sign.bricks);
    Surface::read_proven(&first.path, settings.fill_rule);
    for (name, limits) in variants() {
        let (twin, bytes) = repair(&limits);
        assert!(bytes == expected, "{name}: other bytes");
        let (one, other) = (&first.outcome, &twin.outcome);
        assert_eq!(one.found, other.found, "{name}");
        assert_eq!(one.patch, other.patch, "{name}");
        assert_eq!(one.sign, other.sign, "{name}");
        assert_eq!(one.output.proof, other.output.proof, "{name}");
        if limits.share_bytes.is_some() {
            use brickmend::monitor::Counter;
            assert!(other.counters[&Counter::SpilledRuns] > 0, "{name}: nothing spilled");
        }
    }
}

#[test]
fn a_closed_sphere_has_its_twins() {
    assert_twins(&sphere([0.1, 0.2, 0.3], 1.0, 24), &at_depth(6), "ply", 8);
}

#[test]
fn an_open_soup_with_many_holes_has_its_twins() {
    let mut random = Random::new(41);
    let mut soup = sphere([0.1, 0.2, 0.3], 1.0, 24);
    Breakage::Drop.apply(&mut soup, 0.2, &mut random);
    Breakage::Fin.apply(&mut soup, 0.02, &mut random);
    // A large hole across brick borders.
    soup.retain(|corners| corners[0][0] < 0.8);
    assert_twins(&soup, &at_depth(7), "ply", 20);
}

#[test]
fn a_random_soup_with_duplicates_has_its_twins() {
    let mut random = Random::new(43);
    let mut soup = random_triangles(150, 0.7, &mut random);
    duplicate(&mut soup, 0.3, &mut random);
    assert_twins(&soup, &at_depth(6), "ply", 8);
}

#[test]
fn a_broken_sphere_written_as_stl_has_its_twins() {
    let mut random = Random::new(47);
    let mut soup = sphere([3.0, -2.0, 0.3], 1.0, 16);
    Breakage::Drop.apply(&mut soup, 0.1, &mut random);
    Breakage::Duplicate.apply(&mut soup, 0.1, &mut random);
    assert_twins(&soup, &at_depth(6), "stl", 8);
}
