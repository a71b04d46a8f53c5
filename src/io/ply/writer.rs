//! Writes binary little-endian PLY with `double` coordinates and `uint` indices.
//!
//! Faces wait in a scratch file until all vertices are there; the header has a fixed size and gets
//! its counts at the end. Memory: two buffers.

use std::path::Path;

use crate::io::error::IoError;
use crate::io::output::{Aside, FACES, Output};
use crate::mesh::{MeshSink, SinkState, SinkStats, SinkTriangles};
use crate::store::Scratch;

/// Room for any two counts.
const HEADER_BYTES: usize = 320;
/// Three coordinates.
const VERTEX_BYTES: usize = 24;
/// Length of the list and three indices.
const FACE_BYTES: usize = 13;
/// Vertices or faces that are handed on at a time.
const BLOCK: usize = 128;

/// Writes vertices at once and lays faces aside.
#[derive(Debug)]
pub(crate) struct PlyWriter {
    output: Output,
    faces: Aside,
    vertices: u64,
    triangles: u64,
}

impl PlyWriter {
    pub(crate) fn create(path: &Path, scratch: &Scratch) -> Result<Self, IoError> {
        let faces = Aside::create(scratch, FACES)?;
        let mut output = Output::create(path, scratch)?;
        output.write(&header(0, 0))?;
        Ok(Self { output, faces, vertices: 0, triangles: 0 })
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
        Ok(Self { output, faces, vertices, triangles })
    }
}

impl MeshSink for PlyWriter {
    type Error = IoError;

    fn needs_corners(&self) -> bool {
        false
    }

    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), IoError> {
        self.vertices += positions.len() as u64;
        let mut bytes = [0; BLOCK * VERTEX_BYTES];
        for block in positions.chunks(BLOCK) {
            let numbers = block.as_flattened().iter();
            for (number, bytes) in numbers.zip(bytes.as_chunks_mut::<8>().0) {
                *bytes = number.to_le_bytes();
            }
            self.output.write(&bytes[..block.len() * VERTEX_BYTES])?;
        }
        Ok(())
    }

    fn triangles(&mut self, triangles: &SinkTriangles) -> Result<(), IoError> {
        let SinkTriangles { indices, .. } = *triangles;
        self.triangles += indices.len() as u64;
        let mut bytes = [3; BLOCK * FACE_BYTES];
        for block in indices.chunks(BLOCK) {
            for (triangle, bytes) in block.iter().zip(bytes.as_chunks_mut::<FACE_BYTES>().0) {
                for (index, bytes) in triangle.iter().zip(bytes[1..].as_chunks_mut::<4>().0) {
                    *bytes = index.to_le_bytes();
                }
            }
            self.faces.write(&bytes[..block.len() * FACE_BYTES])?;
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
        let Self { mut output, faces, vertices, triangles } = *self;
        output.append(faces)?;
        output.patch(&header(vertices, triangles), 0)?;
        let file = output.finish()?;
        Ok(SinkStats { vertices, triangles, file })
    }
}

/// The header, filled up to its fixed size in a comment.
fn header(vertices: u64, triangles: u64) -> Vec<u8> {
    let head = "ply\nformat binary_little_endian 1.0\ncomment brickmend";
    let tail = format!(
        "\nelement vertex {vertices}\n\
         property double x\nproperty double y\nproperty double z\n\
         element face {triangles}\n\
         property list uchar uint vertex_indices\nend_header\n"
    );
    let room = HEADER_BYTES - tail.len();
    format!("{head:<room$}{tail}").into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_has_one_size_for_all_counts() {
        for count in [0, 7, u64::MAX] {
            let header = header(count, count);
            assert_eq!(header.len(), HEADER_BYTES);
            let text = String::from_utf8(header).expect("text");
            assert!(text.contains(&format!("\nelement vertex {count}\n")));
            assert!(text.ends_with("end_header\n"));
        }
    }
}
