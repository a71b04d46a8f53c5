//! The elements that most files consist of, decoded without looking at their properties again:
//! little-endian vertices of three doubles, and triangles with a byte for their length.

use crate::io::BATCH_TRIANGLES;
use crate::io::error::IoError;
use crate::io::ply::body::Body;
use crate::io::ply::header::{Element, Kind, Property, Role, Scalar};
use crate::mesh::{NO_POLYGON, TriangleBatch};
use crate::store::Table;

/// Bytes of a vertex.
const VERTEX_BYTES: usize = 24;
/// Bytes of a triangle.
const TRIANGLE_BYTES: usize = 13;

/// Whether all vertices of `element` are x, y, z and nothing else.
pub(crate) fn has_plain_vertices(body: &Body, element: &Element) -> bool {
    let is_plain = |(axis, property): (usize, &Property)| {
        let Property { role, length, scalar } = *property;
        role == Role::Coordinate(axis) && length.is_none() && scalar == Scalar::F64
    };
    is_little_endian(body)
        && element.properties.len() == 3
        && element.properties.iter().enumerate().all(is_plain)
}

/// Whether the triangles of `element` take [`TRIANGLE_BYTES`] each.
pub(crate) fn has_plain_triangles(body: &Body, element: &Element) -> bool {
    is_little_endian(body)
        && element.kind == Kind::Face
        && element.properties.len() == 1
        && element.properties.iter().all(|property| {
            property.role == Role::Indices
                && property.length == Some(Scalar::U8)
                && property.scalar == Scalar::U32
        })
}

fn is_little_endian(body: &Body) -> bool {
    matches!(body, Body::Binary { big_endian: false, .. })
}

/// A vertex.
#[inline]
fn position(bytes: &[u8; VERTEX_BYTES]) -> [f64; 3] {
    let (numbers, _) = bytes.as_chunks::<8>();
    [0, 1, 2].map(|axis| f64::from_le_bytes(numbers[axis]))
}

/// The corners, if the face is a triangle.
#[inline]
fn triangle(bytes: &[u8; TRIANGLE_BYTES]) -> Option<[u32; 3]> {
    let (numbers, _) = bytes[1..].as_chunks::<4>();
    (bytes[0] == 3).then(|| [0, 1, 2].map(|corner| u32::from_le_bytes(numbers[corner])))
}

/// Reads plain vertices; how many are left tells whether the file or the numbers ended first.
pub(crate) fn read_vertices(
    body: &mut Body,
    positions: &mut Table<[f64; 3]>,
    mut left: u64,
) -> Result<u64, IoError> {
    loop {
        let room = u64::from(u32::MAX) - positions.len();
        let (vertices, _) = body.look_ahead(VERTEX_BYTES)?.as_chunks();
        let count = left.min(room).min(vertices.len() as u64);
        if count == 0 {
            return Ok(left);
        }
        for vertex in &vertices[..count as usize] {
            positions.push(position(vertex))?;
        }
        body.consume(count as usize * VERTEX_BYTES);
        left -= count;
    }
}

/// Reads at most `left` triangles, numbered from `first` on, while they are whole and `batch` has
/// room; tells how many it read.
pub(crate) fn read_triangles(
    body: &mut Body,
    positions: &mut Table<[f64; 3]>,
    left: u64,
    first: u64,
    batch: &mut TriangleBatch,
) -> Result<u64, IoError> {
    let left = left.min(u64::from(NO_POLYGON) - first);
    let room = left.min(BATCH_TRIANGLES.saturating_sub(batch.len()) as u64) as usize;
    let (faces, _) = body.look_ahead(TRIANGLE_BYTES)?.as_chunks();
    let mut read = 0;
    for face in &faces[..room.min(faces.len())] {
        let Some(ids) = triangle(face) else { break };
        if ids.iter().any(|&id| u64::from(id) >= positions.len()) {
            break;
        }
        let mut corners = [[0.0; 3]; 3];
        for (corner, &id) in corners.iter_mut().zip(&ids) {
            *corner = positions.get(u64::from(id))?;
        }
        batch.push(corners, 0, 0, (first + read) as u32);
        batch.indices.push(ids);
        read += 1;
    }
    body.consume(read as usize * TRIANGLE_BYTES);
    Ok(read)
}
