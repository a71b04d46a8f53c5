//! What vertices have besides a position, laid aside vertex by vertex: a normal, a texture
//! coordinate, a colour, each if it is asked for.
//!
//! Invariant: there is a record for every vertex in front of the last call; where nothing was
//! said of one, it looks up, lies at the origin of its image, and is white. Memory: one buffer.

use crate::io::Format;
use crate::io::error::IoError;
use crate::io::output::{Aside, VALUES};
use crate::io::polygon::WHITE;
use crate::mesh::{Attributes, SinkFile, VertexValues};
use crate::store::Scratch;

const UP: [f32; 3] = [0.0, 0.0, 1.0];

/// Where things are in a record.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ValuesLayout {
    pub(crate) has: Attributes,
}

impl ValuesLayout {
    const NORMAL_BYTES: u64 = 12;
    const UV_BYTES: u64 = 8;
    const COLOUR_BYTES: u64 = 4;

    pub(crate) fn uv_offset(self) -> u64 {
        if self.has.normals { Self::NORMAL_BYTES } else { 0 }
    }

    pub(crate) fn colour_offset(self) -> u64 {
        self.uv_offset() + if self.has.uvs { Self::UV_BYTES } else { 0 }
    }

    /// Bytes of a record: a multiple of four.
    pub(crate) fn stride(self) -> u64 {
        self.colour_offset() + if self.has.colours { Self::COLOUR_BYTES } else { 0 }
    }
}

/// Records of vertices, in a scratch file.
pub(crate) struct Values {
    layout: ValuesLayout,
    aside: Aside,
}

impl Values {
    /// None where nothing is asked for.
    pub(crate) fn create(scratch: &Scratch, wanted: Attributes) -> Result<Option<Self>, IoError> {
        Self::with(wanted, || Aside::create(scratch, VALUES))
    }

    pub(crate) fn reopen(
        scratch: &Scratch,
        wanted: Attributes,
        state: &SinkFile,
    ) -> Result<Option<Self>, IoError> {
        Self::with(wanted, || Aside::reopen(scratch, VALUES, state))
    }

    fn with(
        wanted: Attributes,
        open: impl FnOnce() -> Result<Aside, IoError>,
    ) -> Result<Option<Self>, IoError> {
        let has = wanted.and(Format::Glb.attributes());
        if !has.any() {
            return Ok(None);
        }
        Ok(Some(Self { layout: ValuesLayout { has }, aside: open()? }))
    }

    pub(crate) fn layout(&self) -> ValuesLayout {
        self.layout
    }

    pub(crate) fn stride(&self) -> u64 {
        self.layout.stride()
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.aside.bytes()
    }

    /// Records up to a number of vertices.
    pub(crate) fn fill(&mut self, vertices: u64) -> Result<(), IoError> {
        let there = self.aside.bytes() / self.stride();
        (there..vertices).try_for_each(|_| self.record(UP, [0.0; 2], WHITE))
    }

    /// Records of the last vertices of so many.
    pub(crate) fn push(&mut self, values: &VertexValues, vertices: u64) -> Result<(), IoError> {
        let there = self.aside.bytes() / self.stride();
        for at in 0..vertices.saturating_sub(there) as usize {
            self.record(
                values.normals.get(at).copied().unwrap_or(UP),
                values.uvs.get(at).copied().unwrap_or_default(),
                values.colours.get(at).copied().unwrap_or(WHITE),
            )?;
        }
        Ok(())
    }

    fn record(
        &mut self,
        normal: [f32; 3],
        [u, v]: [f32; 2],
        colour: [u8; 4],
    ) -> Result<(), IoError> {
        let has = self.layout.has;
        if has.normals {
            self.aside.write(bytemuck::bytes_of(&normal.map(f32::to_le_bytes)))?;
        }
        if has.uvs {
            // In images of glTF v goes down.
            self.aside.write(bytemuck::bytes_of(&[u, 1.0 - v].map(f32::to_le_bytes)))?;
        }
        if has.colours {
            self.aside.write(&colour)?;
        }
        Ok(())
    }

    /// How far the records go, for [`Values::reopen`], once there is one for each vertex.
    pub(crate) fn state(&mut self, vertices: u64) -> Result<SinkFile, IoError> {
        self.fill(vertices)?;
        self.aside.state()
    }

    pub(crate) fn into_aside(self) -> Aside {
        self.aside
    }
}
