//! Loose triangles or edges as PLY: each with vertices of its own, and the triangle that it is of.
//!
//! Binary, little-endian, `double` coordinates. Triangles are `face` elements, edges are `edge`
//! elements with `vertex1` and `vertex2`, as viewers expect them; `triangle` numbers the triangles
//! of the file that they come from, from 0. Memory: a block of shapes.

use std::path::Path;

use bytemuck::{Pod, Zeroable};

use crate::io::error::IoError;
use crate::io::output::Output;
use crate::store::{Scratch, Sequence};

/// Shapes at one time.
const BLOCK: usize = 1024;

/// Viewers expect numbers of vertices as `int`.
const MOST_VERTICES: u64 = i32::MAX as u64;

/// A triangle, or an edge by its first two points; model units.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct LooseShape {
    /// Its corners.
    pub points: [[f64; 3]; 3],
    /// The triangle of the file, from 0.
    pub triangle: u64,
}

/// What loose shapes are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LooseKind {
    /// Edges, between the first two points.
    Edges,
    /// Triangles.
    Triangles,
}

impl LooseKind {
    fn corners(self) -> usize {
        match self {
            Self::Edges => 2,
            Self::Triangles => 3,
        }
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
    let corners = kind.corners();
    if shapes.len() * corners as u64 > MOST_VERTICES {
        return Err(IoError::too_many(path, "vertices of one kind of defect", MOST_VERTICES));
    }
    let mut output = Output::create(path, scratch)?;
    output.write(head(comment, kind, shapes.len()).as_bytes())?;
    let mut buffer = Vec::new();
    let mut at = 0;
    while at < shapes.len() {
        let block = shapes.block(at, BLOCK, &mut buffer)?;
        for x in block.iter().flat_map(|shape| &shape.points[..corners]).flatten() {
            output.write(&x.to_le_bytes())?;
        }
        at += block.len() as u64;
    }
    at = 0;
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
            output.write(&(shape.triangle as u32).to_le_bytes())?;
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
    };
    format!(
        "ply\nformat binary_little_endian 1.0\ncomment {comment}\nelement vertex {vertices}\n\
         property double x\nproperty double y\nproperty double z\n{element}\
         property uint triangle\nend_header\n"
    )
}
