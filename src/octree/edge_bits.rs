//! The inside of a brick as bit planes: edges, corners and faces of 32^3 cells, 64-bit rows along x.
//!
//! A brick holds 33^3 corners, and all edges between them, also those of its max sides, so that
//! every edge of its cells is at hand. Row (z, y) has number z * 33 + y; bit x of it is at x.
//!
//! Invariant:  bits outside of the brick (an x edge with x = 32, and so on) are zero.
//! Memory:     26 KiB for edges, 9 KiB for corners.

/// Cells along one side of a brick.
pub const SIDE: usize = 32;
/// Corners along one side of a brick.
pub const LINES: usize = SIDE + 1;
/// Rows of corners in a brick.
pub const ROWS: usize = LINES * LINES;
/// Edge numbers per axis.
pub const AXIS_EDGES: u32 = (ROWS * LINES) as u32;

/// Bits of a row of corners.
pub const CORNER_ROW: u64 = (1 << LINES) - 1;

/// The number of the edge that runs along `axis` from corner `at` of the brick.
#[must_use]
#[inline]
pub const fn edge_index(axis: usize, at: [usize; 3]) -> u32 {
    (axis as u32) * AXIS_EDGES + ((at[2] * LINES + at[1]) * LINES + at[0]) as u32
}

/// Axis and lower corner of an edge number.
#[must_use]
#[inline]
pub const fn edge_position(index: u32) -> (usize, [usize; 3]) {
    let (axis, rest) = ((index / AXIS_EDGES) as usize, (index % AXIS_EDGES) as usize);
    (axis, [rest % LINES, rest / LINES % LINES, rest / ROWS])
}

/// The row of an edge among those of all axes, one after the other, and its bit there.
#[inline]
const fn row_and_bit(index: u32) -> (usize, u64) {
    let (row, x) = (index / LINES as u32, index % LINES as u32);
    (row as usize, 1 << x)
}

/// One bit for every edge of a brick.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EdgeBits {
    rows: Box<[[u64; ROWS]; 3]>,
}

impl Default for EdgeBits {
    fn default() -> Self {
        let rows: Box<[[u64; ROWS]]> = vec![[0; ROWS]; 3].into_boxed_slice();
        Self { rows: rows.try_into().expect("three axes") }
    }
}

impl EdgeBits {
    /// Clears all bits.
    pub fn clear(&mut self) {
        for rows in self.rows.iter_mut() {
            rows.fill(0);
        }
    }

    /// Flips the bit of edge `index`.
    #[inline]
    pub fn toggle(&mut self, index: u32) {
        let (row, bit) = row_and_bit(index);
        self.rows.as_flattened_mut()[row] ^= bit;
    }

    /// Sets the bit of edge `index`.
    #[inline]
    pub fn set(&mut self, index: u32) {
        let (row, bit) = row_and_bit(index);
        self.rows.as_flattened_mut()[row] |= bit;
    }

    /// Sets the bit of the edge at `x` of a row among those of all axes, one after the other.
    #[inline]
    pub fn set_in_row(&mut self, row: usize, x: usize) {
        self.rows.as_flattened_mut()[row] |= 1 << x;
    }

    /// The bit of edge `index`.
    #[must_use]
    #[inline]
    pub fn get(&self, index: u32) -> bool {
        let (row, bit) = row_and_bit(index);
        self.rows.as_flattened()[row] & bit != 0
    }

    /// The rows of the edges along `axis`.
    #[must_use]
    #[inline]
    pub fn rows(&self, axis: usize) -> &[u64; ROWS] {
        &self.rows[axis]
    }

    /// The edges on which the two ends of `corners` differ.
    pub fn set_differences(&mut self, corners: &CornerBits) {
        let rows = &corners.rows;
        for row in 0..ROWS {
            let (z, y) = (row / LINES, row % LINES);
            self.rows[0][row] = (rows[row] ^ rows[row] >> 1) & (CORNER_ROW >> 1);
            self.rows[1][row] = if y < SIDE { rows[row] ^ rows[row + 1] } else { 0 };
            self.rows[2][row] = if z < SIDE { rows[row] ^ rows[row + LINES] } else { 0 };
        }
    }

    /// Calls `visit` with the number of every set edge, ascending.
    pub fn for_each(&self, mut visit: impl FnMut(u32)) {
        for (axis, rows) in self.rows.iter().enumerate() {
            for (row, &word) in rows.iter().enumerate() {
                let mut word = word;
                while word != 0 {
                    let x = word.trailing_zeros();
                    word &= word - 1;
                    visit(axis as u32 * AXIS_EDGES + (row * LINES) as u32 + x);
                }
            }
        }
    }

    /// How many set edges the brick owns: those from corners below 32 along each axis.
    #[must_use]
    pub fn count_own(&self) -> u64 {
        let own = CORNER_ROW >> 1;
        let rows = (0..SIDE).flat_map(|z| (0..SIDE).map(move |y| z * LINES + y));
        rows.map(|row| {
            self.rows.iter().map(|rows| u64::from((rows[row] & own).count_ones())).sum::<u64>()
        })
        .sum()
    }

    /// The cells of row (z, y), both below 32, that have at least one set edge: bit x per cell.
    #[must_use]
    #[inline]
    pub fn cells_touched(&self, z: usize, y: usize) -> u32 {
        let row = z * LINES + y;
        let [xs, ys, zs] = &*self.rows;
        let along = xs[row] | xs[row + 1] | xs[row + LINES] | xs[row + LINES + 1];
        let across = ys[row] | ys[row + LINES] | zs[row] | zs[row + 1];
        (along | across | across >> 1) as u32
    }

    /// The odd faces, those with an odd number of set edges, with normal `axis`: also those on the
    /// max sides. Row and bit are those of the face's min corner.
    #[must_use]
    pub fn odd_faces(&self, axis: usize) -> FaceBits {
        let mut faces = FaceBits { rows: Box::new([0; ROWS]) };
        for (row, bits) in faces.rows.iter_mut().enumerate() {
            *bits = self.odd_faces_in_row(axis, row);
        }
        faces
    }

    #[inline]
    fn odd_faces_in_row(&self, axis: usize, row: usize) -> u64 {
        let [xs, ys, zs] = &*self.rows;
        let (z, y) = (row / LINES, row % LINES);
        match axis {
            0 if y < SIDE && z < SIDE => ys[row] ^ ys[row + LINES] ^ zs[row] ^ zs[row + 1],
            1 if z < SIDE => {
                (xs[row] ^ xs[row + LINES] ^ zs[row] ^ zs[row] >> 1) & (CORNER_ROW >> 1)
            }
            2 if y < SIDE => (xs[row] ^ xs[row + 1] ^ ys[row] ^ ys[row] >> 1) & (CORNER_ROW >> 1),
            _ => 0,
        }
    }

    /// Whether no face is odd.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        (0..3).all(|axis| (0..ROWS).fold(0, |odd, row| odd | self.odd_faces_in_row(axis, row)) == 0)
    }
}

/// One bit for every face with one normal.
pub struct FaceBits {
    rows: Box<[u64; ROWS]>,
}

impl FaceBits {
    /// Whether no bit is set.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.iter().all(|&row| row == 0)
    }

    /// The min corners of the set faces, ascending.
    pub fn iter(&self) -> impl Iterator<Item = [usize; 3]> + '_ {
        self.rows.iter().enumerate().filter(|(_, word)| **word != 0).flat_map(|(row, &word)| {
            (0..LINES)
                .filter(move |x| word >> x & 1 == 1)
                .map(move |x| [x, row % LINES, row / LINES])
        })
    }
}

/// One bit for every corner of a brick: inside or outside.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CornerBits {
    /// Rows along x, by z * 33 + y.
    pub rows: Box<[u64; ROWS]>,
}

impl Default for CornerBits {
    fn default() -> Self {
        Self { rows: Box::new([0; ROWS]) }
    }
}

impl CornerBits {
    /// Sets every corner from the marks, starting with `base` at the min corner: a corner differs
    /// from another when an odd number of marks lies between them on any path.
    ///
    /// Source: prefix parity by shifted XOR (Warren, Hacker's Delight, 5-2).
    pub fn from_marks(&mut self, marks: &EdgeBits, base: bool) {
        let [xs, ys, zs] = &*marks.rows;
        let mut plane = u64::from(base);
        for z in 0..LINES {
            let mut first = plane;
            for y in 0..LINES {
                let row = z * LINES + y;
                // Corner x is first ^ (marks of the row below x).
                let mut prefix = xs[row] << 1;
                for shift in [1, 2, 4, 8, 16, 32] {
                    prefix ^= prefix << shift;
                }
                self.rows[row] = (prefix ^ (0_u64.wrapping_sub(first))) & CORNER_ROW;
                first ^= ys[row] & 1;
            }
            plane ^= zs[z * LINES] & 1;
        }
    }

    /// The bit of a corner.
    #[must_use]
    #[inline]
    pub fn get(&self, at: [usize; 3]) -> bool {
        self.rows[at[2] * LINES + at[1]] >> at[0] & 1 == 1
    }

    /// The eight corners of a cell as a mask: bit x + 2y + 4z.
    #[must_use]
    #[inline]
    pub fn cell_mask(&self, at: [usize; 3]) -> u8 {
        let row = at[2] * LINES + at[1];
        let pair = |row: usize| (self.rows[row] >> at[0] & 3) as u8;
        pair(row) | pair(row + 1) << 2 | pair(row + LINES) << 4 | pair(row + LINES + 1) << 6
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn noise(seed: u64, keep: u64) -> CornerBits {
        let mut corners = CornerBits::default();
        let mut state = seed | 1;
        for row in corners.rows.iter_mut() {
            for x in 0..LINES {
                state ^= state << 13;
                state ^= state >> 7;
                state ^= state << 17;
                *row |= u64::from(state.is_multiple_of(keep)) << x;
            }
        }
        corners
    }

    #[test]
    fn every_edge_number_has_its_place() {
        for index in 0..3 * AXIS_EDGES {
            let (axis, at) = edge_position(index);
            assert_eq!(edge_index(axis, at), index);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn signs_give_marks_and_marks_give_signs(seed in any::<u64>(), keep in 2..50_u64) {
            let corners = noise(seed, keep);
            let mut marks = EdgeBits::default();
            marks.set_differences(&corners);
            prop_assert!(marks.is_closed());
            let mut back = CornerBits::default();
            back.from_marks(&marks, corners.get([0; 3]));
            prop_assert_eq!(back, corners);
        }

        #[test]
        fn one_flipped_edge_makes_its_faces_odd(seed in any::<u64>(), index in 0..3 * AXIS_EDGES) {
            let (axis, at) = edge_position(index);
            prop_assume!(at[axis] < SIDE);
            let mut marks = EdgeBits::default();
            marks.set_differences(&noise(seed, 3));
            marks.toggle(index);
            let odd: usize = (0..3).map(|a| marks.odd_faces(a).iter().count()).sum();
            let sides = (0..3).filter(|&a| a != axis && (at[a] == 0 || at[a] == SIDE)).count();
            // Two faces hang on the edge per other axis, one where the brick ends.
            prop_assert_eq!(odd, 4 - sides);
        }

        #[test]
        fn touched_cells_are_those_with_mixed_corners(seed in any::<u64>(), keep in 20..900_u64) {
            let corners = noise(seed, keep);
            let mut marks = EdgeBits::default();
            marks.set_differences(&corners);
            for z in 0..SIDE {
                for y in 0..SIDE {
                    let touched = marks.cells_touched(z, y);
                    for x in 0..SIDE {
                        let mixed = !matches!(corners.cell_mask([x, y, z]), 0 | 255);
                        prop_assert_eq!(touched >> x & 1 == 1, mixed);
                    }
                }
            }
        }
    }
}
