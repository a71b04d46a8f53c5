//! Regions of a brick: corners joined by edges without a barrier.
//!
//! In:         the barrier bits of a brick.
//! Out:        a region number per run of corners, and for each of the six sides the regions of
//!             its two-dimensional pieces in an order that the brick beyond finds as well.
//! Invariant:  two bricks agree on the barriers of their common side, hence on its pieces.
//! Memory:     O(runs), a few thousand per brick.
//! Source:     run-based connected components (Rosenfeld and Pfaltz 1966), on bit rows.

use crate::octree::edge_bits::{CORNER_ROW, EdgeBits, LINES, ROWS};

/// The regions of one brick.
#[derive(Clone, Debug, Default)]
pub struct Regions {
    /// First run of every row, and the end of the last.
    row_starts: Vec<u32>,
    /// The corners of each run as bits of its row.
    runs: Vec<u64>,
    /// Region of each run.
    labels: Vec<u16>,
    /// How many regions there are.
    pub count: u16,
}

/// The regions of the pieces of one side, in the order in which the pieces first occur.
pub type FaceRegions = Vec<u16>;

impl Regions {
    /// Runs of row `row`: their corner bits and their regions.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (u64, u16)> + '_ {
        let range = self.row_starts[row] as usize..self.row_starts[row + 1] as usize;
        range.map(|run| (self.runs[run], self.labels[run]))
    }

    /// The region of a corner.
    #[must_use]
    pub fn at(&self, corner: [usize; 3]) -> u16 {
        let row = corner[2] * LINES + corner[1];
        let found = self.row(row).find(|(bits, _)| bits >> corner[0] & 1 == 1);
        found.expect("the runs of a row cover it").1
    }
}

/// Finds the regions of a brick.
#[must_use]
pub fn find_regions(barrier: &EdgeBits) -> Regions {
    let mut regions = Regions::default();
    split_rows(barrier.rows(0), &mut regions);
    let mut parents: Vec<u16> = (0..regions.runs.len() as u16).collect();
    for row in 0..ROWS {
        if row % LINES != LINES - 1 {
            join_rows(&regions, &mut parents, row, row + 1, !barrier.rows(1)[row]);
        }
        if row < ROWS - LINES {
            join_rows(&regions, &mut parents, row, row + LINES, !barrier.rows(2)[row]);
        }
    }
    number_in_order(&mut parents, &mut regions.labels, &mut regions.count);
    regions
}

/// Cuts every row at its barriers.
fn split_rows(along: &[u64], regions: &mut Regions) {
    regions.row_starts.reserve(along.len() + 1);
    // Most rows that the surface passes are cut once.
    regions.runs.reserve(2 * along.len());
    for &cuts in along {
        regions.row_starts.push(regions.runs.len() as u32);
        push_runs(cuts, &mut regions.runs);
    }
    regions.row_starts.push(regions.runs.len() as u32);
}

fn push_runs(mut cuts: u64, runs: &mut Vec<u64>) {
    let mut left = CORNER_ROW;
    while cuts != 0 {
        // The barrier lies between corner x and corner x + 1.
        let below = (2 << cuts.trailing_zeros()) - 1;
        runs.push(left & below);
        left &= !below;
        cuts &= cuts - 1;
    }
    runs.push(left);
}

/// Joins the runs of two neighbouring rows where `open` has a bit under both.
fn join_rows(regions: &Regions, parents: &mut [u16], a: usize, b: usize, open: u64) {
    let (mut i, end_i) = (regions.row_starts[a] as usize, regions.row_starts[a + 1] as usize);
    let (mut j, end_j) = (regions.row_starts[b] as usize, regions.row_starts[b + 1] as usize);
    while i < end_i && j < end_j {
        let (left, right) = (regions.runs[i], regions.runs[j]);
        if left & right & open != 0 {
            join(parents, i as u16, j as u16);
        }
        // The run that ends first is done; both when they end together.
        let (end_left, end_right) = (left.leading_zeros(), right.leading_zeros());
        i += usize::from(end_left >= end_right);
        j += usize::from(end_right >= end_left);
    }
}

fn root(parents: &mut [u16], mut at: u16) -> u16 {
    while parents[at as usize] != at {
        parents[at as usize] = parents[parents[at as usize] as usize];
        at = parents[at as usize];
    }
    at
}

fn join(parents: &mut [u16], a: u16, b: u16) {
    // Most neighbours are united already.
    if parents[a as usize] == parents[b as usize] {
        return;
    }
    let (a, b) = (root(parents, a), root(parents, b));
    parents[a.max(b) as usize] = a.min(b);
}

/// Numbers the sets in the order of their first members.
fn number_in_order(parents: &mut [u16], labels: &mut Vec<u16>, count: &mut u16) {
    labels.clear();
    labels.reserve(parents.len());
    for run in 0..parents.len() {
        let root = root(parents, run as u16) as usize;
        let label = if root == run {
            *count += 1;
            *count - 1
        } else {
            labels[root]
        };
        labels.push(label);
    }
}

impl Regions {
    /// The regions of the pieces of the side with normal `axis`, low (0) or high (1).
    #[must_use]
    pub fn on_side(&self, barrier: &EdgeBits, axis: usize, high: bool) -> FaceRegions {
        let at = if high { LINES - 1 } else { 0 };
        let mut along = [0_u64; LINES];
        let mut across = [0_u64; LINES];
        for line in 0..LINES {
            (along[line], across[line]) = side_rows(barrier, axis, at, line);
        }
        if along.iter().chain(&across[..LINES - 1]).all(|&row| row == 0) {
            return vec![self.at([0, 0, 0].map_axis(axis, at))];
        }
        let mut flat = Regions::default();
        split_rows(&along, &mut flat);
        let mut parents: Vec<u16> = (0..flat.runs.len() as u16).collect();
        for (line, &closed) in across[..LINES - 1].iter().enumerate() {
            join_rows(&flat, &mut parents, line, line + 1, !closed);
        }
        number_in_order(&mut parents, &mut flat.labels, &mut flat.count);
        let mut pieces = FaceRegions::with_capacity(flat.count as usize);
        for line in 0..LINES {
            for (bits, piece) in flat.row(line) {
                if piece as usize == pieces.len() {
                    let x = bits.trailing_zeros() as usize;
                    pieces.push(self.at(side_corner(axis, at, line, x)));
                }
            }
        }
        pieces
    }
}

/// Barriers along row `line` of a side, and between it and the next row.
fn side_rows(barrier: &EdgeBits, axis: usize, at: usize, line: usize) -> (u64, u64) {
    match axis {
        // Rows along y, one per z: bits are gathered from the rows of the brick.
        0 => {
            let gather = |edge_axis: usize| {
                let rows = &barrier.rows(edge_axis)[line * LINES..(line + 1) * LINES];
                rows.iter().enumerate().fold(0, |bits, (y, row)| bits | (row >> at & 1) << y)
            };
            (gather(1), gather(2))
        }
        1 => (barrier.rows(0)[line * LINES + at], barrier.rows(2)[line * LINES + at]),
        _ => (barrier.rows(0)[at * LINES + line], barrier.rows(1)[at * LINES + line]),
    }
}

/// The corner of a side at row `line` and place `x` of it.
fn side_corner(axis: usize, at: usize, line: usize, x: usize) -> [usize; 3] {
    match axis {
        0 => [at, x, line],
        1 => [x, at, line],
        _ => [x, line, at],
    }
}

trait MapAxis {
    fn map_axis(self, axis: usize, value: usize) -> Self;
}

impl MapAxis for [usize; 3] {
    fn map_axis(mut self, axis: usize, value: usize) -> Self {
        self[axis] = value;
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octree::edge_bits::{AXIS_EDGES, SIDE, edge_index, edge_position};
    use proptest::prelude::*;

    fn noise(seed: u64, one_in: u64) -> EdgeBits {
        let mut barrier = EdgeBits::default();
        let mut state = seed | 1;
        for edge in 0..3 * AXIS_EDGES {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            let (axis, at) = edge_position(edge);
            if state.is_multiple_of(one_in) && at[axis] < SIDE {
                barrier.set(edge);
            }
        }
        barrier
    }

    /// Flood fill corner by corner.
    fn brute_force(barrier: &EdgeBits) -> Vec<u16> {
        let number = |c: [usize; 3]| (c[2] * LINES + c[1]) * LINES + c[0];
        let mut labels = vec![u16::MAX; ROWS * LINES];
        let mut count = 0;
        for start in 0..labels.len() {
            if labels[start] != u16::MAX {
                continue;
            }
            let mut stack = vec![[start % LINES, start / LINES % LINES, start / ROWS]];
            labels[start] = count;
            while let Some(corner) = stack.pop() {
                for axis in 0..3 {
                    let mut visit = |next: [usize; 3], edge: [usize; 3]| {
                        if !barrier.get(edge_index(axis, edge)) && labels[number(next)] == u16::MAX
                        {
                            labels[number(next)] = count;
                            stack.push(next);
                        }
                    };
                    if corner[axis] < SIDE {
                        visit(corner.map_axis(axis, corner[axis] + 1), corner);
                    }
                    if corner[axis] > 0 {
                        let below = corner.map_axis(axis, corner[axis] - 1);
                        visit(below, below);
                    }
                }
            }
            count += 1;
        }
        labels
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn runs_give_the_regions_of_a_flood_fill(seed in any::<u64>(), one_in in 1..6_u64) {
            let barrier = noise(seed, one_in);
            let regions = find_regions(&barrier);
            let expected = brute_force(&barrier);
            for (number, &label) in expected.iter().enumerate() {
                let corner = [number % LINES, number / LINES % LINES, number / ROWS];
                prop_assert_eq!(regions.at(corner), label);
            }
        }

        #[test]
        fn a_side_lists_every_region_that_it_meets(seed in any::<u64>(), one_in in 2..9_u64) {
            let barrier = noise(seed, one_in);
            let regions = find_regions(&barrier);
            for axis in 0..3 {
                for high in [false, true] {
                    let at = if high { SIDE } else { 0 };
                    let listed = regions.on_side(&barrier, axis, high);
                    for line in 0..LINES {
                        for x in 0..LINES {
                            let region = regions.at(side_corner(axis, at, line, x));
                            prop_assert!(listed.contains(&region));
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn an_empty_brick_is_one_region_with_one_piece_per_side() {
        let barrier = EdgeBits::default();
        let regions = find_regions(&barrier);
        assert_eq!(regions.count, 1);
        assert_eq!(regions.on_side(&barrier, 0, true), vec![0]);
    }
}
