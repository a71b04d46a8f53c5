//! Thins out crowds of copies before they are binned.
//!
//! A triangle that comes a million times would go a million times into every bin that it meets.
//! Of a group of copies only the first counts, and whether they are odd or even in number; so of
//! each triangle, as given, pairs beyond the second copy are left out here. The filter remembers
//! the triangles that came last; what it overlooks is settled in the bins, to the same end.
//!
//! Memory:  some 400 KiB.

use serde::{Deserialize, Serialize};

use crate::ingest::packed::{Given, given, mix};
use crate::octree::points::{is_degenerate, snapped};
use crate::octree::{Domain, SoupTriangle};

/// Triangles that are remembered. A power of two.
const SLOTS: usize = 2048;

#[derive(Clone, Copy, Default)]
struct Slot {
    /// Of the corners, whatever their order.
    hash: u64,
    corners: [Given; 3],
    /// How often it was let through.
    passed: u8,
}

impl Slot {
    /// Whether these are its corners, in whatever order.
    fn holds(&self, hash: u64, corners: [Given; 3]) -> bool {
        self.hash == hash && sorted(self.corners) == sorted(corners)
    }
}

fn sorted(mut corners: [Given; 3]) -> [Given; 3] {
    corners.sort_unstable();
    corners
}

/// Triangles that are in no bin: copies of others, which cancel in pairs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftOut {
    /// How many.
    pub triangles: u64,
    /// Of these, without area on the lattice.
    pub degenerate_triangles: u64,
}

/// Lets triangles through.
pub(crate) struct CrowdFilter<'d> {
    domain: &'d Domain,
    slots: Vec<Slot>,
    /// Of a slot that was let through twice, a third, fifth, ... copy: it goes with the next one, or is let
    /// through in the end.
    waiting: Vec<Option<SoupTriangle>>,
    left_out: LeftOut,
}

impl<'d> CrowdFilter<'d> {
    pub(crate) fn new(domain: &'d Domain) -> Self {
        Self {
            domain,
            slots: vec![Slot::default(); SLOTS],
            waiting: vec![None; SLOTS],
            left_out: LeftOut::default(),
        }
    }

    /// Takes triangles out of the list, and may put in some that were taken out before; whether it did
    /// either.
    pub(crate) fn thin_out(&mut self, triangles: &mut Vec<SoupTriangle>) -> bool {
        let before = triangles.len();
        let mut overdue = Vec::new();
        triangles.retain(|triangle| {
            let corners = triangle.corners.map(given);
            let hash = corners.iter().fold(0_u64, |sum, corner| sum.wrapping_add(mix(corner)));
            let number = hash as usize % SLOTS;
            let slot = &mut self.slots[number];
            if slot.passed == 0 || !slot.holds(hash, corners) {
                if slot.passed == 2 {
                    overdue.extend(self.waiting[number].take());
                }
                *slot = Slot { hash, corners, passed: 1 };
                return true;
            }
            if slot.passed == 1 {
                slot.passed = 2;
                return true;
            }
            if self.waiting[number].take().is_some() {
                let is_degenerate = is_degenerate(snapped(self.domain, triangle));
                self.left_out.triangles += 2;
                self.left_out.degenerate_triangles += if is_degenerate { 2 } else { 0 };
            } else {
                self.waiting[number] = Some(*triangle);
            }
            false
        });
        let is_changed = triangles.len() != before || !overdue.is_empty();
        triangles.append(&mut overdue);
        is_changed
    }

    /// The triangles that still wait.
    pub(crate) fn finish(&mut self) -> Vec<SoupTriangle> {
        self.waiting.iter_mut().filter_map(Option::take).collect()
    }

    /// What was left out.
    pub(crate) fn left_out(&self) -> LeftOut {
        self.left_out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octree::SnapBox;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    fn triangle(kind: u32, source: u32) -> SoupTriangle {
        let x = f64::from(kind);
        let mut corners = [[x, 0.0, 1.0], [x, 2.0, -0.0], [0.5, x, 3.0]];
        corners.rotate_left(source as usize % 3);
        SoupTriangle { corners, source, part: 0, material: 0, stands_for: 0 }
    }

    proptest! {
        #[test]
        fn of_every_triangle_the_first_and_the_parity_are_kept(
            // Some come in crowds, and more kinds than there are slots push each other out.
            kinds in proptest::collection::vec(prop_oneof![0..3_u32, 0..9000_u32], 0..6000),
        ) {
            let unit = SnapBox { lo: [0.0; 3], hi: [9000.0; 3] };
            let domain = Domain::around(&unit, 4, false).expect("room enough");
            let mut filter = CrowdFilter::new(&domain);
            let mut kept: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
            let mut given: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
            let soup: Vec<_> =
                kinds.iter().zip(0..).map(|(&kind, source)| triangle(kind, source)).collect();
            let kind_of = |triangle: &SoupTriangle| kinds[triangle.source as usize];
            soup.iter().for_each(|t| given.entry(kind_of(t)).or_default().push(t.source));
            let mut through = Vec::new();
            for block in soup.chunks(500) {
                let mut block = block.to_vec();
                filter.thin_out(&mut block);
                through.append(&mut block);
            }
            through.append(&mut filter.finish());
            through.iter().for_each(|t| kept.entry(kind_of(t)).or_default().push(t.source));
            prop_assert_eq!(through.len() as u64 + filter.left_out().triangles, soup.len() as u64);
            for (kind, mut sources) in kept {
                let all = &given[&kind];
                sources.sort_unstable();
                prop_assert_eq!(sources[0], all[0]);
                prop_assert_eq!(sources.len() % 2, all.len() % 2);
                prop_assert_eq!(sources.len() > 1, all.len() > 1);
                prop_assert!(sources.is_sorted_by(|a, b| a < b), "none comes twice");
            }
            if kinds.len() > 600 {
                prop_assert!(filter.left_out().triangles > 0);
            }
        }
    }
}
