//! Units are carried from file to file, and lengths may be given in them.

use std::path::Path;

use brickmend::io::{ReadOptions, open};
use brickmend::mesh::shapes::cuboid;
use brickmend::mesh::{LengthUnit, TriangleBatch};
use brickmend::repair::{Depth, Length, Limits, RepairError, Settings};
use brickmend::store::Scratch;

use crate::support::run::{Encoding, Workshop, at_depth};

fn unit_of(path: &Path) -> Option<LengthUnit> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = ReadOptions::in_scene(1 << 20);
    let mut source = open(path, &Scratch::new(folder.path()), &options).expect("opens");
    source.next_batch(&mut TriangleBatch::default()).expect("reads");
    source.unit()
}

#[test]
fn a_file_in_inches_is_measured_in_millimetres_and_stays_in_inches() {
    let workshop = Workshop::new();
    let input = workshop.write(&cuboid([0.0; 3], [1.0; 3]), Encoding::Obj);
    let fine = Depth::Tolerance { length: Length::Metres(0.0005), max_depth: 12 };
    let settings = Settings { depth: fine, ..at_depth(5) };
    let limits = Limits::default();
    let refused = workshop.repair(&input, "3mf", &settings, &limits);
    assert!(matches!(refused, Err(RepairError::NoUnit { .. })), "nobody says what a unit is");
    let said = Settings { unit: Some(LengthUnit::Inch), ..settings };
    let first = workshop.repair(&input, "3mf", &said, &limits).expect("a result");
    assert_eq!(unit_of(&first.path), Some(LengthUnit::Inch));
    // What the file says counts, whatever the user says.
    let wrong = Settings { unit: Some(LengthUnit::Meter), ..settings };
    let second = workshop.repair(&first.path, "3mf", &wrong, &limits).expect("a result");
    assert_eq!(unit_of(&second.path), Some(LengthUnit::Inch));
    for outcome in [&first.outcome, &second.outcome] {
        let cell_mm = outcome.cell_size * 25.4;
        assert!((0.4..=1.0).contains(&cell_mm), "cells of {cell_mm} mm");
        assert!(outcome.transfer.lost.is_empty(), "{:?}", outcome.transfer.lost);
    }
    let third = workshop.repair(&first.path, "ply", &settings, &limits).expect("a result");
    assert_eq!(third.outcome.transfer.lost, ["the unit"]);
}

/// The corners of the box of a file as a viewer sees it.
fn size_of(path: &Path) -> [f64; 3] {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = ReadOptions::in_scene(1 << 20);
    let mut source = open(path, &Scratch::new(folder.path()), &options).expect("opens");
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let mut batch = TriangleBatch::default();
    while source.next_batch(&mut batch).expect("reads") {
        for corner in batch.corners.as_flattened() {
            for axis in 0..3 {
                lo[axis] = lo[axis].min(corner[axis]);
                hi[axis] = hi[axis].max(corner[axis]);
            }
        }
    }
    [0, 1, 2].map(|axis| hi[axis] - lo[axis])
}

#[test]
fn glb_is_in_metres_whatever_the_numbers_are_in() {
    let workshop = Workshop::new();
    let input = workshop.write(&cuboid([1.0; 3], [11.0, 6.0, 3.0]), Encoding::Obj);
    let inches = Settings { unit: Some(LengthUnit::Inch), ..at_depth(5) };
    let repaired = workshop.repair(&input, "glb", &inches, &Limits::default()).expect("a result");
    assert!(repaired.outcome.transfer.lost.is_empty());
    let proof = &repaired.outcome.output.proof;
    assert!((proof.volume - 100.0).abs() < 0.1, "numbers are inches still: {}", proof.volume);
    for (found, inches) in size_of(&repaired.path).into_iter().zip([10.0, 5.0, 2.0]) {
        assert!((found - inches * 0.0254).abs() < 1e-6, "{found}");
    }
}

#[test]
fn numbers_are_turned_into_another_unit_on_request() {
    let workshop = Workshop::new();
    let input = workshop.write(&cuboid([1.0; 3], [11.0, 6.0, 3.0]), Encoding::Obj);
    let to_mm = Settings { to_unit: Some(LengthUnit::Millimeter), ..at_depth(5) };
    let limits = Limits::default();
    let refused = workshop.repair(&input, "stl", &to_mm, &limits);
    assert!(matches!(refused, Err(RepairError::NothingToConvert { .. })));
    let inches = Settings { unit: Some(LengthUnit::Inch), ..to_mm };
    for extension in ["stl", "3mf"] {
        let repaired = workshop.repair(&input, extension, &inches, &limits).expect("a result");
        for (found, inches) in size_of(&repaired.path).into_iter().zip([10.0, 5.0, 2.0]) {
            assert!((found - inches * 25.4).abs() < 1e-4, "{found}");
        }
    }
    let written = workshop.repair(&input, "3mf", &inches, &limits).expect("a result");
    assert_eq!(unit_of(&written.path), Some(LengthUnit::Millimeter));
}
