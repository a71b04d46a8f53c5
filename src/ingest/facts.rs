//! What the bins say about copies, and the rule that settles them.
//!
//! A *group* is all triangles with the same three corners on the lattice; its number is its
//! smallest source. Where the count of a group is odd, one of it counts: that is its parity.
//! Where it is even, the patch of such groups that hang together at edges is judged as a whole, by
//! its rim:
//!
//! - other triangles in odd number somewhere: the soup is open there, one copy counts;
//! - else no other triangles somewhere: a panel that was written twice, one copy counts; unless the
//!   copies differ as given and their rim is closed as given: a fold that snapping pressed flat;
//! - else two all along that lie on each other but for a hair: a panel with two sides, some of which
//!   are exact copies and some not; one copy counts, unless the copies differ as given;
//! - else in even number all along: an interface, none counts;
//! - no rim: a closed surface that was written twice, one copy counts.
//!
//! So a soup that is closed mod 2 as given stays so, but for panels whose sides are exact copies and
//! that end in the open or where the copies end: nothing tells such a panel from a flat bag.

use bytemuck::{Pod, Zeroable};

use crate::store::Record;

/// A triangle that has copies: group, brick, source.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Copied {
    pub(crate) brick: u64,
    pub(crate) group: u32,
    pub(crate) source: u32,
}

impl Record for Copied {
    type Key = (u32, u64, u32);
    fn key(&self) -> Self::Key {
        (self.group, self.brick, self.source)
    }
}

/// What is known of a group.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Fact {
    pub(crate) group: u32,
    /// One of the kinds below.
    pub(crate) kind: u32,
    /// The other group of [`JOINED`]; of rims the length in model units, as bits.
    pub(crate) value: u64,
}

/// Another even group is at the same edge.
pub(crate) const JOINED: u32 = 0;
/// The group's triangles are not the same as given.
pub(crate) const DIFFERS: u32 = 1;
/// The edge is on the patch's rim, and an odd number of other triangles is there.
pub(crate) const RIM_ODD: u32 = 2;
/// ... an even number, and not zero.
pub(crate) const RIM_EVEN: u32 = 4;
/// ... two, and these lie on each other but for a hair.
pub(crate) const RIM_FOLDED: u32 = 32;
/// ... none, and the edges of the copies as given do not cancel in pairs.
pub(crate) const RIM_ALONE_OPEN: u32 = 8;
/// ... none, and they do.
pub(crate) const RIM_ALONE_CLOSED: u32 = 16;

impl Record for Fact {
    type Key = (u32, u32, u64);
    fn key(&self) -> Self::Key {
        (self.group, self.kind, self.value)
    }
}

/// Whether one triangle of each group of a patch counts, or none; `kinds` is all that was said of
/// the patch.
pub(crate) fn counts_once(kinds: u32) -> bool {
    let saw = |kind: u32| kinds & kind != 0;
    if saw(RIM_ODD | RIM_ALONE_OPEN) {
        return true;
    }
    if saw(RIM_ALONE_CLOSED) || saw(RIM_FOLDED) && !saw(RIM_EVEN) {
        return !saw(DIFFERS);
    }
    !saw(RIM_EVEN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_patch_counts_once_unless_its_rim_says_otherwise() {
        // A closed surface written twice; a panel written twice, on its own or with one side at a
        // closed surface; one whose sides are a hair apart.
        let flap = RIM_EVEN | RIM_ALONE_CLOSED;
        for kinds in [0, DIFFERS, RIM_ALONE_CLOSED, flap, RIM_ALONE_OPEN | DIFFERS, RIM_FOLDED] {
            assert!(counts_once(kinds), "{kinds}");
        }
        // An interface, a fold that was pressed flat, also one on a closed surface.
        let folded = [RIM_FOLDED | DIFFERS, RIM_FOLDED | RIM_EVEN];
        for kinds in
            [RIM_EVEN, RIM_ALONE_CLOSED | DIFFERS, flap | DIFFERS].into_iter().chain(folded)
        {
            assert!(!counts_once(kinds), "{kinds}");
        }
        // The soup is open there anyway.
        for kinds in [RIM_EVEN | RIM_ODD, RIM_EVEN | RIM_ALONE_OPEN, RIM_ODD | DIFFERS] {
            assert!(counts_once(kinds), "{kinds}");
        }
    }
}
