//! Changes that keep closed triangles closed.

use std::collections::BTreeMap;

use glam::{DMat3, DQuat, DVec3};

use crate::mesh::shapes::{Corners, Random};

/// Moves every corner position by up to `amount` along each axis; equal positions move equally.
#[must_use]
pub fn crumple(triangles: &[Corners], amount: f64, random: &mut Random) -> Vec<Corners> {
    let mut moved = BTreeMap::new();
    let mut shift = |corner: [f64; 3]| {
        *moved.entry(corner.map(f64::to_bits)).or_insert_with(|| {
            let by = random.point();
            std::array::from_fn(|a| corner[a] + by[a] * amount)
        })
    };
    triangles.iter().map(|corners| corners.map(&mut shift)).collect()
}

/// Turns, then moves.
#[must_use]
pub fn transform(triangles: &[Corners], turn: DMat3, by: DVec3) -> Vec<Corners> {
    triangles.iter().map(|corners| corners.map(|c| (turn * DVec3::from(c) + by).into())).collect()
}

/// Any rotation.
#[must_use]
pub fn rotation(random: &mut Random) -> DMat3 {
    loop {
        let [x, y, z] = random.point();
        let turn = DQuat::from_xyzw(x, y, z, random.within(-1.0, 1.0));
        if (0.1..=1.0).contains(&turn.length()) {
            return DMat3::from_quat(turn.normalize());
        }
    }
}

/// Puts the triangles into another order.
pub fn shuffle(triangles: &mut [Corners], random: &mut Random) {
    for last in (1..triangles.len()).rev() {
        triangles.swap(last, random.below(last + 1));
    }
}

/// The lowest and highest corner.
#[must_use]
pub fn bounds(triangles: &[Corners]) -> [[f64; 3]; 2] {
    let empty = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    triangles.iter().flatten().fold(empty, |[lo, hi], corner| {
        [
            std::array::from_fn(|a| lo[a].min(corner[a])),
            std::array::from_fn(|a| hi[a].max(corner[a])),
        ]
    })
}
