//! Writes OFF as text, every coordinate as the shortest text that gives its `f64` back.
//!
//! Faces wait in a scratch file until all vertices are there; the counts have room in the header
//! and are patched at the end. Memory: two buffers.

use std::path::Path;

use crate::io::error::IoError;
use crate::io::numbers::{push_count, push_number};
use crate::io::output::{Aside, FACES, Output};
use crate::mesh::{MeshSink, SinkState, SinkStats, SinkTriangles};
use crate::store::Scratch;

/// Writes vertices at once and lays faces aside.
#[derive(Debug)]
pub(crate) struct OffWriter {
    output: Output,
    faces: Aside,
    text: Vec<u8>,
    vertices: u64,
    triangles: u64,
}

impl OffWriter {
    pub(crate) fn create(path: &Path, scratch: &Scratch) -> Result<Self, IoError> {
        let faces = Aside::create(scratch, FACES)?;
        let mut output = Output::create(path, scratch)?;
        output.write(&header(0, 0))?;
        Ok(Self { output, faces, text: Vec::new(), vertices: 0, triangles: 0 })
    }

    /// Goes on where an earlier writer was.
    pub(crate) fn reopen(
        path: &Path,
        scratch: &Scratch,
        state: &SinkState,
    ) -> Result<Self, IoError> {
        let output = Output::reopen(path, scratch, &state.output)?;
        let faces = Aside::reopen(scratch, FACES, &state.aside)?;
        let SinkState { vertices, triangles, .. } = *state;
        Ok(Self { output, faces, text: Vec::new(), vertices, triangles })
    }
}

impl MeshSink for OffWriter {
    type Error = IoError;

    fn needs_corners(&self) -> bool {
        false
    }

    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), IoError> {
        self.vertices += positions.len() as u64;
        for position in positions {
            self.text.clear();
            for (axis, &coordinate) in position.iter().enumerate() {
                push_number(&mut self.text, coordinate);
                self.text.push(if axis < 2 { b' ' } else { b'\n' });
            }
            self.output.write(&self.text)?;
        }
        Ok(())
    }

    fn triangles(&mut self, triangles: &SinkTriangles) -> Result<(), IoError> {
        let SinkTriangles { indices, .. } = *triangles;
        self.triangles += indices.len() as u64;
        for triangle in indices {
            self.text.clear();
            self.text.push(b'3');
            for &index in triangle {
                self.text.push(b' ');
                push_count(&mut self.text, u64::from(index));
            }
            self.text.push(b'\n');
            self.faces.write(&self.text)?;
        }
        Ok(())
    }

    fn bytes_so_far(&self) -> u64 {
        self.output.bytes() + self.faces.bytes()
    }

    fn checkpoint(&mut self) -> Result<SinkState, IoError> {
        let (output, aside) = (self.output.state()?, self.faces.state()?);
        let Self { vertices, triangles, .. } = *self;
        Ok(SinkState { vertices, triangles, output, aside, ..SinkState::default() })
    }

    fn finish(self: Box<Self>) -> Result<SinkStats, IoError> {
        let Self { mut output, faces, vertices, triangles, .. } = *self;
        output.append(faces)?;
        output.patch(&header(vertices, triangles), 0)?;
        let file = output.finish()?;
        Ok(SinkStats { vertices, triangles, file })
    }
}

/// Keyword and counts in a line of fixed length.
fn header(vertices: u64, triangles: u64) -> Vec<u8> {
    format!("OFF\n{:<43}\n", format!("{vertices} {triangles} 0")).into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_has_one_size_for_all_counts() {
        assert_eq!(header(0, 0).len(), header(u64::MAX, u64::MAX).len());
        assert!(header(u64::MAX, u64::MAX).ends_with(b" 0\n"));
    }
}
