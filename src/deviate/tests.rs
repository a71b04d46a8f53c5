//! Comparisons against brute force, on any number of threads and with any share.

use glam::DVec3;
use rayon::ThreadPool;

use crate::deviate::nearest::near_on;
use crate::deviate::samples::Sample;
use crate::deviate::triangles::Triangle;
use crate::deviate::{
    CreaseReport, Deviation, DeviationOptions, Means, Surface, SurfaceOptions, Target, compare,
};
use crate::mesh::shapes::{
    Corners, ListedTriangles, Random, cuboid, rotation, sphere, torus, transform,
};
use crate::monitor::Void;
use crate::octree::{SoupSpool, SoupTriangle, SoupWriter};
use crate::store::Scratch;

const SAMPLES: u64 = 2000;
const SMALL: u64 = 16 << 10;
const LARGE: u64 = 64 << 20;

struct Workshop {
    _folder: tempfile::TempDir,
    scratch: Scratch,
    pool: ThreadPool,
    share_bytes: u64,
}

impl Workshop {
    fn new(threads: usize, share_bytes: u64) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        Self { _folder: folder, scratch, pool, share_bytes }
    }

    fn means(&self) -> Means<'_> {
        let Self { scratch, pool, share_bytes, .. } = self;
        Means { scratch, pool, share_bytes: *share_bytes, monitor: &Void }
    }

    fn read(&self, triangles: &[Corners], samples: u64) -> Surface<'static> {
        let mut source = ListedTriangles::without_indices(triangles.to_vec());
        let surface = Surface::read(&mut source, &asked(samples), &self.means());
        surface.expect("the scratch disk works").expect("it has an area")
    }

    fn soup(&self, triangles: &[Corners]) -> SoupSpool {
        let mut spool = SoupWriter::create(&self.scratch, "soup.spool").expect("writable");
        for (source, &corners) in (0..).zip(triangles) {
            let triangle = SoupTriangle { corners, source, part: 0, material: 0, stands_for: 0 };
            spool.push(triangle).expect("writable");
        }
        spool.finish().expect("writable")
    }

    fn compare(&self, one: &[Corners], other: &[Corners], options: &DeviationOptions) -> Deviation {
        let (one, other) = (self.read(one, SAMPLES), self.read(other, SAMPLES));
        compare(&one, &other, options, &self.means()).expect("the scratch disk works")
    }
}

fn asked(samples: u64) -> SurfaceOptions {
    SurfaceOptions { samples, creases: true }
}

fn options(tolerance: f64) -> DeviationOptions {
    DeviationOptions { crease_samples: 500, tolerance, cell_size: None }
}

/// Triangles of all sizes, some without area.
fn soup(random: &mut Random, count: usize) -> Vec<Corners> {
    let triangle = |i: usize, random: &mut Random| {
        let (at, size) = (random.point(), if i.is_multiple_of(9) { 1.0 } else { 0.1 });
        let corners: Corners = std::array::from_fn(|_| {
            let by = random.point();
            std::array::from_fn(|axis| at[axis] + size * by[axis])
        });
        if i % 17 == 5 { [corners[0], corners[1], corners[0]] } else { corners }
    };
    (0..count).map(|i| triangle(i, random)).collect()
}

fn all_samples(surface: &Surface) -> Vec<Sample> {
    let mut all = Vec::new();
    surface
        .samples
        .each_block(100, |block| {
            all.extend_from_slice(block);
            Ok(())
        })
        .expect("the scratch disk works");
    all
}

/// The nearest of all triangles, by looking at each.
fn nearest(sample: &Sample, triangles: &[Corners]) -> f64 {
    let (point, normal) = (DVec3::from(sample.point), DVec3::from(sample.normal));
    let distances = triangles.iter().map(|&corners| {
        let triangle = Triangle { corners, number: 0, is_pane: 0 };
        let near = near_on(point, normal, &triangle, f64::INFINITY);
        near.expect("nothing is too far").distance_squared
    });
    distances.fold(f64::INFINITY, f64::min).sqrt()
}

#[test]
fn distances_are_those_of_brute_force_whatever_the_share_and_the_threads() {
    let mut random = Random::new(51);
    for round in 0..4 {
        let (one, other) = (soup(&mut random, 150 + 300 * round), soup(&mut random, 400));
        let options = DeviationOptions { cell_size: Some(0.125), ..options(0.2) };
        let large = Workshop::new(1, LARGE);
        let found = large.compare(&one, &other, &options);
        for (way, from, to) in
            [(&found.original_to_file, &one, &other), (&found.file_to_original, &other, &one)]
        {
            let samples = all_samples(&large.read(from, SAMPLES));
            let distances = samples.iter().map(|sample| nearest(sample, to));
            let most = distances.clone().fold(0.0, f64::max);
            assert_eq!(way.largest.expect("there are samples").distance, most);
            assert_eq!(way.in_cells.expect("cells are known")[3], most / 0.125);
            let of_area = samples.iter().zip(distances).filter(|(sample, _)| !sample.is_corner());
            let mut of_area: Vec<f64> = of_area.map(|(_, distance)| distance).collect();
            assert!(of_area.len().abs_diff(2000) <= 1 && way.samples == of_area.len() as u64);
            assert!(way.corners > 300);
            let mean = of_area.iter().sum::<f64>() / of_area.len() as f64;
            assert_eq!(way.mean, mean);
            of_area.sort_unstable_by(f64::total_cmp);
            let rank = (0.999 * of_area.len() as f64).ceil() as usize;
            assert_eq!(way.p999, of_area[rank - 1]);
        }
        for (threads, share_bytes) in [(1, SMALL), (8, LARGE), (8, SMALL)] {
            let again = Workshop::new(threads, share_bytes).compare(&one, &other, &options);
            assert_eq!(again, found, "{threads} threads, {share_bytes} bytes");
        }
        let workshop = Workshop::new(2, SMALL);
        let soup = workshop.soup(&one);
        let left_there = Surface::of_soup(&soup, &asked(SAMPLES), &workshop.means());
        let left_there = left_there.expect("the scratch disk works").expect("it has an area");
        let other = workshop.read(&other, SAMPLES);
        let again = compare(&left_there, &other, &options, &workshop.means());
        assert_eq!(again.expect("the scratch disk works"), found, "in a spool");
    }
}

#[test]
fn points_are_measured_as_by_brute_force_whatever_the_share_and_the_threads() {
    let mut random = Random::new(7);
    // Some lie anywhere, some beside those before them.
    let mut triangles = soup(&mut random, 500);
    triangles.extend(torus(0.4, 0.1, 24, 8));
    let points: Vec<[f64; 3]> =
        (0..3000).map(|_| random.point().map(|part| 2.0 * part - 0.5)).collect();
    let expected = points.iter().map(|point| {
        let distances = triangles.iter().map(|&corners| {
            let triangle = Triangle { corners, number: 0, is_pane: 0 };
            let near = near_on(DVec3::from(*point), DVec3::ZERO, &triangle, f64::INFINITY);
            near.expect("nothing is too far").distance_squared
        });
        distances.fold(f64::INFINITY, f64::min).sqrt()
    });
    let expected: Vec<f64> = expected.collect();
    for (threads, share_bytes) in [(1, LARGE), (1, SMALL), (4, SMALL)] {
        let workshop = Workshop::new(threads, share_bytes);
        let mut source = ListedTriangles::without_indices(triangles.clone());
        let target = Target::read(&mut source, &workshop.means());
        let target = target.expect("the scratch disk works").expect("it has an area");
        let found = target.distances(&points, &workshop.means());
        assert!(found.expect("the scratch disk works") == expected);
    }
}

#[test]
fn samples_lie_on_the_surface_evenly() {
    let shape = cuboid([0.0; 3], [1.0, 2.0, 4.0]);
    let surface = Workshop::new(1, LARGE).read(&shape, 2800);
    let samples = all_samples(&surface);
    assert_eq!(samples.iter().filter(|sample| sample.is_corner()).count(), 8);
    let on = |axis: usize, at: f64| {
        samples.iter().filter(|s| !s.is_corner() && s.point[axis] == at).count()
    };
    // Areas are 8, 4 and 2 on two sides each, of 28.
    for (axis, expected) in [(0, 800), (1, 400), (2, 200)] {
        for at in [0.0, [1.0, 2.0, 4.0][axis]] {
            assert!(on(axis, at).abs_diff(expected) <= 1, "{axis} {at}: {}", on(axis, at));
        }
    }
}

fn creases(deviation: &Deviation) -> &CreaseReport {
    deviation.creases.as_ref().expect("they were sought")
}

#[test]
fn equal_surfaces_have_no_deviation_and_keep_all_creases() {
    let mut random = Random::new(52);
    let turned = transform(&cuboid([-1.0; 3], [1.0, 0.5, 2.0]), rotation(&mut random), DVec3::ONE);
    let found = Workshop::new(2, LARGE).compare(&turned, &turned, &options(0.01));
    let largest = found.original_to_file.largest.expect("there are samples");
    assert!(largest.distance < 1e-12);
    assert!(found.original_to_file.normals.p99_deg < 1e-3);
    assert_eq!((found.lost.share, found.invented_share), (0.0, 0.0));
    assert_eq!(found.lost.visible_share, 1.0);
    assert_eq!(creases(&found).kept_share, Some(1.0));
    let edges = 4.0 * (2.0 + 1.5 + 3.0);
    assert!((creases(&found).length - edges).abs() < 1e-9, "diagonals are not sharp");
    assert!((creases(&found).visible_length - edges).abs() < 1e-9);
}

#[test]
fn what_is_enclosed_is_not_seen_and_not_missed() {
    let outer = cuboid([-1.0; 3], [1.0; 3]);
    let inner = sphere([0.1, 0.0, 0.2], 0.5, 6);
    let both = [outer.clone(), inner.clone()].concat();
    let found = Workshop::new(2, LARGE).compare(&both, &outer, &options(0.05));
    let share = 24.0 / (24.0 + crate::mesh::shapes::area(&inner));
    assert!((found.lost.visible_share - share).abs() < 0.01);
    assert_eq!(found.lost.share, 0.0);
    assert!(found.original_to_file.largest.expect("samples").distance > 0.3);
    assert!(found.lost.largest.expect("something is seen").distance < 1e-12);
    // Without its lid the ball is seen, and missed.
    let open = [outer[2..].to_vec(), inner].concat();
    let found = Workshop::new(2, LARGE).compare(&open, &outer, &options(0.05));
    assert!(found.lost.share > 0.03, "{}", found.lost.share);
    assert!(found.lost.largest.expect("something is seen").distance > 0.3);
    let lid = 4.0 / 24.0;
    assert!((found.invented_share - lid).abs() < 0.05, "{}", found.invented_share);
}

#[test]
fn a_rounded_crease_is_not_kept() {
    let found = Workshop::new(2, LARGE).compare(
        &cuboid([-1.0; 3], [1.0; 3]),
        &sphere([0.0; 3], 1.4, 40),
        &options(1.0),
    );
    assert_eq!(creases(&found).kept_share, Some(0.0));
    assert_eq!((creases(&found).file_length, creases(&found).largest), (0.0, None));
    let none = Workshop::new(2, LARGE).compare(
        &torus(1.0, 0.4, 40, 30),
        &cuboid([-1.0; 3], [1.0; 3]),
        &options(1.0),
    );
    assert_eq!((creases(&none).length, creases(&none).kept_share), (0.0, None));
}

#[test]
fn surfaces_without_an_area_or_without_squares_are_not_measured() {
    let workshop = Workshop::new(1, SMALL);
    for triangles in [
        vec![],
        vec![[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]],
        vec![[[0.0; 3], [1e200, 0.0, 0.0], [0.0, 1e200, 0.0]]],
        vec![[[f64::NAN; 3]; 3]],
    ] {
        let mut source = ListedTriangles::without_indices(triangles);
        let options = SurfaceOptions { samples: 100, creases: true };
        let surface = Surface::read(&mut source, &options, &workshop.means());
        assert!(surface.expect("the scratch disk works").is_none());
    }
}
