//! Primitives that are compressed by Draco, decoded by `draco_core` into a segment.
//!
//! Counts are those of the primitive's accessors, or the stream is refused. Memory: the compressed
//! bytes, at most [`MOST_PACKED_BYTES`], and what the decoder holds of at most [`MOST_FACES`]
//! triangles and [`MOST_POINTS`] vertices: about 70 bytes a triangle with positions alone, 240 with
//! normals and texture coordinates. All is given back before the first triangle is delivered.

use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};

use crate::io::error::IoError;
use crate::io::gltf::accessor::{Component, Field};
use crate::io::gltf::buffers::Buffers;
use crate::io::gltf::model::{BufferRecord, Model, NONE, PrimitiveRecord, origin};

pub(crate) const NAME: &str = "KHR_draco_mesh_compression";
const MOST_PACKED_BYTES: u64 = 64 << 20;
const MOST_FACES: u64 = 4 << 20;
const MOST_POINTS: u64 = 4 << 20;
const MOST_DECODED_BYTES: u64 = 256 << 20;

/// The fields of a primitive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Decoded {
    pub(crate) indices: Field,
    pub(crate) position: Field,
    pub(crate) uv: Option<Field>,
    pub(crate) colour: Option<Field>,
    /// Compressed bytes that were read for this.
    pub(crate) packed_bytes: u64,
}

/// Decodes a primitive, unless that was done before.
pub(crate) fn decode(
    model: &mut Model,
    buffers: &mut Buffers,
    number: u64,
) -> Result<Decoded, IoError> {
    let mut record = model.primitive(number)?;
    let points = model.accessor(record.position)?.count;
    let mut packed_bytes = 0;
    if record.decoded == NONE {
        let packed = read_packed(model, buffers, &record)?;
        packed_bytes = packed.len() as u64;
        let mesh = unpack(model, &record, &packed, points)?;
        drop(packed);
        let first = model.segments.end();
        store(model, &record, &mesh)?;
        model.segments.flush()?;
        record.decoded = u32::try_from(model.buffers.len())
            .map_err(|_| IoError::too_many(&model.path, "buffers", NONE.into()))?;
        record.decoded_faces = mesh.num_faces() as u32;
        let length = model.segments.end() - first;
        let (uri, origin) = (NONE, origin::SEGMENT);
        model.buffers.push(BufferRecord { length, start: first, uri, origin })?;
        model.primitives.set(number, record)?;
    }
    let mut start = 0;
    let mut field = |count: u64, lanes: u32, is_index| {
        let field = Field::decoded(record.decoded, start, count, lanes, is_index);
        start += 4 * u64::from(lanes) * count;
        field
    };
    Ok(Decoded {
        indices: field(3 * u64::from(record.decoded_faces), 1, true),
        position: field(points, 3, false),
        uv: has(record.uv, record.draco_uv).then(|| field(points, 2, false)),
        colour: has(record.colour, record.draco_colour).then(|| field(points, 4, false)),
        packed_bytes,
    })
}

/// Whether an attribute is both in the primitive and in the stream.
fn has(accessor: u32, in_stream: u32) -> bool {
    accessor != NONE && in_stream != NONE
}

/// The compressed bytes.
fn read_packed(
    model: &mut Model,
    buffers: &mut Buffers,
    record: &PrimitiveRecord,
) -> Result<Vec<u8>, IoError> {
    let at = ("buffer view", record.draco_view);
    let view = model.view(record.draco_view)?;
    let buffer = buffers.locate(model, view.buffer)?;
    if view.offset.checked_add(view.length).is_none_or(|end| end > buffer.length) {
        let expected = format!("a part of a buffer of {} bytes", buffer.length);
        let found = format!("{} bytes from byte {}", view.length, view.offset);
        return Err(model.wrong(at, expected, found));
    }
    if view.length > MOST_PACKED_BYTES {
        let expected = format!("at most {MOST_PACKED_BYTES} bytes of {NAME}");
        return Err(model.wrong(at, expected, format!("{}", view.length)));
    }
    let mut bytes = vec![0; view.length as usize];
    buffers.read(model, view.buffer, view.offset, &mut bytes)?;
    Ok(bytes)
}

/// The mesh of a stream, with as many vertices and triangles as the accessors say.
fn unpack(
    model: &mut Model,
    record: &PrimitiveRecord,
    packed: &[u8],
    points: u64,
) -> Result<Mesh, IoError> {
    let at = ("buffer view", record.draco_view);
    let faces = match record.indices {
        NONE => MOST_FACES,
        // Strips are listed as triangles in the stream.
        indices => model.accessor(indices)?.count.min(MOST_FACES),
    };
    if points > MOST_POINTS {
        let expected = format!("at most {MOST_POINTS} vertices in {NAME}");
        return Err(model.wrong(at, expected, format!("{points}")));
    }
    let limits = DecodeLimits::default()
        .with_max_points(points)
        .with_max_faces(faces)
        .with_max_decoded_bytes(MOST_DECODED_BYTES);
    let mut mesh = Mesh::new();
    let mut stream = DecoderBuffer::new(packed).with_limits(limits);
    if let Err(error) = MeshDecoder::new().decode(&mut stream, &mut mesh) {
        return Err(model.wrong(at, format!("a stream of {NAME}"), error.to_string()));
    }
    if mesh.num_points() as u64 != points {
        let expected = format!("{points} vertices in {NAME}");
        return Err(model.wrong(at, expected, format!("{}", mesh.num_points())));
    }
    Ok(mesh)
}

/// Appends indices and attributes to the segments.
fn store(model: &mut Model, record: &PrimitiveRecord, mesh: &Mesh) -> Result<(), IoError> {
    for face in mesh.faces() {
        for corner in face {
            model.segments.push(&corner.0.to_le_bytes())?;
        }
    }
    store_attribute(model, record, mesh, (record.position, record.draco_position, 3))?;
    for (accessor, in_stream, lanes) in
        [(record.uv, record.draco_uv, 2), (record.colour, record.draco_colour, 4)]
    {
        if has(accessor, in_stream) {
            store_attribute(model, record, mesh, (accessor, in_stream, lanes))?;
        }
    }
    Ok(())
}

/// Appends an attribute as floats.
fn store_attribute(
    model: &mut Model,
    record: &PrimitiveRecord,
    mesh: &Mesh,
    (accessor, in_stream, lanes): (u32, u32, usize),
) -> Result<(), IoError> {
    let at = ("buffer view", record.draco_view);
    let Some(attribute) = mesh.attribute_by_unique_id(in_stream) else {
        let expected = format!("attribute {in_stream} in {NAME}");
        return Err(model.wrong(at, expected, "none"));
    };
    let accessor = model.accessor(accessor)?;
    let is_part = accessor.is_normalized != 0 || lanes == 4;
    let unit = Component::of_code(accessor.component).filter(|_| is_part);
    let unit = unit.map_or(1.0, |component| component.most() as f32);
    let stated = usize::from(attribute.num_components()).min(lanes);
    let values = attribute.read_f32s(mesh.num_points(), lanes);
    for value in values.chunks_exact(lanes) {
        for (lane, &number) in value.iter().enumerate() {
            // Colours without alpha are opaque.
            let number = if lane < stated || lanes != 4 { number / unit } else { 1.0 };
            model.segments.push(&number.to_le_bytes())?;
        }
    }
    Ok(())
}
