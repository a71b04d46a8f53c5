//! Points of the lattice packed into words, for sorting and hashing.

use crate::octree::{BrickKey, Domain, LATTICE_BITS, SoupTriangle};

/// A point of the lattice.
pub(crate) type Point = [u32; 3];

/// The corners of a triangle on the lattice.
pub(crate) fn snapped(domain: &Domain, triangle: &SoupTriangle) -> [Point; 3] {
    triangle.corners.map(|c| domain.snap(c).map(|q| q as u32))
}

/// Whether the corners lie on one line.
pub(crate) fn is_degenerate(corners: [Point; 3]) -> bool {
    let [p, q, r] = corners.map(|c| c.map(i64::from));
    (0..3).all(|a| {
        let (u, v) = ((a + 1) % 3, (a + 2) % 3);
        (q[u] - p[u]) * (r[v] - p[v]) == (q[v] - p[v]) * (r[u] - p[u])
    })
}

/// The key of the brick that holds a point.
pub(crate) fn owner(domain: &Domain, point: Point) -> u64 {
    let brick = domain.brick_units() as u32;
    BrickKey::new(point.map(|c| c / brick)).0
}

/// Whether a brick holds the lowest corner of a triangle: of all bricks that have it, one does.
pub(crate) fn is_owned(triangle: &SoupTriangle, domain: &Domain, brick: u64) -> bool {
    let lowest = snapped(domain, triangle).into_iter().min().expect("three corners");
    owner(domain, lowest) == brick
}

/// The length of an edge in model units, for lattice units of `unit`.
pub(crate) fn length_of(ends: [Point; 2], unit: f64) -> f64 {
    let square: f64 =
        (0..3).map(|a| f64::from(ends[0][a]) - f64::from(ends[1][a])).map(|d| d * d).sum();
    square.sqrt() * unit
}

/// Two ends of 84 bits in three words of 56.
pub(crate) fn pack_ends([p, q]: [Point; 2]) -> [u64; 3] {
    let [p, q] = [p, q].map(pack_point);
    let mask = (1 << 56) - 1;
    [(p >> 28) as u64, ((p << 28 | q >> 56) & mask) as u64, (q & mask) as u64]
}

/// A point of 84 bits; comparing words is comparing points.
pub(crate) fn pack_point(point: Point) -> u128 {
    point.iter().fold(0, |bits, &c| bits << LATTICE_BITS | u128::from(c))
}

/// The ends that [`pack_ends`] packed.
pub(crate) fn unpack_ends([high, middle, low]: [u64; 3]) -> [Point; 2] {
    let mask = (1_u128 << LATTICE_BITS) - 1;
    let unpack = |bits: u128| [2, 1, 0].map(|i| (bits >> (i * LATTICE_BITS) & mask) as u32);
    let first = u128::from(high) << 28 | u128::from(middle) >> 28;
    let second = u128::from(middle & ((1 << 28) - 1)) << 56 | u128::from(low);
    [unpack(first), unpack(second)]
}
