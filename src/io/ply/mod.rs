//! PLY: elements with named properties, as text or in binary of either byte order.

mod body;
mod header;
mod materials;
mod paint;
mod plain;
mod reader;
mod strip;
mod writer;

pub(crate) use crate::io::ply::reader::PlyReader;
pub(crate) use crate::io::ply::writer::PlyWriter;
