//! Binary STL: 80 bytes of anything, a facet count, then 50 bytes a facet.
//!
//! Bytes after the last facet are ignored. A count of 0 in front of whole facets (writers that
//! never patched it) is taken from the file's size. Memory: the input's buffer.

use crate::io::BATCH_TRIANGLES;
use crate::io::error::{IoError, Place};
use crate::io::input::Input;
use crate::mesh::{Discarded, MeshSource, TriangleBatch};

/// Header text and facet count.
pub(crate) const HEADER_BYTES: usize = 84;
/// Normal, three corners, attribute.
pub(crate) const FACET_BYTES: usize = 50;
/// Facets decoded at a time; they fit the smallest input buffer.
const BLOCK_FACETS: u64 = 256;

/// What a header says in the light of the file's size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Facets {
    /// The number of facets.
    pub(crate) count: u64,
    /// Whether header, facets and nothing else make up the file.
    pub(crate) exact: bool,
}

/// Reads the facet count of a header; `None` if the file is too short for it.
pub(crate) fn facets_by_size(head: &[u8], size_bytes: u64) -> Option<Facets> {
    let count = promised_facets(head)?;
    let body_bytes = size_bytes.checked_sub(HEADER_BYTES as u64)?;
    let (held, rest) = (body_bytes / FACET_BYTES as u64, body_bytes % FACET_BYTES as u64);
    let unpatched = count == 0 && rest == 0 && held <= u64::from(u32::MAX);
    let count = if unpatched { held } else { u64::from(count) };
    (count <= held).then_some(Facets { count, exact: count == held && rest == 0 && !unpatched })
}

/// Whether a file of unknown size that begins like this may be header, facets and nothing else.
pub(crate) fn may_be_facets(head: &[u8]) -> bool {
    let facets = head.get(HEADER_BYTES..).unwrap_or_default().chunks_exact(FACET_BYTES);
    promised_facets(head).is_some_and(|count| count > 0)
        && head.contains(&0)
        && facets.map(corners).all(|corners| corners.as_flattened().iter().all(|c| c.is_finite()))
}

fn promised_facets(head: &[u8]) -> Option<u32> {
    Some(u32::from_le_bytes(head.get(80..HEADER_BYTES)?.try_into().ok()?))
}

/// Streams binary facets.
#[derive(Debug)]
pub(crate) struct BinaryStlReader {
    input: Input,
    count: u64,
    delivered: u64,
}

impl BinaryStlReader {
    /// Reads the header; a file that cannot hold its facets is refused here.
    pub(crate) fn new(mut input: Input) -> Result<Self, IoError> {
        let size_bytes = input.size_bytes();
        let header = input.bytes(HEADER_BYTES, "an STL header of 84 bytes")?;
        let Some(facets) = facets_by_size(header, size_bytes) else {
            let promised = u32::from_le_bytes([header[80], header[81], header[82], header[83]]);
            let needed = HEADER_BYTES as u64 + u64::from(promised) * FACET_BYTES as u64;
            let expected = format!("{promised} facets in {needed} bytes");
            let found = format!("the end of the file after {size_bytes} bytes");
            let place = Place::Byte(size_bytes);
            return Err(IoError::unreadable(input.path(), place, expected, found));
        };
        Ok(Self { input, count: facets.count, delivered: 0 })
    }
}

impl MeshSource for BinaryStlReader {
    type Error = IoError;

    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, IoError> {
        batch.clear();
        let end = self.count.min(self.delivered + BATCH_TRIANGLES as u64);
        while self.delivered < end {
            let facets = (end - self.delivered).min(BLOCK_FACETS);
            let bytes = self.input.bytes(facets as usize * FACET_BYTES, "an STL facet")?;
            batch.corners.extend(bytes.chunks_exact(FACET_BYTES).map(corners));
            self.delivered += facets;
        }
        let start = end - batch.corners.len() as u64;
        batch.parts.resize(batch.corners.len(), 0);
        batch.materials.resize(batch.corners.len(), 0);
        batch.polygons.extend(start as u32..end as u32);
        Ok(!batch.is_empty())
    }

    fn discarded(&self) -> Discarded {
        Discarded::default()
    }

    fn bytes_read(&self) -> u64 {
        self.input.bytes_read()
    }

    fn vertex_count(&self) -> Option<u64> {
        None
    }
}

#[inline]
fn corners(facet: &[u8]) -> [[f64; 3]; 3] {
    // A fixed length here spares twelve bounds checks a facet.
    let facet: &[u8; FACET_BYTES] = facet.try_into().expect("chunks have this length");
    std::array::from_fn(|corner| {
        std::array::from_fn(|axis| {
            let at = 12 + 12 * corner + 4 * axis;
            let bytes = [facet[at], facet[at + 1], facet[at + 2], facet[at + 3]];
            f64::from(f32::from_le_bytes(bytes))
        })
    })
}
