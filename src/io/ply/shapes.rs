//! Loose triangles, edges or points as PLY: each with vertices of its own, and a number of the file
//! that they come from.
//!
//! Binary, little-endian, `double` coordinates. Triangles are `face` elements, edges are `edge`
//! elements with `vertex1` and `vertex2`, as viewers expect them, points are vertices alone.
//! `triangle` or `vertex` numbers what they are of in the file, from 0; it stands with the faces, and
//! of edges and points with the vertices, as some readers take an edge for all of its numbers.
//! Memory: a block of shapes.

use std::path::Path;

use bytemuck::{Pod, Zeroable};

use crate::io::error::IoError;
use crate::io::output::Output;
use crate::store::{Scratch, Sequence};

/// Shapes at one time.
const BLOCK: usize = 1024;

/// Viewers expect numbers of vertices as `int`.
const MOST_VERTICES: u64 = i32::MAX as u64;

/// A triangle, an edge by its first two points, or a point, the first; model units.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct LooseShape {
    /// Its corners.
    pub points: [[f64; 3]; 3],
    /// The triangle or vertex of the file, from 0.
    pub number: u64,
}

/// What loose shapes are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LooseKind {
    /// Edges, between the first two points.
    Edges,
    /// Triangles.
    Triangles,
    /// Points of triangles, which are numbered by these.
    Points,
    /// Points that are numbered as vertices.
    Vertices,
}

impl LooseKind {
    fn corners(self) -> usize {
        match self {
            Self::Edges => 2,
            Self::Triangles => 3,
            Self::Points | Self::Vertices => 1,
        }
    }

    /// Whether numbers stand with the vertices.
    fn numbers_vertices(self) -> bool {
        self != Self::Triangles
    }
}

/// Writes `shapes` to `path`; `comment` is one line of the header.
///
/// # Errors
/// There are too many shapes, the file cannot be written, or the scratch disk fails.
pub fn write_loose_shapes(
    path: &Path,
    comment: &str,
    kind: LooseKind,
    shapes: &Sequence<LooseShape>,
    scratch: &Scratch,
) -> Result<(), IoError> {
    write_within(MOST_VERTICES, path, comment, (kind, shapes), scratch)
}

/// [`write_loose_shapes`] with at most so many vertices.
fn write_within(
    limit: u64,
    path: &Path,
    comment: &str,
    (kind, shapes): (LooseKind, &Sequence<LooseShape>),
    scratch: &Scratch,
) -> Result<(), IoError> {
    let corners = kind.corners();
    if shapes.len().saturating_mul(corners as u64) > limit {
        let path = path.to_path_buf();
        return Err(IoError::TooLarge { path, what: "vertices of loose shapes", limit });
    }
    let mut output = Output::create(path, scratch)?;
    output.write(head(comment, kind, shapes.len()).as_bytes())?;
    let mut buffer = Vec::new();
    let mut at = 0;
    while at < shapes.len() {
        let block = shapes.block(at, BLOCK, &mut buffer)?;
        for shape in block {
            for point in &shape.points[..corners] {
                for x in point {
                    output.write(&x.to_le_bytes())?;
                }
                if kind.numbers_vertices() {
                    output.write(&(shape.number as u32).to_le_bytes())?;
                }
            }
        }
        at += block.len() as u64;
    }
    at = if corners == 1 { shapes.len() } else { 0 };
    while at < shapes.len() {
        let block = shapes.block(at, BLOCK, &mut buffer)?;
        for (number, shape) in (at..).zip(block) {
            if kind == LooseKind::Triangles {
                output.write(&[3])?;
            }
            for corner in 0..corners as u64 {
                let vertex = (number * corners as u64 + corner) as u32;
                output.write(&vertex.to_le_bytes())?;
            }
            if !kind.numbers_vertices() {
                output.write(&(shape.number as u32).to_le_bytes())?;
            }
        }
        at += block.len() as u64;
    }
    output.finish()?;
    Ok(())
}

fn head(comment: &str, kind: LooseKind, count: u64) -> String {
    let vertices = count * kind.corners() as u64;
    let element = match kind {
        LooseKind::Edges => {
            format!("element edge {count}\nproperty int vertex1\nproperty int vertex2\n")
        }
        LooseKind::Triangles => {
            format!("element face {count}\nproperty list uchar int vertex_indices\n")
        }
        LooseKind::Points | LooseKind::Vertices => String::new(),
    };
    let number = match kind {
        LooseKind::Vertices => "property uint vertex\n",
        _ => "property uint triangle\n",
    };
    let [with_vertices, with_elements] = match kind.numbers_vertices() {
        true => [number, ""],
        false => ["", number],
    };
    format!(
        "ply\nformat binary_little_endian 1.0\ncomment {comment}\nelement vertex {vertices}\n\
         property double x\nproperty double y\nproperty double z\n{with_vertices}{element}\
         {with_elements}end_header\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_vertices_than_viewers_can_number_are_refused_before_a_file_is_there() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let path = folder.path().join("out.ply");
        let mut shapes = Sequence::new(&scratch, 1 << 10);
        for number in 0..5 {
            let shape = LooseShape { points: [[number as f64; 3]; 3], number };
            shapes.push(shape).expect("the scratch folder works");
        }
        for (kind, corners) in [
            (LooseKind::Points, 1),
            (LooseKind::Vertices, 1),
            (LooseKind::Edges, 2),
            (LooseKind::Triangles, 3),
        ] {
            let limit = 5 * corners;
            let write = |limit| write_within(limit, &path, "five", (kind, &shapes), &scratch);
            let refused = write(limit - 1).expect_err("one vertex too many");
            let IoError::TooLarge { limit: told, .. } = &refused else { panic!("{refused}") };
            assert_eq!(*told, limit - 1);
            assert!(!path.exists());
            write(limit).expect("as many as are allowed");
            std::fs::remove_file(&path).expect("there");
        }
    }
}
