//! Writes binary little-endian PLY with `double` coordinates and `uint` indices.
//!
//! Faces wait in a scratch file until all vertices are there; the head of the header has a fixed
//! size and gets its counts at the end. Where there are materials, each face has the number of its
//! own and its colour; comments of the header say what the numbers stand for. Texture coordinates
//! stand in a list `texcoord` of each face, with `texnumber`, the number of its image among the
//! comments `TextureFile`, or -1; colours with every vertex. Normals are not held. Memory: two
//! buffers, the vertices of one call, and what is known of materials, spilled beyond a share.

use std::path::Path;

use crate::io::error::IoError;
use crate::io::output::{Aside, FACES, Output};
use crate::io::palette::LookMap;
use crate::io::ply::paint::Paints;
use crate::io::polygon::WHITE;
use crate::io::{Format, WriteOptions};
use crate::mesh::{
    Attributes, CornerForm, MeshSink, SinkState, SinkStats, SinkTriangles, VertexValues,
};
use crate::store::Scratch;

/// Room for any two counts.
const HEAD_BYTES: usize = 640;
/// The longest that the record of a face gets.
const MOST_FACE_BYTES: usize = 13 + 25 + 4 + 9;

/// Which properties there are besides positions and corners.
#[derive(Clone, Copy, Debug)]
struct Layout {
    has_colours: bool,
    has_uvs: bool,
    has_textures: bool,
    has_surfaces: bool,
}

/// Writes vertices at once and lays faces aside.
pub(crate) struct PlyWriter {
    output: Output,
    faces: Aside,
    attributes: Attributes,
    /// What faces are painted with, where they have materials.
    paints: Option<Paints>,
    looks: LookMap,
    /// Vertices of the last call, while their colours may come.
    pending: Vec<[f64; 3]>,
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
        let output = Output::create(path, scratch)?;
        let mut writer = Self::new((output, faces), scratch, options, &SinkState::default())?;
        let head = head(0, 0, writer.layout());
        writer.output.write(&head)?;
        if let Some(palette) = &options.palette {
            Paints::declare(palette, options, scratch, &mut writer.output)?;
        }
        writer.output.write(b"end_header\n")?;
        Ok(writer)
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
        Self::new((output, faces), scratch, options, state)
    }

    fn new(
        (output, faces): (Output, Aside),
        scratch: &Scratch,
        options: &WriteOptions,
        state: &SinkState,
    ) -> Result<Self, IoError> {
        let palette = options.palette.as_ref();
        let SinkState { vertices, triangles, .. } = *state;
        Ok(Self {
            output,
            faces,
            attributes: options.attributes.and(Format::Ply.attributes()),
            paints: palette.map(|palette| Paints::of(palette, options, scratch)).transpose()?,
            looks: palette.map(|palette| palette.looks()).transpose()?.unwrap_or_default(),
            pending: Vec::new(),
            vertices,
            triangles,
        })
    }

    fn layout(&self) -> Layout {
        Layout {
            has_colours: self.attributes.colours,
            has_uvs: self.attributes.uvs,
            has_textures: self.attributes.uvs
                && self.paints.as_ref().is_some_and(|paints| paints.has_textures),
            has_surfaces: self.paints.is_some(),
        }
    }

    /// Writes the vertices that wait, white where no colour came.
    fn write_pending(&mut self, colours: &[[u8; 4]]) -> Result<(), IoError> {
        for (at, position) in self.pending.iter().enumerate() {
            let mut bytes = [0; 28];
            write_position(&mut bytes, position);
            bytes[24..].copy_from_slice(colours.get(at).unwrap_or(&WHITE));
            self.output.write(&bytes)?;
        }
        self.pending.clear();
        Ok(())
    }
}

fn write_position(bytes: &mut [u8], position: &[f64; 3]) {
    for (number, bytes) in position.iter().zip(bytes.as_chunks_mut::<8>().0) {
        *bytes = number.to_le_bytes();
    }
}

/// The record of a face, as it grows.
struct FaceBytes {
    bytes: [u8; MOST_FACE_BYTES],
    length: usize,
}

impl FaceBytes {
    fn push(&mut self, bytes: &[u8]) {
        self.bytes[self.length..][..bytes.len()].copy_from_slice(bytes);
        self.length += bytes.len();
    }
}

impl MeshSink for PlyWriter {
    type Error = IoError;

    fn needs_corners(&self) -> bool {
        false
    }

    fn corner_form(&self) -> CornerForm {
        if self.attributes.any() { CornerForm::OfCorners } else { CornerForm::None }
    }

    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), IoError> {
        self.vertices += positions.len() as u64;
        if self.attributes.colours {
            self.write_pending(&[])?;
            self.pending.extend_from_slice(positions);
            return Ok(());
        }
        for position in positions {
            let mut bytes = [0; 24];
            write_position(&mut bytes, position);
            self.output.write(&bytes)?;
        }
        Ok(())
    }

    fn vertex_values(&mut self, values: &VertexValues) -> Result<(), IoError> {
        self.write_pending(values.colours)
    }

    fn triangles(&mut self, triangles: &SinkTriangles) -> Result<(), IoError> {
        self.write_pending(&[])?;
        self.triangles += triangles.indices.len() as u64;
        let layout = self.layout();
        let surfaces = self.looks.materials_of(triangles.surfaces)?;
        for (at, triangle) in triangles.indices.iter().enumerate() {
            let mut face = FaceBytes { bytes: [0; MOST_FACE_BYTES], length: 0 };
            face.push(&[3]);
            triangle.iter().for_each(|index| face.push(&index.to_le_bytes()));
            if layout.has_uvs {
                face.push(&[6]);
                let uvs = triangles.uvs.values.get(at).copied().unwrap_or_default();
                uvs.as_flattened().iter().for_each(|number| face.push(&number.to_le_bytes()));
            }
            if let Some(paints) = &mut self.paints {
                let surface = surfaces.get(at).copied().unwrap_or_default();
                let paint = paints.get(surface.material())?;
                if layout.has_textures {
                    face.push(&paint.texture.to_le_bytes());
                }
                face.push(&surface.material().to_le_bytes());
                face.push(&paint.colour);
                face.push(&[surface.is_patch().into()]);
            }
            self.faces.write(&face.bytes[..face.length])?;
        }
        Ok(())
    }

    fn bytes_so_far(&self) -> u64 {
        self.output.bytes() + self.faces.bytes()
    }

    fn checkpoint(&mut self) -> Result<SinkState, IoError> {
        self.write_pending(&[])?;
        let (output, aside) = (self.output.state()?, self.faces.state()?);
        let Self { vertices, triangles, .. } = *self;
        Ok(SinkState { vertices, triangles, output, aside, ..SinkState::default() })
    }

    fn finish(mut self: Box<Self>) -> Result<SinkStats, IoError> {
        self.write_pending(&[])?;
        let layout = self.layout();
        let Self { mut output, faces, vertices, triangles, .. } = *self;
        output.append(faces)?;
        output.patch(&head(vertices, triangles, layout), 0)?;
        let file = output.finish()?;
        Ok(SinkStats { vertices, triangles, file })
    }
}

/// The header but for its last lines, filled up to a fixed size in a comment.
fn head(vertices: u64, triangles: u64, layout: Layout) -> Vec<u8> {
    const COLOUR: &str = "property uchar red\nproperty uchar green\nproperty uchar blue\n\
                          property uchar alpha\n";
    let head = "ply\nformat binary_little_endian 1.0\ncomment brickmend";
    let mut tail = format!(
        "\nelement vertex {vertices}\nproperty double x\nproperty double y\nproperty double z\n"
    );
    if layout.has_colours {
        tail.push_str(COLOUR);
    }
    tail.push_str(&format!("element face {triangles}\nproperty list uchar uint vertex_indices\n"));
    if layout.has_uvs {
        tail.push_str("property list uchar float texcoord\n");
    }
    if layout.has_textures {
        tail.push_str("property int texnumber\n");
    }
    if layout.has_surfaces {
        tail.push_str("property uint material_index\n");
        tail.push_str(COLOUR);
        tail.push_str("property uchar patch\n");
    }
    let room = HEAD_BYTES - tail.len();
    format!("{head:<room$}{tail}").into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_head_has_one_size_for_all_counts() {
        for count in [0, 7, u64::MAX] {
            for has in [false, true] {
                let layout =
                    Layout { has_colours: has, has_uvs: has, has_textures: has, has_surfaces: has };
                let head = head(count, count, layout);
                assert_eq!(head.len(), HEAD_BYTES);
                let text = String::from_utf8(head).expect("text");
                assert!(text.contains(&format!("\nelement vertex {count}\n")));
                assert!(
                    text.starts_with("ply\nformat binary_little_endian 1.0\ncomment brickmend")
                );
            }
        }
    }
}
