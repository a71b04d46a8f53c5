//! The leaf table: which crossed edges of a cell share one vertex, for all 256 sign patterns.
//!
//! In:         the signs of a cell's eight corners as a mask, and those ambiguous faces that join
//!             their inside corners.
//! Out:        [`Components`]: the boundary cycles of the surface patch inside the cell.
//! Invariant:  every marked edge belongs to exactly one component. Each marked edge lies on two
//!             faces and each face pairs its marked edges, so components are cycles. No edge of
//!             the dual surface has more than two polygons where no face is touched twice
//!             ([`touches_twice`]) from both of its sides.
//! Memory:     912 entries, worked out by the compiler, never typed.
//! Fails:      never.
//! Source:     Nielson 2004 (Dual Marching Cubes); Wenger 2013 (Isosurfaces), manifold variant.
//!
//! Numbering. Corner `i` lies at x = `i & 1`, y = `i >> 1 & 1`, z = `i >> 2 & 1`; bit `i` of a mask
//! is set when that corner is inside. Edge `axis * 4 + (second << 1 | first)` runs along +axis
//! from the corner whose positions on the two other axes, in increasing order, are `first` and
//! `second`. Face `axis * 2 + side` is the one at `side` (0 or 1) of its axis.

/// Stands for "no component" in [`Components::component_of_edge`].
pub const NO_COMPONENT: u8 = 255;

/// The boundary cycles of one cell, numbered by their smallest edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Components {
    /// How many cycles there are, 0 to 4.
    pub count: u8,
    /// The cycle of each edge, [`NO_COMPONENT`] when the edge is not marked.
    pub component_of_edge: [u8; 12],
    /// The edges of each cycle as bits.
    pub edge_masks: [u16; 4],
}

/// The ambiguous faces of every mask, as bits.
pub static AMBIGUOUS_FACES: [u8; 256] = {
    let mut faces = [0; 256];
    let mut mask = 0;
    while mask < 256 {
        faces[mask] = ambiguous_faces(mask as u8);
        mask += 1;
    }
    faces
};

/// How many sets of ambiguous faces all masks have together.
const FACE_SETS: usize = 656;

/// The cycles of every mask, no ambiguous face joining its inside corners.
pub static TABLE: [Components; 256] = tabulate();

/// The cycles of every mask and every set of its ambiguous faces, from [`FIRST_SET`] of the mask on.
static JOINING: [Components; FACE_SETS] = tabulate_face_sets();

/// The first entry of every mask in [`JOINING`].
static FIRST_SET: [u16; 256] = {
    let (mut first, mut sum, mut mask) = ([0; 256], 0, 0);
    while mask < 256 {
        first[mask] = sum;
        sum += 1 << ambiguous_faces(mask as u8).count_ones();
        mask += 1;
    }
    first
};

/// All crossed edges of every mask as one: one vertex a cell, as in plain dual contouring.
pub static ONE_VERTEX: [Components; 256] = {
    let mut table = tabulate();
    let mut mask = 1;
    while mask < 255 {
        let mut edge = 0;
        table[mask].count = 1;
        table[mask].edge_masks = [0; 4];
        while edge < 12 {
            if is_marked(mask as u8, edge) {
                table[mask].component_of_edge[edge as usize] = 0;
                table[mask].edge_masks[0] |= 1 << edge;
            }
            edge += 1;
        }
        mask += 1;
    }
    table
};

/// The two other axes of `axis`, in increasing order.
#[must_use]
pub const fn other_axes(axis: u8) -> (u8, u8) {
    match axis {
        0 => (1, 2),
        1 => (0, 2),
        _ => (0, 1),
    }
}

/// The axis that `edge` runs along.
#[must_use]
pub const fn axis_of_edge(edge: u8) -> u8 {
    edge / 4
}

/// The corner at the lower (`end` 0) or upper (`end` 1) end of `edge`.
#[must_use]
pub const fn corner_of_edge(edge: u8, end: u8) -> u8 {
    let axis = axis_of_edge(edge);
    let (first, second) = other_axes(axis);
    (edge & 1) << first | (edge >> 1 & 1) << second | end << axis
}

/// The edge along `axis` that ends at `corner`.
#[must_use]
pub const fn edge_at_corner(corner: u8, axis: u8) -> u8 {
    let (first, second) = other_axes(axis);
    axis * 4 + ((corner >> second & 1) << 1 | corner >> first & 1)
}

/// The four corners of `face`; opposite corners are 0 and 3, 1 and 2.
#[must_use]
pub const fn corners_of_face(face: u8) -> [u8; 4] {
    let (first, second) = other_axes(face / 2);
    let base = (face & 1) << (face / 2);
    [base, base | 1 << first, base | 1 << second, base | 1 << first | 1 << second]
}

/// The four edges of `face`, the two along its first axis before the two along its second.
#[must_use]
pub const fn edges_of_face(face: u8) -> [u8; 4] {
    let (first, second) = other_axes(face / 2);
    let corners = corners_of_face(face);
    [
        edge_at_corner(corners[0], first),
        edge_at_corner(corners[2], first),
        edge_at_corner(corners[0], second),
        edge_at_corner(corners[1], second),
    ]
}

/// Whether the ends of `edge` have different signs.
#[must_use]
pub const fn is_marked(mask: u8, edge: u8) -> bool {
    (mask >> corner_of_edge(edge, 0) ^ mask >> corner_of_edge(edge, 1)) & 1 == 1
}

/// Whether all four edges of `face` are marked.
#[must_use]
pub const fn is_ambiguous(mask: u8, face: u8) -> bool {
    let corners = corners_of_face(face);
    let sign = mask >> corners[0] & 1;
    mask >> corners[3] & 1 == sign
        && mask >> corners[1] & 1 != sign
        && mask >> corners[2] & 1 != sign
}

const fn ambiguous_faces(mask: u8) -> u8 {
    let (mut faces, mut face) = (0, 0);
    while face < 6 {
        faces |= (is_ambiguous(mask, face) as u8) << face;
        face += 1;
    }
    faces
}

/// The cycles of `mask` where those of its ambiguous faces are joined that are set in `joined`.
#[must_use]
#[inline]
pub fn components(mask: u8, joined: u8) -> &'static Components {
    if joined == 0 {
        return &TABLE[usize::from(mask)];
    }
    // The rank of the set: its bits moved together.
    let (mut faces, mut rank, mut bit) = (AMBIGUOUS_FACES[usize::from(mask)], 0, 0);
    while faces != 0 {
        rank |= usize::from(joined >> faces.trailing_zeros() & 1) << bit;
        faces &= faces - 1;
        bit += 1;
    }
    &JOINING[usize::from(FIRST_SET[usize::from(mask)]) + rank]
}

/// Whether `face` is ambiguous and one cycle has all its four edges.
#[must_use]
pub fn touches_twice(mask: u8, joined: u8, face: usize) -> bool {
    // Opposite edges of an ambiguous face are never joined on the face itself.
    let [one, opposite, ..] = edges_of_face(face as u8).map(usize::from);
    let cycle_of = &components(mask, joined).component_of_edge;
    AMBIGUOUS_FACES[usize::from(mask)] >> face & 1 == 1 && cycle_of[one] == cycle_of[opposite]
}

/// Works out the cycles of `mask`.
///
/// A face with two marked edges joins them; an ambiguous face joins the two edges around each of
/// its inside corners, or around each outside corner when it is one of those in `joined`.
const fn work_out(mask: u8, joined: u8) -> Components {
    let mut label = [0_u8; 12];
    let mut edge = 0;
    while edge < 12 {
        label[edge as usize] = if is_marked(mask, edge) { edge } else { NO_COMPONENT };
        edge += 1;
    }
    let mut face = 0;
    while face < 6 {
        label = join_on_face(label, mask, face, joined >> face & 1 == 1);
        face += 1;
    }
    number(label)
}

/// The pairs of crossed edges that a face joins, by their numbers in the cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segments {
    count: u8,
    pairs: [[u8; 2]; 2],
}

impl Segments {
    /// No pair.
    pub const NONE: Self = Self { count: 0, pairs: [[0; 2]; 2] };

    /// The pairs.
    #[inline]
    pub fn pairs(&self) -> &[[u8; 2]] {
        &self.pairs[..usize::from(self.count)]
    }
}

/// How `face` joins the crossed edges of `mask`: the two that there are, or on an ambiguous face the
/// two around each inside corner, around each outside corner when it `joins` the inside ones.
#[must_use]
pub const fn segments(mask: u8, face: u8, joins: bool) -> Segments {
    let mut out = Segments::NONE;
    if is_ambiguous(mask, face) {
        let (first, second) = other_axes(face / 2);
        let corners = corners_of_face(face);
        let mut i = 0;
        while i < 4 {
            let inside = mask >> corners[i] & 1 == 1;
            if inside != joins {
                out.pairs[out.count as usize] =
                    [edge_at_corner(corners[i], first), edge_at_corner(corners[i], second)];
                out.count += 1;
            }
            i += 1;
        }
        return out;
    }
    let edges = edges_of_face(face);
    let mut found = 0;
    let mut i = 0;
    while i < 4 {
        if is_marked(mask, edges[i]) {
            out.pairs[0][found] = edges[i];
            found += 1;
        }
        i += 1;
    }
    out.count = (found == 2) as u8;
    out
}

/// Joins the labels of those edges that `face` connects.
const fn join_on_face(mut label: [u8; 12], mask: u8, face: u8, joins: bool) -> [u8; 12] {
    let segments = segments(mask, face, joins);
    let mut i = 0;
    while i < segments.count as usize {
        label = join(label, segments.pairs[i][0], segments.pairs[i][1]);
        i += 1;
    }
    label
}

/// Gives the sets of edges `a` and `b` the smaller of their labels.
const fn join(mut label: [u8; 12], a: u8, b: u8) -> [u8; 12] {
    let (a, b) = (label[a as usize], label[b as usize]);
    let (keep, drop) = if a < b { (a, b) } else { (b, a) };
    let mut edge = 0;
    while edge < 12 {
        if label[edge] == drop {
            label[edge] = keep;
        }
        edge += 1;
    }
    label
}

/// Numbers the sets in the order of their smallest edges, which are their labels.
const fn number(label: [u8; 12]) -> Components {
    let mut out =
        Components { count: 0, component_of_edge: [NO_COMPONENT; 12], edge_masks: [0; 4] };
    let mut edge = 0;
    while edge < 12 {
        if label[edge] != NO_COMPONENT {
            let component = if label[edge] as usize == edge {
                out.count += 1;
                out.count - 1
            } else {
                out.component_of_edge[label[edge] as usize]
            };
            out.component_of_edge[edge] = component;
            out.edge_masks[component as usize] |= 1 << edge;
        }
        edge += 1;
    }
    out
}

const fn tabulate() -> [Components; 256] {
    let mut table = [work_out(0, 0); 256];
    let mut mask = 0;
    while mask < 256 {
        table[mask] = work_out(mask as u8, 0);
        mask += 1;
    }
    table
}

const fn tabulate_face_sets() -> [Components; FACE_SETS] {
    let mut table = [work_out(0, 0); FACE_SETS];
    let (mut entry, mut mask) = (0, 0);
    while mask < 256 {
        let ambiguous = ambiguous_faces(mask as u8);
        // All subsets in the order of their ranks.
        let mut joined = 0;
        loop {
            table[entry] = work_out(mask as u8, joined);
            entry += 1;
            joined = (joined | !ambiguous).wrapping_add(1) & ambiguous;
            if joined == 0 {
                break;
            }
        }
        mask += 1;
    }
    assert!(entry == FACE_SETS);
    table
}

#[cfg(test)]
mod tests;
