//! What is apart, against brute force, on any number of threads and with any share.

use glam::DVec3;

use crate::deviate::{Gap, Means, Piece, Target};
use crate::geom::closest_on_triangle;
use crate::mesh::shapes::{Corners, ListedTriangles, Random, cuboid, sphere};
use crate::monitor::Void;
use crate::store::Scratch;

const AMPLE: u64 = 64 << 20;
const SMALL: u64 = 16 << 10;

fn apart_with(
    (threads, share_bytes): (usize, u64),
    (one, other): (&[Corners], &[Corners]),
    gap: Gap,
) -> Vec<Piece> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
    let means = Means { scratch: &scratch, pool: &pool, share_bytes, monitor: &Void };
    let mut source = ListedTriangles::without_indices(other.to_vec());
    let target = Target::read(&mut source, &means).expect("the disk works");
    let target = target.expect("it has an area");
    let mut source = ListedTriangles::without_indices(one.to_vec());
    let mut pieces = Vec::new();
    target
        .apart(&mut source, &gap, &means, |piece| {
            pieces.push(*piece);
            Ok(())
        })
        .expect("the disk works");
    pieces
}

fn apart(one: &[Corners], other: &[Corners], tolerance: f64, finest: f64) -> Vec<Piece> {
    apart_with((1, AMPLE), (one, other), Gap { tolerance, finest })
}

fn area(pieces: &[Piece]) -> f64 {
    pieces.iter().map(Piece::area).sum()
}

fn distance(point: DVec3, corners: &Corners) -> f64 {
    point.distance(closest_on_triangle(point, corners.map(DVec3::from)))
}

fn soup(random: &mut Random, count: usize, size: f64) -> Vec<Corners> {
    let triangle = |_| {
        let at = random.point();
        let size = if random.below(4) == 0 { 8.0 * size } else { size };
        std::array::from_fn(|_| {
            let by = random.point();
            std::array::from_fn(|axis| at[axis] + size * by[axis])
        })
    };
    (0..count).map(triangle).collect()
}

#[test]
fn every_point_is_in_a_piece_if_and_only_if_it_is_far() {
    let mut random = Random::new(11);
    let (tolerance, finest) = (0.15, 0.04);
    for _ in 0..4 {
        let (one, other) = (soup(&mut random, 60, 0.2), soup(&mut random, 60, 0.2));
        let pieces = apart(&one, &other, tolerance, finest);
        let (mut far, mut near) = (0, 0);
        for (number, corners) in one.iter().enumerate() {
            let own: Vec<_> = pieces.iter().filter(|p| p.number == number as u64).collect();
            for _ in 0..40 {
                let (u, v) = (random.share(), random.share());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let [a, b, c] = corners.map(DVec3::from);
                let point = a + (b - a) * u + (c - a) * v;
                let away = other.iter().map(|t| distance(point, t)).fold(f64::MAX, f64::min);
                let is_in = own.iter().any(|piece| distance(point, &piece.corners) < 1e-9);
                if away > tolerance + finest {
                    assert!(is_in, "{number}: {away}");
                    far += 1;
                } else if away < tolerance - finest {
                    assert!(!is_in, "{number}: {away}");
                    near += 1;
                }
            }
        }
        assert!(far > 100 && near > 100, "{far} {near}");
    }
}

#[test]
fn threads_and_shares_change_nothing() {
    let mut random = Random::new(3);
    // Some are so large that several workers have pieces of them.
    let mut one = soup(&mut random, 600, 0.05);
    one.insert(7, [[-2.0, -2.0, 0.1], [2.0, -2.0, 0.0], [0.0, 2.0, 0.2]]);
    let other = soup(&mut random, 100, 0.1);
    let gap = Gap { tolerance: 0.05, finest: 0.02 };
    let expected = apart_with((1, AMPLE), (&one, &other), gap);
    assert!(expected.iter().filter(|piece| piece.number == 7).count() > 100);
    for means in [(2, AMPLE), (8, SMALL), (1, SMALL), (3, AMPLE)] {
        assert_eq!(apart_with(means, (&one, &other), gap), expected, "{means:?}");
    }
}

#[test]
fn what_is_far_altogether_comes_whole_and_what_is_near_not_at_all() {
    let ball = sphere([0.0; 3], 1.0, 24);
    let small = sphere([0.0; 3], 0.5, 6);
    let both = [ball.clone(), small.clone()].concat();
    let pieces = apart(&both, &ball, 0.1, 0.01);
    let whole: Vec<_> = pieces.iter().map(|piece| piece.corners).collect();
    assert_eq!(whole, small);
    assert_eq!(pieces[0].number, ball.len() as u64);
    assert!(apart(&ball, &both, 0.1, 0.01).is_empty());
    // A large triangle that is far is no pieces, however many it would have.
    let plate = cuboid([-100.0, -100.0, 50.0], [100.0, 100.0, 51.0]);
    let whole: Vec<_> = apart(&plate, &ball, 0.1, 0.01).iter().map(|piece| piece.corners).collect();
    assert_eq!(whole, plate);
}

#[test]
fn large_faces_are_cut_where_they_leave_the_other_surface() {
    let far = cuboid([0.0; 3], [10.0, 10.0, 1.0]);
    let near = cuboid([0.0; 3], [4.0, 10.0, 1.0]);
    let (tolerance, finest) = (0.3, 0.1);
    let pieces = apart(&far, &near, tolerance, finest);
    // The end, and of the four sides what is beyond 4.3.
    let expected = 10.0 + 2.0 * (10.0 - 4.3) * (10.0 + 1.0);
    let border = 2.0 * (10.0 + 1.0);
    assert!((area(&pieces) - expected).abs() < border * finest, "{} {expected}", area(&pieces));
    let lowest = pieces.iter().flat_map(|piece| piece.corners).map(|c| c[0]).fold(9.0, f64::min);
    assert!((4.3 - finest..4.3 + finest).contains(&lowest), "{lowest}");
    // Fine pieces are at the border alone.
    assert!(pieces.len() < 6000, "{}", pieces.len());
}

#[test]
fn what_is_just_as_far_as_the_tolerance_is_near_whatever_rounding_says() {
    let mut random = Random::new(1);
    for _ in 0..20 {
        let (low, width) = (random.within(100.0, 200.0), random.within(0.1, 0.2));
        let at = |z| [[[low, 0.0, z], [low + 5.0, 0.1, z], [low + 0.3, 5.0, z]]];
        let pieces = apart(&at(low + width), &at(low), width, 0.05);
        assert!(pieces.is_empty(), "{}", area(&pieces));
    }
}

#[test]
fn triangles_without_area_or_with_infinite_corners_are_no_pieces_and_are_counted() {
    let line = [[5.0; 3], [6.0; 3], [7.0; 3]];
    let wild = [[f64::NAN; 3], [1.0; 3], [0.0; 3]];
    let triangle = [[5.0, 0.0, 0.0], [6.0, 0.0, 0.0], [5.0, 1.0, 0.0]];
    let pieces = apart(&[line, wild, triangle], &cuboid([0.0; 3], [1.0; 3]), 0.5, 0.1);
    assert_eq!(pieces, [Piece::whole(2, triangle)]);
}
