//! Closed solids.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::mesh::shapes::Corners;

/// A sphere: an octahedron whose faces are cut into `steps`^2 triangles each.
#[must_use]
pub fn sphere(centre: [f64; 3], radius: f64, steps: u32) -> Vec<Corners> {
    let n = i64::from(steps);
    let on_sphere = |grid: [i64; 3]| -> [f64; 3] {
        let direction = DVec3::from(grid.map(|c| c as f64)).normalize();
        (DVec3::from(centre) + direction * radius).into()
    };
    let mut triangles = Vec::with_capacity(8 * (n * n) as usize);
    for octant in 0..8 {
        let signs = [0, 1, 2].map(|a| if octant >> a & 1 == 1 { -1 } else { 1 });
        let mirrored = signs.iter().product::<i64>() < 0;
        let point =
            |i: i64, j: i64| on_sphere([signs[0] * i, signs[1] * j, signs[2] * (n - i - j)]);
        let mut push = |corners: Corners| {
            let [p, q, r] = corners;
            triangles.push(if mirrored { [p, r, q] } else { corners });
        };
        for i in 0..n {
            for j in 0..n - i {
                push([point(i, j), point(i + 1, j), point(i, j + 1)]);
                if i + j + 1 < n {
                    push([point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)]);
                }
            }
        }
    }
    triangles
}

/// A torus about the z axis: a ring of radius `major`, thick by the radius `minor`.
#[must_use]
pub fn torus(major: f64, minor: f64, around: u32, across: u32) -> Vec<Corners> {
    let point = |i: u32, j: u32| {
        let (s, c) = (TAU * f64::from(i % around) / f64::from(around)).sin_cos();
        let (t, d) = (TAU * f64::from(j % across) / f64::from(across)).sin_cos();
        let reach = major + minor * d;
        [reach * c, reach * s, minor * t]
    };
    let mut triangles = Vec::new();
    for i in 0..around {
        for j in 0..across {
            let quad = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
            push_quad(&mut triangles, quad);
        }
    }
    triangles
}

/// A box of twelve triangles.
#[must_use]
pub fn cuboid(lo: [f64; 3], hi: [f64; 3]) -> Vec<Corners> {
    let corner =
        |bits: usize| std::array::from_fn(|a| if bits >> a & 1 == 1 { hi[a] } else { lo[a] });
    let mut triangles = Vec::with_capacity(12);
    for axis in 0..3 {
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        let top = 1 << axis;
        push_quad(&mut triangles, [0, v, u | v, u].map(corner));
        push_quad(&mut triangles, [top, top | u, top | u | v, top | v].map(corner));
    }
    triangles
}

/// A prism over a star with `teeth` teeth, about the z axis, from z = 0 to `height`.
#[must_use]
pub fn gear(teeth: u32, inner: f64, outer: f64, height: f64) -> Vec<Corners> {
    let count = 4 * teeth;
    let rim = |i: u32, z: f64| {
        let radius = if i % 4 < 2 { outer } else { inner };
        let (s, c) = (TAU * f64::from(i % count) / f64::from(count)).sin_cos();
        [radius * c, radius * s, z]
    };
    let mut triangles = Vec::new();
    for i in 0..count {
        triangles.push([[0.0, 0.0, height], rim(i, height), rim(i + 1, height)]);
        triangles.push([[0.0, 0.0, 0.0], rim(i + 1, 0.0), rim(i, 0.0)]);
        let side = [rim(i, 0.0), rim(i + 1, 0.0), rim(i + 1, height), rim(i, height)];
        push_quad(&mut triangles, side);
    }
    triangles
}

/// The corner of a cube: a tetrahedron with its right angles at `at`.
#[must_use]
pub fn tetrahedron(at: [f64; 3], side: f64) -> Vec<Corners> {
    let [x, y, z] = [0, 1, 2].map(|a| {
        let mut corner = at;
        corner[a] += side;
        corner
    });
    vec![[at, y, x], [at, z, y], [at, x, z], [x, y, z]]
}

fn push_quad(triangles: &mut Vec<Corners>, [p, q, r, s]: [[f64; 3]; 4]) {
    triangles.push([p, q, r]);
    triangles.push([p, r, s]);
}
