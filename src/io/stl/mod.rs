//! STL: facets without indices, in binary (little endian, `f32`) or as text.

mod ascii;
mod binary;
mod writer;

use crate::io::input::Input;
use crate::io::stl::ascii::AsciiStlReader;
use crate::io::stl::binary::BinaryStlReader;
pub(crate) use crate::io::stl::binary::{facets_by_size, may_be_facets};
pub(crate) use crate::io::stl::writer::StlWriter;
use crate::io::words::MARK;
use crate::io::{IoError, Source};

/// Opens an STL file: binary if its size fits the facet count, else text if it begins like text.
pub(crate) fn open_stl(mut input: Input) -> Result<Source, IoError> {
    let size_bytes = input.size_bytes();
    let head = input.look_ahead(1024)?;
    let exact = facets_by_size(head, size_bytes).is_some_and(|header| header.exact);
    let text = head.strip_prefix(MARK).unwrap_or(head).trim_ascii_start();
    let is_solid = text.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    if !exact && is_solid && !head.contains(&0) {
        return Ok(Box::new(AsciiStlReader::new(input)));
    }
    Ok(Box::new(BinaryStlReader::new(input)?))
}
