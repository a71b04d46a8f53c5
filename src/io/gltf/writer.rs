//! Writes GLB: positions as `f32`, and the triangles of each material as a primitive.
//!
//! Vertices, what they have besides, and faces wait in scratch files. Once all are there, faces are
//! brought into the order of their surfaces, and then the file is written from front to back, with
//! the images of materials in use at its end. Memory: four buffers, and [`SORT_BYTES`] in the end.

use std::path::Path;

use bytemuck::{Pod, Zeroable};

use crate::io::error::IoError;
use crate::io::gltf::container::{BINARY, CHUNK_HEADER_BYTES, HEADER_BYTES, JSON, MAGIC, VERSION};
use crate::io::gltf::document::{Counts, Layout, write_document};
use crate::io::gltf::values::Values;
use crate::io::output::{Aside, FACES, Output, VERTICES};
use crate::io::palette::{Looks, Palette};
use crate::io::textures::Textures;
use crate::io::{Format, WriteOptions};
use crate::mesh::{
    CornerForm, MeshSink, SinkFile, SinkState, SinkStats, SinkTriangles, Surface, VertexValues,
};
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
pub(crate) struct GlbWriter {
    output: Output,
    scratch: Scratch,
    palette: Option<Palette>,
    looks: Looks,
    positions: Aside,
    values: Option<Values>,
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
        let asides = (Aside::create(scratch, VERTICES)?, Aside::create(scratch, FACES)?);
        let values = Values::create(scratch, options.attributes)?;
        let output = Output::create(path, scratch)?;
        Self::new(output, asides, values, (scratch, options, &SinkState::default()))
    }

    /// Goes on where an earlier writer was.
    pub(crate) fn reopen(
        path: &Path,
        scratch: &Scratch,
        options: &WriteOptions,
        state: &SinkState,
    ) -> Result<Self, IoError> {
        let output = Output::reopen(path, scratch, &state.output)?;
        let positions = Aside::reopen(scratch, VERTICES, &state.vertices_aside)?;
        let faces = Aside::reopen(scratch, FACES, &state.aside)?;
        let values = Values::reopen(scratch, options.attributes, &state.values_aside)?;
        Self::new(output, (positions, faces), values, (scratch, options, state))
    }

    fn new(
        output: Output,
        (positions, faces): (Aside, Aside),
        values: Option<Values>,
        (scratch, options, state): (&Scratch, &WriteOptions, &SinkState),
    ) -> Result<Self, IoError> {
        let palette = options.palette.clone();
        Ok(Self {
            output,
            scratch: scratch.clone(),
            looks: palette.as_ref().map(Palette::looks).transpose()?.unwrap_or_default(),
            palette,
            positions,
            values,
            faces,
            vertices: state.vertices,
            triangles: state.triangles,
        })
    }

    /// Refuses what no file can hold, before it is known how much else there will be.
    fn check_size(&self, front_bytes: u64) -> Result<(), IoError> {
        let triples = self.vertices.saturating_add(self.triangles);
        let bytes = triples.saturating_mul(TRIPLE_BYTES as u64).saturating_add(front_bytes);
        let stride = self.values.as_ref().map_or(0, Values::stride);
        let bytes = bytes.saturating_add(self.vertices.saturating_mul(stride));
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

    /// The images of materials that triangles have.
    fn textures(&self, counts: Option<&mut Counts>) -> Result<Textures, IoError> {
        let shows = self.values.as_ref().is_some_and(|values| values.layout().has.uvs);
        let (Some(palette), Some(counts), true) = (&self.palette, counts, shows) else {
            return Ok(Textures::none(&self.scratch));
        };
        Textures::find(palette, Format::Glb, &self.scratch, |material| {
            let is_known = u64::from(material) < counts.len();
            Ok(is_known && counts.get(material.into())? != [0; 2])
        })
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
        let front_bytes = json_end + CHUNK_HEADER_BYTES;
        self.check_size(front_bytes.saturating_add(layout.image_bytes))?;
        let json_bytes = (json_end - HEADER_BYTES - CHUNK_HEADER_BYTES) as u32;
        self.output.patch(&json_bytes.to_le_bytes(), HEADER_BYTES)?;
        let binary_bytes = layout.binary_bytes();
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

    fn corner_form(&self) -> CornerForm {
        if self.values.is_some() { CornerForm::OfVertices } else { CornerForm::None }
    }

    fn vertex_values(&mut self, values: &VertexValues) -> Result<(), IoError> {
        match &mut self.values {
            Some(own) => own.push(values, self.vertices),
            None => Ok(()),
        }
    }

    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), IoError> {
        if let Some(values) = &mut self.values {
            values.fill(self.vertices)?;
        }
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
        let indices = triangles.indices;
        self.triangles += indices.len() as u64;
        self.check_size(0)?;
        let surfaces = self.looks.materials_of(triangles.surfaces)?;
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
        let values_bytes = self.values.as_ref().map_or(0, Values::bytes);
        self.positions.bytes() + self.faces.bytes() + values_bytes
    }

    fn checkpoint(&mut self) -> Result<SinkState, IoError> {
        let values_aside = match &mut self.values {
            Some(values) => values.state(self.vertices)?,
            None => SinkFile::default(),
        };
        Ok(SinkState {
            vertices: self.vertices,
            triangles: self.triangles,
            output: self.output.state()?,
            aside: self.faces.state()?,
            vertices_aside: self.positions.state()?,
            values_aside,
        })
    }

    fn finish(mut self: Box<Self>) -> Result<SinkStats, IoError> {
        let bounds = self.bounds()?;
        let sorted = match &self.palette {
            Some(_) => Some(self.sort_faces()?),
            None => None,
        };
        let (sorter, mut counts) = sorted.unzip();
        let textures = self.textures(counts.as_mut())?;
        if let Some(values) = &mut self.values {
            values.fill(self.vertices)?;
        }
        let Self { vertices, triangles, .. } = *self;
        let values = self.values.as_ref().map(Values::layout).unwrap_or_default();
        let mut layout =
            Layout { vertices, triangles, bounds, counts, values, textures, image_bytes: 0 };
        self.write_front(&mut layout)?;
        let Self { mut output, positions, values, faces, .. } = *self;
        output.append(positions)?;
        if let Some(values) = values {
            output.append(values.into_aside())?;
        }
        match sorter {
            None => output.append(faces)?,
            Some(sorter) => {
                let mut sorted = sorter.finish()?;
                while let Some(face) = sorted.next()? {
                    output.write(face.indices.as_flattened())?;
                }
            }
        }
        write_images(&mut output, &mut layout.textures)?;
        let file = output.finish()?;
        Ok(SinkStats { vertices, triangles, file })
    }
}

/// Writes the bytes of all images, each up to a multiple of four.
fn write_images(output: &mut Output, textures: &mut Textures) -> Result<(), IoError> {
    for number in 0..textures.count() as u32 {
        let image = textures.image(number)?;
        textures.copy(&image, |block| output.write(block))?;
        let padding = image.bytes.next_multiple_of(4) - image.bytes;
        output.write(&[0; 3][..padding as usize])?;
    }
    Ok(())
}
