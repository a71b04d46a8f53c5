//! Gathers what clusters are made of: the planes of a brick, and the crossings of its components.
//!
//! Units: cells, from the brick's min corner.

use glam::DVec3;

use crate::contour::mdc::borders::BorderPlanes;
use crate::contour::mdc::cluster::{CellPlane, JUDGES_ONLY, Leaves, PlaneHit};
use crate::contour::mdc::leaf_vertex::Around;
use crate::contour::mdc::workspace::Workspace;

impl Workspace {
    /// The planes of the brick in cells; no leaf yet.
    pub(super) fn begin_leaves(&mut self) {
        let leaves = &mut self.leaves;
        leaves.components.clear();
        leaves.hit_starts.clear();
        leaves.hits.clear();
        leaves.planes.clear();
        leaves.blocks.clear();
        let cell_units = self.cell_units as f64;
        leaves.planes.extend(
            self.planes
                .iter()
                .zip(&self.normals[1..])
                .map(|(plane, &normal)| CellPlane { normal, offset: plane.offset / cell_units }),
        );
    }

    /// Adds planes that pass the vertex of the last component to its crossings; number 0 is none.
    pub(super) fn take_in(&mut self, numbers: &[u32], at: [usize; 3], vertex: DVec3) {
        if self.clustering.is_none() {
            return;
        }
        let point = (vertex + DVec3::from(at.map(|c| c as f64)) + 0.5).as_vec3().to_array();
        for &number in numbers.iter().filter(|number| **number != 0) {
            let normal = self.normals[number as usize];
            let offset = self.planes[number as usize - 1].offset / self.cell_units as f64;
            self.leaves.planes.push(CellPlane { normal, offset });
            let plane = (self.leaves.planes.len() - 1) as u32;
            self.leaves.hits.push(PlaneHit { plane, point });
        }
    }

    /// Adds the only component of a cell, which no border passes, to the leaves, before its vertex is
    /// placed; the numbers of its normals.
    #[inline]
    pub(super) fn add_borderless_leaf(
        &mut self,
        at: [usize; 3],
        mask: u8,
        edges: u16,
    ) -> OwnNormals {
        let low = DVec3::from(at.map(|c| c as f64)) + 0.5;
        let mut own = OwnNormals { numbers: [0; 12], count: 0 };
        let mut leaves = std::mem::take(&mut self.leaves);
        leaves.hit_starts.push(leaves.hits.len() as u32);
        self.each_crossing(at, edges, |point, crossing| {
            leaves.add_hit(mask, point + low, crossing.normal);
            own.numbers[own.count] = crossing.normal;
            own.count += 1;
        });
        self.leaves = leaves;
        own
    }

    /// Adds a component of a cell to the leaves, before its vertex is placed.
    pub(super) fn add_leaf(
        &mut self,
        at: [usize; 3],
        mask: u8,
        around: &Around,
        border: &BorderPlanes,
    ) {
        let low = DVec3::from(at.map(|c| c as f64)) + 0.5;
        self.leaves.hit_starts.push(self.leaves.hits.len() as u32);
        for i in 0..around.count {
            self.leaves.add_hit(mask, around.points[i] + low, around.normals[i]);
        }
        for border in border.planes() {
            let point = border.point + low;
            let offset = border.normal.dot(point);
            self.leaves.planes.push(CellPlane { normal: border.normal, offset });
            let plane = (self.leaves.planes.len() - 1) as u32;
            self.leaves.hits.push(PlaneHit { plane, point: point.as_vec3().to_array() });
        }
    }
}

impl Leaves {
    /// Adds a crossing to the last component, on the plane that has this normal.
    #[inline]
    fn add_hit(&mut self, mask: u8, point: DVec3, normal: u32) {
        let plane = match normal {
            0 => {
                // A patch has no plane: the signs around tell how the surface faces.
                let normal = gradient(mask);
                self.planes.push(CellPlane { normal, offset: normal.dot(point) });
                (self.planes.len() - 1) as u32 | JUDGES_ONLY
            }
            normal => normal - 1,
        };
        self.hits.push(PlaneHit { plane, point: point.as_vec3().to_array() });
    }
}

/// Numbers of the normals on the edges of a cell.
pub(super) struct OwnNormals {
    numbers: [u32; 12],
    count: usize,
}

impl OwnNormals {
    /// All of them.
    #[inline]
    pub(super) fn all(&self) -> &[u32] {
        &self.numbers[..self.count]
    }
}

/// The way from inside to outside in a cell, by the signs of its corners; of unit length.
fn gradient(mask: u8) -> DVec3 {
    let sum = (0..8).fold(DVec3::ZERO, |sum, corner| {
        let at = DVec3::from([0, 1, 2].map(|a| f64::from(corner >> a & 1) - 0.5));
        if mask >> corner & 1 == 1 { sum - at } else { sum + at }
    });
    sum.normalize_or(DVec3::X)
}
