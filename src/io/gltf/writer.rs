//! Writes GLB: positions as `f32`, and the triangles of each material as a primitive.
//!
//! Vertices and faces wait in scratch files. Once all are there, faces are brought into the order
//! of their surfaces, and then the file is written from front to back. Memory: three buffers, and
//! [`SORT_BYTES`] in the end.

use std::path::Path;

use bytemuck::{Pod, Zeroable};

use crate::io::WriteOptions;
use crate::io::error::IoError;
use crate::io::gltf::container::{BINARY, CHUNK_HEADER_BYTES, HEADER_BYTES, JSON, MAGIC, VERSION};
use crate::io::gltf::document::{Counts, Layout, write_document};
use crate::io::output::{Aside, FACES, Output, VERTICES};
use crate::io::palette::Palette;
use crate::mesh::{MeshSink, SinkState, SinkStats, SinkTriangles, Surface};
use crate::store::{Record, Scratch, Sorter};

/// For the order of the faces.
const SORT_BYTES: u64 = 4 << 20;
/// For the numbers of faces of each material.
const COUNT_BYTES: u64 = 64 << 10;
/// Three coordinates or three indices.
const TRIPLE_BYTES: usize = 12;
/// Vertices or faces that are handed on at a time.
const BLOCK: usize = 128;
/// Where the header has the size of the file.
const SIZE_OFFSET: u64 = 8;
/// Sizes are numbers of 32 bits.
const MOST_BYTES: u64 = u32::MAX as u64;

/// Lays vertices and faces aside, the latter with their surfaces if they have any.
#[derive(Debug)]
pub(crate) struct GlbWriter {
    output: Output,
    scratch: Scratch,
    palette: Option<Palette>,
    positions: Aside,
    faces: Aside,
    vertices: u64,
    triangles: u64,
}

/// A face with its place in the file.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Face {
    /// The number of the material, twice, and 1 for a patch.
    surface: u32,
    /// Faces of a surface stay in order.
    number: u32,
    indices: [[u8; 4]; 3],
}

impl Record for Face {
    type Key = (u32, u32);

    fn key(&self) -> (u32, u32) {
        (self.surface, self.number)
    }
}

impl GlbWriter {
    pub(crate) fn create(
        path: &Path,
        scratch: &Scratch,
        options: &WriteOptions,
    ) -> Result<Self, IoError> {
        Ok(Self {
            positions: Aside::create(scratch, VERTICES)?,
            faces: Aside::create(scratch, FACES)?,
            output: Output::create(path, scratch)?,
            scratch: scratch.clone(),
            palette: options.palette.clone(),
            vertices: 0,
            triangles: 0,
        })
    }

    /// Goes on where an earlier writer was.
    pub(crate) fn reopen(
        path: &Path,
        scratch: &Scratch,
        options: &WriteOptions,
        state: &SinkState,
    ) -> Result<Self, IoError> {
        Ok(Self {
            output: Output::reopen(path, scratch, &state.output)?,
            positions: Aside::reopen(scratch, VERTICES, &state.vertices_aside)?,
            faces: Aside::reopen(scratch, FACES, &state.aside)?,
            scratch: scratch.clone(),
            palette: options.palette.clone(),
            vertices: state.vertices,
            triangles: state.triangles,
        })
    }

    /// Refuses what no file can hold, before it is known how much else there will be.
    fn check_size(&self, front_bytes: u64) -> Result<(), IoError> {
        let triples = self.vertices.saturating_add(self.triangles);
        let bytes = triples.saturating_mul(TRIPLE_BYTES as u64).saturating_add(front_bytes);
        if bytes <= MOST_BYTES {
            return Ok(());
        }
        let path = self.output.path().to_path_buf();
        Err(IoError::TooLarge { path, what: "bytes", limit: MOST_BYTES })
    }

    /// The box of the positions as they are written.
    fn bounds(&mut self) -> Result<[[f32; 3]; 2], IoError> {
        let [mut low, mut high] = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
        let mut axis = 0;
        self.positions.for_each_block(|block| {
            for bytes in block.as_chunks::<4>().0 {
                let coordinate = f32::from_le_bytes(*bytes);
                low[axis] = low[axis].min(coordinate);
                high[axis] = high[axis].max(coordinate);
                axis = (axis + 1) % 3;
            }
            Ok(())
        })?;
        Ok([low, high])
    }

    /// Hands the faces to a sorter, and counts those of each surface.
    fn sort_faces(&mut self) -> Result<(Sorter<Face>, Counts), IoError> {
        let mut sorter = Sorter::<Face>::new(&self.scratch, SORT_BYTES);
        let mut counts = Counts::new(&self.scratch, COUNT_BYTES);
        let mut number = 0;
        self.faces.for_each_block(|block| {
            for face in block.as_chunks::<4>().0.as_chunks::<4>().0 {
                let [a, b, c, surface] = *face;
                let surface = Surface::from_bits(u32::from_le_bytes(surface));
                let (material, lane) = (surface.material(), usize::from(surface.is_patch()));
                while counts.len() <= u64::from(material) {
                    counts.push([0; 2])?;
                }
                let mut count = counts.get(material.into())?;
                count[lane] += 1;
                counts.set(material.into(), count)?;
                let surface = 2 * material + lane as u32;
                sorter.push(Face { surface, number, indices: [a, b, c] })?;
                number += 1;
            }
            Ok(())
        })?;
        Ok((sorter, counts))
    }

    /// Writes the header and the JSON; sizes are put in once they are known.
    fn write_front(&mut self, layout: &mut Layout) -> Result<(), IoError> {
        self.output.write(MAGIC)?;
        self.output.write(&VERSION.to_le_bytes())?;
        self.output.write(&[0; 8])?;
        self.output.write(JSON)?;
        write_document(&mut self.output, layout, self.palette.as_ref())?;
        while !self.output.bytes().is_multiple_of(4) {
            self.output.write(b" ")?;
        }
        let json_end = self.output.bytes();
        self.check_size(json_end + CHUNK_HEADER_BYTES)?;
        let json_bytes = (json_end - HEADER_BYTES - CHUNK_HEADER_BYTES) as u32;
        self.output.patch(&json_bytes.to_le_bytes(), HEADER_BYTES)?;
        let binary_bytes = layout.vertex_bytes() + layout.index_bytes();
        let mut size_bytes = json_end as u32;
        if binary_bytes > 0 {
            size_bytes += CHUNK_HEADER_BYTES as u32 + binary_bytes as u32;
            self.output.write(&(binary_bytes as u32).to_le_bytes())?;
            self.output.write(BINARY)?;
        }
        self.output.patch(&size_bytes.to_le_bytes(), SIZE_OFFSET)
    }
}

impl MeshSink for GlbWriter {
    type Error = IoError;

    fn needs_corners(&self) -> bool {
        false
    }

    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), IoError> {
        self.vertices += positions.len() as u64;
        self.check_size(0)?;
        let mut bytes = [0; BLOCK * TRIPLE_BYTES];
        for block in positions.chunks(BLOCK) {
            let numbers = block.as_flattened().iter();
            for (&number, bytes) in numbers.zip(bytes.as_chunks_mut::<4>().0) {
                *bytes = (number as f32).to_le_bytes();
            }
            self.positions.write(&bytes[..block.len() * TRIPLE_BYTES])?;
        }
        Ok(())
    }

    fn triangles(&mut self, triangles: &SinkTriangles) -> Result<(), IoError> {
        let SinkTriangles { indices, surfaces, .. } = *triangles;
        self.triangles += indices.len() as u64;
        self.check_size(0)?;
        for (at, triangle) in indices.iter().enumerate() {
            let mut bytes = [0; TRIPLE_BYTES + 4];
            let surface = surfaces.get(at).copied().unwrap_or_default();
            let numbers = triangle.iter().copied().chain([surface.bits()]);
            for (number, bytes) in numbers.zip(bytes.as_chunks_mut::<4>().0) {
                *bytes = number.to_le_bytes();
            }
            let length = if self.palette.is_some() { TRIPLE_BYTES + 4 } else { TRIPLE_BYTES };
            self.faces.write(&bytes[..length])?;
        }
        Ok(())
    }

    fn bytes_so_far(&self) -> u64 {
        self.positions.bytes() + self.faces.bytes()
    }

    fn checkpoint(&mut self) -> Result<SinkState, IoError> {
        Ok(SinkState {
            vertices: self.vertices,
            triangles: self.triangles,
            output: self.output.state()?,
            aside: self.faces.state()?,
            vertices_aside: self.positions.state()?,
        })
    }

    fn finish(mut self: Box<Self>) -> Result<SinkStats, IoError> {
        let bounds = self.bounds()?;
        let sorted = match &self.palette {
            Some(_) => Some(self.sort_faces()?),
            None => None,
        };
        let (sorter, counts) = sorted.unzip();
        let Self { vertices, triangles, .. } = *self;
        self.write_front(&mut Layout { vertices, triangles, bounds, counts })?;
        let Self { mut output, positions, faces, .. } = *self;
        output.append(positions)?;
        match sorter {
            None => output.append(faces)?,
            Some(sorter) => {
                let mut sorted = sorter.finish()?;
                while let Some(face) = sorted.next()? {
                    output.write(face.indices.as_flattened())?;
                }
            }
        }
        let file = output.finish()?;
        Ok(SinkStats { vertices, triangles, file })
    }
}
