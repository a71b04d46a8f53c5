//! Cells as they are packed in records, and how their faces join their crossed edges.

use crate::contour::mdc::table::{
    Components, ONE_VERTEX, Segments, components, corner_of_edge, edge_at_corner, segments,
};

/// Where the six bits of a cell's joined faces begin, above its number and mask.
pub const JOINED_FACES: u32 = 23;

/// Flag of a cell whose components share one vertex, above its joined faces.
pub const ONE_VERTEX_BIT: u32 = 1 << 29;

/// Morton bits of a coordinate below 32.
const SPREAD: [u16; 32] = {
    let mut spread = [0; 32];
    let mut c = 0;
    while c < 32 {
        let x = c as u16;
        spread[c] = x & 1 | (x & 2) << 2 | (x & 4) << 4 | (x & 8) << 6 | (x & 16) << 8;
        c += 1;
    }
    spread
};

/// The components of a packed cell.
#[inline]
pub fn components_of(cell: u32) -> &'static Components {
    if cell & ONE_VERTEX_BIT != 0 {
        return &ONE_VERTEX[usize::from(cell_mask(cell))];
    }
    components(cell_mask(cell), joined_faces(cell))
}

/// The faces of a packed cell that join their inside corners, as bits.
#[inline]
pub const fn joined_faces(cell: u32) -> u8 {
    (cell >> JOINED_FACES & 0x3f) as u8
}

/// The number of a packed cell in its brick, in Morton order.
#[inline]
pub const fn cell_number(cell: u32) -> usize {
    (cell & 0x7fff) as usize
}

/// The corner mask of a packed cell.
#[inline]
pub const fn cell_mask(cell: u32) -> u8 {
    (cell >> 15 & 0xff) as u8
}

/// The Morton number of the cell at a place in its brick.
#[inline]
pub const fn number_at(at: [usize; 3]) -> usize {
    (SPREAD[at[0]] | SPREAD[at[1]] << 1 | SPREAD[at[2]] << 2) as usize
}

/// The place in its brick of a cell with this Morton number.
#[inline]
pub const fn place_of(number: usize) -> [usize; 3] {
    [gather(number), gather(number >> 1), gather(number >> 2)]
}

#[inline]
const fn gather(bits: usize) -> usize {
    let x = bits & 0x1249;
    let x = (x | x >> 2) & 0x10c3;
    let x = (x | x >> 4) & 0x100f;
    (x | x >> 8) & 0x1f
}

/// Of every corner mask, along how many axes the edge from the min corner is crossed.
pub static OWN_EDGES: [u8; 256] = {
    let mut counts = [0; 256];
    let mut mask = 0;
    while mask < 256 {
        let mut axis = 0;
        while axis < 3 {
            counts[mask] += ((mask ^ mask >> (1 << axis)) & 1) as u8;
            axis += 1;
        }
        mask += 1;
    }
    counts
};

/// Of every mask and face, where it does not join its inside corners and where it does.
static SEGMENTS: [[[Segments; 6]; 256]; 2] = {
    let none = Segments::NONE;
    let mut all = [[[none; 6]; 256]; 2];
    let mut mask = 0;
    while mask < 256 {
        let mut face = 0;
        while face < 6 {
            all[0][mask][face] = segments(mask as u8, face as u8, false);
            all[1][mask][face] = segments(mask as u8, face as u8, true);
            face += 1;
        }
        mask += 1;
    }
    all
};

/// How `face` of a packed cell joins its crossed edges.
#[inline]
pub fn segments_on(cell: u32, face: usize) -> &'static Segments {
    let joins = usize::from(joined_faces(cell) >> face & 1);
    &SEGMENTS[joins][usize::from(cell_mask(cell))][face]
}

/// The lower end of `edge` of the cell at `at`.
#[inline]
pub fn lower_end(at: [i32; 3], edge: u8) -> [i32; 3] {
    let corner = corner_of_edge(edge, 0);
    [0, 1, 2].map(|a| at[a] + i32::from(corner >> a & 1))
}

/// The edge along `axis` from the corner `lower`, as a number in the cell at `at`.
#[inline]
pub fn edge_in_cell(axis: usize, lower: [i32; 3], at: [i32; 3]) -> u8 {
    let corner = (0..3).fold(0, |bits, a| bits | ((lower[a] - at[a]) as u8 & 1) << a);
    edge_at_corner(corner, axis as u8)
}

/// The number of an edge on the min face of `axis`, seen from the cell below.
#[inline]
pub const fn edge_below(edge: u8, axis: usize) -> u8 {
    // Of the two bits for the place of an edge across its direction, the one of `axis`.
    let is_second = axis == if edge / 4 == 2 { 1 } else { 2 };
    edge | if is_second { 2 } else { 1 }
}

/// The edges of a mask of edges.
#[cfg(test)]
pub fn edges_of_mask(edges: u16) -> impl Iterator<Item = u8> {
    (0..12).filter(move |edge| edges >> edge & 1 == 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contour::mdc::table::{AMBIGUOUS_FACES, is_marked};

    #[test]
    fn numbers_and_places_are_each_others_inverse() {
        for number in 0..32_768 {
            assert_eq!(number_at(place_of(number)), number);
        }
    }

    #[test]
    fn segments_join_the_edges_of_one_component_and_every_marked_edge_twice() {
        for mask in 0..=255_u8 {
            let ambiguous = AMBIGUOUS_FACES[usize::from(mask)];
            for joined in (0..64).filter(|joined| joined & !ambiguous == 0) {
                let cell = u32::from(mask) << 15 | u32::from(joined) << JOINED_FACES;
                let expected = components_of(cell);
                let mut seen = [0; 12];
                for face in 0..6 {
                    for &[a, b] in segments_on(cell, face).pairs() {
                        let of = |edge: u8| expected.component_of_edge[usize::from(edge)];
                        assert_eq!(of(a), of(b), "{mask:#x} {face}");
                        seen[usize::from(a)] += 1;
                        seen[usize::from(b)] += 1;
                    }
                }
                for (edge, seen) in seen.into_iter().enumerate() {
                    assert_eq!(seen == 2, is_marked(mask, edge as u8));
                    assert_eq!(seen == 0, !is_marked(mask, edge as u8));
                }
            }
        }
    }
}
