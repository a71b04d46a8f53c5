//! Writes OBJ text, every coordinate as the shortest text that gives its `f64` back.
//!
//! Vertices and faces are written as they come: indices count from the start of the file. Memory:
//! one buffer.

use std::path::Path;

use crate::io::error::IoError;
use crate::io::numbers::{push_count, push_number};
use crate::io::output::Output;
use crate::mesh::{MeshSink, SinkState, SinkStats, SinkTriangles};
use crate::store::Scratch;

/// Writes `v` and `f` lines.
#[derive(Debug)]
pub(crate) struct ObjWriter {
    output: Output,
    text: Vec<u8>,
    vertices: u64,
    triangles: u64,
}

impl ObjWriter {
    pub(crate) fn create(path: &Path, scratch: &Scratch) -> Result<Self, IoError> {
        let mut output = Output::create(path, scratch)?;
        output.write(b"# brickmend\n")?;
        Ok(Self { output, text: Vec::new(), vertices: 0, triangles: 0 })
    }

    /// Goes on where an earlier writer was.
    pub(crate) fn reopen(
        path: &Path,
        scratch: &Scratch,
        state: &SinkState,
    ) -> Result<Self, IoError> {
        let output = Output::reopen(path, scratch, &state.output)?;
        Ok(Self { output, text: Vec::new(), vertices: state.vertices, triangles: state.triangles })
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
        let SinkTriangles { indices, .. } = *triangles;
        self.triangles += indices.len() as u64;
        for triangle in indices {
            self.text.clear();
            self.text.push(b'f');
            for &index in triangle {
                self.text.push(b' ');
                push_count(&mut self.text, u64::from(index) + 1);
            }
            self.text.push(b'\n');
            self.output.write(&self.text)?;
        }
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
