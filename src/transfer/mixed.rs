//! Cells of a brick that have hits of several materials.

use crate::octree::{ArchivedHitBrick, HitEdge, SIDE, edge_position, surface_of};

/// Cells of a brick.
const CELLS: usize = SIDE * SIDE * SIDE;
/// No hit yet.
const NONE: u32 = u32::MAX;

/// Memory of [`MixedCells`].
pub const MIXED_BYTES: u64 = (4 * CELLS + CELLS / 8) as u64;

/// Which cells have hits of several materials. Cells have the number x + 32 y + 1024 z.
pub struct MixedCells {
    with_patches: bool,
    /// The first material of every cell.
    first: Vec<u32>,
    mixed: Vec<u64>,
}

impl MixedCells {
    /// Of no brick yet; patches may count as materials of their own.
    pub fn new(with_patches: bool) -> Self {
        Self { with_patches, first: Vec::new(), mixed: Vec::new() }
    }

    /// Looks at a brick; false where no cell has several.
    pub fn find(&mut self, brick: &ArchivedHitBrick) -> bool {
        let of_plane =
            |plane: usize| told(brick.planes[plane].material.to_native(), self.with_patches);
        if (1..brick.planes.len()).all(|plane| of_plane(plane) == of_plane(0)) {
            return false;
        }
        self.first.clear();
        self.first.resize(CELLS, NONE);
        self.mixed.clear();
        self.mixed.resize(CELLS / 64, 0);
        let mut next = 0;
        for edge in brick.edges.iter() {
            let edge = HitEdge::from(edge);
            for hit in &brick.hits[next..next + edge.kept()] {
                let plane = &brick.planes[hit.to_native() as usize];
                self.note(edge.edge(), told(plane.material.to_native(), self.with_patches));
            }
            next += edge.kept();
        }
        self.mixed.iter().any(|word| *word != 0)
    }

    /// Notes a hit for the four cells around its edge, as far as they are in the brick.
    fn note(&mut self, edge: u32, material: u32) {
        let (axis, at) = edge_position(edge);
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for (du, dv) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let mut cell = at;
            if at[u] < du || at[v] < dv {
                continue;
            }
            cell[u] -= du;
            cell[v] -= dv;
            if cell.iter().any(|c| *c >= SIDE) {
                continue;
            }
            let number = cell_number(cell);
            match &mut self.first[number] {
                first if *first == NONE => *first = material,
                first if *first != material => self.mixed[number / 64] |= 1 << (number % 64),
                _ => {}
            }
        }
    }

    /// Whether a cell has hits of several materials.
    pub fn is_mixed(&self, cell: [usize; 3]) -> bool {
        let number = cell_number(cell);
        self.mixed[number / 64] >> (number % 64) & 1 == 1
    }

    /// How many cells have.
    pub fn count(&self) -> u64 {
        self.mixed.iter().map(|word| u64::from(word.count_ones())).sum()
    }
}

/// What is told apart of a material with its bits.
pub fn told(material: u32, with_patches: bool) -> u32 {
    let surface = surface_of(material);
    if with_patches { surface.bits() } else { surface.material() }
}

/// The number of a cell.
pub fn cell_number([x, y, z]: [usize; 3]) -> usize {
    (z * SIDE + y) * SIDE + x
}
