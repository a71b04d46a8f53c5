//! PLY: elements with named properties, as text or in binary of either byte order.

mod body;
mod header;
mod materials;
mod paint;
mod plain;
mod reader;
mod shapes;
mod strip;
mod writer;

pub(crate) use crate::io::ply::reader::PlyReader;
pub use crate::io::ply::shapes::{LooseKind, LooseShape, write_loose_shapes};
pub(crate) use crate::io::ply::writer::PlyWriter;
