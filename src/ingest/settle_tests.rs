//! The settling of duplicates against a second, plain telling of its rule, and in its forms.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;
use proptest::prelude::*;

use crate::ingest::{SettleStats, fill_bins, read_soup, settle};
use crate::mesh::Attributes;
use crate::mesh::shapes::{Corners, ListedTriangles, Random, cuboid, shuffle, sphere};
use crate::monitor::Void;
use crate::octree::{BrickKey, Domain};
use crate::store::{Backing, NoCheckpoints, Resources, Scratch};

/// A distance far below the lattice of soups of size one.
const HAIR: f64 = 1e-11;

/// What settling says: the counts, and for each brick the sources that are left.
#[derive(Clone, Debug, PartialEq)]
struct Said {
    stats: SettleStats,
    left: BTreeMap<u64, BTreeSet<u32>>,
    left_out: u64,
    domain: Domain,
}

fn settled(soup: &[Corners], depth: u32, share_bytes: u64, threads: usize) -> Said {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    let resources = Resources {
        scratch: &scratch,
        pool: &pool,
        share_bytes,
        cached_windows: 4,
        backing: Backing::Memory,
        checkpoints: &NoCheckpoints,
        monitor: &Void,
    };
    let mut source = ListedTriangles::without_indices(soup.to_vec());
    let read = read_soup(&mut source, true, Attributes::NONE, &resources).expect("a sound soup");
    let domain = Domain::around(&read.facts.bounds, depth, false).expect("room enough");
    let triangles = read.facts.stats.triangles;
    let (bins, _) = fill_bins(read, &domain, &resources).expect("room on the disk");
    let settled = settle(&bins, &domain, triangles, &resources).expect("room");
    let mut left: BTreeMap<u64, BTreeSet<u32>> = BTreeMap::new();
    let mut drops = Vec::new();
    let spools = bins.spools();
    let mut walk = spools.bins();
    while let Some(bin) = walk.next().expect("readable") {
        let sources = left.entry(bin.brick.0).or_default();
        let listed = spools.each_block(&bin, None, |block| {
            sources.extend(block.iter().map(|t| t.source));
            Ok(())
        });
        listed.expect("readable");
    }
    settled.drops.read(0, usize::MAX >> 8, &mut drops).expect("readable");
    for drop in &drops {
        assert!(left.get_mut(&drop.brick).expect("a bin").remove(&drop.source), "{drop:?}");
    }
    assert!(drops.is_sorted_by_key(|drop| (drop.brick, drop.source)));
    Said { stats: settled.stats, left, left_out: bins.left_out.triangles, domain }
}

type Point = [i64; 3];

fn key<T: Ord + Copy, const N: usize>(mut points: [T; N]) -> [T; N] {
    points.sort_unstable();
    points
}

fn given(corner: [f64; 3]) -> [u64; 3] {
    corner.map(|c| (c + 0.0).to_bits())
}

/// All edges of a soup on the lattice: the triangles at each, and the edges as given.
#[derive(Default)]
struct Edge {
    triples: BTreeMap<[Point; 3], u64>,
    given: BTreeMap<[[u64; 3]; 2], u64>,
}

/// The sources that count, told from the whole soup at once; and how many edges are left odd.
fn expected(soup: &[Corners], domain: &Domain) -> (BTreeSet<u32>, u64) {
    let snapped: Vec<[Point; 3]> =
        soup.iter().map(|t| t.map(|c| domain.snap(c).map(i64::from))).collect();
    let mut groups: BTreeMap<[Point; 3], Vec<u32>> = BTreeMap::new();
    let mut edges: BTreeMap<[Point; 2], Edge> = BTreeMap::new();
    for (source, (corners, &points)) in (0..).zip(soup.iter().zip(&snapped)) {
        groups.entry(key(points)).or_default().push(source);
        let flat = (0..3).any(|i| points[i] == points[(i + 1) % 3]);
        for (i, j) in [(0, 1), (1, 2), (2, 0)].into_iter().filter(|&(i, j)| points[i] != points[j])
        {
            let edge = edges.entry(key([points[i], points[j]])).or_default();
            *edge.given.entry(key([given(corners[i]), given(corners[j])])).or_default() += 1;
            *edge.triples.entry(key(points)).or_default() += u64::from(!flat);
        }
    }
    let is_even = |triple: &[Point; 3]| groups[triple].len().is_multiple_of(2);
    // Patches: even groups that share an edge, named by their smallest triple.
    let mut patch_of: BTreeMap<[Point; 3], [Point; 3]> =
        groups.keys().filter(|t| is_even(t)).map(|&t| (t, t)).collect();
    let mut changed = true;
    while changed {
        changed = false;
        for edge in edges.values() {
            let here: Vec<_> = edge
                .triples
                .iter()
                .filter(|(t, n)| **n > 0 && is_even(t))
                .map(|(t, _)| *t)
                .collect();
            if let Some(least) = here.iter().map(|t| patch_of[t]).min() {
                for triple in here {
                    changed |= patch_of.insert(triple, least) != Some(least);
                }
            }
        }
    }
    #[derive(Default, Clone, Copy)]
    struct Rim {
        odd: bool,
        even: bool,
        folded: bool,
        alone_open: bool,
        alone_closed: bool,
        differs: bool,
    }
    let mut rims: BTreeMap<[Point; 3], Rim> = BTreeMap::new();
    for (triple, patch) in &patch_of {
        let as_given = |&s: &u32| key(soup[s as usize].map(given));
        let kinds: BTreeSet<_> = groups[triple].iter().map(as_given).collect();
        rims.entry(*patch).or_default().differs |= kinds.len() > 1;
    }
    let others_of = |edge: &Edge| -> u64 {
        let odd = |(t, n): (&[Point; 3], &u64)| if is_even(t) { 0 } else { (*n).min(1) };
        edge.triples.iter().map(odd).sum()
    };
    let are_folded = |ends: &[Point; 2], edge: &Edge| {
        let odd = edge.triples.iter().filter(|(t, n)| **n > 0 && !is_even(t));
        let corner = |(t, _): (&[Point; 3], _)| *t.iter().find(|p| !ends.contains(p)).expect("one");
        let corners: Vec<Point> = odd.map(corner).collect();
        let vector = |p: Point, q: Point| DVec3::from([0, 1, 2].map(|a| (q[a] - p[a]) as f64));
        let along = vector(ends[0], ends[1]);
        let away = |&corner: &Point| vector(ends[0], corner).reject_from(along);
        corners.len() == 2
            && away(&corners[0]).angle_between(away(&corners[1])) < std::f64::consts::TAU / 128.0
    };
    for (ends, edge) in &edges {
        let even: Vec<_> = edge.triples.iter().filter(|(t, n)| **n > 0 && is_even(t)).collect();
        if even.len() % 2 == 1 {
            let rim = rims.get_mut(&patch_of[even[0].0]).expect("a patch");
            let others = others_of(edge);
            let closed = edge.given.values().all(|n| n % 2 == 0);
            rim.odd |= others % 2 == 1;
            let folded = others == 2 && are_folded(ends, edge);
            rim.folded |= folded;
            rim.even |= others % 2 == 0 && others > 0 && !folded;
            rim.alone_closed |= others == 0 && closed;
            rim.alone_open |= others == 0 && !closed;
        }
    }
    let none = |triple: &[Point; 3]| {
        is_even(triple) && {
            let rim = rims[&patch_of[triple]];
            let open = rim.odd || rim.alone_open;
            let sides_are_copies = rim.alone_closed || rim.folded && !rim.even;
            !open && if sides_are_copies { rim.differs } else { rim.even }
        }
    };
    let counted = groups.iter().filter(|(t, _)| !none(t)).map(|(_, sources)| sources[0]).collect();
    let odd = edges.values().filter(|edge| {
        let here = edge.triples.iter().filter(|(t, n)| **n > 0 && !none(t)).count();
        here % 2 == 1
    });
    (counted, odd.count() as u64)
}

fn check(soup: &[Corners], name: &str) -> Said {
    let said = settled(soup, 6, 1 << 30, 1);
    let (counted, odd) = expected(soup, &said.domain);
    let left: BTreeSet<u32> = said.left.values().flatten().copied().collect();
    assert_eq!(left, counted, "{name}");
    assert_eq!(said.stats.rim_edges, odd, "{name}");
    said
}

/// Points of a coarse grid; each has a second one within a hair.
fn point(random: &mut Random, side: usize) -> [f64; 3] {
    let hair = if random.below(4) == 0 { HAIR } else { 0.0 };
    std::array::from_fn(|_| random.below(side) as f64 / side as f64 + hair)
}

fn random_copies(random: &mut Random, triangles: usize, side: usize) -> Vec<Corners> {
    (0..triangles).map(|_| [0; 3].map(|_| point(random, side))).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    #[test]
    fn the_rule_is_the_one_that_was_told(
        seed in any::<u64>(), triangles in 1..80_usize, side in 2..4_usize,
    ) {
        check(&random_copies(&mut Random::new(seed), triangles, side), "random");
    }

    #[test]
    fn every_share_and_every_order_settles_alike(
        seed in any::<u64>(), triangles in 1000..6000_usize, side in 2..6_usize,
    ) {
        let mut random = Random::new(seed);
        let soup = random_copies(&mut random, triangles, side);
        let said = settled(&soup, 6, 1 << 30, 1);
        assert_eq!(said, settled(&soup, 6, 16 << 10, 2), "of 16 KiB");
        let mut shuffled = soup.clone();
        shuffle(&mut shuffled, &mut random);
        let again = settled(&shuffled, 6, 16 << 10, 1);
        let SettleStats { rim_length, .. } = said.stats;
        prop_assert!((again.stats.rim_length - rim_length).abs() <= 1e-9 * rim_length);
        prop_assert_eq!(SettleStats { rim_length, ..again.stats }, said.stats);
        let kept = |said: &Said, soup: &[Corners]| -> BTreeMap<u64, Vec<[Point; 3]>> {
            let triple =
                |&s: &u32| key(soup[s as usize].map(|c| said.domain.snap(c).map(i64::from)));
            let list = |(&brick, sources): (&u64, &BTreeSet<u32>)| {
                let mut triples: Vec<_> = sources.iter().map(triple).collect();
                triples.sort_unstable();
                (brick, triples)
            };
            said.left.iter().map(list).filter(|(_, triples)| !triples.is_empty()).collect()
        };
        prop_assert_eq!(kept(&again, &shuffled), kept(&said, &soup));
    }
}

/// The sides of tetrahedra, many of which snapping presses flat.
fn flat_tetrahedra(seed: u64, solids: usize, side: usize) -> Vec<Corners> {
    let mut random = Random::new(seed);
    let mut soup = Vec::new();
    for _ in 0..solids {
        // Two equal corners would make a triangle that is written twice.
        let [p, q, r, s] = loop {
            let corners = [0; 4].map(|_| point(&mut random, side));
            let distinct = key(corners.map(given)).windows(2).all(|pair| pair[0] != pair[1]);
            if distinct {
                break corners;
            }
        };
        soup.extend([[p, q, r], [p, q, s], [p, r, s], [q, r, s]]);
    }
    soup
}

#[test]
fn soups_that_are_closed_as_given_stay_closed() {
    // The rule goes by patches of copies, so a tangle of pressed solids may keep a rim: rarely.
    let cases = 4000;
    let left_open = (0..cases).filter(|&seed| {
        let (solids, side) = (1 + seed as usize % 23, 2 + seed as usize / 23 % 2);
        check(&flat_tetrahedra(seed, solids, side), "closed").stats.rim_edges > 0
    });
    let seeds: Vec<u64> = left_open.collect();
    assert!(seeds.len() as u64 * 100 < cases, "{} of {cases}: {seeds:?}", seeds.len());
}

/// How many triangles of the soup count.
fn counted(said: &Said) -> usize {
    said.left.values().flatten().collect::<BTreeSet<_>>().len()
}

/// A panel of eight triangles around its middle, which lies `lift` above.
fn panel(lift: f64) -> Vec<Corners> {
    let rim = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)];
    let rim = rim.map(|(x, y)| [f64::from(x) / 2.0, f64::from(y) / 2.0, 0.5]);
    (0..8).map(|i| [rim[i], rim[(i + 1) % 8], [0.5, 0.5, 0.5 + lift]]).collect()
}

fn turned(mut soup: Vec<Corners>) -> Vec<Corners> {
    soup.iter_mut().for_each(|corners| corners.swap(0, 2));
    soup
}

#[test]
fn a_panel_that_was_written_twice_counts_once() {
    let twice = [panel(0.0), turned(panel(0.0))].concat();
    let said = check(&twice, "exact");
    assert_eq!((counted(&said), said.stats.rim_edges), (8, 8));
    // Its second side was computed another way.
    let mut apart = twice;
    apart[8..].iter_mut().flatten().flatten().for_each(|c| *c += HAIR);
    let said = check(&apart, "a hair apart");
    assert_eq!((counted(&said), said.stats.duplicate_triangles), (8, 8));
    let thrice = [panel(0.0), panel(0.0), turned(panel(0.0))].concat();
    assert_eq!(counted(&check(&thrice, "thrice")), 8);
}

#[test]
fn of_a_panel_whose_sides_are_copies_in_places_all_places_count() {
    // Around the middle the sides are a hair apart, farther out they are the same.
    let ring = |lift: f64| -> Vec<Corners> {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| [x, y, 0.5]);
        let inner = square.map(|p| [0.5 + (p[0] - 0.5) / 2.0, 0.5 + (p[1] - 0.5) / 2.0, 0.5]);
        let top = [0.5, 0.5, 0.5 + lift];
        (0..4)
            .flat_map(|i| {
                let j = (i + 1) % 4;
                let outer = [[square[i], square[j], inner[i]], [square[j], inner[j], inner[i]]];
                // The outermost are never copies.
                let far = [square[i], square[j], [0.5, 0.5, -lift]];
                [outer[0], outer[1], [inner[i], inner[j], top], far]
            })
            .collect()
    };
    let gap = 1e-3;
    let said = check(&[ring(0.0), turned(ring(gap))].concat(), "pinched");
    assert_eq!((said.stats.interface_triangles, counted(&said)), (0, 24));
    // Solids that touch part further.
    let said = check(&[ring(0.0), turned(ring(0.5))].concat(), "touching");
    assert_eq!((said.stats.interface_triangles, counted(&said)), (8, 16));
}

#[test]
fn a_closed_fold_that_snapping_presses_flat_leaves_nothing_open() {
    // Two sides that share their rim; the middles are a hair apart.
    let fold = [panel(0.0), turned(panel(HAIR))].concat();
    let said = check(&fold, "fold");
    assert_eq!((counted(&said), said.stats.rim_edges), (0, 0));
    assert_eq!((said.stats.duplicate_triangles, said.stats.interface_triangles), (8, 8));
    // The corners are the same on both sides.
    let rim: Vec<_> = panel(0.0).iter().map(|corners| corners[0]).collect();
    let corner = |i: usize| [rim[i], rim[(i + 1) % 8], rim[(i + 2) % 8]];
    let side = |lift: f64| -> Vec<Corners> {
        let middle = [0.5, 0.5, 0.5 + lift];
        let inner = |i: usize| [rim[i], rim[(i + 2) % 8], middle];
        [1, 3, 5, 7].into_iter().flat_map(|i| [corner(i), inner(i)]).collect()
    };
    let said = check(&[side(0.0), turned(side(HAIR))].concat(), "corners alike");
    assert_eq!((counted(&said), said.stats.rim_edges), (0, 0));
    // A plate with walls a hair high.
    let plate = cuboid([0.0, 0.0, 0.5], [1.0, 1.0, 0.5 + HAIR]);
    let said = check(&plate, "plate");
    assert_eq!((counted(&said) - 8, said.stats.rim_edges), (0, 0), "the walls have no width");
}

#[test]
fn a_flap_on_a_closed_surface_is_a_panel_and_counts_once() {
    let mut soup = cuboid([0.0; 3], [1.0; 3]);
    let [p, q, _] = soup[0];
    let flap = [p, q, [0.4, 0.3, -0.7]];
    soup.extend([flap, [q, p, flap[2]]]);
    let said = check(&soup, "flap");
    assert_eq!((counted(&said), said.stats.rim_edges), (13, 3));
    // So it does where the surface is open as well.
    soup.remove(0);
    assert_eq!(counted(&check(&soup, "flap at a hole")), 12);
}

#[test]
fn closed_surfaces_written_twice_or_thrice_count_once() {
    let ball = sphere([0.5; 3], 0.5, 6);
    for times in [2, 3, 5] {
        let said = check(&vec![ball.clone(); times].concat(), "ball");
        assert_eq!((counted(&said), said.stats.rim_edges), (ball.len(), 0));
        assert_eq!(said.stats.duplicate_triangles as usize, ball.len() * (times - 1));
    }
}

#[test]
fn a_crowd_of_copies_is_thinned_out_and_settles_like_a_few() {
    let mut soup = sphere([0.5; 3], 0.5, 4);
    let spike = [[0.1, 0.2, 0.3], [0.9, 0.4, 0.3], [0.5, 0.6, 1.4]];
    for copies in [100_000, 100_001] {
        let mut crowd = soup.clone();
        crowd.extend(vec![spike; copies]);
        let said = settled(&crowd, 6, 16 << 10, 2);
        soup.extend(vec![spike; 2 + copies % 2]);
        let few = settled(&soup, 6, 16 << 10, 2);
        soup.truncate(soup.len() - 2 - copies % 2);
        assert_eq!(said.left, few.left);
        assert_eq!(said.left_out as usize, copies - 2 - copies % 2);
        assert_eq!(said.stats.duplicate_triangles, few.stats.duplicate_triangles + said.left_out);
        assert_eq!(said.stats.rim_edges, few.stats.rim_edges);
    }
}

#[test]
fn large_bins_of_copies_settle_like_small_ones() {
    // A hundred kinds that come by turns, more often than the filter remembers and the share holds.
    let mut random = Random::new(5);
    let kinds: Vec<Corners> = random_copies(&mut random, 3000, 40);
    let soup: Vec<Corners> = (0..24).flat_map(|_| kinds.clone()).collect();
    assert!(soup.len() > 1 << 16);
    let said = settled(&soup, 4, 16 << 10, 1);
    assert_eq!(said, settled(&soup, 4, 1 << 30, 2));
    assert!(said.left.values().any(|bin| bin.len() > 100));
    let (counted, odd) = expected(&soup, &said.domain);
    let left: BTreeSet<u32> = said.left.values().flatten().copied().collect();
    assert_eq!((left, said.stats.rim_edges), (counted, odd));
    assert!(
        said.left.keys().any(|&brick| BrickKey(brick).position() != [0; 3]) || said.left.len() == 1
    );
}
