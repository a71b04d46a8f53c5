//! The bytes of images inside of a glTF file: in a buffer view, or decoded from its JSON.
//!
//! What cannot be found or read is no image, and no error. Memory: a block.

use crate::io::error::IoError;
use crate::io::gltf::buffers::Buffers;
use crate::io::gltf::model::{Model, NONE, ViewRecord};
use crate::io::gltf::text::DATA_MARK;

const BLOCK_BYTES: u64 = 64 << 10;

/// Replaces `bytes` by the next of an image's from an offset on; by none at its end.
pub(crate) fn read_block(
    model: &mut Model,
    buffers: &mut Buffers,
    (number, offset): (u32, u64),
    bytes: &mut Vec<u8>,
) -> Result<(), IoError> {
    bytes.clear();
    if u64::from(number) >= model.images.len() {
        return Ok(());
    }
    let image = model.images.get(number.into())?;
    let block = |length: u64| vec![0; length.saturating_sub(offset).min(BLOCK_BYTES) as usize];
    if let Some(uri) = model.text_of(image.uri)? {
        let segment = uri.strip_prefix(DATA_MARK).and_then(|text| text.parse().ok());
        if let Some(segment) = segment.filter(|&segment| segment < model.segments.table.len()) {
            let [start, length] = model.segments.table.get(segment)?;
            *bytes = block(length);
            model.segments.read_at(bytes, start + offset)?;
        }
        return Ok(());
    }
    if let Some(view) = view_of(model, buffers, image.view)? {
        *bytes = block(view.length);
        if !bytes.is_empty() {
            buffers.read(model, view.buffer, view.offset + offset, bytes)?;
        }
    }
    Ok(())
}

/// A view, if it is there and its buffer has all of it.
fn view_of(
    model: &mut Model,
    buffers: &mut Buffers,
    view: u32,
) -> Result<Option<ViewRecord>, IoError> {
    if view == NONE || u64::from(view) >= model.views.len() {
        return Ok(None);
    }
    let view = model.views.get(view.into())?;
    let buffer = match buffers.locate(model, view.buffer) {
        Ok(buffer) => buffer,
        Err(error) if error.is_input() => return Ok(None),
        Err(error) => return Err(error),
    };
    let end = view.offset.checked_add(view.length);
    Ok(end.is_some_and(|end| end <= buffer.length).then_some(view))
}
