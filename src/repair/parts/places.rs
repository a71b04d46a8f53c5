//! Where parts stand in their scene, and how large that makes them.
//!
//! Memory: a record for each part and one for each node, in tables that spill.

use bytemuck::{Pod, Zeroable};

use crate::ingest::Scattered;
use crate::mesh::{Affine, SceneNode, apply, compose, stretch};
use crate::octree::SnapBox;
use crate::store::{Resources, StoreError, Table};

/// Of a part.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PartPlaces {
    /// How often it stands in the scene.
    pub count: u64,
    /// The largest factor by which a place makes it longer.
    pub stretch: f64,
}

/// See the module.
pub struct Places {
    parts: Table<PartPlaces>,
    /// The parts in the order in which a walk over the scene meets them.
    order: Table<u32>,
    total: u64,
    /// Of all parts in all their places.
    pub bounds: SnapBox,
}

impl Places {
    /// Walks over the scene of a file.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn find(scattered: &mut Scattered, resources: &Resources) -> Result<Self, StoreError> {
        let share_bytes = resources.share_bytes / 16;
        let mut parts = Table::new(resources.scratch, share_bytes);
        (0..scattered.part_count()).try_for_each(|_| parts.push(PartPlaces::zeroed()))?;
        let mut maps = Table::<Affine>::new(resources.scratch, share_bytes);
        let order = Table::new(resources.scratch, share_bytes);
        let mut places = Self { parts, order, total: 0, bounds: SnapBox::EMPTY };
        let scene = scattered.scene.clone();
        scene.for_each(|_, SceneNode { parent, map, part, .. }| {
            let map = match parent {
                Some(parent) => compose(&maps.get(parent.into())?, &map),
                None => map,
            };
            maps.push(map)?;
            let Some(part) = part else { return Ok(()) };
            places.enter(part, &map)?;
            let SnapBox { lo, hi } = scattered.bounds(part)?;
            for corner in 0..8 {
                let at = [0, 1, 2].map(|axis| if corner >> axis & 1 == 0 { lo } else { hi }[axis]);
                let placed = apply(&map, at);
                if lo[0] <= hi[0] && placed.iter().all(|x| x.is_finite()) {
                    places.bounds.add(placed);
                }
            }
            Ok::<_, StoreError>(())
        })?;
        Ok(places)
    }

    fn enter(&mut self, part: u32, map: &Affine) -> Result<(), StoreError> {
        let PartPlaces { count, stretch: before } = self.parts.get(part.into())?;
        if count == 0 {
            self.order.push(part)?;
        }
        self.total += 1;
        let stretch = before.max(stretch(map));
        self.parts.set(part.into(), PartPlaces { count: count + 1, stretch })
    }

    /// How many places there are.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// How many parts stand anywhere.
    pub fn len(&self) -> u32 {
        self.order.len() as u32
    }

    /// The part that a walk over the scene meets as this one, and where it stands.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn get(&mut self, turn: u32) -> Result<(u32, PartPlaces), StoreError> {
        let part = self.order.get(turn.into())?;
        Ok((part, self.parts.get(part.into())?))
    }
}
