//! One primitive of a mesh at its place in the scene, triangle by triangle.

use crate::io::error::IoError;
use crate::io::gltf::accessor::{Demand, Field};
use crate::io::gltf::buffers::Buffers;
use crate::io::gltf::draco::decode;
use crate::io::gltf::materials;
use crate::io::gltf::model::{Model, NONE};
use crate::io::gltf::triangles::Mode;
use crate::io::polygon::WHITE;
use crate::mesh::TriangleBatch;
use crate::mesh::{Affine, IDENTITY, apply, mirrors};

pub(crate) const POSITIONS: Demand =
    Demand { what: "three numbers in an element", lanes: [3, 3], is_index: false, is_part: false };
const UVS: Demand = Demand { what: "two numbers in an element", lanes: [2, 2], ..POSITIONS };
const COLOURS: Demand = Demand {
    what: "three or four numbers in an element",
    lanes: [3, 4],
    is_part: true,
    ..POSITIONS
};
const INDICES: Demand =
    Demand { what: "a whole number in an element", lanes: [1, 1], is_index: true, ..POSITIONS };

/// A primitive that is being delivered.
pub(crate) struct Stream {
    mode: Mode,
    position: Field,
    indices: Option<Field>,
    uv: Option<Field>,
    uv_map: [[f32; 3]; 2],
    colour: Option<Field>,
    has_alpha: bool,
    /// Numbers of the same in the file.
    pub(crate) accessors: [u32; 4],
    pub(crate) material: u32,
    map: Affine,
    mirrors: bool,
    /// Number in the file of the vertex with index 0.
    pub(crate) first_vertex: u32,
    /// Triangles in all, and delivered.
    pub(crate) count: u64,
    pub(crate) next: u64,
    pub(crate) has_rest: bool,
    /// Whether its fields are no part of the file.
    pub(crate) is_packed: bool,
    /// Bytes that are counted while this is delivered.
    pub(crate) pending_bytes: u64,
}

/// Where a position is put; zeros keep their sign where nothing moves.
#[inline]
pub(crate) fn place(map: &Affine, position: [f64; 3]) -> [f64; 3] {
    if *map == IDENTITY { position } else { apply(map, position) }
}

impl Stream {
    /// The primitive of a number, if it has triangles.
    pub(crate) fn open(
        model: &mut Model,
        buffers: &mut Buffers,
        number: u64,
        map: Affine,
    ) -> Result<Option<Self>, IoError> {
        let record = model.primitive(number)?;
        let Some(mut mode) = Mode::of_code(record.mode).filter(|_| record.position != NONE) else {
            return Ok(None);
        };
        let uv_map = match record.material {
            NONE => materials::UV_IDENTITY,
            material => model.material(material)?.uv_map,
        };
        let mut open = |accessor: u32, demand: &Demand| match accessor {
            NONE => Ok(None),
            accessor => Field::open(model, buffers, accessor, demand).map(Some),
        };
        let mut packed_bytes = 0;
        let (position, indices, uv, colour) = if record.draco_view == NONE {
            let indices = open(record.indices, &INDICES)?;
            let (uv, colour) = (open(record.uv, &UVS)?, open(record.colour, &COLOURS)?);
            (open(record.position, &POSITIONS)?, indices, uv, colour)
        } else {
            let decoded = decode(model, buffers, number)?;
            mode = Mode::Triangles;
            packed_bytes = decoded.packed_bytes;
            (Some(decoded.position), Some(decoded.indices), decoded.uv, decoded.colour)
        };
        let Some(position) = position else { return Ok(None) };
        for (accessor, field) in [(record.uv, &uv), (record.colour, &colour)] {
            let count = field.as_ref().map_or(position.count, |field| field.count);
            if count < position.count {
                let expected = format!("an element for each of {} vertices", position.count);
                return Err(model.wrong(("accessor", accessor), expected, format!("{count}")));
            }
        }
        let corners = indices.map_or(position.count, |indices| indices.count);
        Ok(Some(Self {
            mode,
            position,
            indices,
            uv: uv.filter(|_| model.has_uvs),
            uv_map,
            has_alpha: match record.colour {
                NONE => false,
                _ if record.draco_view != NONE => true,
                colour => model.accessor(colour)?.lanes == 4,
            },
            colour,
            accessors: [record.position, record.indices, record.uv, record.colour],
            material: record.material,
            mirrors: mirrors(&map),
            map,
            first_vertex: 0,
            count: mode.triangles(corners),
            next: 0,
            has_rest: mode.has_rest(corners),
            is_packed: record.draco_view != NONE,
            pending_bytes: packed_bytes,
        }))
    }

    /// In the order of the accessors.
    pub(crate) fn fields(&self) -> [Option<Field>; 4] {
        [Some(self.position), self.indices, self.uv, self.colour]
    }

    /// Bytes of the file that were read for this, about.
    pub(crate) fn bytes_read(&self) -> u64 {
        let part = self.next as f64 / self.count.max(1) as f64;
        ((self.pending_bytes as f64 * part) as u64).min(self.pending_bytes)
    }

    /// The indices of the next triangle; `None` where one leads nowhere.
    #[inline]
    pub(crate) fn next_triangle(
        &mut self,
        model: &mut Model,
        buffers: &mut Buffers,
    ) -> Result<Option<[u32; 3]>, IoError> {
        let mut corners = self.mode.corners(self.next);
        self.next += 1;
        if let Some(indices) = &self.indices {
            for corner in &mut corners {
                *corner = indices.get(model, buffers, *corner)?[0] as u64;
            }
        }
        if corners.iter().any(|&corner| corner >= self.position.count) {
            return Ok(None);
        }
        if self.mirrors {
            corners.swap(1, 2);
        }
        // Vertices are numbered in 32 bits.
        Ok(Some(corners.map(|corner| corner as u32)))
    }

    /// Adds a triangle to the batch, but for what all of its primitive share.
    #[inline]
    pub(crate) fn push(
        &self,
        model: &mut Model,
        buffers: &mut Buffers,
        corners: [u32; 3],
        batch: &mut TriangleBatch,
    ) -> Result<(), IoError> {
        let mut positions = [[0.0; 3]; 3];
        for (position, &corner) in positions.iter_mut().zip(&corners) {
            let [x, y, z, _] = self.position.get(model, buffers, corner.into())?;
            *position = place(&self.map, [x, y, z]);
        }
        batch.corners.push(positions);
        batch.indices.push(corners.map(|corner| self.first_vertex + corner));
        if model.has_uvs {
            let mut uvs = [[0.0; 2]; 3];
            if let Some(field) = &self.uv {
                for (uv, &corner) in uvs.iter_mut().zip(&corners) {
                    let [u, v, ..] = field.get(model, buffers, corner.into())?;
                    *uv = materials::mapped(&self.uv_map, [u as f32, v as f32]);
                }
            }
            batch.uvs.push(uvs);
        }
        if model.has_colours {
            let mut colours = [WHITE; 3];
            if let Some(field) = &self.colour {
                for (colour, &corner) in colours.iter_mut().zip(&corners) {
                    *colour = self.channels(field.get(model, buffers, corner.into())?);
                }
            }
            batch.colours.push(colours);
        }
        Ok(())
    }

    /// A colour in bytes.
    fn channels(&self, mut lanes: [f64; 4]) -> [u8; 4] {
        if !self.has_alpha {
            lanes[3] = 1.0;
        }
        // The cast keeps what is outside of 0..255 at its ends.
        lanes.map(|lane| (lane * 255.0).round() as u8)
    }
}
