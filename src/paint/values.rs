//! Texture coordinates and colours of vertices: of every source triangle that is asked, the nearest.
//!
//! In:         places by source triangle, and the attributes by source number: one merge.
//! Out:        by vertex and look, the value of the nearest.
//! Memory:     a share for the sort.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::octree::AttributeRecord;
use crate::paint::drawing::Drawn;
use crate::paint::mapping::{Mapped, map_at};
use crate::paint::{PaintOptions, stop_if_asked};
use crate::store::{Record, Resources, Sorted, Sorter, Spool, SpoolPeek, StoreError};

/// What a source triangle has at a vertex. 32 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Value {
    /// Bits of the squared distance; of numbers that are not negative they have the same order.
    pub distance: u64,
    /// The vertex.
    pub vertex: u32,
    /// The look.
    pub look: u32,
    /// The source triangle.
    pub source: u32,
    /// The texture coordinate.
    pub uv: [f32; 2],
    /// RGBA.
    pub colour: [u8; 4],
}

impl Value {
    /// How near it is; sources decide ties.
    pub fn nearness(&self) -> (u64, u32) {
        (self.distance, self.source)
    }
}

impl Record for Value {
    type Key = (u32, u32, u64, u32);
    fn key(&self) -> Self::Key {
        (self.vertex, self.look, self.distance, self.source)
    }
}

/// Answers all places that are asked.
pub fn pick_values(
    drawn: &Drawn,
    sources: &Spool<AttributeRecord>,
    options: &PaintOptions,
    resources: &Resources,
) -> Result<Values, StoreError> {
    let mut values = Sorter::<Value>::new(resources.scratch, resources.share_bytes / 3);
    let mut records = SpoolPeek::new(sources);
    let mut reader = drawn.places.reader(0, drawn.places.len());
    while let Some(places) = reader.next_block()? {
        stop_if_asked(resources)?;
        for place in places {
            records.pass_to(place.source.into());
            let Some(record) = records.peek()? else { continue };
            let Mapped { distance_squared, uv, colour } =
                map_at(DVec3::from(place.position), &record, options.cell);
            values.push(Value {
                distance: distance_squared.to_bits(),
                vertex: place.vertex,
                look: place.look,
                source: place.source,
                uv,
                colour,
            })?;
        }
    }
    Values::new(values.finish()?)
}

/// Values vertex by vertex.
pub struct Values {
    sorted: Sorted<Value>,
    next: Option<Value>,
}

impl Values {
    fn new(mut sorted: Sorted<Value>) -> Result<Self, StoreError> {
        let next = sorted.next()?;
        Ok(Self { sorted, next })
    }

    /// Replaces `values` by the nearest of each look of a vertex, by ascending look; vertices come
    /// in ascending order.
    pub fn take(&mut self, vertex: u32, values: &mut Vec<Value>) -> Result<(), StoreError> {
        values.clear();
        while let Some(value) = self.next.filter(|value| value.vertex <= vertex) {
            let is_known = values.last().is_some_and(|last: &Value| last.look == value.look);
            if value.vertex == vertex && !is_known {
                values.push(value);
            }
            self.next = self.sorted.next()?;
        }
        Ok(())
    }
}
