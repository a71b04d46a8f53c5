//! Writes binary little-endian PLY with `double` coordinates and `uint` indices.
//!
//! Faces wait in a scratch file until all vertices are there; the head of the header has a fixed
//! size and gets its counts at the end. Where there are materials, each face has the number of its
//! own and its colour; comments of the header say what the numbers stand for. Memory: two buffers,
//! and the colours, spilled beyond a share.

use std::path::Path;

use crate::io::error::IoError;
use crate::io::output::{Aside, FACES, Output};
use crate::io::output_names::OutputNames;
use crate::io::{Palette, WriteOptions};
use crate::mesh::{MeshSink, SinkState, SinkStats, SinkTriangles, Surface};
use crate::store::{Scratch, Table};

/// Room for any two counts.
const HEAD_BYTES: usize = 448;
/// Three coordinates.
const VERTEX_BYTES: usize = 24;
/// Length of the list and three indices.
const FACE_BYTES: usize = 13;
/// Number of the material, colour, and whether it is a patch.
const SURFACE_BYTES: usize = 9;
/// Vertices or faces that are handed on at a time.
const BLOCK: usize = 128;
/// Memory for colours.
const COLOUR_SHARE_BYTES: u64 = 64 << 10;

/// Writes vertices at once and lays faces aside.
pub(crate) struct PlyWriter {
    output: Output,
    faces: Aside,
    /// Colours by material, where faces have any.
    colours: Option<Table<[u8; 4]>>,
    vertices: u64,
    triangles: u64,
}

impl PlyWriter {
    pub(crate) fn create(
        path: &Path,
        scratch: &Scratch,
        options: &WriteOptions,
    ) -> Result<Self, IoError> {
        let faces = Aside::create(scratch, FACES)?;
        let mut output = Output::create(path, scratch)?;
        output.write(&head(0, 0, options.palette.is_some()))?;
        if let Some(palette) = &options.palette {
            let mut names = OutputNames::new(palette, scratch)?;
            palette.for_each(|number, _| {
                let name = names.name(Surface::new(number, false))?;
                output.write(format!("comment material {number} {name}\n").as_bytes())
            })?;
        }
        output.write(b"end_header\n")?;
        let colours = colours_of(options, scratch)?;
        Ok(Self { output, faces, colours, vertices: 0, triangles: 0 })
    }

    /// Goes on where an earlier writer was.
    pub(crate) fn reopen(
        path: &Path,
        scratch: &Scratch,
        options: &WriteOptions,
        state: &SinkState,
    ) -> Result<Self, IoError> {
        let output = Output::reopen(path, scratch, &state.output)?;
        let faces = Aside::reopen(scratch, FACES, &state.aside)?;
        let colours = colours_of(options, scratch)?;
        let SinkState { vertices, triangles, .. } = *state;
        Ok(Self { output, faces, colours, vertices, triangles })
    }

    /// Lays faces aside that have a surface each.
    fn coloured(&mut self, triangles: &SinkTriangles) -> Result<(), IoError> {
        let Some(colours) = &mut self.colours else { return Ok(()) };
        for (triangle, surface) in triangles.indices.iter().zip(triangles.surfaces) {
            let mut bytes = [3; FACE_BYTES + SURFACE_BYTES];
            for (index, bytes) in triangle.iter().zip(bytes[1..].as_chunks_mut::<4>().0) {
                *bytes = index.to_le_bytes();
            }
            let material = surface.material();
            bytes[FACE_BYTES..][..4].copy_from_slice(&material.to_le_bytes());
            bytes[FACE_BYTES + 4..][..4].copy_from_slice(&colours.get(material.into())?);
            bytes[FACE_BYTES + 8] = surface.is_patch().into();
            self.faces.write(&bytes)?;
        }
        Ok(())
    }

    /// Lays faces aside that have no surface.
    fn plain(&mut self, indices: &[[u32; 3]]) -> Result<(), IoError> {
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
        self.triangles += triangles.indices.len() as u64;
        if self.colours.is_some() {
            self.coloured(triangles)
        } else {
            self.plain(triangles.indices)
        }
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
        let Self { mut output, faces, colours, vertices, triangles } = *self;
        output.append(faces)?;
        output.patch(&head(vertices, triangles, colours.is_some()), 0)?;
        let file = output.finish()?;
        Ok(SinkStats { vertices, triangles, file })
    }
}

fn colours_of(
    options: &WriteOptions,
    scratch: &Scratch,
) -> Result<Option<Table<[u8; 4]>>, IoError> {
    let read = |palette: &Palette| {
        let mut colours = Table::new(scratch, COLOUR_SHARE_BYTES);
        palette.for_each(|_, material| Ok(colours.push(material.rgba())?))?;
        Ok(colours)
    };
    options.palette.as_ref().map(read).transpose()
}

/// The header but for its last lines, filled up to a fixed size in a comment.
fn head(vertices: u64, triangles: u64, with_surfaces: bool) -> Vec<u8> {
    let head = "ply\nformat binary_little_endian 1.0\ncomment brickmend";
    let surface = if with_surfaces {
        "property uint material_index\nproperty uchar red\nproperty uchar green\n\
         property uchar blue\nproperty uchar alpha\nproperty uchar patch\n"
    } else {
        ""
    };
    let tail = format!(
        "\nelement vertex {vertices}\n\
         property double x\nproperty double y\nproperty double z\n\
         element face {triangles}\n\
         property list uchar uint vertex_indices\n{surface}"
    );
    let room = HEAD_BYTES - tail.len();
    format!("{head:<room$}{tail}").into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_head_has_one_size_for_all_counts() {
        for count in [0, 7, u64::MAX] {
            for with_surfaces in [false, true] {
                let head = head(count, count, with_surfaces);
                assert_eq!(head.len(), HEAD_BYTES);
                let text = String::from_utf8(head).expect("text");
                assert!(text.contains(&format!("\nelement vertex {count}\n")));
                assert!(text.starts_with("ply\nformat binary_little_endian 1.0\n"));
            }
        }
    }
}
