//! The elements that most files consist of, decoded without looking at their properties again:
//! little-endian vertices of three doubles, and triangles with a byte for their length, alone or
//! with what our own writer says of their materials.

use crate::io::BATCH_TRIANGLES;
use crate::io::error::IoError;
use crate::io::ply::body::Body;
use crate::io::ply::header::{Element, Kind, Property, Role, Scalar};
use crate::io::ply::materials::FaceSurface;
use crate::mesh::{NO_POLYGON, TriangleBatch};
use crate::store::Table;

/// Bytes of a vertex.
const VERTEX_BYTES: usize = 24;
/// Bytes of a triangle.
const TRIANGLE_BYTES: usize = 13;
/// The same with number of the material, colour, and whether it is a patch.
const PAINTED_BYTES: usize = TRIANGLE_BYTES + 9;
/// What follows the corners of a painted triangle.
const PAINT: [(Role, Scalar); 6] = [
    (Role::Material, Scalar::U32),
    (Role::Colour(0), Scalar::U8),
    (Role::Colour(1), Scalar::U8),
    (Role::Colour(2), Scalar::U8),
    (Role::Colour(3), Scalar::U8),
    (Role::Patch, Scalar::U8),
];

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

/// How many bytes each triangle of `element` takes, if that is [`TRIANGLE_BYTES`], or
/// [`PAINTED_BYTES`].
pub(crate) fn plain_triangle_bytes(body: &Body, element: &Element) -> Option<usize> {
    let (corners, paint) = element.properties.split_first()?;
    let has_corners = corners.role == Role::Indices
        && corners.length == Some(Scalar::U8)
        && corners.scalar == Scalar::U32;
    if !is_little_endian(body) || element.kind != Kind::Face || !has_corners {
        return None;
    }
    let is_painted = paint.len() == PAINT.len()
        && paint
            .iter()
            .zip(PAINT)
            .all(|(property, (role, scalar))| *property == Property { role, length: None, scalar });
    match paint.len() {
        0 => Some(TRIANGLE_BYTES),
        _ => is_painted.then_some(PAINTED_BYTES),
    }
}

/// What a painted triangle says of its material; nothing where it is not painted.
fn paint(bytes: &[u8]) -> FaceSurface {
    let Some(paint) = bytes.get(TRIANGLE_BYTES..PAINTED_BYTES) else {
        return FaceSurface::default();
    };
    let number = |at: usize| [0, 1, 2, 3].map(|i| paint[at + i]);
    FaceSurface {
        index: u32::from_le_bytes(number(0)),
        colour: Some(number(4)),
        is_patch: paint[8] != 0,
        // What shows no image has no texture coordinates, and is not plain.
        image: Some(-1),
    }
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
fn triangle(bytes: &[u8]) -> Option<[u32; 3]> {
    let (numbers, _) = bytes[1..TRIANGLE_BYTES].as_chunks::<4>();
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

/// Reads at most `left` triangles of `face_bytes` each, numbered from `first` on, while they are
/// whole and `batch` has room; tells how many it read. `material` numbers materials.
pub(crate) fn read_triangles(
    body: &mut Body,
    positions: &mut Table<[f64; 3]>,
    (left, first, face_bytes): (u64, u64, usize),
    mut material: impl FnMut(FaceSurface) -> Result<u32, IoError>,
    batch: &mut TriangleBatch,
) -> Result<u64, IoError> {
    let left = left.min(u64::from(NO_POLYGON) - first);
    let room = left.min(BATCH_TRIANGLES.saturating_sub(batch.len()) as u64) as usize;
    let faces = body.look_ahead(face_bytes)?.chunks_exact(face_bytes);
    let mut read = 0;
    for face in faces.take(room) {
        let Some(ids) = triangle(face) else { break };
        if ids.iter().any(|&id| u64::from(id) >= positions.len()) {
            break;
        }
        let mut corners = [[0.0; 3]; 3];
        for (corner, &id) in corners.iter_mut().zip(&ids) {
            *corner = positions.get(u64::from(id))?;
        }
        batch.push(corners, 0, material(paint(face))?, (first + read) as u32);
        batch.indices.push(ids);
        read += 1;
    }
    body.consume(read as usize * face_bytes);
    Ok(read)
}
