//! Vertices and triangles that wait for the end of a file, in the order in which they came.
//!
//! A record is its tag (one byte), then numbers with their lowest byte first: three `f64` of a
//! vertex; four bytes of its colour; two `f32` of a texture coordinate; three `u32` of a triangle, a
//! fourth where its surface is known, and three more where it has texture coordinates, by their
//! numbers. Memory: a record.

use std::ops::Range;

use crate::io::error::IoError;
use crate::io::output::Aside;
use crate::mesh::Surface;

const VERTEX: u8 = 0;
const TRIANGLE: u8 = 1;
const SURFACE: u8 = 2;
const COLOUR: u8 = 3;
const UV: u8 = 4;
const TEXTURED: u8 = 5;

/// What waits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Record {
    Vertex([f64; 3]),
    /// Of the vertex whose turn it is.
    Colour([u8; 4]),
    Uv([f32; 2]),
    Triangle([u32; 3], Option<Surface>),
    /// The same with the numbers of its texture coordinates.
    Textured([u32; 3], Surface, [u32; 3]),
}

impl Record {
    /// Appends its bytes.
    pub(super) fn push(&self, bytes: &mut Vec<u8>) {
        match *self {
            Self::Vertex(position) => {
                bytes.push(VERTEX);
                bytes.extend(position.iter().flat_map(|number| number.to_le_bytes()));
            }
            Self::Colour(colour) => {
                bytes.push(COLOUR);
                bytes.extend(colour);
            }
            Self::Uv(uv) => {
                bytes.push(UV);
                bytes.extend(uv.iter().flat_map(|number| number.to_le_bytes()));
            }
            Self::Textured(indices, surface, uvs) => {
                bytes.push(TEXTURED);
                let numbers = indices.into_iter().chain([surface.bits()]).chain(uvs);
                bytes.extend(numbers.flat_map(u32::to_le_bytes));
            }
            Self::Triangle(indices, surface) => {
                bytes.push(if surface.is_some() { SURFACE } else { TRIANGLE });
                let numbers = indices.into_iter().chain(surface.map(Surface::bits));
                bytes.extend(numbers.flat_map(u32::to_le_bytes));
            }
        }
    }

    /// The record at the front of `bytes` and how long it is, if it is whole.
    fn read(bytes: &[u8]) -> Option<(Self, usize)> {
        let index = |number: usize| {
            let at = 1 + 4 * number;
            Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
        };
        let coordinate = |axis: usize| {
            let at = 1 + 8 * axis;
            Some(f64::from_le_bytes(bytes.get(at..at + 8)?.try_into().ok()?))
        };
        let triangle = || Some([index(0)?, index(1)?, index(2)?]);
        match *bytes.first()? {
            VERTEX => {
                let position = [coordinate(0)?, coordinate(1)?, coordinate(2)?];
                Some((Self::Vertex(position), 25))
            }
            TRIANGLE => Some((Self::Triangle(triangle()?, None), 13)),
            COLOUR => Some((Self::Colour(index(0)?.to_le_bytes()), 5)),
            UV => Some((Self::Uv([index(0)?, index(1)?].map(f32::from_bits)), 9)),
            SURFACE => {
                let surface = Surface::from_bits(index(3)?);
                Some((Self::Triangle(triangle()?, Some(surface)), 17))
            }
            _ => {
                let surface = Surface::from_bits(index(3)?);
                let uvs = [index(4)?, index(5)?, index(6)?];
                Some((Self::Textured(triangle()?, surface, uvs), 29))
            }
        }
    }
}

/// Shows everything that was laid aside.
pub(super) fn for_each_record(
    aside: &mut Aside,
    visit: impl FnMut(Record) -> Result<(), IoError>,
) -> Result<(), IoError> {
    for_each_record_in(aside, 0..aside.bytes(), visit)
}

/// Shows what was laid aside in these bytes, which hold whole records.
pub(super) fn for_each_record_in(
    aside: &mut Aside,
    bytes: Range<u64>,
    mut visit: impl FnMut(Record) -> Result<(), IoError>,
) -> Result<(), IoError> {
    // The start of a record whose end is in the next block.
    let mut carried = Vec::new();
    aside.for_each_block_in(bytes, |block| {
        let mut rest = block;
        while !carried.is_empty() && !rest.is_empty() {
            carried.push(rest[0]);
            rest = &rest[1..];
            if let Some((record, _)) = Record::read(&carried) {
                carried.clear();
                visit(record)?;
            }
        }
        while let Some((record, length)) = Record::read(rest) {
            rest = &rest[length..];
            visit(record)?;
        }
        carried.extend_from_slice(rest);
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::output::FACES;
    use crate::store::Scratch;

    #[test]
    fn records_come_back_across_blocks() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut aside = Aside::create(&Scratch::new(folder.path()), FACES).expect("a file");
        let record = |i: u32| match i % 6 {
            3 => Record::Colour(i.to_be_bytes()),
            4 => Record::Uv([i as f32, -0.25]),
            5 => Record::Textured([i, 1, 2], Surface::new(i, true), [3, i, u32::MAX]),
            0 => Record::Vertex([f64::from(i), -0.5, 1e300]),
            1 => Record::Triangle([i, 1, u32::MAX], None),
            _ => Record::Triangle([i, 1, 2], Some(Surface::new(i, i.is_multiple_of(2)))),
        };
        let mut bytes = Vec::new();
        for i in 0..100_000 {
            bytes.clear();
            record(i).push(&mut bytes);
            aside.write(&bytes).expect("written");
        }
        let mut next = 0;
        let shown = for_each_record(&mut aside, |found| {
            assert_eq!(found, record(next));
            next += 1;
            Ok(())
        });
        shown.expect("read");
        assert_eq!(next, 100_000);
    }
}
