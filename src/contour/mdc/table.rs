//! The leaf table: which crossed edges of a cell share one vertex, for all 256 sign patterns.
//!
//! In:         the signs of a cell's eight corners as a mask, and at most one flipped face.
//! Out:        [`Components`]: the boundary cycles of the surface patch inside the cell.
//! Invariant:  every marked edge belongs to exactly one component. Each marked edge lies on two
//!             faces and each face pairs its marked edges, so components are cycles. With
//!             [`FLIPPED`] used where both cells at a face are two-sided, no edge of the dual
//!             surface has more than two polygons.
//! Memory:     two tables of 256 entries, worked out by the compiler, never typed.
//! Fails:      never.
//! Source:     Nielson 2004 (Dual Marching Cubes); Wenger 2013 (Isosurfaces), manifold variant.
//!
//! Numbering. Corner `i` lies at x = `i & 1`, y = `i >> 1 & 1`, z = `i >> 2 & 1`; bit `i` of a mask
//! is set when that corner is inside. Edge `axis * 4 + (second << 1 | first)` runs along +axis
//! from the corner whose positions on the two other axes, in increasing order, are `first` and
//! `second`. Face `axis * 2 + side` is the one at `side` (0 or 1) of its axis.

/// Stands for "no component" in [`Components::component_of_edge`].
pub const NO_COMPONENT: u8 = 255;

/// Stands for "no face" in [`TWO_SIDED`] and as an argument of [`components`].
pub const NO_FACE: u8 = 255;

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

/// The cycles of every mask, "separate inside" on all ambiguous faces.
pub static TABLE: [Components; 256] = tabulate(false);

/// The ambiguous face that one cycle of the mask touches twice, else [`NO_FACE`].
pub static TWO_SIDED: [u8; 256] = tabulate_two_sided();

/// The cycles of every mask with its two-sided face, if any, turned to "separate outside".
pub static FLIPPED: [Components; 256] = tabulate(true);

/// All crossed edges of every mask as one: one vertex a cell, as in plain dual contouring.
pub static JOINED: [Components; 256] = {
    let mut table = tabulate(false);
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

/// Works out the cycles of `mask`.
///
/// A face with two marked edges joins them; an ambiguous face joins the two edges around each of
/// its inside corners, or around each outside corner when it is `flipped_face`.
#[must_use]
pub const fn components(mask: u8, flipped_face: u8) -> Components {
    let mut label = [0_u8; 12];
    let mut edge = 0;
    while edge < 12 {
        label[edge as usize] = if is_marked(mask, edge) { edge } else { NO_COMPONENT };
        edge += 1;
    }
    let mut face = 0;
    while face < 6 {
        label = join_on_face(label, mask, face, face == flipped_face);
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
/// two around each inside corner, around each outside corner when it is `flipped`.
#[must_use]
pub const fn segments(mask: u8, face: u8, flipped: bool) -> Segments {
    let mut out = Segments::NONE;
    if is_ambiguous(mask, face) {
        let (first, second) = other_axes(face / 2);
        let corners = corners_of_face(face);
        let mut i = 0;
        while i < 4 {
            let inside = mask >> corners[i] & 1 == 1;
            if inside != flipped {
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
const fn join_on_face(mut label: [u8; 12], mask: u8, face: u8, flipped: bool) -> [u8; 12] {
    let segments = segments(mask, face, flipped);
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

/// The first ambiguous face whose four edges are in one cycle.
const fn two_sided_face(mask: u8, components: &Components) -> u8 {
    let mut face = 0;
    while face < 6 {
        let edges = edges_of_face(face);
        // Opposite edges of an ambiguous face are never joined on the face itself.
        if is_ambiguous(mask, face)
            && components.component_of_edge[edges[0] as usize]
                == components.component_of_edge[edges[1] as usize]
        {
            return face;
        }
        face += 1;
    }
    NO_FACE
}

const fn tabulate(flipped: bool) -> [Components; 256] {
    let mut table = [components(0, NO_FACE); 256];
    let mut mask = 0;
    while mask < 256 {
        let plain = components(mask as u8, NO_FACE);
        let face = two_sided_face(mask as u8, &plain);
        table[mask] = if flipped { components(mask as u8, face) } else { plain };
        mask += 1;
    }
    table
}

const fn tabulate_two_sided() -> [u8; 256] {
    let mut faces = [NO_FACE; 256];
    let mut mask = 0;
    while mask < 256 {
        faces[mask] = two_sided_face(mask as u8, &components(mask as u8, NO_FACE));
        mask += 1;
    }
    faces
}

#[cfg(test)]
mod tests;
