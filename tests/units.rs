//! Units are carried from file to file, and lengths may be given in them.

mod support;

use std::path::Path;

use brickmend::io::{ReadOptions, open};
use brickmend::mesh::shapes::cuboid;
use brickmend::mesh::{LengthUnit, TriangleBatch};
use brickmend::repair::{Depth, Length, Limits, RepairError, Settings};
use brickmend::store::Scratch;

use crate::support::run::{Encoding, Workshop, at_depth};

fn unit_of(path: &Path) -> Option<LengthUnit> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = ReadOptions { share_bytes: 1 << 20 };
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
