//! OFF: counts, vertices and polygons as text.

mod reader;
mod writer;

pub(crate) use crate::io::off::reader::{OffReader, is_off_keyword};
pub(crate) use crate::io::off::writer::OffWriter;
