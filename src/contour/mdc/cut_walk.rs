//! The cells of the cut of a brick, as they come along with its leaf cells.
//!
//! In:         a record of cells.
//! Out:        the cell of the cut that each leaf cell lies in, and its vertices.
//! Units:      numbers of leaf cells, ascending.
//! Memory:     none.
//! Fails:      never; where members are missing there is none.

use crate::contour::mdc::cut_cell::CutCell;
use crate::octree::ArchivedCellBrick;

/// Walks the cells of the cut along the leaf cells.
pub struct CutWalk<'r> {
    record: &'r ArchivedCellBrick,
    cluster: usize,
    member: usize,
    flagged: usize,
    reach: usize,
    /// First vertex of the cell of the cut under way.
    vertex: u32,
    /// End of the cluster under way, in leaf numbers, and how many vertices it has.
    end: usize,
    count: u32,
    cut: CutCell,
}

impl<'r> CutWalk<'r> {
    /// Before the first leaf cell.
    pub fn new(record: &'r ArchivedCellBrick) -> Self {
        let cut = CutCell::new(0, 0, false, false);
        Self {
            record,
            cluster: 0,
            member: 0,
            flagged: 0,
            reach: 0,
            vertex: 0,
            end: 0,
            count: 0,
            cut,
        }
    }

    fn is_flagged(&mut self, first: usize) -> bool {
        let flagged = &self.record.flagged;
        while flagged.get(self.flagged).is_some_and(|f| usize::from(f.to_native()) < first) {
            self.flagged += 1;
        }
        flagged.get(self.flagged).is_some_and(|f| usize::from(f.to_native()) == first)
    }

    /// The face that the vertex of a leaf cell reaches through.
    #[inline]
    fn reaches(&mut self, number: usize) -> Option<u8> {
        let reaches = &self.record.reaches;
        while reaches.get(self.reach).is_some_and(|r| usize::from(r.cell.to_native()) < number) {
            self.reach += 1;
        }
        let reach = reaches.get(self.reach)?;
        (reach.is_granted && usize::from(reach.cell.to_native()) == number).then_some(reach.face)
    }

    /// The cell of the cut that the leaf cell lies in, with its first vertex; the leaf's components
    /// have the vertices that `member` tells.
    #[inline]
    pub fn step(&mut self, number: usize, components: u32) -> (CutCell, u32, bool) {
        if number < self.end {
            return (self.cut, self.vertex - self.count, true);
        }
        if let Some(cluster) = self.record.clusters.get(self.cluster) {
            let cluster = cluster.to_native();
            let (first, level) = ((cluster & 0x7fff) as usize, cluster >> 15 & 7);
            if first <= number {
                self.cluster += 1;
                self.end = first + (1 << (3 * level));
                self.count = cluster >> 18;
                self.vertex += self.count;
                let flagged = self.is_flagged(first);
                self.cut = CutCell::new(first, level, flagged, self.count > 1);
                return (self.cut, self.vertex - self.count, true);
            }
        }
        let flagged = !self.record.flagged.is_empty() && self.is_flagged(number);
        let mut cut = CutCell::new(number, 0, flagged, components > 1);
        if let Some(face) = self.reaches(number) {
            cut = cut.reaching(face);
        }
        self.vertex += components;
        (cut, self.vertex - components, false)
    }

    /// Whether a leaf cell lies in the cluster under way, which has one vertex: then there is nothing to
    /// step over.
    #[inline]
    pub fn is_in_one_vertex(&self, number: usize) -> bool {
        number < self.end && self.count == 1
    }

    /// Which vertex of its cluster, which has several, the next component has.
    pub fn member(&mut self) -> Option<u32> {
        self.member += 1;
        self.record.members.get(self.member - 1).map(|member| u32::from(*member))
    }

    /// Where the cluster that came last ends, in leaf numbers.
    #[inline]
    pub fn end(&self) -> usize {
        self.end
    }
}
