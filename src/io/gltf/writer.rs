//! Writes GLB: positions as `f32`, a mesh for each part, and in it the triangles of each material
//! as a primitive.
//!
//! Vertices, what they have besides, and faces wait in scratch files. Once all are there, faces are
//! brought into the order of their surfaces, and then the file is written from front to back, with
//! the images of materials in use at its end. Memory: four buffers, and [`SORT_BYTES`] in the end.

use std::path::Path;

use bytemuck::{Pod, Zeroable};

use crate::io::error::IoError;
use crate::io::gltf::container::{BINARY, CHUNK_HEADER_BYTES, HEADER_BYTES, JSON, MAGIC, VERSION};
use crate::io::gltf::document::{Counts, Group, Layout, PartShape, write_document};
use crate::io::gltf::values::Values;
use crate::io::output::{Aside, FACES, Output, VERTICES};
use crate::io::palette::{LookMap, Palette};
use crate::io::parts_written::{Extent, PartsWritten};
use crate::io::scene::SceneTree;
use crate::io::textures::Textures;
use crate::io::{Format, WriteOptions};
use crate::mesh::{
    CornerForm, LengthUnit, MeshSink, SinkFile, SinkState, SinkStats, SinkTriangles, Surface,
    VertexValues,
};
use crate::store::{Record, Scratch, Sorter, StoreError, Table};

/// For the order of the faces.
const SORT_BYTES: u64 = 4 << 20;
/// For the numbers of faces of each material.
const COUNT_BYTES: u64 = 64 << 10;
/// For what is known of parts.
const SHAPE_BYTES: u64 = 64 << 10;
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
    looks: LookMap,
    positions: Aside,
    values: Option<Values>,
    faces: Aside,
    parts: PartsWritten,
    scene: Option<SceneTree>,
    metres: f64,
    vertices: u64,
    triangles: u64,
}

/// A face with its place in the file.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Face {
    part: u32,
    /// The number of the material, twice, and 1 for a patch.
    surface: u32,
    /// Faces of a surface stay in order.
    number: u32,
    indices: [[u8; 4]; 3],
}

impl Record for Face {
    type Key = (u32, u32, u32);

    fn key(&self) -> Self::Key {
        (self.part, self.surface, self.number)
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
            parts: PartsWritten::new(scratch),
            scene: options.scene.clone(),
            metres: options.unit.unwrap_or(LengthUnit::Meter).metres(),
            vertices: state.vertices,
            triangles: state.triangles,
        })
    }

    fn extent(&self) -> Extent {
        let Self { vertices, triangles, .. } = *self;
        Extent { vertices, triangles, bytes: self.faces.bytes() }
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

    /// The boxes of the positions of all parts, as they are written.
    fn shapes(&mut self) -> Result<Table<PartShape>, IoError> {
        let mut shapes = Table::new(&self.scratch, SHAPE_BYTES);
        let totals = self.extent();
        let [mut low, mut high] = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
        let (mut axis, mut vertex) = (0, 0);
        let mut end = self.parts.get(0, totals)?.vertices.end;
        let parts = &mut self.parts;
        let shape = |low, high| PartShape { first_group: 0, end_group: 0, low, high };
        self.positions.for_each_block(|block| {
            for bytes in block.as_chunks::<4>().0 {
                while vertex == end {
                    shapes.push(shape(low, high))?;
                    end = parts.get(shapes.len(), totals)?.vertices.end;
                    [low, high] = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
                }
                let coordinate = f32::from_le_bytes(*bytes);
                low[axis] = low[axis].min(coordinate);
                high[axis] = high[axis].max(coordinate);
                axis = (axis + 1) % 3;
                vertex += u64::from(axis == 0);
            }
            Ok(())
        })?;
        while shapes.len() < parts.len() {
            shapes.push(shape(low, high))?;
        }
        Ok(shapes)
    }

    /// Hands the faces to a sorter, and counts those of each surface.
    fn sort_faces(
        &mut self,
        shapes: &mut Table<PartShape>,
    ) -> Result<(Sorter<Face>, Table<Group>, Counts), IoError> {
        let mut sorter = Sorter::<Face>::new(&self.scratch, SORT_BYTES);
        let mut groups = Table::new(&self.scratch, SHAPE_BYTES);
        let mut counts = Counts::new(&self.scratch, COUNT_BYTES);
        let mut own = Counts::new(&self.scratch, COUNT_BYTES);
        let (mut number, mut part) = (0, 0);
        let totals = self.extent();
        let mut end = self.parts.get(0, totals)?.triangles.end;
        let (scratch, parts) = (&self.scratch, &mut self.parts);
        self.faces.for_each_block(|block| {
            for face in block.as_chunks::<4>().0.as_chunks::<4>().0 {
                while number == end {
                    let whole = std::mem::replace(&mut own, Counts::new(scratch, COUNT_BYTES));
                    close_part((part, whole), shapes, &mut groups, &mut counts)?;
                    part += 1;
                    end = parts.get(part, totals)?.triangles.end;
                }
                let [a, b, c, surface] = *face;
                let surface = Surface::from_bits(u32::from_le_bytes(surface));
                let (material, lane) = (surface.material(), usize::from(surface.is_patch()));
                add(&mut own, material, lane, 1)?;
                let surface = 2 * material + lane as u32;
                let (part, number_in_file) = (part as u32, number as u32);
                let indices = [a, b, c];
                sorter.push(Face { part, surface, number: number_in_file, indices })?;
                number += 1;
            }
            Ok(())
        })?;
        close_part((part, own), shapes, &mut groups, &mut counts)?;
        Ok((sorter, groups, counts))
    }

    /// One group for each part that has triangles.
    fn whole_parts(&mut self, shapes: &mut Table<PartShape>) -> Result<Table<Group>, IoError> {
        let mut groups = Table::new(&self.scratch, SHAPE_BYTES);
        let whole = self.extent();
        for part in 0..self.parts.len() {
            let triangles = self.parts.get(part, whole)?.triangles;
            let (first_group, triangles) = (groups.len(), triangles.end - triangles.start);
            if triangles > 0 {
                groups.push(Group { triangles, material: 0, lane: 0 })?;
            }
            let shape = shapes.get(part)?;
            shapes.set(part, PartShape { first_group, end_group: groups.len(), ..shape })?;
        }
        Ok(groups)
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

    fn begin_part(&mut self, number: u32, name: &str) -> Result<(), IoError> {
        Ok(self.parts.begin((number, name), self.extent())?)
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
        let first_vertex = self.parts.first_vertex()? as u32;
        let surfaces = self.looks.materials_of(triangles.surfaces)?;
        for (at, triangle) in indices.iter().enumerate() {
            let mut bytes = [0; TRIPLE_BYTES + 4];
            let surface = surfaces.get(at).copied().unwrap_or_default();
            let in_part = triangle.map(|index| index - first_vertex);
            let numbers = in_part.into_iter().chain([surface.bits()]);
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
        self.parts.begin_only()?;
        let mut shapes = self.shapes()?;
        let (sorter, groups, mut counts) = match &self.palette {
            Some(_) => {
                let (sorter, groups, counts) = self.sort_faces(&mut shapes)?;
                (Some(sorter), groups, Some(counts))
            }
            None => (None, self.whole_parts(&mut shapes)?, None),
        };
        let textures = self.textures(counts.as_mut())?;
        if let Some(values) = &mut self.values {
            values.fill(self.vertices)?;
        }
        let mut layout = Layout {
            vertices: self.vertices,
            triangles: self.triangles,
            parts: std::mem::replace(&mut self.parts, PartsWritten::new(&self.scratch)),
            shapes,
            groups,
            counts,
            values: self.values.as_ref().map(Values::layout).unwrap_or_default(),
            textures,
            image_bytes: 0,
            scene: self.scene.take(),
            metres: self.metres,
            scratch: self.scratch.clone(),
        };
        self.write_front(&mut layout)?;
        let Self { mut output, positions, values, faces, vertices, triangles, .. } = *self;
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

/// Counts triangles of a surface.
fn add(counts: &mut Counts, material: u32, lane: usize, triangles: u64) -> Result<(), StoreError> {
    while counts.len() <= u64::from(material) {
        counts.push([0; 2])?;
    }
    let mut count = counts.get(material.into())?;
    count[lane] += triangles;
    counts.set(material.into(), count)
}

/// Enters the surfaces of a part, all of whose triangles were counted.
fn close_part(
    (part, mut own): (u64, Counts),
    shapes: &mut Table<PartShape>,
    groups: &mut Table<Group>,
    counts: &mut Counts,
) -> Result<(), StoreError> {
    let first_group = groups.len();
    for material in 0..own.len() {
        for (lane, triangles) in own.get(material)?.into_iter().enumerate() {
            if triangles > 0 {
                let material = material as u32;
                add(counts, material, lane, triangles)?;
                groups.push(Group { triangles, material, lane: lane as u32 })?;
            }
        }
    }
    let shape = shapes.get(part)?;
    shapes.set(part, PartShape { first_group, end_group: groups.len(), ..shape })
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
