//! Judges a surface while it passes by: a vertex leaves as soon as its triangles close one round.
//!
//! In:         whole triangles in file order, with the names and positions of their corners.
//! Out:        whether all is well, and then the counts; nothing about what is wrong.
//! Invariant:  all is well only if every vertex was closed by one cycle of different neighbours,
//!             nothing came after that (it would enter again, and its position then twice), and no
//!             two positions have equal hashes of 64 bits. So "well" is exact; "not well" is not.
//! Memory:     half of `share_bytes` for the vertices under way, a quarter for the hashes, which
//!             are sorted externally beyond that.
//! Fails:      only as [`StoreError`].

use std::collections::HashMap;

use bytemuck::{Pod, Zeroable};

use crate::store::{Record, Scratch, Sorter, StoreError};
use crate::verify::bodies::{Bodies, BodyId};
use crate::verify::cone::Cone;
use crate::verify::link::{FEW_WEDGES, Wedge, is_one_cycle, is_one_long_cycle};
use crate::verify::positions::{hash, key_of};
use crate::verify::slots::{Name, Slots, mix};

/// Wedges that have room beside their vertex; more are rare.
const FEW: usize = 12;
/// What a wedge beyond these takes: a vector that doubles, again when its round is closed, and a
/// share of the map.
const CROWD_WEDGE_BYTES: u64 = 6 * size_of::<Wedge>() as u64;
const NO_BODY: BodyId = BodyId::MAX;

/// A vertex under way.
#[derive(Clone, Copy)]
struct Fan {
    /// Its number; in files without numbers in the order of arrival.
    vertex: u32,
    body: BodyId,
    /// Mixed next neighbours minus mixed previous ones: zero when all rounds are closed.
    balance: u64,
    count: u32,
    wedges: [Wedge; FEW],
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(transparent)]
struct PositionHash(u64);

impl Record for PositionHash {
    type Key = u64;
    fn key(&self) -> u64 {
        self.0
    }
}

/// What a sound surface consists of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sound {
    pub(crate) vertices: u64,
    pub(crate) components: u64,
    /// Components whose volume is not surely positive.
    pub(crate) doubtful: u64,
}

/// All vertices under way.
pub(crate) struct Window<N> {
    slots: Slots<N>,
    fans: Vec<Fan>,
    free: Vec<u32>,
    /// Wedges beyond [`FEW`], by slot.
    crowds: HashMap<u32, Vec<Wedge>>,
    crowd_bytes: u64,
    scratch_wedges: Vec<Wedge>,
    bodies: Bodies,
    hashes: Sorter<PositionHash>,
    entered: u64,
    most_bytes: u64,
}

impl<N: Name> Window<N> {
    /// An empty window.
    pub(crate) fn new(scratch: &Scratch, share_bytes: u64) -> Self {
        Self {
            slots: Slots::new(),
            fans: Vec::new(),
            free: Vec::new(),
            crowds: HashMap::new(),
            crowd_bytes: 0,
            scratch_wedges: Vec::new(),
            bodies: Bodies::default(),
            hashes: Sorter::new(scratch, share_bytes / 4),
            entered: 0,
            most_bytes: share_bytes / 2,
        }
    }

    /// Takes a whole triangle; `false` when the surface is not sound or too scattered.
    ///
    /// `number` turns the order of arrival into the number of a vertex.
    #[inline]
    pub(crate) fn add(
        &mut self,
        names: [N; 3],
        corners: &[[f64; 3]; 3],
        cone: &Cone,
        number: impl Fn(N, u64) -> u32,
    ) -> Result<bool, StoreError> {
        let mut slots = [0; 3];
        for ((slot, &name), &corner) in slots.iter_mut().zip(&names).zip(corners) {
            *slot = self.enter(name, corner, &number)?;
        }
        self.connect(slots, cone);
        let ids = slots.map(|slot| self.fans[slot as usize].vertex);
        let mixed = ids.map(mix);
        let mut fits = true;
        for (at, next, previous) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
            let balance = mixed[next].wrapping_sub(mixed[previous]);
            fits &= self.add_wedge(slots[at], [ids[next], ids[previous]], balance);
        }
        Ok(fits)
    }

    #[inline]
    fn enter(
        &mut self,
        name: N,
        corner: [f64; 3],
        number: &impl Fn(N, u64) -> u32,
    ) -> Result<u32, StoreError> {
        let next = self.free.last().copied().unwrap_or(self.fans.len() as u32);
        let slot = self.slots.find_or_enter(name, next);
        if slot == next {
            let vertex = number(name, self.entered);
            let fan = Fan { vertex, body: NO_BODY, balance: 0, count: 0, wedges: [[0; 2]; FEW] };
            if next as usize == self.fans.len() {
                self.fans.push(fan);
            } else {
                self.fans[next as usize] = fan;
                self.free.pop();
            }
            self.entered += 1;
            self.hashes.push(PositionHash(hash(key_of(corner))))?;
        }
        Ok(slot)
    }

    /// Brings the three vertices into one body and adds the triangle to it.
    #[inline]
    fn connect(&mut self, slots: [u32; 3], cone: &Cone) {
        let mut root = NO_BODY;
        for slot in slots {
            let body = self.fans[slot as usize].body;
            if body != NO_BODY && body != root {
                let other = self.bodies.root(body);
                root = if root == NO_BODY { other } else { self.bodies.join(root, other) };
            }
        }
        if root == NO_BODY {
            root = self.bodies.begin();
        }
        for slot in slots {
            let fan = &mut self.fans[slot as usize];
            let old = std::mem::replace(&mut fan.body, root);
            if old != root {
                self.bodies.refer(root);
                if old != NO_BODY {
                    self.bodies.release(old);
                }
            }
        }
        self.bodies.add(root, cone);
    }

    /// `false` when the rounds are closed but are not one, or when the room is used up.
    #[inline]
    fn add_wedge(&mut self, slot: u32, wedge: Wedge, balance: u64) -> bool {
        let fan = &mut self.fans[slot as usize];
        fan.balance = fan.balance.wrapping_add(balance);
        let count = fan.count as usize;
        fan.count += 1;
        if count >= FEW {
            return self.add_to_crowd(slot, wedge);
        }
        fan.wedges[count] = wedge;
        if fan.balance != 0 {
            return true;
        }
        if !is_one_cycle(&mut fan.wedges[..=count]) {
            return false;
        }
        self.close(slot);
        true
    }

    #[cold]
    fn add_to_crowd(&mut self, slot: u32, wedge: Wedge) -> bool {
        let fan = &self.fans[slot as usize];
        let crowd = self.crowds.entry(slot).or_default();
        crowd.push(wedge);
        self.crowd_bytes += CROWD_WEDGE_BYTES;
        if fan.balance != 0 {
            return !self.is_full();
        }
        self.crowd_bytes -= crowd.len() as u64 * CROWD_WEDGE_BYTES;
        let wedges = &mut self.scratch_wedges;
        wedges.clear();
        wedges.extend_from_slice(&fan.wedges);
        wedges.append(crowd);
        self.crowds.remove(&slot);
        let long = wedges.len() > FEW_WEDGES;
        let whole = if long { is_one_long_cycle(wedges) } else { is_one_cycle(wedges) };
        if whole {
            self.close(slot);
        }
        whole
    }

    #[inline]
    fn close(&mut self, slot: u32) {
        self.bodies.release(self.fans[slot as usize].body);
        self.slots.remove(slot);
        self.free.push(slot);
    }

    /// Whether the vertices under way take all the room; asked once in a while.
    pub(crate) fn is_full(&self) -> bool {
        let slot_bytes = size_of::<Fan>() as u64 + 4 + Slots::<N>::bytes_per_slot();
        let bytes = self.fans.len() as u64 * slot_bytes + self.bodies.peak() * Bodies::BODY_BYTES;
        // A vector that grows holds its old and its new room for a moment.
        (bytes * 3 / 2 + self.crowd_bytes) > self.most_bytes
    }

    /// After the last triangle: the counts if all is well.
    pub(crate) fn finish(self) -> Result<Option<Sound>, StoreError> {
        let Self { fans, free, bodies, hashes, entered, .. } = self;
        if fans.len() != free.len() {
            return Ok(None);
        }
        drop((fans, free));
        let mut sorted = hashes.finish()?;
        let mut last = None;
        while let Some(PositionHash(next)) = sorted.next()? {
            if last == Some(next) {
                return Ok(None);
            }
            last = Some(next);
        }
        let (components, doubtful) = (bodies.finished(), bodies.doubtful());
        Ok(Some(Sound { vertices: entered, components, doubtful }))
    }
}
