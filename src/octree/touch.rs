//! Which bricks a triangle touches.

use crate::octree::{BrickKey, Domain};

/// Share by which a separating test must fail before a brick is left out: far above the rounding
/// of f64 on lattice coordinates, far below a lattice unit. Too large a value costs an idle bin
/// entry, never a hit.
const SLACK: f64 = 1e-9;

/// Calls `visit` for every brick whose closed box meets the triangle with these lattice corners
/// (and possibly for a few that it misses by a hair), in Morton order within the descent.
pub fn for_each_touched_brick<E>(
    domain: &Domain,
    corners: [[i32; 3]; 3],
    visit: &mut impl FnMut(BrickKey) -> Result<(), E>,
) -> Result<(), E> {
    let brick = domain.brick_units();
    let last = i64::from(domain.bricks_per_side()) - 1;
    let mut lo = [0_u32; 3];
    let mut hi = [0_u32; 3];
    for axis in 0..3 {
        let coordinates = corners.map(|c| i64::from(c[axis]));
        let (least, most) = (
            coordinates[0].min(coordinates[1]).min(coordinates[2]),
            coordinates[0].max(coordinates[1]).max(coordinates[2]),
        );
        // Within the lattice, which has fewer units a side than a u32: wider division takes longer.
        let bricks_below = |units: i64| i64::from(units.max(0) as u32 / brick as u32);
        // A coordinate on a border belongs to both sides.
        lo[axis] = (bricks_below(least + brick - 1) - 1).clamp(0, last) as u32;
        hi[axis] = bricks_below(most).clamp(0, last) as u32;
    }
    let span = (0..3).map(|a| hi[a] - lo[a]).max().unwrap_or(0);
    if span <= 1 && (0..3).map(|a| hi[a] - lo[a]).sum::<u32>() <= 1 {
        return for_each_in_box(lo, hi, &mut |position| visit(BrickKey::new(position)));
    }
    let triangle = Slabs::new(corners, brick as f64);
    let level = 32 - (0..3).map(|a| lo[a] ^ hi[a]).max().unwrap_or(0).leading_zeros();
    let first = lo.map(|c| c >> level << level);
    descend(&triangle, first, level, lo, hi, visit)
}

fn for_each_in_box<E>(
    lo: [u32; 3],
    hi: [u32; 3],
    visit: &mut impl FnMut([u32; 3]) -> Result<(), E>,
) -> Result<(), E> {
    for z in lo[2]..=hi[2] {
        for y in lo[1]..=hi[1] {
            for x in lo[0]..=hi[0] {
                visit([x, y, z])?;
            }
        }
    }
    Ok(())
}

/// Visits the octree node at brick `first` of `level` as far as it lies in the box and is touched.
fn descend<E>(
    triangle: &Slabs,
    first: [u32; 3],
    level: u32,
    lo: [u32; 3],
    hi: [u32; 3],
    visit: &mut impl FnMut(BrickKey) -> Result<(), E>,
) -> Result<(), E> {
    let size = 1_u32 << level;
    if (0..3).any(|a| first[a] > hi[a] || first[a] + size <= lo[a]) {
        return Ok(());
    }
    if !triangle.meets(first, size) {
        return Ok(());
    }
    if level == 0 {
        return visit(BrickKey::new(first));
    }
    let half = size / 2;
    for child in 0..8_u32 {
        let at = std::array::from_fn(|a| first[a] + (child >> a & 1) * half);
        descend(triangle, at, level - 1, lo, hi, visit)?;
    }
    Ok(())
}

/// The separating axes of a triangle against axis-parallel cubes: its plane, and its edges in the
/// three projections. Akenine-Möller 2001, Fast 3D triangle-box overlap testing.
struct Slabs {
    corners: [[f64; 3]; 3],
    normal: [f64; 3],
    brick: f64,
}

impl Slabs {
    fn new(corners: [[i32; 3]; 3], brick: f64) -> Self {
        let wide = corners.map(|c| c.map(i64::from));
        let e: [i64; 3] = std::array::from_fn(|a| wide[1][a] - wide[0][a]);
        let f: [i64; 3] = std::array::from_fn(|a| wide[2][a] - wide[0][a]);
        let normal = std::array::from_fn(|a| {
            let (u, v) = ((a + 1) % 3, (a + 2) % 3);
            (e[u] * f[v] - e[v] * f[u]) as f64
        });
        Self { corners: corners.map(|c| c.map(f64::from)), normal, brick }
    }

    fn meets(&self, first: [u32; 3], size: u32) -> bool {
        let half = f64::from(size) * self.brick * 0.5;
        let centre: [f64; 3] = first.map(|c| f64::from(c) * self.brick + half);
        let p: [[f64; 3]; 3] = self.corners.map(|c| std::array::from_fn(|a| c[a] - centre[a]));
        let terms: [f64; 3] = std::array::from_fn(|a| self.normal[a] * p[0][a]);
        let reach = half * self.normal.iter().map(|n| n.abs()).sum::<f64>();
        let noise = terms.iter().map(|t| t.abs()).sum::<f64>() * SLACK;
        if terms.iter().sum::<f64>().abs() > reach * (1.0 + SLACK) + noise {
            return false;
        }
        (0..3).all(|a| edges_meet_square(&p, (a + 1) % 3, (a + 2) % 3, half))
    }
}

/// Whether no edge of the triangle, projected to axes u and v, keeps it off the square.
fn edges_meet_square(p: &[[f64; 3]; 3], u: usize, v: usize, half: f64) -> bool {
    (0..3).all(|i| {
        let (q, r, apex) = (p[i], p[(i + 1) % 3], p[(i + 2) % 3]);
        let (du, dv) = (r[u] - q[u], r[v] - q[v]);
        let side = |w: [f64; 3]| du * (w[v] - q[v]) - dv * (w[u] - q[u]);
        let at_centre = dv * q[u] - du * q[v];
        let reach = half * (du.abs() + dv.abs());
        let noise = ((dv * q[u]).abs() + (du * q[v]).abs()) * SLACK;
        // The triangle spans from the edge (0) to its apex; the square from -reach to reach.
        let apex = side(apex);
        let (least, most) = (apex.min(0.0), apex.max(0.0));
        let wide = reach * (1.0 + SLACK) + noise + apex.abs() * SLACK;
        at_centre + wide >= least && at_centre - wide <= most
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octree::SnapBox;
    use proptest::prelude::*;

    fn touched(domain: &Domain, corners: [[i32; 3]; 3]) -> Vec<u64> {
        let mut keys = Vec::new();
        let done: Result<(), ()> = for_each_touched_brick(domain, corners, &mut |key| {
            keys.push(key.0);
            Ok(())
        });
        assert_eq!(done, Ok(()));
        keys.sort_unstable();
        keys
    }

    fn unit_domain() -> Domain {
        Domain::around(&SnapBox { lo: [0.0; 3], hi: [1.0; 3] }, 9, false).expect("room enough")
    }

    #[test]
    fn a_point_on_a_brick_border_belongs_to_both_sides() {
        let domain = unit_domain();
        let b = domain.brick_units() as i32;
        assert_eq!(touched(&domain, [[b * 5 + 1, b * 5 + 1, b * 5 + 1]; 3]).len(), 1);
        assert_eq!(touched(&domain, [[b * 5, b * 5 + 1, b * 5 + 1]; 3]).len(), 2);
        assert_eq!(touched(&domain, [[b * 5, b * 5, b * 5]; 3]).len(), 8);
    }

    proptest! {
        #[test]
        fn points_of_the_triangle_lie_in_touched_bricks(
            corners in proptest::array::uniform3(proptest::array::uniform3(1_000_000..120_000_000_i32)),
            weights in proptest::collection::vec((0.0..1.0_f64, 0.0..1.0_f64), 200),
        ) {
            let domain = unit_domain();
            let keys = touched(&domain, corners);
            let brick = domain.brick_units() as f64;
            for (s, t) in weights {
                let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
                let position = std::array::from_fn(|a| {
                    let [p, q, r] = corners.map(|c| f64::from(c[a]));
                    ((p + s * (q - p) + t * (r - p)) / brick) as u32
                });
                prop_assert!(keys.binary_search(&BrickKey::new(position).0).is_ok());
            }
        }
    }

    #[test]
    fn a_large_flat_triangle_touches_about_its_area_in_bricks() {
        let domain = unit_domain();
        let b = domain.brick_units() as i32;
        let (near, far, z) = (b + 9, b * 15 - 9, b * 4 + 9);
        let corners = [[near, near, z], [far, near, z], [near, far, z]];
        let count = touched(&domain, corners).len();
        assert!((100..130).contains(&count), "{count}");
    }
}
