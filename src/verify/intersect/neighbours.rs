//! Pairs of triangles whose boxes overlap, found by the boxes of neighbours in the file.
//!
//! In:         the boxes of a cell's triangles, in the order of the file.
//! Out:        as from [`NearPairs`], less what the caller leaves out.
//! Invariant:  the same pairs whatever is taken together.
//! Memory:     32 bytes a triangle beside the lists of numbers.
//!
//! Most surfaces come quad by quad: both halves of one have about the same box. One box for both
//! leaves a quarter of the comparisons.

use crate::verify::intersect::boxes::NearBox;
use crate::verify::intersect::grid::CellRange;
use crate::verify::intersect::near::NearPairs;

/// So many triangles are taken together at most.
const MOST: u32 = 2;
/// The sides of the common box are at most so many times as long as those of the largest.
const STRETCH: f32 = 1.5;

/// Boxes of a cell's triangles.
#[derive(Default)]
pub(crate) struct Neighbours {
    boxes: Vec<NearBox>,
    /// The first triangle of each group.
    firsts: Vec<u32>,
    groups: NearPairs,
    /// The group under way.
    common: Option<CellRange>,
    longest: u32,
}

/// The sum of the sides.
fn length(range: &CellRange) -> u32 {
    (0..3).map(|i| range.high[i] - range.low[i] + 1).sum()
}

impl Neighbours {
    /// Forgets all triangles.
    pub(crate) fn clear(&mut self) {
        self.boxes.clear();
        self.firsts.clear();
        self.groups.boxes.clear();
        self.common = None;
    }

    /// Takes the next triangle, and along which axes it starts in the cell.
    #[inline]
    pub(crate) fn push(&mut self, range: CellRange, starts: [bool; 3]) {
        let number = self.boxes.len() as u32;
        self.boxes.push(NearBox::new(range.low, range.high, starts));
        let own = length(&range);
        if let (Some(common), Some(&first)) = (&mut self.common, self.firsts.last()) {
            let both = CellRange {
                low: std::array::from_fn(|i| common.low[i].min(range.low[i])),
                high: std::array::from_fn(|i| common.high[i].max(range.high[i])),
            };
            let longest = self.longest.max(own);
            if number - first < MOST && length(&both) as f32 <= STRETCH * longest as f32 {
                (*common, self.longest) = (both, longest);
                return;
            }
        }
        self.close();
        self.firsts.push(number);
        (self.common, self.longest) = (Some(range), own);
    }

    fn close(&mut self) {
        if let Some(CellRange { low, high }) = self.common.take() {
            // Where an overlap starts is asked of the triangles themselves.
            self.groups.boxes.push(NearBox::new(low, high, [true; 3]));
        }
    }

    /// Shows all pairs whose boxes overlap, except those to be left out.
    pub(crate) fn each(
        &mut self,
        leaves_out: impl Fn(u32, u32) -> bool,
        mut visit: impl FnMut(u32, u32),
    ) {
        self.close();
        self.firsts.push(self.boxes.len() as u32);
        let Self { boxes, firsts, groups, .. } = self;
        let members = |group: u32| firsts[group as usize]..firsts[group as usize + 1];
        let mut show = |first: u32, second: u32| {
            let others = members(second);
            for a in members(first) {
                let start = if first == second { a + 1 } else { others.start };
                for b in start..others.end {
                    if !leaves_out(a, b) && boxes[a as usize].overlaps(&boxes[b as usize]) {
                        visit(a, b);
                    }
                }
            }
        };
        (0..groups.boxes.len() as u32).for_each(|group| show(group, group));
        groups.each(&mut show);
    }
}
