//! Methods other than the default: what they keep all the same, and what they do not.

use brickmend::contour::Method;
use brickmend::mesh::shapes::{Random, cuboid};
use brickmend::repair::{RepairError, Settings, Verdict};
use brickmend::sign::FillRule;
use proptest::prelude::*;

use crate::support::breakage::Breakage;
use crate::support::run::{Encoding, Workshop, at_depth, repair_soup, unclustered};
use crate::support::soups::{closed_soups, random_triangles};
use crate::support::surface::Surface;

fn marching_cubes(depth: u32) -> Settings {
    Settings { method: Method::Mc, ..at_depth(depth) }
}

#[test]
fn marching_cubes_keep_closed_soups_closed() {
    for depth in 4..=6 {
        for closed in closed_soups(depth, u64::from(depth)) {
            let found = repair_soup(&closed.triangles, &marching_cubes(depth));
            let (outcome, surface) = found.unwrap_or_else(|e| panic!("{}: {e}", closed.name));
            assert_ne!(outcome.verdict, Verdict::Fail, "{}", closed.name);
            assert_eq!(outcome.output.caveat.as_deref(), Method::Mc.caveat());
            let (_, dual) = repair_soup(&closed.triangles, &at_depth(depth)).expect("a result");
            // Both surfaces pass the same edges of the grid.
            let (volume, cells) = (surface.proof.volume, outcome.output.contour.cells as f64);
            let off = (volume - dual.proof.volume).abs() / outcome.cell_size.powi(3) / cells;
            assert!(off < 0.25, "{} at depth {depth}: {off} of its leaf cells", closed.name);
        }
    }
}

#[test]
fn marching_cubes_stay_sound_in_single_precision() {
    let workshop = Workshop::new();
    for closed in closed_soups(5, 77) {
        let input = workshop.write(&closed.triangles, Encoding::BinaryStl);
        let settings = marching_cubes(5);
        let repaired = workshop
            .repair(&input, "stl", &settings, &Default::default())
            .unwrap_or_else(|e| panic!("{}: {e}", closed.name));
        Surface::read_proven(&repaired.path, settings.fill_rule);
    }
}

#[test]
fn marching_cubes_cut_off_what_the_default_keeps_sharp() {
    let (lo, hi) = ([-0.25, -1.75, 2.125], [1.5, -0.375, 3.25]);
    let on_planes = |settings: &Settings| {
        let (_, surface) = repair_soup(&cuboid(lo, hi), settings).expect("a result");
        let planes =
            |vertex: &[f64; 3]| (0..3).filter(|&a| [lo[a], hi[a]].contains(&vertex[a])).count();
        let mut counts = [0; 4];
        surface.vertices.iter().for_each(|vertex| counts[planes(vertex)] += 1);
        counts
    };
    let [off, flat, creases, corners] = on_planes(&unclustered(6));
    assert!(off == 0 && flat > 0 && creases > 0 && corners == 8);
    let [off, flat, creases, corners] = on_planes(&marching_cubes(6));
    assert!(flat > 0, "on the planes, to the bit");
    assert_eq!([off, creases, corners], [0; 3]);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(24) })]

    #[test]
    fn marching_cubes_make_a_sound_surface_of_any_soup(
        seed in any::<u64>(), kind in 0..11_usize, depth in 4..7_u32, evenodd in any::<bool>(),
        steps in proptest::collection::vec((0..9_usize, 0.0..0.5_f64), 0..4),
    ) {
        let mut random = Random::new(seed);
        let mut soup = match kind {
            10 => random_triangles(40, 0.6, &mut random),
            _ => closed_soups(depth, seed).swap_remove(kind).triangles,
        };
        for (step, share) in steps {
            Breakage::ALL[step].apply(&mut soup, share, &mut random);
        }
        let fill_rule = if evenodd { FillRule::Evenodd } else { FillRule::Solid };
        match repair_soup(&soup, &Settings { fill_rule, ..marching_cubes(depth) }) {
            Ok((outcome, _)) => prop_assert_ne!(outcome.verdict, Verdict::Fail),
            Err(RepairError::EmptyResult { .. } | RepairError::NoTriangle { .. }) => {}
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn what_dual_contouring_does_not_promise_is_told_and_the_file_is_kept() {
    let workshop = Workshop::new();
    let input =
        workshop.write(&random_triangles(400, 0.3, &mut Random::new(3)), Encoding::BinaryStl);
    let settings = Settings { method: Method::Dc, ..at_depth(6) };
    let repaired =
        workshop.repair(&input, "ply", &settings, &Default::default()).expect("a file in place");
    assert_eq!(repaired.outcome.verdict, Verdict::Fail);
    assert!(repaired.outcome.output.proof.nonmanifold_edges > 0);
    assert!(repaired.outcome.reasons[0].contains("not sound"), "{:?}", repaired.outcome.reasons);
    assert!(repaired.outcome.output.caveat.is_some() && repaired.path.exists());
    let sound = Settings { method: Method::Mdc, ..settings };
    let other = workshop.repair(&input, "ply", &sound, &Default::default()).expect("a result");
    assert!(other.outcome.output.proof.holds());
}
