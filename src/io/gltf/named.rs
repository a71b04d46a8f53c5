//! The buffers and images beside a glTF file.

use crate::io::error::IoError;
use crate::io::gltf::buffers::unescaped;
use crate::io::gltf::container::find_chunks;
use crate::io::gltf::load::load;
use crate::io::gltf::model::Model;
use crate::io::input::Input;
use crate::io::named::Names;
use crate::store::Scratch;

/// What is no file, but holds its bytes itself.
const DATA: &str = "data:";

/// Enters what the JSON of the file `input` names.
pub(crate) fn find_names(
    input: &mut Input,
    names: &mut Names,
    scratch: &Scratch,
    share_bytes: u64,
) -> Result<(), IoError> {
    let chunks = find_chunks(input)?;
    let mut model = load(input, chunks.json, chunks.is_text, scratch, share_bytes / 2)?;
    for number in 0..model.buffers.len() {
        let uri = model.buffers.get(number)?.uri;
        enter(&mut model, uri, names)?;
    }
    for number in 0..model.images.len() {
        let uri = model.images.get(number)?.uri;
        enter(&mut model, uri, names)?;
    }
    Ok(())
}

fn enter(model: &mut Model, uri: u32, names: &mut Names) -> Result<(), IoError> {
    let uri = model.text_of(uri)?.filter(|uri| !uri.starts_with(DATA));
    if let Some(uri) = uri {
        names.enter(&unescaped(&uri));
    }
    Ok(())
}
