//! Writes OBJ text, every number as the shortest text that gives its bits back; parts are objects
//! (`o`), whose names are told apart.
//!
//! Vertices, lists and faces are written as they come: indices count from the start of the file.
//! The faces of one call are grouped by material, and every group names its own. Colours stand
//! behind positions, in steps of 1/10000, without their alpha. Memory: one buffer, the vertices or
//! triangles of one call, and the names of materials.

use std::path::Path;

use crate::io::error::IoError;
use crate::io::numbers::{push_count, push_number, push_single};
use crate::io::output::Output;
use crate::io::output_names::{OutputNames, PartNames};
use crate::io::palette::LookMap;
use crate::io::polygon::WHITE;
use crate::io::{Format, WriteOptions};
use crate::mesh::{
    Attributes, CornerForm, MeshSink, SinkState, SinkStats, SinkTriangles, Surface, VertexValues,
};
use crate::store::Scratch;

/// Writes `v`, `vt`, `vn`, `usemtl` and `f` lines.
pub(crate) struct ObjWriter {
    output: Output,
    attributes: Attributes,
    /// Names of materials, where triangles have any.
    names: Option<OutputNames>,
    part_names: PartNames,
    looks: LookMap,
    order: Vec<(Surface, u32)>,
    /// Vertices of the last call, while their colours may come.
    pending: Vec<[f64; 3]>,
    text: Vec<u8>,
    vertices: u64,
    triangles: u64,
}

impl ObjWriter {
    pub(crate) fn create(
        path: &Path,
        scratch: &Scratch,
        options: &WriteOptions,
    ) -> Result<Self, IoError> {
        let mut output = Output::create(path, scratch)?;
        output.write(b"# brickmend\n")?;
        if options.palette.is_some() {
            output.write(format!("mtllib {}\n", options.library).as_bytes())?;
        }
        Self::new(output, scratch, options, &SinkState::default())
    }

    /// Goes on where an earlier writer was.
    pub(crate) fn reopen(
        path: &Path,
        scratch: &Scratch,
        options: &WriteOptions,
        state: &SinkState,
    ) -> Result<Self, IoError> {
        Self::new(Output::reopen(path, scratch, &state.output)?, scratch, options, state)
    }

    fn new(
        output: Output,
        scratch: &Scratch,
        options: &WriteOptions,
        state: &SinkState,
    ) -> Result<Self, IoError> {
        let palette = options.palette.as_ref();
        let names = palette.map(|palette| OutputNames::new(palette, scratch)).transpose()?;
        let looks = palette.map(|palette| palette.looks()).transpose()?.unwrap_or_default();
        let SinkState { vertices, triangles, .. } = *state;
        Ok(Self {
            output,
            attributes: options.attributes.and(Format::Obj.attributes()),
            names,
            part_names: PartNames::new(scratch),
            looks,
            order: Vec::new(),
            pending: Vec::new(),
            text: Vec::new(),
            vertices,
            triangles,
        })
    }

    /// A line of a keyword and numbers.
    fn line<T: Copy>(
        &mut self,
        keyword: &[u8],
        numbers: &[T],
        push: fn(&mut Vec<u8>, T),
    ) -> Result<(), IoError> {
        self.text.clear();
        self.text.extend_from_slice(keyword);
        for &number in numbers {
            self.text.push(b' ');
            push(&mut self.text, number);
        }
        self.text.push(b'\n');
        self.output.write(&self.text)
    }

    /// Writes the vertices that wait, white where no colour came.
    fn write_pending(&mut self, colours: &[[u8; 4]]) -> Result<(), IoError> {
        let pending = std::mem::take(&mut self.pending);
        for (at, &[x, y, z]) in pending.iter().enumerate() {
            let [red, green, blue, _] = colours.get(at).copied().unwrap_or(WHITE).map(channel);
            self.line(b"v", &[x, y, z, red, green, blue], push_number)?;
        }
        self.pending = pending;
        self.pending.clear();
        Ok(())
    }

    fn face(&mut self, triangles: &SinkTriangles, at: usize) -> Result<(), IoError> {
        let uvs = triangles.uvs.numbers.get(at).filter(|_| self.attributes.uvs);
        let normals = triangles.normals.numbers.get(at).filter(|_| self.attributes.normals);
        self.text.clear();
        self.text.push(b'f');
        for (corner, &index) in triangles.indices[at].iter().enumerate() {
            self.text.push(b' ');
            push_count(&mut self.text, u64::from(index) + 1);
            if uvs.is_some() || normals.is_some() {
                self.text.push(b'/');
            }
            if let Some(uvs) = uvs {
                push_count(&mut self.text, u64::from(uvs[corner]) + 1);
            }
            if let Some(normals) = normals {
                self.text.push(b'/');
                push_count(&mut self.text, u64::from(normals[corner]) + 1);
            }
        }
        self.text.push(b'\n');
        self.output.write(&self.text)
    }
}

/// A channel with no more digits than give it back.
fn channel(byte: u8) -> f64 {
    (f64::from(byte) / 255.0 * 1e4).round() / 1e4
}

impl MeshSink for ObjWriter {
    type Error = IoError;

    fn needs_corners(&self) -> bool {
        false
    }

    fn corner_form(&self) -> CornerForm {
        if self.attributes.any() { CornerForm::OfCorners } else { CornerForm::None }
    }

    fn begin_part(&mut self, number: u32, name: &str) -> Result<(), IoError> {
        self.write_pending(&[])?;
        let name = self.part_names.name(number, name)?;
        self.output.write(format!("o {name}\n").as_bytes())
    }

    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), IoError> {
        self.vertices += positions.len() as u64;
        if self.attributes.colours {
            self.write_pending(&[])?;
            self.pending.extend_from_slice(positions);
            return Ok(());
        }
        positions.iter().try_for_each(|position| self.line(b"v", position, push_number))
    }

    fn vertex_values(&mut self, values: &VertexValues) -> Result<(), IoError> {
        self.write_pending(values.colours)
    }

    fn list_uvs(&mut self, uvs: &[[f32; 2]]) -> Result<(), IoError> {
        let uvs = if self.attributes.uvs { uvs } else { &[] };
        uvs.iter().try_for_each(|uv| self.line(b"vt", uv, push_single))
    }

    fn list_normals(&mut self, normals: &[[f32; 3]]) -> Result<(), IoError> {
        let normals = if self.attributes.normals { normals } else { &[] };
        normals.iter().try_for_each(|normal| self.line(b"vn", normal, push_single))
    }

    fn triangles(&mut self, triangles: &SinkTriangles) -> Result<(), IoError> {
        self.write_pending(&[])?;
        let count = triangles.indices.len();
        self.triangles += count as u64;
        if self.names.is_none() {
            return (0..count).try_for_each(|at| self.face(triangles, at));
        }
        let mut order = std::mem::take(&mut self.order);
        order.clear();
        order.extend(self.looks.materials_of(triangles.surfaces)?.iter().copied().zip(0..));
        order.sort_unstable();
        let mut named = None;
        for &(surface, triangle) in &order {
            if named != Some(surface)
                && let Some(names) = &mut self.names
            {
                let line = format!("usemtl {}\n", names.name(surface)?);
                self.output.write(line.as_bytes())?;
                named = Some(surface);
            }
            self.face(triangles, triangle as usize)?;
        }
        self.order = order;
        Ok(())
    }

    fn bytes_so_far(&self) -> u64 {
        self.output.bytes()
    }

    fn checkpoint(&mut self) -> Result<SinkState, IoError> {
        self.write_pending(&[])?;
        let output = self.output.state()?;
        let Self { vertices, triangles, .. } = *self;
        Ok(SinkState { vertices, triangles, output, ..SinkState::default() })
    }

    fn finish(mut self: Box<Self>) -> Result<SinkStats, IoError> {
        self.write_pending(&[])?;
        let Self { output, vertices, triangles, .. } = *self;
        let file = output.finish()?;
        Ok(SinkStats { vertices, triangles, file })
    }
}
