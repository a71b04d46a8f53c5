//! glTF 2.0: a scene of nodes in JSON, with its numbers in a GLB chunk, in files or in the JSON.

mod accessor;
mod base64;
mod buffers;
mod container;
mod document;
mod document_materials;
mod document_nodes;
mod draco;
#[cfg(test)]
mod draco_tests;
#[cfg(test)]
mod hostile_tests;
mod images;
mod listed;
mod load;
mod materials;
mod model;
mod named;
mod nodes;
mod reader;
mod scene;
mod schema;
mod stream;
#[cfg(test)]
mod tests;
mod text;
mod transform;
mod triangles;
mod values;
mod writer;
#[cfg(test)]
mod writer_tests;

pub(crate) use crate::io::gltf::container::MAGIC;
pub(crate) use crate::io::gltf::named::find_names;
pub(crate) use crate::io::gltf::reader::GltfReader;
#[cfg(test)]
pub(crate) use crate::io::gltf::tests::gltf_square;
pub(crate) use crate::io::gltf::writer::GlbWriter;
