//! A node of the vertex tree: the piece of surface that one vertex would stand for.
//!
//! Invariant:  χ by increments is that of the piece: gluing children takes away one per shared
//!             polyline, and the inner edges of the cell count those fourfold.
//! Units:      counts.
//! Memory:     64 bytes besides its groups of planes.
//! Source:     Schaefer, Ju, Warren 2007, section 4 (the criterion and its increments); that an
//!             ambiguous face may belong to a piece once only is an addition of ours.

use glam::DVec3;

/// How often a piece crosses each of the twelve edges of its cell, a byte each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EdgeCounts([u64; 2]);

/// Every bit of a byte in a byte of its own.
static BYTES: [u64; 256] = {
    let mut bytes = [0; 256];
    let mut mask = 0;
    while mask < 256 {
        let mut bit = 0;
        while bit < 8 {
            bytes[mask] |= ((mask as u64) >> bit & 1) << (8 * bit);
            bit += 1;
        }
        mask += 1;
    }
    bytes
};

impl EdgeCounts {
    /// One crossing on every edge of the mask.
    #[inline]
    pub const fn of_leaf(edges: u16) -> Self {
        Self([BYTES[(edges & 0xff) as usize], BYTES[(edges >> 8) as usize]])
    }

    /// Adds crossings of one edge.
    #[inline]
    pub const fn add_to(&mut self, edge: u8, count: u64) {
        self.0[edge as usize / 8] += count << (8 * (edge % 8));
    }

    /// The sum of all.
    #[inline]
    pub const fn sum(&self) -> u32 {
        const ONES: u64 = 0x0101_0101_0101_0101;
        // Below 256: a cell of a brick has at most 32 crossings on an edge.
        let [low, high] = self.0;
        (low.wrapping_mul(ONES) >> 56) as u32 + (high.wrapping_mul(ONES) >> 56) as u32
    }

    /// Those of a record.
    pub const fn from_words(words: [u64; 2]) -> Self {
        Self(words)
    }

    /// Those that a record has.
    pub const fn words(self) -> [u64; 2] {
        self.0
    }

    /// Whether no edge is crossed twice.
    pub const fn are_single(&self) -> bool {
        const ONES: u64 = 0x0101_0101_0101_0101;
        (self.0[0] | self.0[1]) & !ONES == 0
    }

    /// Whether an edge of `face` is crossed.
    pub fn is_on_face(&self, face: usize) -> bool {
        self.on(&FACES[face]).sum() != 0
    }

    #[inline]
    const fn on(&self, edges: &Self) -> Self {
        Self([self.0[0] & edges.0[0], self.0[1] & edges.0[1]])
    }

    #[inline]
    const fn add(&mut self, other: &Self) {
        self.0[0] += other.0[0];
        self.0[1] += other.0[1];
    }
}

/// All ones in the bytes of these edges.
const fn bytes_of(edges: u16) -> EdgeCounts {
    let ones = EdgeCounts::of_leaf(edges);
    EdgeCounts([ones.0[0] * 255, ones.0[1] * 255])
}

/// Of the child in each octant, the edges that lie on the parent's edge of the same number.
static OUTER: [EdgeCounts; 8] = {
    let mut outer = [bytes_of(0); 8];
    let mut octant = 0;
    while octant < 8 {
        let mut edges = 0;
        let mut axis = 0;
        while axis < 3 {
            edges |= 1 << crate::contour::mdc::table::edge_at_corner(octant as u8, axis);
            axis += 1;
        }
        outer[octant] = bytes_of(edges);
        octant += 1;
    }
    outer
};

/// The edges of each face.
static FACES: [EdgeCounts; 6] = {
    let mut faces = [bytes_of(0); 6];
    let mut face = 0;
    while face < 6 {
        let edges = crate::contour::mdc::table::edges_of_face(face as u8);
        let mut mask = 0;
        let mut i = 0;
        while i < 4 {
            mask |= 1 << edges[i];
            i += 1;
        }
        faces[face] = bytes_of(mask);
        face += 1;
    }
    faces
};

/// A connected piece of the surface in one cell.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// Crossings of the cell's edges.
    pub edges: EdgeCounts,
    /// Vertices minus edges plus faces, were it drawn from its leaf cells.
    pub euler: i32,
    /// Crossings of inner edges of the cell so far, while it is summed up from its children.
    pub inner: u32,
    /// Its groups of planes in the arena; [`Node::TOO_MANY`] of them do not fit a vertex.
    pub first_group: u32,
    /// How many.
    pub groups: u32,
    /// Sum of its crossings, and their number.
    pub points: DVec3,
    /// How many crossings.
    pub count: f64,
}

impl Node {
    /// In `groups`: more than one vertex can stand for.
    pub const TOO_MANY: u32 = u32::MAX;

    /// A node without children yet.
    pub const EMPTY: Self = Self {
        edges: EdgeCounts([0; 2]),
        euler: 0,
        inner: 0,
        first_group: 0,
        groups: 0,
        points: DVec3::ZERO,
        count: 0.0,
    };

    /// The piece in a leaf cell that crosses these edges.
    #[inline]
    pub fn leaf(edges: u16) -> Self {
        Self::disk(EdgeCounts::of_leaf(edges))
    }

    /// A disk that crosses the edges of its cell so often.
    #[inline]
    pub fn disk(edges: EdgeCounts) -> Self {
        Self { edges, euler: 1, ..Self::EMPTY }
    }

    /// Adds the child in `octant`, but for its planes.
    #[inline]
    pub fn add(&mut self, child: &Self, octant: usize) {
        let outer = child.edges.on(&OUTER[octant]);
        self.inner += child.edges.sum() - outer.sum();
        self.edges.add(&outer);
        self.euler += child.euler;
        self.points += child.points;
        self.count += child.count;
    }

    /// All children are added.
    #[inline]
    pub fn close(&mut self) {
        debug_assert!(self.inner.is_multiple_of(4), "{} inner crossings", self.inner);
        self.euler -= (self.inner / 4) as i32;
        self.inner = 0;
    }

    /// Whether it is a disk that meets every face of its cell in one arc at most, and at least one
    /// face. What is left to ask is about ambiguous faces.
    #[inline]
    pub fn is_simple(&self) -> bool {
        self.euler == 1
            && self.edges != EdgeCounts::default()
            && FACES.iter().all(|face| matches!(self.edges.on(face).sum(), 0 | 2))
    }
}
