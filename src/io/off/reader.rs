//! Streams the polygons of an OFF file, with or without colours, normals and texture coordinates.
//!
//! What follows the position of a vertex or the indices of a face on its line is ignored. A count
//! that is glued to the keyword (`OFF490 518 0`) is understood. Four-dimensional and binary
//! variants are refused. Memory: half of the share for the positions, spilled beyond.

use crate::io::error::{IoError, shown};
use crate::io::input::Input;
use crate::io::listed::Listing;
use crate::io::polygon::{Columns, Corner, Owner, PolygonCutter, checked_index, polygon_number};
use crate::io::words::{Dialect, Words};
use crate::io::{BATCH_TRIANGLES, ReadOptions};
use crate::mesh::{Discarded, MeshSource, TriangleBatch};
use crate::store::{Scratch, Table};

/// Whether a file that begins with this word is OFF.
pub(crate) fn is_off_keyword(word: &[u8]) -> bool {
    keyword(word).is_some()
}

/// What the first word of a file says.
struct Keyword<'a> {
    is_spatial: bool,
    glued: &'a [u8],
}

/// Takes `[ST][C][N][4][n]OFF` apart; only digits may follow.
fn keyword(word: &[u8]) -> Option<Keyword<'_>> {
    let mut rest = word;
    let mut is_spatial = true;
    for (prefix, spatial) in [("ST", true), ("C", true), ("N", true), ("4", false), ("n", false)] {
        if let Some(stripped) = rest.strip_prefix(prefix.as_bytes()) {
            rest = stripped;
            is_spatial &= spatial;
        }
    }
    let glued = rest.strip_prefix(b"OFF")?;
    glued.iter().all(u8::is_ascii_digit).then_some(Keyword { is_spatial, glued })
}

/// Reads an OFF file in batches.
pub(crate) struct OffReader {
    words: Words,
    vertices: u64,
    faces: u64,
    faces_read: u64,
    vertices_known: bool,
    positions: Table<[f64; 3]>,
    listing: Listing,
    polygon: PolygonCutter,
    discarded: Discarded,
}

impl OffReader {
    pub(crate) fn open(
        input: Input,
        scratch: &Scratch,
        options: &ReadOptions,
    ) -> Result<Self, IoError> {
        let mut words = Words::new(input, Dialect::Comments);
        let glued = read_keyword(&mut words)?;
        let vertices = match glued {
            Some(vertices) => vertices,
            None => read_count(&mut words, "the number of vertices")?,
        };
        let line = words.line();
        let faces = read_count(&mut words, "the number of faces")?;
        // The number of edges is often left out, but not where each count has its own line.
        if words.line() > line {
            read_count(&mut words, "the number of edges")?;
        }
        words.skip_line()?;
        let columns = Columns { indices: true, uvs: false, colours: false };
        Ok(Self {
            words,
            vertices,
            faces,
            faces_read: 0,
            vertices_known: false,
            positions: Table::new(scratch, options.share_bytes / 2),
            listing: Listing::default(),
            polygon: PolygonCutter::new(columns),
            discarded: Discarded::default(),
        })
    }

    fn read_vertices(&mut self) -> Result<(), IoError> {
        self.vertices_known = true;
        while self.positions.len() < self.vertices {
            let mut position = [0.0; 3];
            for coordinate in &mut position {
                *coordinate = self.words.number("a coordinate")?;
            }
            self.words.skip_line()?;
            if self.positions.len() >= u64::from(u32::MAX) {
                let path = self.words.input().path();
                return Err(IoError::too_many(path, "vertices", u64::from(u32::MAX)));
            }
            self.positions.push(position)?;
        }
        Ok(())
    }

    /// Reads the next face; `false` behind the last one.
    fn read_face(&mut self) -> Result<bool, IoError> {
        if self.faces_read == self.faces {
            return Ok(false);
        }
        let polygon = polygon_number(self.words.input().path(), self.faces_read)?;
        self.faces_read += 1;
        let count = read_count(&mut self.words, "the number of corners")?;
        let mut is_wild = false;
        for _ in 0..count {
            let index = self.words.number("the index of a vertex")?;
            let Some(vertex) = checked_index(index, self.positions.len()) else {
                is_wild = true;
                continue;
            };
            let position = self.positions.get(u64::from(vertex))?;
            let corner = Corner { vertex, ..Corner::default() };
            self.polygon.push(self.words.input().path(), position, corner)?;
        }
        self.words.skip_line()?;
        if is_wild {
            self.discarded.wild_index_faces += 1;
            self.polygon.clear();
        } else if count < 3 {
            self.discarded.short_faces += 1;
            self.polygon.clear();
        } else {
            self.polygon.close(Owner { part: 0, material: 0, polygon });
        }
        Ok(true)
    }
}

impl MeshSource for OffReader {
    type Error = IoError;

    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, IoError> {
        batch.clear();
        if !self.vertices_known {
            self.read_vertices()?;
        }
        while self.polygon.deliver(batch) && batch.len() < BATCH_TRIANGLES && self.read_face()? {}
        Ok(!batch.is_empty())
    }

    fn discarded(&self) -> Discarded {
        self.discarded
    }

    fn bytes_read(&self) -> u64 {
        self.words.input().bytes_read()
    }

    fn vertex_count(&self) -> Option<u64> {
        Some(self.positions.len())
    }

    fn next_vertices(&mut self, positions: &mut Vec<[f64; 3]>) -> Result<bool, IoError> {
        self.listing.next(&mut self.positions, positions)
    }
}

/// Reads the first word; a count may be glued to it.
fn read_keyword(words: &mut Words) -> Result<Option<u64>, IoError> {
    const EXPECTED: &str = "OFF, COFF, NOFF, STOFF or a mixture";
    let word = words.word()?.unwrap_or_default();
    let found = shown(word);
    match keyword(word) {
        Some(Keyword { is_spatial: true, glued }) => Ok(parse_count(glued)),
        _ => Err(words.unreadable(EXPECTED, &found)),
    }
}

fn read_count(words: &mut Words, expected: &str) -> Result<u64, IoError> {
    let Some(word) = words.word()? else {
        return Err(words.unreadable(expected, "the end of the file"));
    };
    match parse_count(word) {
        Some(count) => Ok(count),
        None => {
            let found = shown(word);
            Err(words.unreadable(expected, &found))
        }
    }
}

fn parse_count(word: &[u8]) -> Option<u64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keywords_are_known_with_all_their_prefixes() {
        for word in ["OFF", "COFF", "NOFF", "STOFF", "STCNOFF", "4OFF", "OFF490"] {
            assert!(is_off_keyword(word.as_bytes()), "{word}");
        }
        for word in ["OF", "off", "OFFSET", "XOFF", ""] {
            assert!(!is_off_keyword(word.as_bytes()), "{word}");
        }
    }
}
