//! Writes OBJ text, every coordinate as the shortest text that gives its `f64` back.
//!
//! Vertices and faces are written as they come: indices count from the start of the file. The faces
//! of one call are grouped by material, and every group names its own. Memory: one buffer, the
//! triangles of one call, and the names of materials.

use std::path::Path;

use crate::io::WriteOptions;
use crate::io::error::IoError;
use crate::io::numbers::{push_count, push_number};
use crate::io::output::Output;
use crate::io::output_names::OutputNames;
use crate::mesh::{MeshSink, SinkState, SinkStats, SinkTriangles, Surface};
use crate::store::Scratch;

/// Writes `v`, `usemtl` and `f` lines.
pub(crate) struct ObjWriter {
    output: Output,
    /// Names of materials, where triangles have any.
    names: Option<OutputNames>,
    order: Vec<(Surface, u32)>,
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
        let names = options.palette.as_ref().map(|palette| OutputNames::new(palette, scratch));
        let SinkState { vertices, triangles, .. } = *state;
        let (order, text) = (Vec::new(), Vec::new());
        Ok(Self { output, names: names.transpose()?, order, text, vertices, triangles })
    }

    fn face(&mut self, triangle: [u32; 3]) -> Result<(), IoError> {
        self.text.clear();
        self.text.push(b'f');
        for index in triangle {
            self.text.push(b' ');
            push_count(&mut self.text, u64::from(index) + 1);
        }
        self.text.push(b'\n');
        self.output.write(&self.text)
    }
}

impl MeshSink for ObjWriter {
    type Error = IoError;

    fn needs_corners(&self) -> bool {
        false
    }

    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), IoError> {
        self.vertices += positions.len() as u64;
        for position in positions {
            self.text.clear();
            self.text.push(b'v');
            for &coordinate in position {
                self.text.push(b' ');
                push_number(&mut self.text, coordinate);
            }
            self.text.push(b'\n');
            self.output.write(&self.text)?;
        }
        Ok(())
    }

    fn triangles(&mut self, triangles: &SinkTriangles) -> Result<(), IoError> {
        let SinkTriangles { indices, surfaces, .. } = *triangles;
        self.triangles += indices.len() as u64;
        if self.names.is_none() {
            return indices.iter().try_for_each(|&triangle| self.face(triangle));
        }
        let mut order = std::mem::take(&mut self.order);
        order.clear();
        order.extend(surfaces.iter().copied().zip(0..));
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
            self.face(indices[triangle as usize])?;
        }
        self.order = order;
        Ok(())
    }

    fn bytes_so_far(&self) -> u64 {
        self.output.bytes()
    }

    fn checkpoint(&mut self) -> Result<SinkState, IoError> {
        let output = self.output.state()?;
        let Self { vertices, triangles, .. } = *self;
        Ok(SinkState { vertices, triangles, output, ..SinkState::default() })
    }

    fn finish(self: Box<Self>) -> Result<SinkStats, IoError> {
        let Self { output, vertices, triangles, .. } = *self;
        let file = output.finish()?;
        Ok(SinkStats { vertices, triangles, file })
    }
}
