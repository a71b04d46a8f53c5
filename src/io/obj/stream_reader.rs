//! The tolerant OBJ reader for files of any size: two passes, one for the vertices and one for the
//! faces.
//!
//! Indices may point forward. Indices that lead nowhere and faces with fewer than three corners are
//! dropped and counted; a missing texture index gives `[0, 0]`. Statements that mean nothing to us
//! are passed over; numbers that do not parse end the reading with their line. Memory: half of the
//! share for positions, an eighth for each of texture coordinates and colours, a 32nd for each list
//! of names, spilled beyond.

use crate::io::error::IoError;
use crate::io::input::Input;
use crate::io::listed::Listing;
use crate::io::names::{Materials, Parts};
use crate::io::obj::materials::Library;
use crate::io::obj::statements::{CornerIndices, Statement, Vertex, read_texture, resolve};
use crate::io::polygon::{Columns, Corner, Owner, PolygonCutter, WHITE, polygon_number};
use crate::io::words::{Dialect, Words};
use crate::io::{BATCH_TRIANGLES, ReadOptions};
use crate::mesh::{Discarded, Material, MeshSource, Part, TriangleBatch};
use crate::store::{Scratch, Table};

/// Reads an OBJ file in batches.
pub(crate) struct ObjStreamReader {
    words: Words,
    scratch: Scratch,
    share_bytes: u64,
    vertices_known: bool,
    positions: Table<[f64; 3]>,
    listing: Listing,
    textures: Table<[f32; 2]>,
    colours: Option<Table<[u8; 4]>>,
    has_objects: bool,
    has_normals: bool,
    library: Library,
    vertices_so_far: u64,
    textures_so_far: u64,
    part_name: String,
    material_name: String,
    /// Numbers of the two names, once a face has used them.
    owner: Option<(u32, u32)>,
    faces: u64,
    polygon: PolygonCutter,
    discarded: Discarded,
    parts: Parts,
    materials: Materials,
}

impl ObjStreamReader {
    /// Reads `input` from its start, wherever it stands.
    pub(crate) fn new(mut input: Input, scratch: &Scratch, options: &ReadOptions) -> Self {
        let share_bytes = options.share_bytes;
        let library = Library::new(input.path(), scratch, share_bytes / 32);
        input.seek(0);
        Self {
            words: Words::new(input, Dialect::CommentsAndContinuations),
            scratch: scratch.clone(),
            share_bytes,
            vertices_known: false,
            positions: Table::new(scratch, share_bytes / 2),
            listing: Listing::default(),
            textures: Table::new(scratch, share_bytes / 8),
            colours: None,
            has_objects: false,
            has_normals: false,
            library,
            vertices_so_far: 0,
            textures_so_far: 0,
            part_name: String::new(),
            material_name: String::new(),
            owner: None,
            faces: 0,
            polygon: PolygonCutter::default(),
            discarded: Discarded::default(),
            parts: Parts::new(scratch, share_bytes / 32),
            materials: Materials::new(scratch, share_bytes / 32),
        }
    }

    /// The first pass: all vertices, all libraries, and what kind of file this is.
    fn read_vertices(&mut self) -> Result<(), IoError> {
        self.vertices_known = true;
        let mut is_obj = false;
        while let Some(statement) = Statement::next(&mut self.words)? {
            is_obj |= statement != Statement::Unknown;
            match statement {
                Statement::Vertex => self.read_vertex()?,
                Statement::Texture => {
                    let texture = read_texture(&mut self.words)?;
                    self.textures.push(texture.map(|x| x as f32))?;
                }
                Statement::Object => self.has_objects = true,
                Statement::Normal => self.has_normals = true,
                Statement::Library => {
                    let names = self.words.raw_name()?;
                    self.library.load(&names)?;
                }
                _ => {}
            }
            self.words.skip_line()?;
        }
        if !is_obj {
            let found = "none in the whole file";
            return Err(self.words.unreadable("a statement of OBJ such as v or f", found));
        }
        let columns = Columns {
            indices: true,
            uvs: !self.textures.is_empty(),
            colours: self.colours.is_some(),
        };
        self.polygon = PolygonCutter::new(columns);
        self.words.rewind();
        Ok(())
    }

    fn read_vertex(&mut self) -> Result<(), IoError> {
        let vertex = Vertex::read(&mut self.words)?;
        let count = self.positions.len();
        if count >= u64::from(u32::MAX) {
            let path = self.words.input().path();
            return Err(IoError::too_many(path, "vertices", u64::from(u32::MAX)));
        }
        self.positions.push(vertex.position)?;
        if vertex.colour.is_some() && self.colours.is_none() {
            // The vertices before the first colour are white.
            let mut colours = Table::new(&self.scratch, self.share_bytes / 8);
            (0..count).try_for_each(|_| colours.push(WHITE))?;
            self.colours = Some(colours);
        }
        if let Some(colours) = &mut self.colours {
            colours.push(vertex.colour.unwrap_or(WHITE))?;
        }
        Ok(())
    }

    /// The second pass, up to the next face; `false` at the end of the file.
    fn read_face(&mut self) -> Result<bool, IoError> {
        while let Some(statement) = Statement::next(&mut self.words)? {
            match statement {
                Statement::Vertex => self.vertices_so_far += 1,
                Statement::Texture => self.textures_so_far += 1,
                Statement::Object => self.name_part()?,
                Statement::Group if !self.has_objects => self.name_part()?,
                Statement::UseMaterial => {
                    self.material_name = self.words.name()?;
                    self.owner = None;
                }
                Statement::Face => {
                    self.read_corners()?;
                    self.words.skip_line()?;
                    return Ok(true);
                }
                _ => {}
            }
            self.words.skip_line()?;
        }
        Ok(false)
    }

    fn name_part(&mut self) -> Result<(), IoError> {
        self.part_name = self.words.name()?;
        self.owner = None;
        Ok(())
    }

    fn read_corners(&mut self) -> Result<(), IoError> {
        let polygon = polygon_number(self.words.input().path(), self.faces)?;
        self.faces += 1;
        let mut is_wild = false;
        while let Some(indices) = CornerIndices::read(&mut self.words)? {
            let total = self.positions.len();
            match resolve(indices.vertex, self.vertices_so_far, total) {
                Some(vertex) => self.push_corner(vertex, indices.texture)?,
                None => is_wild = true,
            }
        }
        if is_wild {
            self.discarded.wild_index_faces += 1;
            self.polygon.clear();
        } else if self.polygon.len() < 3 {
            self.discarded.short_faces += 1;
            self.polygon.clear();
        } else {
            let (part, material) = self.owner()?;
            self.polygon.close(Owner { part, material, polygon });
        }
        Ok(())
    }

    fn push_corner(&mut self, vertex: u64, texture: Option<i64>) -> Result<(), IoError> {
        let total = self.textures.len();
        let texture = texture.and_then(|index| resolve(index, self.textures_so_far, total));
        let uv = match texture {
            Some(texture) => self.textures.get(texture)?,
            None => [0.0; 2],
        };
        let colour = match &mut self.colours {
            Some(colours) => colours.get(vertex)?,
            None => WHITE,
        };
        let position = self.positions.get(vertex)?;
        let corner = Corner { vertex: vertex as u32, uv, colour };
        self.polygon.push(self.words.input().path(), position, corner)
    }

    fn owner(&mut self) -> Result<(u32, u32), IoError> {
        if let Some(owner) = self.owner {
            return Ok(owner);
        }
        let path = self.words.input().path();
        let part = self.parts.number(path, &self.part_name)?;
        let material = self.library.number(&mut self.materials, path, &self.material_name)?;
        self.owner = Some((part, material));
        Ok((part, material))
    }
}

impl MeshSource for ObjStreamReader {
    type Error = IoError;

    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, IoError> {
        batch.clear();
        if !self.vertices_known {
            self.read_vertices()?;
        }
        while self.polygon.deliver(batch) && batch.len() < BATCH_TRIANGLES && self.read_face()? {}
        Ok(!batch.is_empty())
    }

    fn part_count(&self) -> u64 {
        self.parts.count()
    }

    fn material_count(&self) -> u64 {
        self.materials.count()
    }

    fn part(&mut self, number: u32) -> Result<Part, IoError> {
        self.parts.get(number)
    }

    fn material(&mut self, number: u32) -> Result<Material, IoError> {
        self.materials.get(number)
    }

    fn has_normals(&self) -> bool {
        self.has_normals
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
        if !self.vertices_known {
            self.read_vertices()?;
        }
        self.listing.next(&mut self.positions, positions)
    }
}
