//! Soups with known properties.

use brickmend::mesh::shapes::{
    Corners, Random, bounds, crumple, cuboid, gear, rotation, sphere, tetrahedron, torus, transform,
};
use brickmend::octree::{Domain, SnapBox};
use glam::{DMat3, DVec3};

/// A closed soup, and its volume where it has one.
pub struct Closed {
    pub name: &'static str,
    pub triangles: Vec<Corners>,
    /// `None` where the soup crosses itself.
    pub volume: Option<f64>,
}

/// Closed soups of all kinds; some lie on the very grid that `depth` gives them.
pub fn closed_soups(depth: u32, seed: u64) -> Vec<Closed> {
    let mut random = Random::new(seed);
    let ball = sphere([0.3, -0.2, 0.1], 1.0, 12);
    let mut two_balls = sphere([0.0; 3], 1.0, 10);
    two_balls.extend(sphere([0.9, 0.4, 0.2], 0.8, 9));
    let turned_gear = transform(&gear(7, 0.7, 1.0, 0.5), rotation(&mut random), DVec3::ONE);
    let solid = |name, triangles: Vec<Corners>| {
        let volume = Some(brickmend::mesh::shapes::volume(&triangles));
        Closed { name, triangles, volume }
    };
    let tangled = |name, triangles| Closed { name, triangles, volume: None };
    vec![
        solid("sphere", ball.clone()),
        solid("torus", torus(1.0, 0.45, 28, 14)),
        solid("cube", cuboid([-1.0; 3], [1.0; 3])),
        solid("gear", turned_gear),
        tangled("crumpled sphere", crumple(&ball, 0.15, &mut random)),
        tangled("crushed sphere", crumple(&ball, 0.8, &mut random)),
        tangled("two overlapping spheres", two_balls),
        solid("cube on the grid", on_grid(&cuboid([0.2; 3], [0.8; 3]), depth, 1.0)),
        solid("sphere on the grid", on_grid(&sphere([0.5; 3], 0.4, 2), depth, 1.0)),
        solid("sphere on the half grid", on_grid(&sphere([0.5; 3], 0.4, 3), depth, 0.5)),
    ]
}

/// A sphere, and another one that is pressed so flat that its two sides are one on the lattice.
pub fn beside_a_fold() -> Vec<Corners> {
    let mut fold = sphere([2.0, -0.2, 0.1], 0.8, 6);
    fold.iter_mut().flatten().for_each(|corner| corner[1] = -0.2 + (corner[1] + 0.2) * 1e-12);
    let mut soup = sphere([0.3, -0.2, 0.1], 1.0, 12);
    soup.extend(fold);
    soup
}

/// Moves all corners of a soup in the unit cube to multiples of `step` cells of the grid that it
/// gets at `depth`; two specks hold the unit cube, and with it the grid, in place.
pub fn on_grid(triangles: &[Corners], depth: u32, step: f64) -> Vec<Corners> {
    let unit = SnapBox { lo: [0.0; 3], hi: [1.0; 3] };
    let domain = Domain::around(&unit, depth, false).expect("room enough");
    let step = (f64::from(domain.cell_units) * step) as i64;
    let snap = |corner: [f64; 3]| {
        let units = domain.to_units(corner);
        domain.to_model(units.map(|c| (c / step as f64).round() as i64 * step))
    };
    let mut soup: Vec<Corners> = triangles.iter().map(|corners| corners.map(snap)).collect();
    soup.extend(specks());
    soup
}

/// Two closed specks, far below a cell, whose box is the unit cube.
pub fn specks() -> Vec<Corners> {
    let side = 1.0 / 1024.0;
    let mut specks = tetrahedron([0.0; 3], side);
    let mirrored = tetrahedron([0.0; 3], side);
    // A point reflection turns it inside out; the other order turns it back.
    specks.extend(mirrored.iter().map(|&[p, q, r]| [p, r, q].map(|c| c.map(|x| 1.0 - x))));
    specks
}

/// Triangles anywhere in the cube from -1 to 1, of sides around `size`.
pub fn random_triangles(count: usize, size: f64, random: &mut Random) -> Vec<Corners> {
    (0..count)
        .map(|_| {
            let at = random.point();
            [0; 3].map(|_| {
                let by = random.point();
                std::array::from_fn(|a| at[a] + size * by[a])
            })
        })
        .collect()
}

/// A closed cube of side 2 about the origin in any position.
pub fn turned_cube(random: &mut Random) -> (Vec<Corners>, DMat3, DVec3) {
    let (turn, by) = (rotation(random), DVec3::from(random.point()));
    (transform(&cuboid([-1.0; 3], [1.0; 3]), turn, by), turn, by)
}

/// A prism over a profile in the plane of x and y that is seen whole from its first corner, from z = `low` to `high`.
pub fn prism(profile: &[[f64; 2]], low: f64, high: f64) -> Vec<Corners> {
    let at = |i: usize, z: f64| {
        let [x, y] = profile[i % profile.len()];
        [x, y, z]
    };
    let mut triangles = Vec::new();
    for i in 0..profile.len() {
        let [p, q] = [at(i, low), at(i + 1, low)];
        let [r, s] = [at(i + 1, high), at(i, high)];
        triangles.extend([[p, q, r], [p, r, s]]);
        if (1..profile.len() - 1).contains(&i) {
            triangles.push([at(0, low), q, p]);
            triangles.push([at(0, high), s, r]);
        }
    }
    triangles
}

/// The longest side of the box.
pub fn extent(triangles: &[Corners]) -> f64 {
    let [lo, hi] = bounds(triangles);
    (0..3).map(|a| hi[a] - lo[a]).fold(0.0, f64::max)
}
