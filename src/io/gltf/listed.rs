//! All vertices of a scene, in the order in which the reader numbered them.
//!
//! In: the primitives whose vertices got numbers, in that order, with their places. Out: positions.
//! Those of points and lines that cannot be read are NaN: no triangle needs them. Memory: a share
//! for the list of primitives.

use bytemuck::{Pod, Zeroable};

use crate::io::error::IoError;
use crate::io::gltf::accessor::Field;
use crate::io::gltf::buffers::Buffers;
use crate::io::gltf::draco::decode;
use crate::io::gltf::model::{Model, NONE};
use crate::io::gltf::stream::{POSITIONS, place};
use crate::io::gltf::triangles::is_triangles;
use crate::io::listed::LISTED_POSITIONS;
use crate::mesh::Affine;
use crate::store::{Scratch, Table};

/// A primitive in a place.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Placed {
    primitive: u64,
    map: Affine,
}

/// What is being listed.
struct Open {
    field: Option<Field>,
    count: u64,
    map: Affine,
    next: u64,
}

/// See the module.
pub(crate) struct Listed {
    placed: Table<Placed>,
    next: u64,
    open: Option<Open>,
}

impl Listed {
    pub(crate) fn new(scratch: &Scratch, share_bytes: u64) -> Self {
        Self { placed: Table::new(scratch, share_bytes), next: 0, open: None }
    }

    /// Notes a primitive whose vertices got the next numbers.
    pub(crate) fn enter(&mut self, primitive: u64, map: &Affine) -> Result<(), IoError> {
        Ok(self.placed.push(Placed { primitive, map: *map })?)
    }

    /// Replaces `positions` by the next ones; `false` behind the last.
    pub(crate) fn next(
        &mut self,
        model: &mut Model,
        buffers: &mut Buffers,
        positions: &mut Vec<[f64; 3]>,
    ) -> Result<bool, IoError> {
        positions.clear();
        while (positions.len() as u64) < LISTED_POSITIONS {
            let Some(open) = self.open.as_mut().filter(|open| open.next < open.count) else {
                if self.next == self.placed.len() {
                    break;
                }
                let Placed { primitive, map } = self.placed.get(self.next)?;
                self.next += 1;
                self.open = Some(Open::of(model, buffers, primitive, map)?);
                continue;
            };
            let position = match open.field.filter(|field| open.next < field.count) {
                Some(field) => {
                    let [x, y, z, _] = field.get(model, buffers, open.next)?;
                    place(&open.map, [x, y, z])
                }
                None => [f64::NAN; 3],
            };
            open.next += 1;
            positions.push(position);
        }
        Ok(!positions.is_empty())
    }
}

impl Open {
    fn of(
        model: &mut Model,
        buffers: &mut Buffers,
        primitive: u64,
        map: Affine,
    ) -> Result<Self, IoError> {
        let record = model.primitive(primitive)?;
        let count = model.accessor(record.position)?.count;
        let is_packed = record.draco_view != NONE && is_triangles(record.mode);
        let field = match is_packed {
            true => decode(model, buffers, primitive).map(|decoded| decoded.position),
            false => Field::open(model, buffers, record.position, &POSITIONS),
        };
        let field = match field {
            Err(error) if error.is_input() => None,
            field => Some(field?),
        };
        Ok(Self { field, count, map, next: 0 })
    }
}
