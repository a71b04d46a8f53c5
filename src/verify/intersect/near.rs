//! Pairs of boxes that overlap, in one cell.
//!
//! In:         boxes on a grid of 2^20 places a side over the cell.
//! Out:        every pair that overlaps on that grid (touching counts) and whose overlap starts in
//!             the cell, once.
//! Invariant:  the low corner of a pair's overlap lies in one part of any division into parts, and
//!             the pair is told there.
//! Memory:     lists of numbers: 3 per box and level of division at most. A level has at most 7 of 8
//!             boxes of the one around it.

use crate::verify::intersect::boxes::{NearBox, PLACE, SPARE, not_below, pack, unpack};

/// So few boxes are compared each with each.
const FEW: usize = 40;

/// Shows the numbers of the parts that a box meets.
#[inline]
fn each_part(
    near: &NearBox,
    part: Part,
    shifts: [u32; 3],
    sides: [u32; 3],
    mut visit: impl FnMut(usize),
) {
    let range = |i: usize| {
        let first = unpack(near.low, i).max(part.low[i]) - part.low[i];
        let last = unpack(near.high, i).min(part.high[i]) - part.low[i];
        (first >> shifts[i])..=(last >> shifts[i])
    };
    let [xs, ys, zs] = [range(0), range(1), range(2)];
    for z in zs {
        for y in ys.clone() {
            let row = (z * sides[1] + y) * sides[0];
            for x in xs.clone() {
                visit((row + x) as usize);
            }
        }
    }
}

/// Boxes of a cell, and room to divide them.
#[derive(Default)]
pub(crate) struct NearPairs {
    pub(crate) boxes: Vec<NearBox>,
    /// Lists of boxes, of a part behind the one that it is a part of.
    lists: Vec<u32>,
    compared: Vec<(u64, u64, u64)>,
    hits: Vec<u32>,
}

/// A box of places.
#[derive(Clone, Copy)]
struct Part {
    low: [u32; 3],
    high: [u32; 3],
}

impl Part {
    /// How many parts of these widths, powers of two, it has along each axis.
    fn sides(&self, shifts: [u32; 3]) -> [u32; 3] {
        std::array::from_fn(|i| ((self.high[i] - self.low[i]) >> shifts[i]) + 1)
    }
}

impl NearPairs {
    /// Shows all pairs of a cell's boxes.
    pub(crate) fn each(&mut self, visit: &mut impl FnMut(u32, u32)) {
        self.lists.clear();
        self.lists.extend(0..self.boxes.len() as u32);
        let whole = Part { low: [0; 3], high: [PLACE as u32; 3] };
        self.divide(0, whole, visit);
    }

    /// Shows the pairs of the list from `from` on, in a part of the cell.
    fn divide(&mut self, from: usize, part: Part, visit: &mut impl FnMut(u32, u32)) {
        let count = self.lists.len() - from;
        if count <= FEW {
            return self.compare(from, part, visit);
        }
        let (part, mut shifts) = self.division(from, part);
        let end = self.lists.len();
        let (sides, ends) = loop {
            let sides = part.sides(shifts);
            if sides == [1; 3] {
                return self.compare(from, part, visit);
            }
            if let Some(ends) = self.distribute(from, part, shifts, sides) {
                break (sides, ends);
            }
            shifts = shifts.map(|shift| shift + 1);
        };
        // Parts are taken from the last on, so that each is the end of the lists.
        let mut cell = ends.len();
        for z in (0..sides[2]).rev() {
            for y in (0..sides[1]).rev() {
                for x in (0..sides[0]).rev() {
                    cell -= 1;
                    let first = end + if cell == 0 { 0 } else { ends[cell - 1] as usize };
                    let within = self.lists.len() - first;
                    if within > 1 {
                        let low: [u32; 3] =
                            std::array::from_fn(|i| part.low[i] + ([x, y, z][i] << shifts[i]));
                        let high = std::array::from_fn(|i| {
                            (low[i] + ((1 << shifts[i]) - 1)).min(part.high[i])
                        });
                        // Most of them at one place: dividing on would not part them.
                        if within * 8 > count * 7 {
                            self.compare(first, Part { low, high }, visit);
                        } else {
                            self.divide(first, Part { low, high }, visit);
                        }
                    }
                    self.lists.truncate(first);
                }
            }
        }
    }

    /// The part without its empty rim, and the widths of its own parts as powers of two.
    fn division(&self, from: usize, part: Part) -> (Part, [u32; 3]) {
        let list = &self.lists[from..];
        let mut tight = Part { low: part.high, high: part.low };
        let mut extents = [0_u64; 3];
        for &number in list {
            let near = &self.boxes[number as usize];
            for (i, extent) in extents.iter_mut().enumerate() {
                let first = unpack(near.low, i).max(part.low[i]);
                let last = unpack(near.high, i).min(part.high[i]);
                tight.low[i] = tight.low[i].min(first);
                tight.high[i] = tight.high[i].max(last);
                *extent += u64::from(last - first);
            }
        }
        // A part is two to four times as wide as its boxes, and there are not more than boxes.
        let mut shifts = extents.map(|extent| {
            let mean = (extent / list.len() as u64) as u32;
            u32::BITS - mean.leading_zeros() + 1
        });
        loop {
            let sides = tight.sides(shifts);
            let parts: u64 = sides.iter().map(|&side| u64::from(side)).product();
            if parts <= list.len() as u64 {
                return (tight, shifts);
            }
            let longest = (0..3).max_by_key(|&i| sides[i]).unwrap_or(0);
            shifts[longest] += 1;
        }
    }

    /// Appends the lists of all parts; where each ends, counted from the first. `None` if that
    /// would multiply the boxes.
    fn distribute(
        &mut self,
        from: usize,
        part: Part,
        shifts: [u32; 3],
        sides: [u32; 3],
    ) -> Option<Vec<u32>> {
        let list = from..self.lists.len();
        let mut ends = vec![0_u32; (sides[0] * sides[1] * sides[2]) as usize];
        let mut copies = 0;
        for at in list.clone() {
            let near = &self.boxes[self.lists[at] as usize];
            each_part(near, part, shifts, sides, |cell| {
                ends[cell] += 1;
                copies += 1;
            });
            if copies > 3 * list.len() {
                return None;
            }
        }
        let mut sum = 0;
        for end in &mut ends {
            sum += *end;
            *end = sum;
        }
        self.lists.resize(list.end + copies, 0);
        let (lists, parts) = self.lists.split_at_mut(list.end);
        // From the last box to the first, each part from its end to its start.
        for &number in lists[list].iter().rev() {
            each_part(&self.boxes[number as usize], part, shifts, sides, |cell| {
                ends[cell] -= 1;
                parts[ends[cell] as usize] = number;
            });
        }
        // Now there are starts; the end of a part is the start of the next.
        ends.rotate_left(1);
        if let Some(last) = ends.last_mut() {
            *last = copies as u32;
        }
        Some(ends)
    }

    /// Compares each box of the list with each.
    fn compare(&mut self, from: usize, part: Part, visit: &mut impl FnMut(u32, u32)) {
        let Self { boxes, lists, compared, hits } = self;
        let list = &lists[from..];
        let origin = pack(part.low);
        compared.clear();
        compared.extend(list.iter().map(|&number| {
            let NearBox { low, high, starts } = boxes[number as usize];
            (low, high | SPARE, starts & not_below(low, origin))
        }));
        hits.resize(hits.len().max(list.len()), 0);
        for (at, &(low, high, starts)) in compared.iter().enumerate() {
            // One hit in four or so is hard to foresee: without a branch the loop does not stall.
            let mut count = 0;
            let others = &list[at + 1..];
            for (&(other_low, other_high, other_starts), &other) in
                compared[at + 1..].iter().zip(others)
            {
                let overlap = (high - other_low) & (other_high - low);
                hits[count] = other;
                count += usize::from(overlap & (starts | other_starts) & SPARE == SPARE);
            }
            hits[..count].iter().for_each(|&other| visit(list[at], other));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::Random;

    /// Boxes of all sizes, many at one place, some from before the cell.
    fn boxes(count: u32, most: f64, random: &mut Random) -> Vec<([u32; 3], [u32; 3], [bool; 3])> {
        let mut next = |most: f64| (random.share() * most) as u32;
        (0..count)
            .map(|i| {
                let size = if i % 50 == 0 { 1e6 } else { most };
                let low: [u32; 3] = match i % 5 {
                    0 => [1_000_000, 7, 7],
                    1 => [next(1e5), next(1e5), 77],
                    _ => [next(1e6), next(1e6), next(1e6)],
                };
                let high = low.map(|x| (x + next(size)).min(PLACE as u32));
                let before = next(8.0);
                let starts = std::array::from_fn(|axis| before != axis as u32);
                let low = std::array::from_fn(|axis| if starts[axis] { low[axis] } else { 0 });
                (low, high, starts)
            })
            .collect()
    }

    #[test]
    fn pairs_are_those_of_comparing_all_each_once() {
        let mut random = Random::new(5);
        for (count, most) in [(0, 1.0), (1, 1.0), (30, 1e6), (900, 2e4), (900, 4e5), (3000, 3e3)] {
            let boxes = boxes(count, most, &mut random);
            let mut expected = Vec::new();
            for (i, a) in boxes.iter().enumerate() {
                for (j, b) in boxes.iter().enumerate().skip(i + 1) {
                    if (0..3).all(|k| a.1[k] >= b.0[k] && b.1[k] >= a.0[k] && (a.2[k] || b.2[k])) {
                        expected.push([i as u32, j as u32]);
                    }
                }
            }
            let boxes = boxes.iter().map(|&(low, high, starts)| NearBox::new(low, high, starts));
            let mut pairs = NearPairs { boxes: boxes.collect(), ..NearPairs::default() };
            let mut found = Vec::new();
            pairs.each(&mut |a, b| found.push([a.min(b), a.max(b)]));
            found.sort_unstable();
            assert_eq!(found, expected, "{count} boxes of {most}");
        }
    }
}
