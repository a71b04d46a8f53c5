//! STL as text: any case, any line ends, any number of solids, with or without names.
//!
//! Normals are ignored; facets with more than three vertices are cut, with fewer are dropped and
//! counted. A file that ends inside of a solid was cut off and is refused. Memory: the input's
//! buffer and one facet.

use crate::io::BATCH_TRIANGLES;
use crate::io::error::{IoError, shown};
use crate::io::input::Input;
use crate::io::polygon::{Columns, Corner, Owner, PolygonCutter, polygon_number};
use crate::io::words::{Dialect, Words};
use crate::mesh::{Discarded, MeshSource, TriangleBatch};

const KEYWORD: &str = "solid, facet, vertex, endfacet or endsolid";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Keyword {
    Solid,
    EndSolid,
    Facet,
    Vertex,
    EndFacet,
    Filler,
}

/// Streams text facets.
#[derive(Debug)]
pub(crate) struct AsciiStlReader {
    words: Words,
    in_solid: bool,
    facets: u64,
    polygon: PolygonCutter,
    discarded: Discarded,
}

impl AsciiStlReader {
    pub(crate) fn new(input: Input) -> Self {
        Self {
            words: Words::new(input, Dialect::Plain),
            in_solid: false,
            facets: 0,
            polygon: PolygonCutter::new(Columns::default()),
            discarded: Discarded::default(),
        }
    }

    /// Reads up to the end of a facet; `false` at the end of the file.
    fn read_facet(&mut self) -> Result<bool, IoError> {
        loop {
            match self.keyword()? {
                None if self.in_solid => {
                    return Err(self.words.unreadable(KEYWORD, "the end of the file"));
                }
                None => return Ok(false),
                Some(Keyword::Solid | Keyword::EndSolid | Keyword::Facet)
                    if self.polygon.len() > 0 =>
                {
                    return Err(self.words.unreadable("endfacet", "the next facet or solid"));
                }
                Some(Keyword::Solid) => {
                    self.in_solid = true;
                    self.words.skip_line()?;
                }
                Some(Keyword::EndSolid) => {
                    self.in_solid = false;
                    self.words.skip_line()?;
                }
                Some(Keyword::Facet) => self.read_normal()?,
                Some(Keyword::Vertex) => {
                    let mut position = [0.0; 3];
                    for coordinate in &mut position {
                        *coordinate = self.words.number("a coordinate")?;
                    }
                    self.polygon.push(self.words.input().path(), position, Corner::default())?;
                }
                Some(Keyword::EndFacet) => return self.close_facet().map(|()| true),
                Some(Keyword::Filler) => {}
            }
        }
    }

    fn close_facet(&mut self) -> Result<(), IoError> {
        let polygon = polygon_number(self.words.input().path(), self.facets)?;
        self.facets += 1;
        if self.polygon.len() < 3 {
            self.discarded.short_faces += 1;
            self.polygon.clear();
        } else {
            self.polygon.close(Owner { part: 0, material: 0, polygon });
        }
        Ok(())
    }

    fn keyword(&mut self) -> Result<Option<Keyword>, IoError> {
        const KEYWORDS: [(&[u8], Keyword); 8] = [
            (b"vertex", Keyword::Vertex),
            (b"outer", Keyword::Filler),
            (b"loop", Keyword::Filler),
            (b"endloop", Keyword::Filler),
            (b"facet", Keyword::Facet),
            (b"endfacet", Keyword::EndFacet),
            (b"endsolid", Keyword::EndSolid),
            (b"solid", Keyword::Solid),
        ];
        let Some(word) = self.words.word()? else { return Ok(None) };
        match KEYWORDS.iter().find(|(name, _)| name.eq_ignore_ascii_case(word)) {
            Some((_, keyword)) => Ok(Some(*keyword)),
            None => {
                let found = shown(word);
                Err(self.words.unreadable(KEYWORD, &found))
            }
        }
    }

    /// Passes over `normal` and its numbers, whatever they are.
    fn read_normal(&mut self) -> Result<(), IoError> {
        let is_normal = match self.words.word_on_line()? {
            Some(word) => word.eq_ignore_ascii_case(b"normal"),
            None => false,
        };
        for _ in 0..3 {
            if is_normal {
                self.words.word_on_line()?;
            }
        }
        Ok(())
    }
}

impl MeshSource for AsciiStlReader {
    type Error = IoError;

    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, IoError> {
        batch.clear();
        while self.polygon.deliver(batch) && batch.len() < BATCH_TRIANGLES && self.read_facet()? {}
        Ok(!batch.is_empty())
    }

    fn discarded(&self) -> Discarded {
        self.discarded
    }

    fn bytes_read(&self) -> u64 {
        self.words.input().bytes_read()
    }

    fn vertex_count(&self) -> Option<u64> {
        None
    }
}
